//! Disney's principled model of 2012; twin of `shaders/materials/disney.wesl`, which has the formulas' sources.

use std::f64::consts::{FRAC_1_PI, TAU};

use glam::{DVec2, DVec3};
use schemars::JsonSchema;
use serde::Deserialize;

use super::ggx::{Frame, alpha, ggx_d, ggx_normal, ggx_pdf, ggx_s};
use super::lobes::{Lobes, Pair, arrival, schlick};
use super::powers::expm1_over;
use super::scattered::{MARGIN, gains_energy, most_scattered};
use super::{
    Bsdf, BsdfSample, BsdfValue, Form, Member, MemberValue, Mistake, Surface, Value, luminance,
    schema,
};
use crate::sampling::directions::{circle_point, cosine_direction};

#[cfg(test)]
mod tests;

pub(super) const NAME: &str = "disney";

pub(super) const FORMS: &[Form] = &[Form {
    what: "Disney's principled model of 2012",
    members: &[
        // At normal incidence.
        Member::vector("specular_color"),
        // The sheen's, times the share that is no metal.
        Member::vector("sheen_color"),
        Member::vector("axis"),
        Member::scalar("alpha_u"),
        Member::scalar("alpha_v"),
        Member::scalar("roughness"),
        Member::scalar("subsurface"),
        // That is no metal.
        Member::scalar("diffuse_share"),
        // A quarter of the clearcoat.
        Member::scalar("coat"),
        // The square of its roughness, and minus the logarithm of that.
        Member::scalar("coat_alpha2"),
        Member::scalar("coat_log"),
        // For the choice of lobes.
        Member::scalar("diffuse_weight"),
        Member::scalar("cosine_share"),
    ],
    derives: Some(&[
        "roughness",
        "anisotropic",
        "metallic",
        "specular",
        "specular_tint",
        "sheen",
        "sheen_tint",
    ]),
    ..Form::of(NAME)
}];

/// Roughness of the clearcoat in its shadowing.
const COAT_SHADOWING: DVec2 = DVec2::splat(0.25);

/// Disney's principled model of 2012. Nothing bounds the sum of its lobes: at grazing angles bright colours
/// scatter more light than they receive.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
pub struct Disney {
    /// Colour of the base, linear.
    #[schemars(schema_with = "super::schema::share")]
    pub base_color: DVec3,
    /// From a rough surface to light that goes in and comes out nearby.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1.0), extend("default" = 0.0))]
    pub subsurface: f64,
    /// From a dielectric over a diffuse base to a metal of the base's colour.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1.0), extend("default" = 0.0))]
    pub metallic: f64,
    /// Reflection at normal incidence, in units of 0.08.
    #[serde(default = "half")]
    #[schemars(
        range(min = 0.0, max = 1.0),
        extend("default" = 0.5),
        transform = schema::texture
    )]
    pub specular: f64,
    /// How much of the base's hue it has.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1.0), extend("default" = 0.0))]
    pub specular_tint: f64,
    /// Of base and microfacets; the square of it is their alpha, 0.001 at least.
    #[serde(default = "half")]
    #[schemars(
        range(min = 0.0, max = 1.0),
        extend("default" = 0.5),
        transform = schema::texture
    )]
    pub roughness: f64,
    /// How much wider highlights are along the tangent axis × normal than across it.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1.0), extend("default" = 0.0))]
    pub anisotropic: f64,
    /// A grazing lobe, as of cloth.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1.0), extend("default" = 0.0))]
    pub sheen: f64,
    /// How much of the base's hue it has.
    #[serde(default = "half")]
    #[schemars(range(min = 0.0, max = 1.0), extend("default" = 0.5))]
    pub sheen_tint: f64,
    /// A second, white lobe over all.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1.0), extend("default" = 0.0))]
    pub clearcoat: f64,
    /// From a satin one to a glossy one.
    #[serde(default = "one")]
    #[schemars(range(min = 0.0, max = 1.0), extend("default" = 1.0))]
    pub clearcoat_gloss: f64,
    /// The axis about which surfaces are brushed.
    #[serde(default = "schema::up")]
    #[schemars(schema_with = "schema::axis")]
    pub axis: DVec3,
}

fn half() -> f64 {
    0.5
}

fn one() -> f64 {
    1.0
}

impl Disney {
    /// That of a colour, with the defaults.
    #[must_use]
    pub fn of(base_color: DVec3) -> Self {
        Self {
            base_color,
            subsurface: 0.0,
            metallic: 0.0,
            specular: half(),
            specular_tint: 0.0,
            roughness: half(),
            anisotropic: 0.0,
            sheen: 0.0,
            sheen_tint: half(),
            clearcoat: 0.0,
            clearcoat_gloss: one(),
            axis: schema::up(),
        }
    }
}

pub(super) fn cases() -> Vec<Disney> {
    let tilted = DVec3::new(1.0, 2.0, -2.0) / 3.0;
    let skin = Disney::of(DVec3::new(0.8, 0.5, 0.3));
    vec![
        // The defaults; that of the known albedo; metals rough, brushed and smooth.
        skin.clone(),
        Disney {
            roughness: 1.0,
            specular: 0.0,
            ..Disney::of(DVec3::ONE)
        },
        Disney {
            metallic: 1.0,
            roughness: 1.0,
            ..skin.clone()
        },
        Disney {
            metallic: 1.0,
            roughness: 0.3,
            anisotropic: 1.0,
            axis: tilted,
            ..skin.clone()
        },
        Disney {
            metallic: 0.5,
            roughness: 0.0,
            ..skin.clone()
        },
        // Each of the others at its end.
        Disney {
            subsurface: 1.0,
            ..skin.clone()
        },
        Disney {
            sheen: 1.0,
            sheen_tint: 1.0,
            roughness: 0.7,
            ..skin.clone()
        },
        Disney {
            clearcoat: 1.0,
            roughness: 0.4,
            ..skin.clone()
        },
        Disney {
            base_color: DVec3::ZERO,
            clearcoat: 1.0,
            clearcoat_gloss: 0.0,
            specular: 1.0,
            roughness: 0.8,
            ..skin
        },
        // All at once.
        Disney {
            base_color: DVec3::new(0.1, 0.2, 0.6),
            subsurface: 0.5,
            metallic: 0.3,
            specular: 0.8,
            specular_tint: 0.7,
            roughness: 0.35,
            anisotropic: 0.6,
            sheen: 0.5,
            sheen_tint: 0.4,
            clearcoat: 0.7,
            clearcoat_gloss: 0.8,
            axis: tilted,
        },
    ]
}

fn mix(a: f64, b: f64, t: f64) -> f64 {
    a + (b - a) * t
}

fn coat_reflectance(schlick_h: f64) -> f64 {
    mix(0.04, 1.0, schlick_h)
}

/// The shares of microfacets, of the clearcoat and of the cosine.
type Shares = [f64; 3];

impl Disney {
    fn alpha(&self) -> DVec2 {
        alpha(self.roughness, self.anisotropic)
    }

    fn frame(&self, surface: &Surface) -> Frame {
        Frame::about(surface.normal, schema::along(self.axis))
    }

    /// Its hue, as bright as white; the luminance is Burley's.
    fn tint(&self) -> DVec3 {
        let brightness = self.base_color.dot(DVec3::new(0.3, 0.6, 0.1));
        if brightness > 0.0 {
            self.base_color / brightness
        } else {
            DVec3::ONE
        }
    }

    fn specular_color(&self) -> DVec3 {
        let dielectric = 0.08 * self.specular * DVec3::ONE.lerp(self.tint(), self.specular_tint);
        dielectric.lerp(self.base_color, self.metallic)
    }

    fn diffuse_share(&self) -> f64 {
        1.0 - self.metallic
    }

    fn sheen_color(&self) -> DVec3 {
        self.diffuse_share() * self.sheen * DVec3::ONE.lerp(self.tint(), self.sheen_tint)
    }

    fn coat(&self) -> f64 {
        0.25 * self.clearcoat
    }

    fn coat_alpha2(&self) -> f64 {
        mix(0.1, 0.001, self.clearcoat_gloss).powi(2)
    }

    fn coat_log(&self) -> f64 {
        -self.coat_alpha2().ln()
    }

    /// About what base and sheen scatter.
    fn diffuse_weight(&self) -> f64 {
        self.diffuse_share() * luminance(self.base_color) + 0.2 * luminance(self.sheen_color())
    }

    /// The part of the microfacets that the cosine samples.
    fn cosine_share(&self) -> f64 {
        0.9 * self.alpha().element_product().min(1.0)
    }

    fn coat_d(&self, h: DVec3) -> f64 {
        let rest = 1.0 - self.coat_alpha2();
        let width = self.coat_alpha2() + rest * h.truncate().length_squared();
        FRAC_1_PI * rest / (self.coat_log() * width)
    }

    fn coat_normal(&self, u: DVec2) -> DVec3 {
        let rest = 1.0 - self.coat_alpha2();
        let (x, y) = (self.coat_log() * u.x, self.coat_log() * (1.0 - u.x));
        let sine2 = self.coat_alpha2() * x * expm1_over(x) / rest;
        let cos2 = y * expm1_over(-y) / rest;
        (sine2.sqrt() * circle_point(u.y)).extend(cos2.sqrt())
    }

    fn shares(&self, o: DVec3) -> Shares {
        let fresnel = schlick(o.z);
        let specular = mix(luminance(self.specular_color()), 1.0, fresnel);
        let lit = o.z / (o.z + ggx_s(o, COAT_SHADOWING));
        let coat = 4.0 * self.coat() * coat_reflectance(fresnel) * lit * lit;
        let total = self.diffuse_weight() + specular + coat;
        if total > 0.0 {
            let wide = self.cosine_share() * specular;
            [specular - wide, coat, self.diffuse_weight() + wide].map(|weight| weight / total)
        } else {
            [0.0, 0.0, 1.0]
        }
    }

    fn lobes(&self, pair: &Pair, [specular_share, coat_share, cosine_share]: Shares) -> Lobes {
        let Pair { o, i, h, cos_h } = *pair;
        let (fresnel_o, fresnel_i, fresnel_h) = (schlick(o.z), schlick(i.z), schlick(cos_h));
        let retro = cos_h * cos_h * self.roughness;
        let both = |grazing: f64| mix(1.0, grazing, fresnel_i) * mix(1.0, grazing, fresnel_o);
        let dull = both(0.5 + 2.0 * retro);
        let under = 1.25 * (both(retro) * (1.0 / (i.z + o.z) - 0.5) + 0.5);
        let base = FRAC_1_PI * self.diffuse_share() * mix(dull, under, self.subsurface);
        let diffuse = base * self.base_color + fresnel_h * self.sheen_color();
        let alpha = self.alpha();
        let g = 1.0 / ((i.z + ggx_s(i, alpha)) * (o.z + ggx_s(o, alpha)));
        let specular = ggx_d(h, alpha) * g * self.specular_color().lerp(DVec3::ONE, fresnel_h);
        let d = self.coat_d(h);
        let [lit_o, lit_i] = [o, i].map(|w| w.z + ggx_s(w, COAT_SHADOWING));
        let coat = self.coat() * d / (lit_i * lit_o) * coat_reflectance(fresnel_h);
        Lobes {
            diffuse: i.z * diffuse,
            glossy: i.z * (specular + coat),
            pdf: cosine_share * i.z * FRAC_1_PI
                + specular_share * ggx_pdf(o, h, alpha)
                + coat_share * 0.25 * d * h.z / cos_h,
        }
    }
}

impl Bsdf for Disney {
    fn form(&self) -> &'static Form {
        &FORMS[0]
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![
            ("base_color", Value::Vector(self.base_color)),
            ("subsurface", Value::Number(self.subsurface)),
            ("metallic", Value::Number(self.metallic)),
            ("specular", Value::Number(self.specular)),
            ("specular_tint", Value::Number(self.specular_tint)),
            ("roughness", Value::Number(self.roughness)),
            ("anisotropic", Value::Number(self.anisotropic)),
            ("sheen", Value::Number(self.sheen)),
            ("sheen_tint", Value::Number(self.sheen_tint)),
            ("clearcoat", Value::Number(self.clearcoat)),
            ("clearcoat_gloss", Value::Number(self.clearcoat_gloss)),
            ("axis", Value::Vector(self.axis)),
        ]
    }

    fn mistake(&self) -> Option<Mistake> {
        schema::axis_mistake(self.axis)
    }

    fn members(&self) -> Vec<MemberValue> {
        let alpha = self.alpha();
        vec![
            self.specular_color().into(),
            self.sheen_color().into(),
            schema::along(self.axis).into(),
            alpha.x.into(),
            alpha.y.into(),
            self.roughness.into(),
            self.subsurface.into(),
            self.diffuse_share().into(),
            self.coat().into(),
            self.coat_alpha2().into(),
            self.coat_log().into(),
            self.diffuse_weight().into(),
            self.cosine_share().into(),
        ]
    }

    fn color(&self) -> DVec3 {
        self.base_color
    }

    fn albedo(&self) -> DVec3 {
        MARGIN * most_scattered(self, schema::along(self.axis))
    }

    // The k-th power of the largest weight, 2 pi f cos, each term at its most: Fd is at most (1/2 + 2 r)^2 or 1,
    // the subsurface term's cosine 5/4; D at most 1/(pi a_u a_v), G cos at most 1/2 over the smallest of 1 and
    // both roughnesses; the clearcoat's likewise, over its 1/4.
    fn moment(&self, channel: usize, k: i32) -> f64 {
        let alpha = self.alpha();
        let dull = (0.5 + 2.0 * self.roughness).max(1.0).powi(2).max(1.25);
        let base = FRAC_1_PI * dull * self.diffuse_share() * self.base_color[channel];
        let d = FRAC_1_PI / alpha.element_product();
        let specular = 0.5 * d / alpha.min_element().min(1.0);
        let coat = 0.5 * self.coat() * self.coat_d(DVec3::Z) / COAT_SHADOWING.x;
        (TAU * (base + self.sheen_color()[channel] + specular + coat)).powi(k)
    }

    fn sample(&self, surface: &Surface, wo: DVec3, u: [f64; 4]) -> BsdfSample {
        let frame = self.frame(surface);
        let (o, place) = (arrival(&frame, wo), DVec2::new(u[0], u[1]));
        let shares = self.shares(o);
        let pair = if u[2] >= shares[0] + shares[1] {
            Pair::between(o, cosine_direction(DVec3::Z, place))
        } else if u[2] >= shares[0] {
            Pair::about(o, self.coat_normal(place))
        } else {
            let (h, cos_h) = ggx_normal(o, self.alpha(), place);
            let cos_h = cos_h.min(1.0);
            let i = 2.0 * cos_h * h - o;
            Pair { o, i, h, cos_h }
        };
        self.lobes(&pair, shares).sample(&frame, &pair)
    }

    fn evaluate(&self, surface: &Surface, wo: DVec3, wi: DVec3) -> BsdfValue {
        let frame = self.frame(surface);
        let pair = Pair::between(arrival(&frame, wo), frame.to_local(wi));
        self.lobes(&pair, self.shares(pair.o)).value(&pair)
    }

    fn warning(&self) -> Option<[String; 2]> {
        gains_energy(
            most_scattered(self, schema::along(self.axis)),
            "the model's lobes are not weighed against each other: use a darker `base_color`, \
             or less `subsurface`, `sheen` or `clearcoat`",
        )
    }
}

//! Metals; twin of `shaders/materials/conductor.wesl`.

use glam::{DVec2, DVec3};
use schemars::JsonSchema;
use serde::Deserialize;

use super::ggx::{Frame, alpha, ggx_normal, ggx_pdf, ggx_weight};
use super::{
    Bsdf, BsdfSample, BsdfValue, Event, Form, Member, MemberValue, Mistake, Surface, Value, schema,
};

pub(super) const NAME: &str = "conductor";

pub(super) const FORMS: &[Form] = &[
    Form {
        name: "conductor",
        what: "smooth metals: Fresnel reflection by a complex index",
        delta: true,
        relative: true,
        members: &[Member::vector("eta"), Member::vector("k")],
        ..Form::of(NAME)
    },
    Form {
        name: "rough_conductor",
        what: "rough metals: the same about GGX microfacets",
        relative: true,
        members: &[
            Member::vector("eta"),
            Member::vector("k"),
            Member::scalar("alpha_u"),
            Member::scalar("alpha_v"),
            Member::vector("axis"),
        ],
        derives: Some(&["roughness", "anisotropy"]),
        ..Form::of(NAME)
    },
];

/// The largest index: its fourth power is an f32.
const MAX_INDEX: f64 = 1.0e6;

/// A metal, smooth or rough.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
pub struct Conductor {
    /// A metal's index, in the place of eta and k.
    #[serde(default)]
    #[schemars(with = "Metal")]
    pub preset: Option<Metal>,
    /// Real part of the refractive index, per channel.
    #[serde(default)]
    #[schemars(schema_with = "index")]
    pub eta: Option<DVec3>,
    /// Imaginary part of the refractive index, per channel.
    #[serde(default)]
    #[schemars(schema_with = "index")]
    pub k: Option<DVec3>,
    /// 0 is smooth; the square of it is the GGX alpha.
    #[serde(default)]
    #[schemars(
        range(min = 0.0, max = 1.0),
        extend("default" = 0.0),
        transform = schema::texture
    )]
    pub roughness: f64,
    /// How much wider highlights are along the tangent axis × normal than across it.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1.0), extend("default" = 0.0))]
    pub anisotropy: f64,
    /// The axis about which surfaces are brushed.
    #[serde(default = "schema::up")]
    #[schemars(schema_with = "schema::axis")]
    pub axis: DVec3,
}

/// Metals by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[expect(missing_docs, reason = "the names say it")]
pub enum Metal {
    Gold,
    Copper,
    Silver,
    Aluminium,
    Iron,
}

impl Metal {
    /// Real and imaginary part of the index at red, green and blue.
    #[must_use]
    pub fn index(self) -> [DVec3; 2] {
        let of = |eta: [f64; 3], k: [f64; 3]| [DVec3::from(eta), DVec3::from(k)];
        match self {
            Self::Gold => of([0.143, 0.375, 1.442], [3.983, 2.386, 1.603]),
            Self::Copper => of([0.200, 0.924, 1.102], [3.913, 2.453, 2.142]),
            Self::Silver => of([0.155, 0.117, 0.138], [4.828, 3.122, 2.147]),
            Self::Aluminium => of([1.657, 0.880, 0.521], [9.224, 6.270, 4.837]),
            Self::Iron => of([2.911, 2.950, 2.585], [3.089, 2.932, 2.767]),
        }
    }
}

fn index(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
    schema::vector(0.0, MAX_INDEX)
}

pub(super) fn cases() -> Vec<Conductor> {
    let case = |metal: Metal, roughness, anisotropy, axis: DVec3| {
        let [eta, k] = metal.index();
        Conductor {
            preset: None,
            eta: Some(eta),
            k: Some(k),
            roughness,
            anisotropy,
            axis,
        }
    };
    let tilted = DVec3::new(1.0, 2.0, -2.0) / 3.0;
    vec![
        case(Metal::Gold, 0.0, 0.0, DVec3::Y),
        case(Metal::Iron, 0.0, 0.0, DVec3::Y),
        case(Metal::Silver, 0.04, 0.0, DVec3::Y),
        case(Metal::Copper, 0.2, 0.5, DVec3::Y),
        case(Metal::Aluminium, 0.5, 1.0, tilted),
        case(Metal::Gold, 1.0, 0.0, tilted),
    ]
}

/// For the index eta + i k over that before the surface, in one channel.
#[must_use]
pub fn conductor_fresnel(cos_i: f64, eta: f64, k: f64) -> f64 {
    let cos2 = cos_i * cos_i;
    let sin2 = 1.0 - cos2;
    let real = (eta - k) * (eta + k) - sin2;
    let product = eta * k;
    let size = real.hypot(2.0 * product);
    let larger = (0.5 * (size + real.abs())).sqrt();
    let a = if real < 0.0 { product / larger } else { larger };
    let (sum, cross) = (size + cos2, 2.0 * cos_i * a);
    let r_s = (sum - cross) / (sum + cross);
    let (sum_p, cross_p) = (cos2 * size + sin2 * sin2, cross * sin2);
    0.5 * (r_s + r_s * (sum_p - cross_p) / (sum_p + cross_p))
}

impl Conductor {
    fn index(&self) -> [DVec3; 2] {
        match (self.preset, self.eta, self.k) {
            (Some(metal), ..) => metal.index(),
            (None, eta, k) => [eta.unwrap_or(DVec3::ONE), k.unwrap_or_default()],
        }
    }

    fn alpha(&self) -> DVec2 {
        alpha(self.roughness, self.anisotropy)
    }

    fn reflectance(&self, surface: &Surface, cos_i: f64) -> DVec3 {
        let [eta, k] = self.index().map(|part| surface.eta * part);
        let channel = |c: usize| conductor_fresnel(cos_i, eta[c], k[c]);
        DVec3::new(channel(0), channel(1), channel(2))
    }

    fn frame(&self, surface: &Surface) -> Frame {
        Frame::about(surface.normal, schema::along(self.axis))
    }
}

fn above(w: DVec3) -> DVec3 {
    w.truncate().extend(w.z.max(0.0))
}

impl Bsdf for Conductor {
    fn form(&self) -> &'static Form {
        &FORMS[usize::from(self.roughness > 0.0)]
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        let [eta, k] = self.index();
        vec![
            ("eta", Value::Vector(eta)),
            ("k", Value::Vector(k)),
            ("roughness", Value::Number(self.roughness)),
            ("anisotropy", Value::Number(self.anisotropy)),
            ("axis", Value::Vector(self.axis)),
        ]
    }

    fn mistake(&self) -> Option<Mistake> {
        let given = [self.eta.is_some(), self.k.is_some()];
        let (key, what, help) = match (self.preset.is_some(), given) {
            (true, [true, _]) => ("eta", "`eta` and `preset` are both given", PRESET_HELP),
            (true, [_, true]) => ("k", "`k` and `preset` are both given", PRESET_HELP),
            (false, [false, false]) => ("type", "a conductor needs its index", INDEX_HELP),
            (false, [true, false]) => ("eta", "`eta` needs `k` beside it", INDEX_HELP),
            (false, [false, true]) => ("k", "`k` needs `eta` beside it", INDEX_HELP),
            _ => return schema::axis_mistake(self.axis),
        };
        Some(Mistake { key, what, help })
    }

    fn members(&self) -> Vec<MemberValue> {
        let [eta, k] = self.index();
        if self.roughness == 0.0 {
            return vec![eta.into(), k.into()];
        }
        let alpha = self.alpha();
        vec![
            eta.into(),
            k.into(),
            alpha.x.into(),
            alpha.y.into(),
            schema::along(self.axis).into(),
        ]
    }

    fn color(&self) -> DVec3 {
        let [eta, k] = self.index();
        let below = |x: DVec3| x * x + k * k;
        below(eta - 1.0) / below(eta + 1.0)
    }

    // At grazing incidence, whatever the index.
    fn albedo(&self) -> DVec3 {
        DVec3::ONE
    }

    // The weight is at most pi D/s(o), D at most 1/(pi a_u a_v) and s at least the smallest of 1 and both
    // roughnesses; its mean is at most 1.
    fn moment(&self, _: usize, k: i32) -> f64 {
        if self.roughness == 0.0 {
            return 1.0;
        }
        let alpha = self.alpha();
        (alpha.x * alpha.y * alpha.min_element().min(1.0)).powi(1 - k)
    }

    fn sample(&self, surface: &Surface, wo: DVec3, u: [f64; 4]) -> BsdfSample {
        if self.roughness == 0.0 {
            let cos_i = surface.normal.dot(wo).clamp(0.0, 1.0);
            return BsdfSample {
                wi: (2.0 * cos_i * surface.normal - wo).normalize(),
                weight: self.reflectance(surface, cos_i),
                pdf: 0.0,
                event: Event::DELTA,
                eta: 1.0,
            };
        }
        let (alpha, frame) = (self.alpha(), self.frame(surface));
        let o = above(frame.to_local(wo));
        let (h, cos_h) = ggx_normal(o, alpha, DVec2::new(u[0], u[1]));
        let cos_h = cos_h.min(1.0);
        let i = 2.0 * cos_h * h - o;
        let (mut weight, mut pdf) = (DVec3::ZERO, 0.0);
        // Below the horizon the path ends: it would meet another microfacet.
        if i.z > 0.0 {
            weight = ggx_weight(o, i, alpha) * self.reflectance(surface, cos_h);
            pdf = ggx_pdf(o, h, alpha);
        }
        BsdfSample {
            wi: frame.to_world(i).normalize(),
            weight,
            pdf,
            event: Event::GLOSSY,
            eta: 1.0,
        }
    }

    fn evaluate(&self, surface: &Surface, wo: DVec3, wi: DVec3) -> BsdfValue {
        if self.roughness == 0.0 {
            return BsdfValue::NONE;
        }
        let (alpha, frame) = (self.alpha(), self.frame(surface));
        let (o, i) = (above(frame.to_local(wo)), frame.to_local(wi));
        if i.z <= 0.0 {
            return BsdfValue {
                f_cos: DVec3::ZERO,
                pdf: 0.0,
                event: Event::GLOSSY,
            };
        }
        let h = (o + i).normalize();
        let pdf = ggx_pdf(o, h, alpha);
        let fresnel = self.reflectance(surface, o.dot(h).clamp(0.0, 1.0));
        BsdfValue {
            f_cos: pdf * ggx_weight(o, i, alpha) * fresnel,
            pdf,
            event: Event::GLOSSY,
        }
    }
}

const PRESET_HELP: &str = "a preset is an index: give either it, or `eta` and `k`";
const INDEX_HELP: &str = "give `eta` and `k`, or a `preset` such as \"gold\"";

//! Nylon, by the ABC model; twin of `shaders/materials/nylon.wesl`, which has the formulas' sources.

use std::f64::consts::FRAC_1_PI;

use glam::{DVec2, DVec3};
use schemars::JsonSchema;
use serde::Deserialize;

use super::ggx::Frame;
use super::lobes::{Lobes, Pair, arrival};
use super::powers::{expm1_over, log1p_over};
use super::scattered::{MARGIN, gains_energy, most_scattered};
use super::{
    Bsdf, BsdfSample, BsdfValue, Form, Member, MemberValue, Surface, Value, luminance, schema,
};
use crate::sampling::directions::{circle_point, cosine_direction};

#[cfg(test)]
mod tests;

pub(super) const NAME: &str = "nylon";

pub(super) const FORMS: &[Form] = &[Form {
    what: "nylon: the ABC model of microfacets over a diffuse term",
    members: &[
        Member::vector("abc_a"),
        Member::scalar("abc_b"),
        Member::scalar("abc_c"),
        // The integral of the distribution over 1 - cos, for A = 1.
        Member::scalar("abc_norm"),
        Member::scalar("index"),
        // For the choice of lobes.
        Member::scalar("glossy_weight"),
    ],
    ..Form::of(NAME)
}];

const MAX_A: f64 = 1.0e6;
const MAX_B: f64 = 1.0e6;
const MAX_C: f64 = 20.0;
const MAX_INDEX: f64 = 100.0;

/// Nylon, by a fit to measurements of it: the ABC model of microfacets, whose distribution is no density that
/// conserves energy, over a diffuse term.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
pub struct Nylon {
    /// Colour of the diffuse term.
    #[serde(default = "nylons_diffuse")]
    #[schemars(schema_with = "diffuse_schema")]
    pub diffuse: DVec3,
    /// Size of the distribution of microfacets A/(1 + B (1 - cos))^C, by channel.
    #[serde(default = "nylons_a")]
    #[schemars(schema_with = "a_schema")]
    pub a: DVec3,
    /// One over its width.
    #[serde(default = "nylons_b")]
    #[schemars(range(min = 0.0, max = MAX_B), extend("default" = 3334.45))]
    pub b: f64,
    /// How fast it falls.
    #[serde(default = "nylons_c")]
    #[schemars(range(min = 0.0, max = MAX_C), extend("default" = 0.8868))]
    pub c: f64,
    /// Refractive index over that around it.
    #[serde(default = "nylons_ior")]
    #[schemars(range(min = 1.0, max = MAX_INDEX), extend("default" = 1.3825))]
    pub ior: f64,
}

fn nylons_diffuse() -> DVec3 {
    DVec3::new(0.2327, 0.2325, 0.2074)
}

fn nylons_a() -> DVec3 {
    DVec3::new(19.216, 18.194, 16.938)
}

fn nylons_b() -> f64 {
    3334.45
}

fn nylons_c() -> f64 {
    0.8868
}

fn nylons_ior() -> f64 {
    1.3825
}

fn diffuse_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
    let mut schema = schema::share(generator);
    schema.insert(
        "default".into(),
        serde_json::json!(nylons_diffuse().to_array()),
    );
    schema
}

fn a_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
    let mut schema = schema::vector(0.0, MAX_A);
    schema.insert("default".into(), serde_json::json!(nylons_a().to_array()));
    schema
}

impl Default for Nylon {
    fn default() -> Self {
        Self {
            diffuse: nylons_diffuse(),
            a: nylons_a(),
            b: nylons_b(),
            c: nylons_c(),
            ior: nylons_ior(),
        }
    }
}

pub(super) fn cases() -> Vec<Nylon> {
    let nylon = Nylon::default();
    vec![
        nylon.clone(),
        // Most of it in the lobe; C = 1; a lobe alone, narrow and steep; no lobe; one without a shape.
        Nylon {
            a: DVec3::new(300.0, 280.0, 320.0),
            ..nylon.clone()
        },
        Nylon {
            a: DVec3::new(200.0, 150.0, 100.0),
            b: 1000.0,
            c: 1.0,
            ior: 1.6,
            ..nylon.clone()
        },
        Nylon {
            diffuse: DVec3::ZERO,
            a: DVec3::new(1000.0, 800.0, 600.0),
            b: 2000.0,
            c: 2.5,
            ior: 1.5,
        },
        Nylon {
            diffuse: DVec3::new(0.5, 0.4, 0.3),
            ior: 1.0,
            ..nylon
        },
        Nylon {
            diffuse: DVec3::splat(0.3),
            a: DVec3::new(0.5, 0.6, 0.7),
            b: 0.0,
            c: 3.0,
            ior: 1.5,
        },
    ]
}

/// Fresnel's term for an index of at least 1.
fn reflectance(cosine: f64, index: f64) -> f64 {
    let g = ((index - 1.0) * (index + 1.0) + cosine * cosine).sqrt();
    let s = (g - cosine) / (g + cosine);
    let p = s * (cosine * (g + cosine) - 1.0) / (cosine * (g - cosine) + 1.0);
    0.5 * (s * s + p * p)
}

impl Nylon {
    /// The integral of the distribution over 1 - cos from 0 to 1, for A = 1.
    fn norm(&self) -> f64 {
        let ratio = log1p_over(self.b);
        ratio * expm1_over((1.0 - self.c) * self.b * ratio)
    }

    /// What the lobe reflects for a Fresnel term of 1, about: by half vectors its weight is 8 A norm times what
    /// G leaves.
    fn glossy_weight(&self) -> f64 {
        6.0 * luminance(self.a) * self.norm()
    }

    fn abc(&self, h: DVec3) -> f64 {
        let x = h.truncate().length_squared() / (1.0 + h.z.max(0.0));
        (1.0 + self.b * x).powf(-self.c)
    }

    fn abc_normal(&self, u: DVec2) -> DVec3 {
        let share = u.x * self.norm();
        let ratio = log1p_over((1.0 - self.c) * self.b * share);
        let x = (share * ratio * expm1_over(self.b * share * ratio)).min(1.0);
        ((x * (2.0 - x)).sqrt() * circle_point(u.y)).extend(1.0 - x)
    }

    fn shares(&self, cos_o: f64) -> [f64; 2] {
        let glossy = self.glossy_weight() * reflectance(cos_o, self.ior);
        let total = glossy + luminance(self.diffuse);
        let wide = (6.0 * self.norm()).powi(3);
        let narrow = glossy / (1.0 + wide);
        if total > 0.0 {
            [
                narrow / total,
                (luminance(self.diffuse) + wide * narrow) / total,
            ]
        } else {
            [0.0, 1.0]
        }
    }

    fn lobes(&self, pair: &Pair) -> Lobes {
        let (larger, smaller) = (pair.o.z.max(pair.i.z), pair.o.z.min(pair.i.z));
        let cavity = 2.0 * pair.h.z / pair.cos_h;
        let lit = if cavity * smaller > 1.0 {
            1.0 / smaller
        } else {
            cavity
        };
        let d = self.abc(pair.h);
        let reflected = reflectance(pair.cos_h, self.ior);
        let dull = pair.i.z * FRAC_1_PI;
        let [half_vectors, cosine] = self.shares(pair.o.z);
        Lobes {
            diffuse: dull * self.diffuse,
            glossy: reflected * d * lit / larger * dull * self.a,
            pdf: half_vectors * 0.125 * FRAC_1_PI * d / (self.norm() * pair.cos_h) + cosine * dull,
        }
    }
}

impl Bsdf for Nylon {
    fn form(&self) -> &'static Form {
        &FORMS[0]
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![
            ("diffuse", Value::Vector(self.diffuse)),
            ("a", Value::Vector(self.a)),
            ("b", Value::Number(self.b)),
            ("c", Value::Number(self.c)),
            ("ior", Value::Number(self.ior)),
        ]
    }

    fn members(&self) -> Vec<MemberValue> {
        vec![
            self.a.into(),
            self.b.into(),
            self.c.into(),
            self.norm().into(),
            self.ior.into(),
            self.glossy_weight().into(),
        ]
    }

    fn color(&self) -> DVec3 {
        self.diffuse
    }

    fn albedo(&self) -> DVec3 {
        MARGIN * most_scattered(self, DVec3::Y)
    }

    // Of directions opposite to a grazing one the value goes as 1 over its distance from them: over all
    // incidences only the mean has a bound.
    fn moment(&self, channel: usize, k: i32) -> f64 {
        if k > 1 {
            f64::INFINITY
        } else {
            self.albedo()[channel]
        }
    }

    fn sample(&self, surface: &Surface, wo: DVec3, u: [f64; 4]) -> BsdfSample {
        let frame = Frame::about(surface.normal, DVec3::Y);
        let (o, place) = (arrival(&frame, wo), DVec2::new(u[0], u[1]));
        let pair = if u[2] < self.shares(o.z)[0] {
            Pair::about(o, self.abc_normal(place))
        } else {
            Pair::between(o, cosine_direction(DVec3::Z, place))
        };
        self.lobes(&pair).sample(&frame, &pair)
    }

    fn evaluate(&self, surface: &Surface, wo: DVec3, wi: DVec3) -> BsdfValue {
        let frame = Frame::about(surface.normal, DVec3::Y);
        let pair = Pair::between(arrival(&frame, wo), frame.to_local(wi));
        self.lobes(&pair).value(&pair)
    }

    fn warning(&self) -> Option<[String; 2]> {
        gains_energy(
            most_scattered(self, DVec3::Y),
            "nothing bounds the distribution's size: lower `a` or `diffuse`",
        )
    }
}

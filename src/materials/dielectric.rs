//! Smooth glass; twin of `shaders/materials/dielectric.wesl`.

use glam::DVec3;
use schemars::JsonSchema;
use serde::Deserialize;

use super::schema::MAX_MAGNITUDE;
use super::{Bsdf, BsdfSample, BsdfValue, Event, Form, Member, MemberValue, Surface, Value};

pub(super) const NAME: &str = "dielectric";

pub(super) const FORMS: &[Form] = &[Form {
    what: "smooth glass: Fresnel reflection and refraction",
    delta: true,
    transmits: true,
    members: &[Member::scalar("ior")],
    ..Form::of(NAME)
}];

/// Smooth glass.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
pub struct Dielectric {
    /// Absolute refractive index (vacuum 1).
    #[schemars(range(max = MAX_MAGNITUDE), extend("exclusiveMinimum" = 0.0))]
    pub ior: f64,
}

pub(super) fn cases() -> Vec<Dielectric> {
    [1.5, 1.0, 2.4].map(|ior| Dielectric { ior }).into()
}

/// Fresnel's answer for one direction.
#[derive(Clone, Copy, Debug)]
pub struct Fresnel {
    /// Share of the unpolarised light that is reflected.
    pub reflected: f64,
    /// Cosine beyond the surface; 0 if the reflection is total.
    pub cos_t: f64,
}

/// eta: index beyond the surface over the index before it.
#[must_use]
pub fn fresnel(cos_i: f64, eta: f64) -> Fresnel {
    let square = ((eta - 1.0) * (eta + 1.0) + cos_i * cos_i) / (eta * eta);
    if square <= 0.0 {
        return Fresnel {
            reflected: 1.0,
            cos_t: 0.0,
        };
    }
    let cos_t = square.sqrt();
    let s = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    let p = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    Fresnel {
        reflected: 0.5 * (s * s + p * p),
        cos_t,
    }
}

impl Bsdf for Dielectric {
    fn form(&self) -> &'static Form {
        &FORMS[0]
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![("ior", Value::Number(self.ior))]
    }

    fn members(&self) -> Vec<MemberValue> {
        vec![self.ior.into()]
    }

    fn color(&self) -> DVec3 {
        DVec3::ONE
    }

    fn albedo(&self) -> DVec3 {
        DVec3::ONE
    }

    fn moment(&self, _: usize, _: i32) -> f64 {
        1.0
    }

    // Chooses a lobe with its share of the light; radiance is scaled by 1/eta^2 on refraction.
    fn sample(&self, surface: &Surface, wo: DVec3, u: [f64; 4]) -> BsdfSample {
        let (normal, eta) = (surface.normal, surface.eta);
        let cos_i = normal.dot(wo).clamp(0.0, 1.0);
        let f = fresnel(cos_i, eta);
        if u[2] < f.reflected {
            return BsdfSample {
                wi: (2.0 * cos_i * normal - wo).normalize(),
                weight: DVec3::ONE,
                pdf: 0.0,
                event: Event::DELTA,
                eta: 1.0,
            };
        }
        BsdfSample {
            wi: ((cos_i / eta - f.cos_t) * normal - wo / eta).normalize(),
            weight: DVec3::splat(1.0 / (eta * eta)),
            pdf: 0.0,
            event: Event::DELTA | Event::TRANSMITTED,
            eta,
        }
    }

    fn evaluate(&self, _: &Surface, _: DVec3, _: DVec3) -> BsdfValue {
        BsdfValue::NONE
    }

    fn ior(&self) -> f64 {
        self.ior
    }
}

//! Lambert's law; twin of `shaders/materials/diffuse.wesl`.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};
use schemars::JsonSchema;
use serde::Deserialize;

use super::uniform::cosine_moment;
use super::{Bsdf, BsdfSample, BsdfValue, Event, Form, MemberValue, Surface, Value};
use crate::sampling::directions::cosine_direction;

/// Its type in scene files.
pub const NAME: &str = "diffuse";

pub(super) const FORMS: &[Form] = &[Form {
    what: "Lambert's law",
    lambertian: true,
    ..Form::of(NAME)
}];

/// Lambert's law: BRDF = albedo/π.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
pub struct Diffuse {
    /// Share of the light that is scattered.
    #[schemars(schema_with = "super::schema::share")]
    pub albedo: DVec3,
}

pub(super) fn cases() -> Vec<Diffuse> {
    [[0.5, 0.25, 0.75], [1.0, 1.0, 1.0], [0.9, 0.0, 0.1]]
        .map(|albedo| Diffuse {
            albedo: albedo.into(),
        })
        .into()
}

impl Bsdf for Diffuse {
    fn form(&self) -> &'static Form {
        &FORMS[0]
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![("albedo", Value::Vector(self.albedo))]
    }

    fn members(&self) -> Vec<MemberValue> {
        Vec::new()
    }

    fn color(&self) -> DVec3 {
        self.albedo
    }

    fn albedo(&self) -> DVec3 {
        self.albedo
    }

    fn moment(&self, channel: usize, k: i32) -> f64 {
        cosine_moment(k) * self.albedo[channel].powi(k)
    }

    // pdf = cos/pi, so that the weight is the albedo.
    fn sample(&self, surface: &Surface, _: DVec3, u: [f64; 4]) -> BsdfSample {
        let wi = cosine_direction(surface.normal, DVec2::new(u[0], u[1]));
        BsdfSample {
            wi,
            weight: self.albedo,
            pdf: surface.normal.dot(wi).max(0.0) / PI,
            event: Event::DIFFUSE,
            eta: 1.0,
        }
    }

    fn evaluate(&self, surface: &Surface, _: DVec3, wi: DVec3) -> BsdfValue {
        let pdf = surface.normal.dot(wi).max(0.0) / PI;
        BsdfValue {
            f_cos: pdf * self.albedo,
            pdf,
            event: Event::DIFFUSE,
        }
    }
}

//! A perfect mirror; twin of `shaders/materials/mirror.wesl`.

use glam::DVec3;
use schemars::JsonSchema;
use serde::Deserialize;

use super::{Bsdf, BsdfSample, BsdfValue, Event, Form, Imaging, MemberValue, Surface, Value};

pub(super) const NAME: &str = "mirror";

pub(super) const FORMS: &[Form] = &[Form {
    what: "perfect mirrors",
    delta: true,
    imaging: Some(Imaging::Reflects),
    ..Form::of(NAME)
}];

/// A perfect mirror.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
pub struct Mirror {
    /// Share of the light that is reflected.
    #[schemars(schema_with = "super::schema::share")]
    pub reflectance: DVec3,
}

pub(super) fn cases() -> Vec<Mirror> {
    [[0.9, 0.8, 0.7], [1.0, 1.0, 1.0]]
        .map(|reflectance| Mirror {
            reflectance: reflectance.into(),
        })
        .into()
}

impl Bsdf for Mirror {
    fn form(&self) -> &'static Form {
        &FORMS[0]
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![("reflectance", Value::Vector(self.reflectance))]
    }

    fn members(&self) -> Vec<MemberValue> {
        Vec::new()
    }

    fn color(&self) -> DVec3 {
        self.reflectance
    }

    fn albedo(&self) -> DVec3 {
        self.reflectance
    }

    fn moment(&self, channel: usize, k: i32) -> f64 {
        self.reflectance[channel].powi(k)
    }

    fn sample(&self, surface: &Surface, wo: DVec3, _: [f64; 4]) -> BsdfSample {
        BsdfSample {
            wi: (-wo).reflect(surface.normal).normalize(),
            weight: self.reflectance,
            pdf: 0.0,
            event: Event::DELTA,
            eta: 1.0,
        }
    }

    fn evaluate(&self, _: &Surface, _: DVec3, _: DVec3) -> BsdfValue {
        BsdfValue::NONE
    }
}

//! The lecture's reflective material; twin of `shaders/materials/reflective.wesl`.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};
use schemars::JsonSchema;
use serde::Deserialize;

use super::schema::MAX_MAGNITUDE;
use super::uniform::cosine_moment;
use super::{
    Bsdf, BsdfSample, BsdfValue, Event, Form, Member, MemberValue, Surface, Value, luminance,
};
use crate::sampling::directions::{cap_direction, cosine_direction};

pub(super) const NAME: &str = "reflective";

pub(super) const FORMS: &[Form] = &[Form {
    what: "the lecture's lobe around the ideal reflection",
    members: &[
        Member::vector("specular"),
        // 1 - cos(half angle) of the lobe.
        Member::scalar("epsilon"),
        // The BRDF in the lobe for specular = 1, 1/sr.
        Member::scalar("mu"),
        // Luminance of the lobe's albedo at normal incidence, and of the colour.
        Member::scalar("lobe_weight"),
        Member::scalar("color_weight"),
    ],
    derives: Some(&[]),
    ..Form::of(NAME)
}];

/// A material may reflect this much more than everything without a warning: the lecture's ε = 0.01,
/// µ = 10 with albedo 0.375 reflects 1.00018 and counts as energy-conserving.
const ENERGY_SLACK: f64 = 5e-4;

/// The lecture's reflective material: albedo/π, plus µ · specular within ε of the mirror
/// direction.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
pub struct Reflective {
    /// Albedo of the diffuse part.
    #[schemars(schema_with = "super::schema::share")]
    pub albedo: DVec3,
    /// Colour of the lobe.
    #[schemars(schema_with = "super::schema::share")]
    pub specular: DVec3,
    /// Size of the lobe: one minus the cosine of its half-angle.
    #[schemars(range(max = 1.0), extend("exclusiveMinimum" = 0.0))]
    pub epsilon: f64,
    /// Value of the BRDF in the lobe for specular = 1, in 1/sr.
    #[schemars(range(min = 0.0, max = MAX_MAGNITUDE))]
    pub mu: f64,
}

pub(super) fn cases() -> Vec<Reflective> {
    let case = |albedo: [f64; 3], specular: [f64; 3], epsilon, mu| Reflective {
        albedo: albedo.into(),
        specular: specular.into(),
        epsilon,
        mu,
    };
    vec![
        // The lecture's, a wide one, and each part alone.
        case([0.37, 0.3, 0.2], [1.0, 0.9, 0.8], 0.01, 10.0),
        case([0.3, 0.3, 0.3], [0.4, 0.2, 0.1], 0.2, 0.5),
        case([0.0; 3], [0.7; 3], 1.0e-4, 100.0),
        case([0.6, 0.5, 0.4], [0.0; 3], 0.5, 1.0),
        case([0.1; 3], [0.3; 3], 1.0, 0.2),
    ]
}

impl Reflective {
    /// Whether w.d_r > 1 - epsilon.
    #[must_use]
    pub fn in_lobe(&self, w: DVec3, d_r: DVec3) -> bool {
        (w - d_r).length_squared() < 2.0 * self.epsilon
    }

    /// Projected solid angle of the lobe at normal incidence, times mu: its albedo for specular = 1.
    fn lobe_albedo(&self) -> f64 {
        self.mu * PI * self.epsilon * (2.0 - self.epsilon)
    }

    /// Probability of the lobe: its share of the reflected light, by luminance.
    #[must_use]
    pub fn lobe_probability(&self, cos_o: f64) -> f64 {
        let lobe = self.lobe_albedo() * luminance(self.specular) * cos_o;
        let total = lobe + luminance(self.albedo);
        if total > 0.0 { lobe / total } else { 0.0 }
    }

    /// Value and pdf of a direction that makes `cosine` with the normal, in the lobe or out of it.
    #[must_use]
    pub fn value_of(&self, q: f64, cosine: f64, lobe: bool) -> BsdfValue {
        let [in_cap, mu] = if lobe {
            [q / (2.0 * PI * self.epsilon), self.mu]
        } else {
            [0.0; 2]
        };
        BsdfValue {
            f_cos: cosine * (self.albedo / PI + mu * self.specular),
            pdf: in_cap + (1.0 - q) * cosine / PI,
            event: if lobe { Event::GLOSSY } else { Event::DIFFUSE },
        }
    }
}

impl Bsdf for Reflective {
    fn form(&self) -> &'static Form {
        &FORMS[0]
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![
            ("albedo", Value::Vector(self.albedo)),
            ("specular", Value::Vector(self.specular)),
            ("epsilon", Value::Number(self.epsilon)),
            ("mu", Value::Number(self.mu)),
        ]
    }

    fn members(&self) -> Vec<MemberValue> {
        vec![
            self.specular.into(),
            self.epsilon.into(),
            self.mu.into(),
            (self.lobe_albedo() * luminance(self.specular)).into(),
            luminance(self.albedo).into(),
        ]
    }

    fn color(&self) -> DVec3 {
        self.albedo
    }

    fn albedo(&self) -> DVec3 {
        self.albedo + self.lobe_albedo() * self.specular
    }

    // For w = 2 c (rho + pi mu S) within the lobe and 2 c rho elsewhere, c uniform on [0, 1], the mean of
    // w^k is largest if the lobe, a share of at most epsilon of the hemisphere, is where c is largest.
    fn moment(&self, channel: usize, k: i32) -> f64 {
        let (low, lobe) = (self.albedo[channel], PI * self.mu * self.specular[channel]);
        let outside = (1.0 - self.epsilon).powi(k + 1);
        cosine_moment(k) * (low.powi(k) * outside + (low + lobe).powi(k) * (1.0 - outside))
    }

    // The lobe or the diffuse part; below the horizon the path ends.
    fn sample(&self, surface: &Surface, wo: DVec3, u: [f64; 4]) -> BsdfSample {
        let normal = surface.normal;
        let d_r = (-wo).reflect(normal).normalize();
        let q = self.lobe_probability(normal.dot(d_r).max(0.0));
        let place = DVec2::new(u[0], u[1]);
        let chosen = u[2] < q;
        let wi = if chosen {
            cap_direction(d_r, self.epsilon, place)
        } else {
            cosine_direction(normal, place)
        };
        let cosine = normal.dot(wi);
        let value = self.value_of(q, cosine.max(0.0), chosen || self.in_lobe(wi, d_r));
        BsdfSample {
            wi,
            weight: if cosine > 0.0 {
                value.f_cos / value.pdf
            } else {
                DVec3::ZERO
            },
            pdf: value.pdf,
            event: value.event,
            eta: 1.0,
        }
    }

    fn evaluate(&self, surface: &Surface, wo: DVec3, wi: DVec3) -> BsdfValue {
        let normal = surface.normal;
        let d_r = (-wo).reflect(normal).normalize();
        let q = self.lobe_probability(normal.dot(d_r).max(0.0));
        self.value_of(q, normal.dot(wi).max(0.0), self.in_lobe(wi, d_r))
    }

    fn warning(&self) -> Option<[String; 2]> {
        let total = self.albedo().max_element();
        let lobe = self.lobe_albedo();
        (total > 1.0 + ENERGY_SLACK).then(|| {
            [
                format!("gains energy: it reflects up to {total:.3} times the light"),
                format!(
                    "albedo + {lobe:.3} specular must be at most 1 in each channel, \
                     where {lobe:.3} = mu pi (2 epsilon - epsilon^2)"
                ),
            ]
        })
    }
}

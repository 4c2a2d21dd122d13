//! Twin of `shaders/bsdf/reflective.wesl`.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use super::sample::{BsdfSample, bsdf_sample};
use crate::reference::core::sampling::{cap_direction, cosine_direction, sphere_direction};
use crate::scene::luminance;

/// The lecture's reflective material.
#[derive(Clone, Copy, Debug)]
pub struct Reflective {
    /// Albedo of the diffuse part.
    pub color: DVec3,
    /// Colour of the lobe.
    pub specular: DVec3,
    /// 1 - cos(half angle) of the lobe.
    pub epsilon: f64,
    /// The BRDF in the lobe for specular = 1, 1/sr.
    pub mu: f64,
}

/// Whether w.d_r > 1 - epsilon.
#[must_use]
pub fn in_lobe(material: &Reflective, w: DVec3, d_r: DVec3) -> bool {
    (w - d_r).length_squared() < 2.0 * material.epsilon
}

/// The BRDF, in the lobe or out of it.
#[must_use]
pub fn eval_reflective(material: &Reflective, lobe: bool) -> DVec3 {
    material.color / PI
        + if lobe {
            material.mu * material.specular
        } else {
            DVec3::ZERO
        }
}

/// Probability of the lobe: its share of the reflected light, by luminance.
#[must_use]
pub fn lobe_probability(material: &Reflective, cos_o: f64) -> f64 {
    let cap = PI * material.epsilon * (2.0 - material.epsilon);
    let lobe = material.mu * cap * luminance(material.specular) * cos_o;
    let total = lobe + luminance(material.color);
    if total > 0.0 { lobe / total } else { 0.0 }
}

/// pdf in solid angle of the direction w, which makes the cosine `cosine` with the normal.
#[must_use]
pub fn pdf_reflective(material: &Reflective, q: f64, cosine: f64, lobe: bool) -> f64 {
    let cap = if lobe {
        q / (2.0 * PI * material.epsilon)
    } else {
        0.0
    };
    cap + (1.0 - q) * cosine.max(0.0) / PI
}

/// Samples the lobe or the diffuse part; below the horizon the path ends.
#[must_use]
pub fn sample_reflective(
    material: &Reflective,
    normal: DVec3,
    arrival: DVec3,
    u: [f64; 4],
) -> BsdfSample {
    let d_r = arrival.reflect(normal).normalize();
    let q = lobe_probability(material, normal.dot(d_r).max(0.0));
    let place = DVec2::new(u[0], u[1]);
    let chosen = u[2] < q;
    let w = if chosen {
        cap_direction(d_r, material.epsilon, place)
    } else {
        cosine_direction(normal, place)
    };
    let cosine = normal.dot(w);
    if cosine <= 0.0 {
        return bsdf_sample(w, DVec3::ZERO);
    }
    let lobe = chosen || in_lobe(material, w, d_r);
    let pdf = pdf_reflective(material, q, cosine, lobe);
    let mut s = bsdf_sample(w, cosine / pdf * eval_reflective(material, lobe));
    s.density = pdf;
    s
}

/// The lecture's: uniform on the hemisphere, pdf = 1/(2 pi).
#[must_use]
pub fn sample_reflective_uniform(
    material: &Reflective,
    normal: DVec3,
    arrival: DVec3,
    u: [f64; 4],
) -> BsdfSample {
    let d_r = arrival.reflect(normal).normalize();
    let v = sphere_direction(DVec2::new(u[0], u[1]));
    let cosine = v.dot(normal);
    let w = if cosine < 0.0 { -v } else { v };
    let f = eval_reflective(material, in_lobe(material, w, d_r));
    bsdf_sample(w, 2.0 * PI * cosine.abs() * f)
}

//! Twin of `shaders/bsdf/diffuse.wesl`.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use super::sample::{BsdfSample, bsdf_sample};
use crate::reference::core::sampling::{cosine_direction, sphere_direction};

/// pdf = cos/pi, so that the weight is the albedo.
#[must_use]
pub fn sample_diffuse(albedo: DVec3, normal: DVec3, u: [f64; 4]) -> BsdfSample {
    let mut s = bsdf_sample(cosine_direction(normal, DVec2::new(u[0], u[1])), albedo);
    s.density = normal.dot(s.direction).max(0.0) / PI;
    s
}

/// The lecture's: uniform on the hemisphere, pdf = 1/(2 pi).
#[must_use]
pub fn sample_diffuse_uniform(albedo: DVec3, normal: DVec3, u: [f64; 4]) -> BsdfSample {
    let w = sphere_direction(DVec2::new(u[0], u[1]));
    let cosine = w.dot(normal);
    bsdf_sample(
        if cosine < 0.0 { -w } else { w },
        2.0 * cosine.abs() * albedo,
    )
}

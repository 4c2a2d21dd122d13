//! Twin of `shaders/materials/uniform.wesl`.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::{Bsdf, BsdfSample, Surface};
use crate::sampling::directions::sphere_direction;

/// The lecture's way to sample any material but delta lobes: uniform on the hemisphere, pdf = 1/(2 pi). A delta
/// lobe beside others is chosen as the material itself does.
#[must_use]
pub fn sample_uniform(
    material: &dyn Bsdf,
    surface: &Surface,
    wo: DVec3,
    u: [f64; 4],
) -> BsdfSample {
    let share = material.delta_share(surface, wo);
    if u[2] < share {
        return material.sample(surface, wo, u);
    }
    let w = sphere_direction(DVec2::new(u[0], u[1]));
    let wi = if w.dot(surface.normal) < 0.0 { -w } else { w };
    let value = material.evaluate(surface, wo, wi);
    BsdfSample {
        wi,
        weight: TAU * value.f_cos / (1.0 - share),
        pdf: (1.0 - share) / TAU,
        event: value.event,
        eta: 1.0,
    }
}

/// The k-th moment of 2 c for c uniform on [0, 1]: that of the weight of a white diffuse surface.
#[must_use]
pub(super) fn cosine_moment(k: i32) -> f64 {
    2f64.powi(k) / f64::from(k + 1)
}

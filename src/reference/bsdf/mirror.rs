//! Twin of `shaders/bsdf/mirror.wesl`.

use glam::DVec3;

use super::sample::{BsdfSample, bsdf_sample};

/// A delta lobe, weight = reflectance.
#[must_use]
pub fn sample_mirror(reflectance: DVec3, normal: DVec3, arrival: DVec3) -> BsdfSample {
    bsdf_sample(arrival.reflect(normal).normalize(), reflectance)
}

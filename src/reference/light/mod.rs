//! Twins of `shaders/light/`.

pub mod aim;
pub mod projected;
pub mod sphere;

use glam::DVec3;

use crate::scene::Scene;

/// What a ray sees that hits nothing.
#[must_use]
pub fn environment_radiance(scene: &Scene) -> DVec3 {
    scene.environment.unwrap_or_default()
}

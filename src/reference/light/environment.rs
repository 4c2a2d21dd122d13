//! Twin of `shaders/light/environment.wesl` and `gradient.wesl`.

use glam::DVec3;

use crate::scene::{Environment, Gradient, Scene};

/// What a ray in the unit direction `w` sees that hits nothing.
#[must_use]
pub fn environment_radiance(scene: &Scene, w: DVec3) -> DVec3 {
    match &scene.environment {
        None => DVec3::ZERO,
        Some(Environment::Constant(radiance)) => *radiance,
        Some(Environment::Gradient(gradient)) => gradient_radiance(gradient, w),
    }
}

/// mix(horizon, zenith, w.y) above the horizon, the ground below.
#[must_use]
pub fn gradient_radiance(gradient: &Gradient, w: DVec3) -> DVec3 {
    if w.y < 0.0 {
        gradient.ground
    } else {
        gradient.horizon.lerp(gradient.zenith, w.y.min(1.0))
    }
}

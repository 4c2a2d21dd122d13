//! Twin of `shaders/light/surround/` and `shaders/light/sky.wesl`.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use crate::scene::{Environment, Gradient, Scene, Sky};

/// What a ray in the unit direction `w` sees that hits nothing.
#[must_use]
pub fn environment_radiance(scene: &Scene, w: DVec3) -> DVec3 {
    match &scene.environment {
        None => DVec3::ZERO,
        Some(Environment::Constant(radiance)) => *radiance,
        Some(Environment::Gradient(gradient)) => gradient_radiance(gradient, w),
        Some(Environment::Sky(sky)) => sky_radiance(sky, sky_place(sky, w)),
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

/// Where in the image the unit direction `w` is, in texels from its upper left corner.
#[must_use]
pub fn sky_place(sky: &Sky, w: DVec3) -> DVec2 {
    let across = w.x.atan2(-w.z) / TAU - sky.rotation() / 360.0;
    let down = 2.0 * w.x.hypot(w.z).atan2(w.y) / TAU;
    let size = DVec2::new(sky.image().width.into(), sky.image().height.into());
    DVec2::new(across - across.floor(), down) * size
}

/// The radiance there: bilinear between the centres of texels; columns go on around, rows end.
#[must_use]
pub fn sky_radiance(sky: &Sky, place: DVec2) -> DVec3 {
    let [width, height] = [sky.image().width, sky.image().height].map(i64::from);
    let low = (place - 0.5).floor();
    let part = place - 0.5 - low;
    let texel = |x: i64, y: i64| {
        let (column, row) = (x.rem_euclid(width), y.clamp(0, height - 1));
        sky.texel(column as u32, row as u32)
    };
    let (x, y) = (low.x as i64, low.y as i64);
    let row = |y: i64| texel(x, y).lerp(texel(x + 1, y), part.x);
    row(y).lerp(row(y + 1), part.y)
}

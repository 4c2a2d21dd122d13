//! Twin of `shaders/scene/absorption.wesl`.

use glam::DVec3;

/// What is left of light that has gone a length `t`, `None` for infinitely far, by channel.
#[must_use]
pub fn transmittance(absorption: DVec3, t: Option<f64>) -> DVec3 {
    let left = |absorption: f64| match t {
        _ if absorption == 0.0 => 1.0,
        Some(t) => (-absorption * t).exp(),
        None => 0.0,
    };
    DVec3::from(absorption.to_array().map(left))
}

//! Twin of `shaders/light/sphere.wesl`.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use crate::lights::{Light, Lights};
use crate::placement::PlacedSphere;
use crate::reference::core::sampling::cap_direction;
use crate::reference::scene::ray::{Hit, Ray};
use crate::scene::luminance;

/// The light that the alias table gives; `None` if there is none.
#[must_use]
pub fn choose_light(lights: &Lights, u: [f64; 2]) -> Option<&Light> {
    let count = lights.table.len();
    let place = ((u[0] * count as f64) as usize).min(count.checked_sub(1)?);
    let light = &lights.table[place];
    if u[1] < light.threshold {
        Some(light)
    } else {
        lights.table.get(light.alias)
    }
}

/// 1 - cos of the half angle of the cone that a sphere fills, at the squared distance `ww`.
#[must_use]
pub fn cone_height(ww: f64, radius: f64) -> f64 {
    let ss = radius * radius / ww;
    ss / (1.0 + (1.0 - ss).max(0.0).sqrt())
}

/// pdf in solid angle with which light sampling at the ray's origin finds its direction; 0 for a
/// sphere that is not sampled.
#[must_use]
pub fn light_density(
    ray: &Ray,
    hit: &Hit,
    sphere: &PlacedSphere,
    emission: DVec3,
    lights: &Lights,
) -> f64 {
    let w = (sphere.anchor - ray.anchor) - ray.offset;
    let ww = w.length_squared();
    let radius = sphere.radius;
    if sphere.pole.is_some() || hit.inside || ww <= radius * radius {
        return 0.0;
    }
    let share = radius * radius * luminance(emission) * lights.share;
    share / (TAU * cone_height(ww, radius))
}

/// A direction to a sphere, uniform in the cone that it fills, and its pdf in solid angle for a light
/// that is chosen with this probability; `w` goes from the vertex to the centre. `None` from within.
#[must_use]
pub fn sample_cone(probability: f64, radius: f64, w: DVec3, u: DVec2) -> Option<(DVec3, f64)> {
    let ww = w.length_squared();
    if ww <= radius * radius {
        return None;
    }
    let height = cone_height(ww, radius);
    let direction = cap_direction(w / ww.sqrt(), height, u);
    Some((direction, probability / (TAU * height)))
}

/// Weight of an estimate whose direction has density `a`, against another way with density `b`.
#[must_use]
pub fn power_weight(a: f64, b: f64) -> f64 {
    let ratio = b / a;
    1.0 / (1.0 + ratio * ratio)
}

//! Units: powers of two that bring a scene's lengths and its light to numbers that f32 can stand.

use glam::DVec3;

use super::pole::pole_point;
use crate::scene::{Environment, Scene};

/// The power of two that brings the extent of the spheres `all`, without those in pole frames, to [1, 2).
pub(super) fn length(
    scene: &Scene,
    centers: &[DVec3],
    poles: &[Option<DVec3>],
    all: &[usize],
) -> f64 {
    let extent = all
        .iter()
        .map(|&i| match poles[i] {
            Some(n) => (
                i,
                pole_point(centers[i], scene.spheres[i].radius, n).length(),
            ),
            None => (i, centers[i].length() + scene.spheres[i].radius),
        })
        .map(|(i, distance)| distance + 0.5 * scene.spheres[i].motion.length())
        .fold(0.0, f64::max);
    if extent > 0.0 {
        (-extent.log2().floor()).exp2()
    } else {
        1.0
    }
}

/// The unit of radiance for the reachable spheres `all`.
pub(super) fn radiance(scene: &Scene, all: &[usize], enclosed: bool) -> f64 {
    let emission = |i: &usize| scene.materials[scene.spheres[*i].material].emission;
    let surfaces = all.iter().map(|i| emission(i).max_element());
    let environment = scene.environment.iter().filter(|_| !enclosed);
    let brightest = surfaces
        .chain(environment.map(Environment::brightest))
        .fold(0.0, f64::max);
    if brightest > 0.0 {
        (32.0 - brightest.log2().floor()).exp2()
    } else {
        1.0
    }
}

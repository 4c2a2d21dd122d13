//! Integrals over the hemisphere, for the materials' tests.

use glam::DVec3;

use super::{Bsdf, Surface};
use crate::verify::{Cells, Random};

/// A point that is flat, in air.
pub(super) const SURFACE: Surface = Surface {
    normal: DVec3::Z,
    eta: 1.0,
    offset: DVec3::ZERO,
};

/// The direction that makes `degrees` with the normal, turned by `turn` radians about it.
pub(super) fn direction(degrees: f64, turn: f64) -> DVec3 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    DVec3::new(sin * turn.cos(), sin * turn.sin(), cos)
}

/// The integral over the directions above the surface, in cells that are narrow about the mirror direction of
/// `wo`.
pub(super) fn integral(wo: DVec3, f: impl Fn(DVec3) -> f64 + Sync) -> f64 {
    const EDGES: [f64; 6] = [0.0, 1.0e-4, 1.0e-2, 0.1, 1.0, 2.0];
    let cells = Cells::new(DVec3::new(-wo.x, -wo.y, wo.z), &EDGES, 4, 16);
    let above = |w: DVec3| [if w.z > 0.0 { f(w) } else { 0.0 }];
    cells
        .integrals(above, 1.0e-7)
        .into_iter()
        .map(|[part]| part)
        .sum()
}

/// The share of the light from there that is scattered, in the red channel.
pub(super) fn albedo(material: &(impl Bsdf + Sync), wo: DVec3) -> f64 {
    integral(wo, |wi| material.evaluate(&SURFACE, wo, wi).f_cos.x)
}

/// The largest difference between f and a formula written down again, in all channels, relative where f is above
/// 1e-3, over random directions, half of which are near the other one's mirror direction.
pub(super) fn furthest(material: &dyn Bsdf, formula: impl Fn(DVec3, DVec3) -> DVec3) -> f64 {
    let mut random = Random::new("literal");
    let up = |w: DVec3| w.with_z(w.z.abs()).normalize();
    let off = |i| {
        let wo = up(random.direction());
        let wi = match i % 2 {
            0 => -wo.with_z(-wo.z) + random.magnitude(-4.0, 0.0) * random.direction(),
            _ => random.direction(),
        };
        let wi = up(wi);
        let f = material.evaluate(&SURFACE, wo, wi).f_cos / wi.z;
        let truth = formula(wo, wi);
        (f - truth).abs().max_element() / truth.max_element().max(1.0e-3)
    };
    (0..20_000).map(off).fold(0.0, f64::max)
}

//! The share of the light that a material scatters, where no formula says it.

use std::f64::consts::FRAC_PI_4;

use glam::DVec3;

use super::{Bsdf, Surface};
use crate::sampling::directions::basis_around;

/// By how much [`most_scattered`] may be too low: the tests compare it with quadrature.
pub(super) const MARGIN: f64 = 1.02;

/// A material that scatters this much more than everything is said to gain energy: what the figure is known to.
pub(super) const ENERGY_SLACK: f64 = 0.01;

/// Directions of a mean.
const POINTS: u32 = 512;

/// The share of the light that is scattered at the angle where it is largest, by channel, about: means of weights
/// over numbers that are evenly spread (Roberts, "The Unreasonable Effectiveness of Quasirandom Sequences", 2018).
/// `axis` is that of the material.
pub(super) fn most_scattered(material: &dyn Bsdf, axis: DVec3) -> DVec3 {
    let normal = basis_around(axis).tangent;
    let surface = Surface {
        normal,
        eta: 1.0,
        offset: DVec3::ZERO,
    };
    let across = axis.cross(normal);
    let mut most = DVec3::ZERO;
    // Close to each other at grazing angles.
    for cosine in (0..=8).map(|i| f64::from(i * i) / 64.0) {
        for turn in [0.0, FRAC_PI_4, 2.0 * FRAC_PI_4] {
            let along = turn.cos() * across + turn.sin() * axis;
            let wo = cosine * normal + (1.0 - cosine * cosine).sqrt() * along;
            most = most.max(mean_weight(material, &surface, wo));
        }
    }
    most
}

/// The warning of a material that scatters as much, if that is more than everything.
pub(super) fn gains_energy(most: DVec3, help: &str) -> Option<[String; 2]> {
    let most = most.max_element();
    (most > 1.0 + ENERGY_SLACK).then(|| {
        [
            format!("gains energy: at some angles it scatters {most:.2} times the light"),
            help.into(),
        ]
    })
}

fn mean_weight(material: &dyn Bsdf, surface: &Surface, wo: DVec3) -> DVec3 {
    mean_over(|u| material.sample(surface, wo, u).weight)
}

/// The mean of what depends on uniform numbers, of which a material uses three.
pub(super) fn mean_over(value: impl Fn([f64; 4]) -> DVec3) -> DVec3 {
    // Powers of the inverse of the root of x^4 = x + 1.
    const STEP: [f64; 3] = [
        0.819_172_513_396_164_4,
        0.671_043_606_703_789_2,
        0.549_700_477_901_970_3,
    ];
    let values = (0..POINTS).map(|i| {
        let [x, y, z] = STEP.map(|step| (0.5 + f64::from(i) * step).fract());
        value([x, y, z, 0.5])
    });
    values.sum::<DVec3>() / f64::from(POINTS)
}

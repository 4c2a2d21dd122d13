//! Microfacets: Beckmann's distribution in V-cavities; twin of `shaders/materials/beckmann.wesl`, which has the
//! formulas' sources.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use super::lobes::Pair;
use super::powers::log1p_over;

/// The least cosine of a facet that the kernel has.
const LEAST_COS: f64 = 1.0e-3;

/// What reflection has in common for all m.
#[derive(Clone, Copy, Debug)]
pub struct Facets {
    /// Cosine of the half vector with the normal.
    pub cos_h: f64,
    /// Square of its tangent.
    pub tan2: f64,
    /// G1(o)/(4 co) over ch.
    pub visible: f64,
    /// G2/(G1(o) ci); 0 where one of the directions is below the horizon.
    pub both: f64,
}

impl Facets {
    /// Those that reflect the one direction into the other, in a frame about the normal.
    #[must_use]
    pub fn of(pair: &Pair) -> Self {
        let cos_h = pair.h.z.max(LEAST_COS);
        let (double_o, double_i) = (2.0 * cos_h * pair.o.z, 2.0 * cos_h * pair.i.z);
        let lit = pair.o.z >= 0.0 && pair.i.z > 0.0;
        Self {
            cos_h,
            tan2: pair.h.truncate().length_squared() / (cos_h * cos_h),
            visible: 0.5 / pair.cos_h.max(double_o),
            both: match lit {
                true => 2.0 * cos_h / double_i.max(pair.cos_h.min(double_o)),
                false => 0.0,
            },
        }
    }

    /// D G1(o)/(4 co): the pdf of reflection about visible normals, in solid angle of wi.
    #[must_use]
    pub fn pdf(&self, m: f64) -> f64 {
        (-self.tan2 / (m * m)).exp() * self.visible / (PI * m * m * self.cos_h.powi(3))
    }
}

/// The square of a slope of width 1: -log(1 - u).
#[must_use]
pub fn beckmann_slope2(u: f64) -> f64 {
    u * log1p_over(-u)
}

/// A normal that wo sees.
#[must_use]
pub fn beckmann_normal(wo: DVec3, m: f64, u: DVec2, v: f64) -> DVec3 {
    let slope = m * beckmann_slope2(u.x).sqrt() * DVec2::from_angle(TAU * u.y);
    let h = slope.extend(1.0).normalize();
    let along = wo.truncate().dot(h.truncate());
    let front = (wo.z * h.z + along).max(0.0);
    let back = (wo.z * h.z - along).max(0.0);
    if v * (front + back) >= front {
        (-h.truncate()).extend(h.z)
    } else {
        h
    }
}

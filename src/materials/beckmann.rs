//! Microfacets: Beckmann's distribution in V-cavities; twin of `shaders/materials/beckmann.wesl`, which has the
//! formulas' sources.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

/// The least cosine of a facet that the kernel has.
const LEAST_COS: f64 = 1.0e-3;

/// What reflection has in common for all m.
#[derive(Clone, Copy, Debug)]
pub struct Facets {
    /// Cosine of the half vector with the normal.
    pub cos_h: f64,
    /// Square of its tangent.
    pub tan2: f64,
    /// Cosine of the half vector with both directions.
    pub oh: f64,
    /// G1(o)/(4 co) over ch; 0 where one of the directions is below the normal's horizon.
    pub visible: f64,
    /// G2/(G1(o) ci), or 0.
    pub both: f64,
}

/// The direction halfway between two, and its cosine with either.
#[derive(Clone, Copy, Debug)]
pub struct Halfway {
    /// The direction.
    pub h: DVec3,
    /// The cosine.
    pub oh: f64,
}

impl Halfway {
    /// That between wo and wi.
    #[must_use]
    pub fn between(wo: DVec3, wi: DVec3) -> Self {
        let sum = wo + wi;
        Self {
            h: sum.normalize(),
            oh: 0.5 * sum.length(),
        }
    }
}

impl Facets {
    /// Those about `normal`; `cos_o`: of wo with it.
    #[must_use]
    pub fn about(normal: DVec3, cos_o: f64, wi: DVec3, between: Halfway) -> Self {
        let Halfway { h, oh } = between;
        let cos_i = normal.dot(wi);
        let cos_h = normal.dot(h).max(LEAST_COS);
        let double_o = 2.0 * cos_h * cos_o;
        let both = 2.0 * cos_h / (2.0 * cos_h * cos_i).max(oh.min(double_o));
        let [visible, both] = if cos_o >= 0.0 && cos_i > 0.0 {
            [0.5 / oh.max(double_o), both]
        } else {
            [0.0; 2]
        };
        Self {
            cos_h,
            tan2: normal.cross(h).length_squared() / (cos_h * cos_h),
            oh,
            visible,
            both,
        }
    }

    /// D G1(o)/(4 co): the pdf of reflection about visible normals, in solid angle of wi.
    #[must_use]
    pub fn pdf(&self, m: f64) -> f64 {
        (-self.tan2 / (m * m)).exp() * self.visible / (PI * m * m * self.cos_h.powi(3))
    }
}

/// -log(1 - u)
#[must_use]
pub fn minus_log(u: f64) -> f64 {
    -(-u).ln_1p()
}

/// A normal that wo sees, in a frame about z.
#[must_use]
pub fn beckmann_normal(wo: DVec3, m: f64, u: DVec2, v: f64) -> DVec3 {
    let slope = m * minus_log(u.x).sqrt() * DVec2::from_angle(TAU * u.y);
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

//! Microfacets: the GGX distribution; twin of `shaders/materials/ggx.wesl`, which has the formulas' sources.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use crate::sampling::directions::basis_around;

/// The least roughness of a surface that is not smooth.
pub const LEAST_ALPHA: f64 = 1.0e-3;

/// Roughness along the tangents: alpha = roughness², apart by the aspect sqrt(1 - 0.9 anisotropy).
#[must_use]
pub fn alpha(roughness: f64, anisotropy: f64) -> DVec2 {
    let alpha = roughness * roughness;
    let aspect = (1.0 - 0.9 * anisotropy).sqrt();
    DVec2::new(alpha / aspect, alpha * aspect).max(DVec2::splat(LEAST_ALPHA))
}

/// Unit vectors along x, y and z.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    tangent: DVec3,
    bitangent: DVec3,
    normal: DVec3,
}

impl Frame {
    /// Tangents u = axis x n and v = n x u; any, where the axis is along the normal.
    #[must_use]
    pub fn about(normal: DVec3, axis: DVec3) -> Self {
        let across = axis.cross(normal);
        let tangent = if across.length_squared() > 1.0e-12 {
            across.normalize()
        } else {
            basis_around(normal).tangent
        };
        Self {
            tangent,
            bitangent: normal.cross(tangent),
            normal,
        }
    }

    /// With any tangents.
    #[must_use]
    pub fn around(normal: DVec3) -> Self {
        let basis = basis_around(normal);
        Self {
            tangent: basis.tangent,
            bitangent: basis.bitangent,
            normal,
        }
    }

    /// The vector along z.
    #[must_use]
    pub fn normal(&self) -> DVec3 {
        self.normal
    }

    /// The vector's components.
    #[must_use]
    pub fn to_local(&self, w: DVec3) -> DVec3 {
        let Self {
            tangent,
            bitangent,
            normal,
        } = *self;
        DVec3::new(w.dot(tangent), w.dot(bitangent), w.dot(normal))
    }

    /// The vector of these components.
    #[must_use]
    pub fn to_world(&self, w: DVec3) -> DVec3 {
        w.x * self.tangent + w.y * self.bitangent + w.z * self.normal
    }
}

/// Density of microfacet normals by projected area, 1/sr.
#[must_use]
pub fn ggx_d(h: DVec3, alpha: DVec2) -> f64 {
    let slope = h.truncate() / alpha;
    let square = slope.length_squared() + h.z * h.z;
    1.0 / (PI * alpha.x * alpha.y * square * square)
}

/// s(w)
#[must_use]
pub fn ggx_s(w: DVec3, alpha: DVec2) -> f64 {
    (alpha * w.truncate()).extend(w.z).length()
}

/// D G1(o)/(4 z_o): the pdf of reflection about visible normals, in solid angle of wi.
#[must_use]
pub fn ggx_pdf(wo: DVec3, h: DVec3, alpha: DVec2) -> f64 {
    ggx_d(h, alpha) / (2.0 * (wo.z + ggx_s(wo, alpha)))
}

/// G2/G1(o)
#[must_use]
pub fn ggx_weight(wo: DVec3, wi: DVec3, alpha: DVec2) -> f64 {
    let s = ggx_s(wo, alpha);
    wi.z * (wo.z + s) / (wi.z * s + wo.z * ggx_s(wi, alpha))
}

/// A normal that wo sees, and its cosine with wo.
#[must_use]
pub fn ggx_normal(wo: DVec3, alpha: DVec2, u: DVec2) -> (DVec3, f64) {
    let length = ggx_s(wo, alpha);
    let stretched = (alpha * wo.truncate()).extend(wo.z) / length;
    let whole = 1.0 + stretched.z;
    let (below, above) = (whole * u.x, whole * (1.0 - u.x));
    let sine2 = below * (stretched.truncate().length_squared() / whole + above);
    let h = (sine2.sqrt() * DVec2::from_angle(TAU * u.y) + stretched.truncate()).extend(above);
    let n = (alpha * h.truncate()).extend(h.z);
    let inverse = n.length().recip();
    (inverse * n, 0.5 * length * h.length_squared() * inverse)
}

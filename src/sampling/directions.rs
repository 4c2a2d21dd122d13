//! Twin of `shaders/core/sampling.wesl`.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

/// (cos, sin) of 2 pi u.
#[must_use]
pub fn circle_point(u: f64) -> DVec2 {
    let (sin, cos) = (TAU * u).sin_cos();
    DVec2::new(cos, sin)
}

/// Uniform direction on the unit sphere; pdf = 1/(4 pi) in solid angle.
#[must_use]
pub fn sphere_direction(u: DVec2) -> DVec3 {
    let sin_theta = 2.0 * (u.x * (1.0 - u.x)).sqrt();
    (sin_theta * circle_point(u.y)).extend(1.0 - 2.0 * u.x)
}

/// Direction with pdf cos(theta)/pi in solid angle around the unit vector n.
#[must_use]
pub fn cosine_direction(n: DVec3, u: DVec2) -> DVec3 {
    let v = n + sphere_direction(u);
    // The kernel's threshold, since the two must agree on the direction.
    if v.length_squared() > 1.0e-12 {
        v.normalize()
    } else {
        n
    }
}

/// Two unit vectors that make an orthonormal basis with the unit vector n.
#[derive(Clone, Copy, Debug)]
pub struct Basis {
    /// First vector.
    pub tangent: DVec3,
    /// Second vector.
    pub bitangent: DVec3,
}

/// Duff et al., "Building an Orthonormal Basis, Revisited" (JCGT 6(1), 2017), listing 3.
#[must_use]
pub fn basis_around(n: DVec3) -> Basis {
    let s = if n.z >= 0.0 { 1.0 } else { -1.0 };
    let a = -1.0 / (s + n.z);
    let b = n.x * n.y * a;
    Basis {
        tangent: DVec3::new(1.0 + s * n.x * n.x * a, s * b, -s * n.x),
        bitangent: DVec3::new(b, s + n.y * n.y * a, -n.y),
    }
}

/// Uniform direction in the cap of height h = 1 - cos(half angle) around the unit vector axis;
/// pdf = 1/(2 pi h) in solid angle.
#[must_use]
pub fn cap_direction(axis: DVec3, height: f64, u: DVec2) -> DVec3 {
    let x = height * u.x;
    let p = (x * (2.0 - x)).sqrt() * circle_point(u.y);
    let basis = basis_around(axis);
    (p.x * basis.tangent + p.y * basis.bitangent + (1.0 - x) * axis).normalize()
}

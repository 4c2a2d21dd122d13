//! Twin of `shaders/light/aim.wesl`.

use glam::DVec3;

use crate::placement::PlacedSphere;
use crate::reference::scene::ray::anchors_apart;

/// A sphere as a vertex sees it; see the kernel's struct.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(missing_docs, reason = "the members are those of the kernel's struct")]
pub struct Aim {
    pub axis: DVec3,
    pub distance: f64,
    pub sine: f64,
    pub rim: f64,
    pub outside: bool,
}

/// About the centre; `x` goes from there to the vertex.
#[must_use]
pub fn aim_center(x: DVec3, radius: f64) -> Aim {
    let distance = x.length();
    let gap = (distance - radius) * (distance + radius);
    Aim {
        axis: -x / distance,
        distance,
        sine: radius / distance,
        rim: gap.max(0.0).sqrt() / distance,
        outside: distance > radius,
    }
}

/// About the pole, whose outward normal is `normal`; `x` goes from there to the vertex.
#[must_use]
pub fn aim_pole(x: DVec3, normal: DVec3, curvature: f64) -> Aim {
    let c = curvature * x.length_squared() + 2.0 * normal.dot(x);
    let v = normal + curvature * x;
    let radii = v.length();
    Aim {
        axis: -v / radii,
        distance: radii / curvature,
        sine: 1.0 / radii,
        rim: (curvature * c).max(0.0).sqrt() / radii,
        outside: c > 0.0,
    }
}

/// A sphere of the placement, from `anchor + time motion + offset`.
#[must_use]
pub fn aim_at(
    sphere: &PlacedSphere,
    anchor: DVec3,
    offset: DVec3,
    motion: DVec3,
    time: f64,
) -> Aim {
    let x = anchors_apart(sphere, anchor, motion, time) + offset;
    match sphere.pole {
        Some(normal) => aim_pole(x, normal, 1.0 / sphere.radius),
        None => aim_center(x, sphere.radius),
    }
}

/// 1 - cos of the half angle.
#[must_use]
pub fn cone_height(aim: &Aim) -> f64 {
    aim.sine * aim.sine / (1.0 + aim.rim)
}

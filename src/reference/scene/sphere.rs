//! Twin of `shaders/scene/sphere.wesl`: a ray against one sphere, and against all.

use glam::DVec3;

use super::priority::is_within;
use super::ray::{Hit, Ray, anchors_apart};
use crate::placement::{PlacedSphere, Side};

/// a t^2 - 2 b t + c = 0 with c = 0 on the surface and positive outside.
#[derive(Clone, Copy, Debug)]
#[expect(missing_docs, reason = "the coefficients of the formula above")]
pub struct Quadratic {
    pub a: f64,
    pub b: f64,
    /// b^2 - a c
    pub square: f64,
    pub c: f64,
}

/// The root of a path outside the sphere, if it hits.
#[must_use]
pub fn root_outside(q: &Quadratic, own: bool) -> Option<f64> {
    let hits = q.b > 0.0 && q.square >= 0.0 && !own;
    hits.then(|| q.c.max(0.0) / (q.b + q.square.sqrt()))
}

/// The root of a path inside the sphere.
#[must_use]
pub fn root_interior(q: &Quadratic, own: bool) -> f64 {
    let s = if own {
        q.b.abs()
    } else {
        q.square.max(0.0).sqrt()
    };
    let depth = if own { 0.0 } else { (-q.c).max(0.0) };
    let sum = q.b.abs() + s;
    if q.b >= 0.0 { sum / q.a } else { depth / sum }
}

/// About the centre: f = origin - centre. In f64, factored throughout.
#[must_use]
pub fn sphere_quadratic(f: DVec3, direction: DVec3, radius: f64) -> Quadratic {
    let a = direction.length_squared();
    let b = -f.dot(direction);
    let l = (f + (b / a) * direction).length();
    let square = a * (radius - l) * (radius + l);
    let c = (f.length() - radius) * (f.length() + radius);
    Quadratic { a, b, square, c }
}

/// About the pole: x = origin - pole.
#[must_use]
pub fn pole_quadratic(x: DVec3, direction: DVec3, normal: DVec3, curvature: f64) -> Quadratic {
    let a = curvature * direction.length_squared();
    let b = -(curvature * x.dot(direction) + normal.dot(direction));
    let c = curvature * x.length_squared() + 2.0 * normal.dot(x);
    Quadratic {
        a,
        b,
        square: b * b - a * c,
        c,
    }
}

/// The nearest hit on any of `spheres`; of equally near ones that of the lowest index.
#[must_use]
pub fn closest_hit(ray: &Ray, spheres: &[PlacedSphere]) -> Option<Hit> {
    let mut nearest: Option<Hit> = None;
    for (index, sphere) in spheres.iter().enumerate() {
        let x = anchors_apart(sphere, ray.anchor, ray.motion, ray.time) + ray.offset;
        let q = match sphere.pole {
            Some(normal) => pole_quadratic(x, ray.direction, normal, 1.0 / sphere.radius),
            None => sphere_quadratic(x, ray.direction, sphere.radius),
        };
        let own = ray.own == Some(index);
        let inside = match sphere.side {
            Side::Outside => false,
            Side::Inside => true,
            Side::Tracked => is_within(&ray.media, index),
            Side::Sign if own => ray.inward,
            Side::Sign => q.c < 0.0,
        };
        if sphere.container.is_some_and(|c| !is_within(&ray.media, c))
            || sphere.cores.iter().any(|c| is_within(&ray.media, *c))
        {
            continue;
        }
        let t = if inside {
            Some(root_interior(&q, own))
        } else {
            root_outside(&q, own)
        };
        if let Some(t) = t
            && nearest.is_none_or(|hit| t < hit.t)
        {
            nearest = Some(Hit { t, index, inside });
        }
    }
    nearest
}

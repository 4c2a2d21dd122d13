//! Twin of `shaders/scene/ray.wesl`: rays and points as offsets from anchors.

use glam::DVec3;

use super::priority::Media;
use crate::placement::PlacedSphere;
use crate::settings::Offset;

/// A ray; see the kernel's source for the members.
#[derive(Clone, Debug)]
#[expect(missing_docs, reason = "the members are those of the kernel's struct")]
pub struct Ray {
    pub anchor: DVec3,
    pub motion: DVec3,
    pub time: f64,
    pub offset: DVec3,
    pub direction: DVec3,
    pub own: Option<usize>,
    pub inward: bool,
    pub media: Media,
}

impl Ray {
    /// One that is in no dielectric; where it is and goes is left open.
    #[must_use]
    pub fn in_vacuum() -> Self {
        Self {
            anchor: DVec3::ZERO,
            motion: DVec3::ZERO,
            time: 0.0,
            offset: DVec3::ZERO,
            direction: DVec3::ZERO,
            own: None,
            inward: false,
            media: Media::default(),
        }
    }
}

/// The nearest hit of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// In units of the direction's length.
    pub t: f64,
    /// Index into the placement's spheres.
    pub index: usize,
    /// Whether the ray arrived from inside the sphere.
    pub inside: bool,
}

/// A point on a sphere.
#[derive(Clone, Copy, Debug)]
#[expect(missing_docs, reason = "the members are those of the kernel's struct")]
pub struct Vertex {
    pub anchor: DVec3,
    pub motion: DVec3,
    pub time: f64,
    pub offset: DVec3,
    pub normal: DVec3,
    pub both_sides: bool,
}

/// The vector from the anchor of `sphere` to another one at `anchor`, that moves by `motion`, at this time.
#[must_use]
pub fn anchors_apart(sphere: &PlacedSphere, anchor: DVec3, motion: DVec3, time: f64) -> DVec3 {
    (anchor - sphere.anchor) + time * (motion - sphere.motion)
}

/// The point where `ray` hits `sphere`.
#[must_use]
pub fn vertex_at(ray: &Ray, hit: &Hit, sphere: &PlacedSphere) -> Vertex {
    let apart = anchors_apart(sphere, ray.anchor, ray.motion, ray.time);
    let x = (apart + ray.offset) + hit.t * ray.direction;
    let (offset, outward) = match sphere.pole {
        Some(pole) => (x, (pole + x / sphere.radius).normalize()),
        None => {
            let outward = x.normalize();
            (sphere.radius * outward, outward)
        }
    };
    let normal = if hit.inside { -outward } else { outward };
    Vertex {
        anchor: sphere.anchor,
        motion: sphere.motion,
        time: ray.time,
        offset,
        normal,
        both_sides: false,
    }
}

/// The ray that goes on from a vertex; crossed: through the surface, in which case its media change.
#[must_use]
pub fn leave(
    arrived: Ray,
    hit: &Hit,
    vertex: &Vertex,
    direction: DVec3,
    crossed: bool,
    offset: Offset,
) -> Ray {
    let mut ray = Ray {
        anchor: vertex.anchor,
        motion: vertex.motion,
        time: arrived.time,
        offset: vertex.offset,
        direction,
        own: Some(hit.index),
        inward: hit.inside != crossed,
        media: arrived.media,
    };
    if offset == Offset::Exact {
        return ray;
    }
    let start = arrived.anchor + arrived.time * arrived.motion;
    let point = start + (arrived.offset + hit.t * arrived.direction);
    let out = if crossed {
        -vertex.normal
    } else {
        vertex.normal
    };
    ray.own = None;
    ray.anchor = DVec3::ZERO;
    ray.motion = DVec3::ZERO;
    ray.offset = match offset.distances() {
        Some([back, away]) => point - back * arrived.direction + away * out,
        None => ulp_away(point, out),
    };
    ray
}

/// Moves a point by so many ulp *of f32* along n, or near the origin by a fixed length.
#[must_use]
pub fn ulp_away(p: DVec3, n: DVec3) -> DVec3 {
    let component = |p: f64, n: f64| {
        if p.abs() < 1.0 / 32.0 {
            return p + n / 65536.0;
        }
        let steps = (256.0 * n) as i32;
        let bits = (p as f32).to_bits() as i32;
        let steps = if p < 0.0 { -steps } else { steps };
        f64::from(f32::from_bits(bits.wrapping_add(steps) as u32))
    };
    DVec3::new(
        component(p.x, n.x),
        component(p.y, n.y),
        component(p.z, n.z),
    )
}

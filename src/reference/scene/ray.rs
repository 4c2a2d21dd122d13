//! Twin of `shaders/scene/ray.wesl`: rays and points as offsets from anchors.

use glam::DVec3;

use crate::placement::PlacedSphere;

/// A ray; see the kernel's source for the members.
#[derive(Clone, Copy, Debug)]
#[expect(missing_docs, reason = "the members are those of the kernel's struct")]
pub struct Ray {
    pub anchor: DVec3,
    pub offset: DVec3,
    pub direction: DVec3,
    pub own: Option<usize>,
    pub inward: bool,
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
    pub offset: DVec3,
    pub normal: DVec3,
}

/// The point where `ray` hits `sphere`.
#[must_use]
pub fn vertex_at(ray: &Ray, hit: &Hit, sphere: &PlacedSphere) -> Vertex {
    let x = ((ray.anchor - sphere.anchor) + ray.offset) + hit.t * ray.direction;
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
        offset,
        normal,
    }
}

//! Spheres as the renderers use them: what all other files of the placement speak of.

use glam::DVec3;

use crate::scene::Scene;

/// Rounding of the sum of a distance and a radius in f64, as a share of it.
pub(super) const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// A sphere in kernel units, relative to the placement's origin.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedSphere {
    /// Index into the scene's spheres.
    pub source: usize,
    /// Index into the scene's materials.
    pub material: usize,
    /// The centre, or the pole.
    pub anchor: DVec3,
    /// Radius, in kernel units.
    pub radius: f64,
    /// Outward unit normal at the pole, if the sphere has a pole frame.
    pub pole: Option<DVec3>,
    /// Which side of the surface paths can be on.
    pub side: Side,
    /// Precedence among dielectrics that share points; see [`Media`](super::Media).
    pub level: u32,
    /// The dielectric that this sphere lies just within, an index into the placement's spheres:
    /// this sphere is hit only from within that.
    pub container: Option<usize>,
    /// The dielectrics that lie just within this sphere, indices into the placement's spheres: from
    /// within any of them, this sphere is not hit.
    pub cores: Vec<usize>,
}

impl PlacedSphere {
    /// Where the anchor is, from the centre and in scene units; `scale`: the placement's.
    #[must_use]
    pub fn anchor_offset(&self, scale: f64) -> DVec3 {
        self.pole
            .map_or(DVec3::ZERO, |normal| self.radius / scale * normal)
    }
}

/// Which side of a sphere's surface paths can be on.
///
/// No path crosses an opaque surface, so its side is that of the camera, once and for all; and a
/// path that crosses a dielectric's surface knows it. What f32 says about a point near the surface
/// is not asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Side {
    /// Only outside.
    Outside = 0,
    /// Only inside.
    Inside = 1,
    /// Both: a dielectric. The path keeps account of it.
    Tracked = 2,
    /// Both, and only the sign of the ray's distance tells: a surface that the lens straddles, or
    /// any surface where paths leave by a nudge ([`Offset`](crate::settings::Offset)).
    Sign = 3,
}

impl Side {
    /// The side of sphere `i` of `scene` on which paths can be, where they leave surfaces exactly.
    #[must_use]
    pub fn of(scene: &Scene, i: usize) -> Self {
        let sphere = &scene.spheres[i];
        let distance = scene.camera.position.distance(sphere.center);
        let lens = scene.camera.aperture_radius;
        if lens > 0.0 && (distance - sphere.radius).abs() <= lens {
            return Self::Sign;
        }
        if scene.materials[sphere.material].kind.transmits() {
            Self::Tracked
        } else if distance >= sphere.radius * (1.0 - ROUNDING) {
            // A camera on the surface sees it from outside.
            Self::Outside
        } else {
            Self::Inside
        }
    }
}

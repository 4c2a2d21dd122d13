//! Spheres as the renderers use them: what all other files of the placement speak of.

use glam::DVec3;

use crate::scene::Scene;

pub(super) use crate::scene::motion::ROUNDING;

/// A sphere in kernel units, relative to the placement's origin.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedSphere {
    /// Index into the scene's spheres.
    pub source: usize,
    /// Index into the scene's materials.
    pub material: usize,
    /// The centre, or the pole, in the middle of the time for which the shutter is open.
    pub anchor: DVec3,
    /// Its way in that time, in kernel units: at the time t, from -1/2 to 1/2, the anchor is at `anchor + t motion`.
    pub motion: DVec3,
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
    /// The side of sphere `i` of `scene` on which paths can be, where they leave surfaces exactly. It is the same for
    /// all of the time for which the shutter is open: no sphere moves over the camera.
    #[must_use]
    pub fn of(scene: &Scene, i: usize) -> Self {
        let sphere = &scene.spheres[i];
        let distances = sphere.distances_from(scene.camera.position);
        let lens = scene.camera.aperture_radius;
        if lens > 0.0 && distances.gap(sphere.radius) <= lens {
            return Self::Sign;
        }
        if scene.materials[sphere.material].kind.transmits() {
            Self::Tracked
        } else if distances.least >= sphere.radius * (1.0 - ROUNDING) {
            // A camera on the surface sees it from outside.
            Self::Outside
        } else {
            Self::Inside
        }
    }
}

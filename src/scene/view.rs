//! Where a camera can look.

use glam::DVec3;

use super::Camera;
use crate::materials::schema::along;

/// Directions whose angle has a smaller sine are parallel: of the sixteen digits of an f64 the
/// cross product keeps half, which is what the f32 of the GPU needs.
const PARALLEL: f64 = 1e-8;

/// Below this length a vector's square, and that of its product with a direction that is hardly not
/// parallel, is lost in an f64. Times the largest length, its inverse is still an f64.
pub(super) const SHORTEST: f64 = 1e-140;

/// Why a camera cannot look as it does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Fault {
    /// What it looks at is so near that the direction is lost.
    TooNear,
    /// It looks at itself.
    NoDirection,
    /// Its upward direction is none.
    NoUp,
    /// Its upward direction is along the view axis.
    Parallel,
    /// Its lens is focused on itself, almost.
    FocusTooNear,
}

impl Fault {
    /// That of the view axis with what is up, if it has one.
    pub(super) fn of_view(position: DVec3, look_at: DVec3, up: DVec3) -> Option<Self> {
        let axis = look_at - position;
        let Some(forward) = direction(axis) else {
            return Some(Self::NoDirection);
        };
        if axis.abs().max_element() < SHORTEST {
            return Some(Self::TooNear);
        }
        match direction(up).map(|up| up.cross(forward).length()) {
            None => Some(Self::NoUp),
            Some(sine) => (sine < PARALLEL).then_some(Self::Parallel),
        }
    }

    /// That of a lens, if it has one: a pinhole has everything in focus.
    pub(super) fn of_lens(aperture_radius: f64, focus_distance: f64) -> Option<Self> {
        (aperture_radius > 0.0 && focus_distance < SHORTEST).then_some(Self::FocusTooNear)
    }

    /// The first of a camera.
    pub(super) fn of(camera: &Camera) -> Option<Self> {
        Self::of_view(camera.position, camera.look_at, camera.up)
            .or_else(|| Self::of_lens(camera.aperture_radius, camera.focus_distance))
    }

    /// What the camera does.
    pub(super) fn what(self) -> &'static str {
        match self {
            Self::TooNear => "`look_at` is too near to the camera's `position` to look there",
            Self::NoDirection => "`look_at` is the camera's `position`: no direction to look in",
            Self::NoUp => "`up` has no direction: its length is 0",
            Self::Parallel => "`up` is parallel to the camera's view axis",
            Self::FocusTooNear => "`focus_distance` is too small to compute with",
        }
    }

    /// What to do instead, where it looks like this; empty where that says itself.
    pub(super) fn help(self, axis: DVec3) -> String {
        match self {
            Self::TooNear => "any point on the view axis will do: move it away".to_owned(),
            Self::NoDirection => String::new(),
            Self::NoUp => "`up = [0.0, 1.0, 0.0]` is the default".to_owned(),
            Self::Parallel => {
                let is_level = direction(axis).is_some_and(|forward| forward.y.abs() < 0.9);
                let other = match is_level {
                    true => "[0.0, 1.0, 0.0]",
                    false => "[0.0, 0.0, 1.0]",
                };
                format!("set another upward direction: `up = {other}`")
            }
            Self::FocusTooNear => format!("the least is {SHORTEST:e}"),
        }
    }
}

/// The vector's direction; `None` if it has none. Lengths whose square is no f64 are fine.
fn direction(vector: DVec3) -> Option<DVec3> {
    (vector.abs().max_element() > 0.0).then(|| along(vector))
}

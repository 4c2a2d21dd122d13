//! The camera, moved up to what it sees.

use glam::DVec3;

use crate::scene::{Handedness, Scene};

/// The camera: rays start at `anchor + lens_share lens + approach film` in the direction
/// `forward + film - focus lens`, for a point `film` of the image plane at distance 1 and a point
/// `lens` of the lens.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedCamera {
    /// The camera's position, moved along the view axis by `approach`.
    pub anchor: DVec3,
    /// How far rays can go along the view axis before they can hit anything.
    pub approach: f64,
    /// Film position of the top left corner of pixel (0, 0).
    pub corner: DVec3,
    /// Film step from a pixel to the one right of it.
    pub across: DVec3,
    /// Film step from a pixel to the one below it.
    pub down: DVec3,
    /// Unit vector along the view axis.
    pub forward: DVec3,
    /// Semi-axis of the lens along the image's rows; zero for a pinhole.
    pub lens_across: DVec3,
    /// Semi-axis of the lens along the image's columns.
    pub lens_down: DVec3,
    /// One over the focus distance; zero for a pinhole.
    pub focus: f64,
    /// `1 - approach focus`
    pub lens_share: f64,
}

/// How far along the view axis nothing can be hit, for any ray of the camera at any time.
pub(super) fn approach(scene: &Scene, forward: DVec3) -> f64 {
    let eye = scene.camera.position;
    let nearest = scene
        .spheres
        .iter()
        .map(|s| {
            let way = 0.5 * forward.dot(s.motion).abs();
            (forward.dot(s.center - eye), s.radius + way)
        })
        // What is wholly behind the lens is out of every ray's way.
        .filter(|(depth, half)| depth + half > 0.0)
        .map(|(depth, half)| depth - half)
        .fold(f64::INFINITY, f64::min);
    if nearest.is_finite() {
        nearest.max(0.0)
    } else {
        0.0
    }
}

impl PlacedCamera {
    /// The camera of `scene` for an image of `width` x `height` pixels, `approach` (in scene units) farther
    /// along its view axis `forward`.
    pub(super) fn new(
        scene: &Scene,
        forward: DVec3,
        approach: f64,
        scale: f64,
        width: u32,
        height: u32,
    ) -> Self {
        let camera = &scene.camera;
        let right = match camera.handedness {
            Handedness::Right => forward.cross(camera.up),
            Handedness::Left => camera.up.cross(forward),
        }
        .normalize();
        // Perpendicular to the two, on the side of `up`.
        let up = (camera.up - camera.up.dot(forward) * forward).normalize();
        let pixel = 2.0 * (0.5 * camera.fov.to_radians()).tan() / f64::from(height);
        let (across, down) = (pixel * right, -pixel * up);
        let corner = -0.5 * (f64::from(width) * across + f64::from(height) * down);
        let lens = camera.aperture_radius * scale;
        let focus = if lens > 0.0 {
            1.0 / (camera.focus_distance * scale)
        } else {
            0.0
        };
        let approach = approach * scale;
        Self {
            // The origin is where the rays start.
            anchor: DVec3::ZERO,
            approach,
            corner,
            across,
            down,
            forward,
            lens_across: lens * right,
            lens_down: -lens * up,
            focus,
            lens_share: 1.0 - approach * focus,
        }
    }
}

//! Twin of `shaders/scene/camera.wesl`.

use glam::{DVec2, DVec3};

use super::priority::Media;
use super::ray::Ray;
use crate::placement::PlacedCamera;
use crate::sampling::directions::circle_point;

/// The ray through the place `u[0..2]` of a pixel and `u[2..4]` of the lens, in `media`, in the middle of the time for
/// which the shutter is open.
#[must_use]
pub fn camera_ray(camera: &PlacedCamera, pixel: [u32; 2], u: [f64; 4], media: &Media) -> Ray {
    let place = DVec2::new(f64::from(pixel[0]) + u[0], f64::from(pixel[1]) + u[1]);
    let film = camera.corner + place.x * camera.across + place.y * camera.down;
    let disc = u[2].sqrt() * circle_point(u[3]);
    let lens = disc.x * camera.lens_across + disc.y * camera.lens_down;
    Ray {
        anchor: camera.anchor,
        motion: DVec3::ZERO,
        time: 0.0,
        offset: camera.lens_share * lens + camera.approach * film,
        direction: (camera.forward + film - camera.focus * lens).normalize(),
        own: None,
        inward: false,
        media: media.clone(),
    }
}

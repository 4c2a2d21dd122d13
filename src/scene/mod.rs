//! What is to be rendered: camera, spheres, materials, environment.
//!
//! A [`Scene`] is checked before it is rendered, a file's when it is loaded, and each when a
//! [job](crate::job) is prepared: every number is finite and in its range, every material index is in
//! bounds. Lengths are in scene units, radiances in W/(sr m²) per colour channel (linear RGB), and
//! everything is f64: rounding to f32 happens in one later place only.

pub mod builtin;
mod check;
pub mod color_map;
mod describe;
pub mod direct;
pub mod environment;
mod file;
mod hash;
mod image;
pub mod load;
mod measured;
mod mix;
pub mod motion;
mod named;
mod names;
mod parsed;
pub mod particles;
mod pieces;
#[cfg(test)]
mod properties;
mod range;
mod report;
mod shape;
mod suggest;
mod texture_table;
pub mod trajectory;
mod validate;
mod vector;
mod view;

pub use describe::summary;
pub use environment::{Environment, Gradient, Sky};
pub use file::{MAX_BOUNCES, MAX_SIDE, MAX_SPP, json_schema};
pub use hash::{content_hash, file_hash};
pub use load::Loaded;

use glam::DVec3;

use crate::materials::Material;

/// A scene: read by the loader (`scene::load`), from the gallery (`scene::builtin`), or made in code;
/// [`check`](Self::check) says whether it can be one.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// The camera.
    pub camera: Camera,
    /// Width of the image, in pixels; at least 1.
    pub width: u32,
    /// Height of the image, in pixels; at least 1.
    pub height: u32,
    /// What the scene file's `[render]` table asks for; the command line wins.
    pub render: RenderDefaults,
    /// What a path sees that hits nothing; `None` is black, and costs nothing.
    pub environment: Option<Environment>,
    /// All materials, in file order.
    pub materials: Vec<Material>,
    /// All spheres, in file order.
    pub spheres: Vec<Sphere>,
}

impl Scene {
    /// Whether any sphere moves while the shutter is open.
    #[must_use]
    pub fn moves(&self) -> bool {
        self.spheres.iter().any(|s| s.motion != DVec3::ZERO)
    }
}

/// Rendering options that a scene file may set.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RenderDefaults {
    /// Samples a pixel.
    pub spp: Option<u64>,
    /// The largest number of scattering events of a path.
    pub max_bounces: Option<u32>,
}

/// A pinhole or thin-lens camera.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Centre of the lens.
    pub position: DVec3,
    /// A point on the view axis, different from `position`.
    pub look_at: DVec3,
    /// Upward direction, not parallel to the view axis; need not be normalised.
    pub up: DVec3,
    /// Full vertical angle of view, in degrees, in (0, 180).
    pub fov: f64,
    /// Which way image right is.
    pub handedness: Handedness,
    /// Radius of the thin lens; 0 is a pinhole.
    pub aperture_radius: f64,
    /// Distance of the plane in focus along the view axis; positive. Unused by a pinhole.
    pub focus_distance: f64,
}

/// Which way image right is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Handedness {
    /// Image right is forward × up.
    Right,
    /// Image right is up × forward.
    Left,
}

/// A sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Its centre in the middle of the time for which the shutter is open.
    pub center: DVec3,
    /// Its way in that time: from `center - motion/2` to `center + motion/2`.
    pub motion: DVec3,
    /// Its radius; positive.
    pub radius: f64,
    /// Index into [`Scene::materials`].
    pub material: usize,
    /// Which dielectric fills the space where several overlap: the highest wins. `None`: smaller
    /// spheres win over larger ones. Only dielectric spheres may have one.
    pub priority: Option<i32>,
}

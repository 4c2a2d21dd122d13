//! Twins of `shaders/scene/`.

pub mod absorption;
pub mod camera;
pub mod priority;
pub mod ray;
pub mod sphere;
pub mod texture;

//! Twins of `shaders/scene/`.

pub mod camera;
pub mod ray;
pub mod sphere;

//! Twins of `shaders/bsdf/`.

pub mod dielectric;
pub mod diffuse;
pub mod evaluate;
pub mod event;
pub mod mirror;
pub mod reflective;
pub mod sample;
pub mod scatter;

//! Twins of `shaders/light/`.

pub mod aim;
pub mod environment;
pub mod projected;
pub mod skylight;
pub mod sphere;

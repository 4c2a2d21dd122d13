//! Twins of `shaders/light/`.

pub mod aim;
pub mod environment;
pub mod images;
pub mod projected;
pub mod skylight;
pub mod sphere;

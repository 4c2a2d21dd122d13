//! Twins of `shaders/core/`.

pub mod random;
pub mod sampling;
pub mod sobol;
pub mod spectrum;

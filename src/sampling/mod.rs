//! Random numbers, and what is drawn by them: f64 twins of `shaders/sampler/` and of `shaders/core/`, which the twins of
//! materials and of paths share.

pub mod directions;
pub mod purpose;
pub mod random;
pub mod sobol;
pub mod spectrum;

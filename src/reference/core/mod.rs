//! Twins of `shaders/core/`.

pub mod random;

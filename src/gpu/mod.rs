//! The GPU: adapters, an engine that runs passes on them, and the renderer.

mod aov;
pub mod bsdf_probe;
mod cache;
mod data;
pub mod device;
mod engine;
mod pace;
pub mod probe;
mod region;
pub mod renderer;

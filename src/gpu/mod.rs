//! The GPU: adapters, an engine that runs passes on them, the layouts of what it uploads, and the renderer.

mod aov;
pub mod bsdf_probe;
mod cache;
mod data;
pub mod device;
mod engine;
pub mod layout;
pub mod measured;
pub mod mix;
mod pace;
pub mod probe;
mod region;
pub mod renderer;
pub mod tables;
pub mod textures;

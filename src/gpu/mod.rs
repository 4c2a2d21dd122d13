//! The GPU: adapters, buffer layouts, and the renderer.

mod aov;
pub mod bsdf_probe;
pub mod device;
pub mod layout;
pub mod probe;
pub mod renderer;
mod upload;

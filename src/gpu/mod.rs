//! The GPU: adapters, buffer layouts, and the renderer.

mod aov;
pub mod device;
pub mod layout;
pub mod probe;
pub mod renderer;
mod upload;

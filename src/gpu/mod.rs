//! The GPU: adapters, buffer layouts, and the renderer.

pub mod device;
pub mod layout;
pub mod probe;
pub mod renderer;
mod upload;

//! gpu-trace.
pub mod error;
pub mod scene;
pub mod settings;
pub mod placement;
pub mod effects;
pub mod shader;
pub mod render;
pub mod film;
pub mod estimate;
pub mod gpu;
pub mod reference;

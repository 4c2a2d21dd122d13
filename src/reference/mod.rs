//! The CPU reference: f64 twins of the kernel's functions, file by file under the names they have
//! in `shaders/`, and a renderer that traces the same paths with them.
//!
//! It is an oracle, written to be read: it takes no shortcut that the kernel takes, has no
//! geometry form and drops no effect.

pub mod core;
pub mod light;
pub mod path;
pub mod purpose;
pub mod renderer;
pub mod scene;

//! The CPU reference: f64 twins of the kernel's functions under the names they have in `shaders/`, and a
//! renderer that traces the same paths with them; those of materials are with the materials.
//!
//! It is an oracle, written to be read: it takes no shortcut that the kernel takes and has no geometry
//! form. What an effect leaves out of the kernel, it computes and finds to be nothing.

pub mod cells;
pub mod light;
pub mod path;
pub mod renderer;
pub mod scene;
pub mod survey;

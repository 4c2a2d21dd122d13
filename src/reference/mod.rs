//! The CPU reference: f64 twins of the kernel's functions under the names they have in `shaders/`, and the same
//! paths traced with them; those of materials are with the materials. What renders by it is
//! [`backend::cpu`](crate::backend::cpu).
//!
//! It is an oracle, written to be read: it takes no shortcut that the kernel takes and has no geometry
//! form. What an effect leaves out of the kernel, it computes and finds to be nothing.

pub mod cells;
mod direct;
mod images;
pub mod light;
pub mod path;
pub mod scene;
pub mod state;
pub mod survey;

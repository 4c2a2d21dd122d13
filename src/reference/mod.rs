//! The CPU reference: f64 twins of the kernel's functions, file by file under the names they have
//! in `shaders/`, and a renderer that traces the same paths with them.

pub mod core;

//! A scene as the kernel reads it: its structs, and the tables that these refer to by numbers. The linker writes some of
//! it into the kernel's text, the GPU uploads the rest.

pub mod layout;
pub mod material;
pub mod measured;
pub mod mix;
pub mod tables;
pub mod textures;

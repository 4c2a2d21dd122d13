//! A headless path tracer for scenes made of spheres, on the GPU through wgpu.
//!
//! Data flows one way. The modules stand in its order, and each uses only those that are named before it
//! (`tests/modules.rs`); none decides again what an earlier one decided:
//!
//! 1. [`error`]: what can go wrong anywhere. [`numbers`]: as people read them. [`statistics`]: tests and
//!    distributions. [`image`](mod@image): what is written and read, and in which formats. `numpy`: the header of NPY
//!    files. [`input`]: images of any origin. [`particles`]: what files of other programs hold.
//! 2. [`sampling`]: random numbers and what is drawn by them. [`sampler`]: which samples are placed together.
//!    [`materials`]: how surfaces scatter light, and what of it may be a texture.
//! 3. [`scene`]: the scene file, validated. [`settings`]: how it will be rendered.
//! 4. [`film`]: f64 sums and variances over all windows; mean and error; where further samples go. [`memory`]: what
//!    that takes, asked before it is taken.
//! 5. [`bvh`]: a tree over many spheres. [`placement`]: where everything is, in f64, relative to where the picture
//!    is; what lies in what, which of several dielectrics fills the space, what light sampling chooses from.
//! 6. [`effects`]: what the scene asks for; nothing else goes into the kernel.
//! 7. [`records`]: the scene as the kernel reads it. [`shader`]: the kernel, linked for these effects from
//!    `shaders/`.
//! 8. [`reference`](mod@reference): the same paths on the CPU, in f64.
//! 9. [`variance`]: whether samples can show their variance. [`claims`]: what an estimator claims. [`job`]: scene and
//!    settings with all of this, checked: renderers are made of jobs only.
//! 10. [`render`]: the loop that asks a renderer for windows of samples until a stop rule holds. [`gpu`]: the renderer
//!     through wgpu, in f32. [`backend`]: that one or the reference's, opened.
//! 11. [`forecast`]: what an error will cost, from a pilot. [`ledger`]: how much light inexact settings took.
//!     [`choice`]: which estimator pays on a scene.
//! 12. [`output`]: images, statistics, progress. [`film_file`]: films kept, to go on with or to join.
//!     [`compare`](mod@compare): how far images are apart.
//! 13. [`verify`]: what tests, benches and the hard cases share. [`check`]: the hard cases of all this, measured on a
//!     device. [`study`]: what accuracy costs in time. [`prices`]: what each effect costs.
//! 14. [`cli`]: what was typed.

pub mod backend;
pub mod bvh;
pub mod check;
pub mod choice;
pub mod claims;
pub mod cli;
pub mod compare;
pub mod effects;
pub mod error;
pub mod film;
pub mod film_file;
pub mod forecast;
pub mod gpu;
pub mod image;
pub mod input;
pub mod job;
pub mod ledger;
pub mod materials;
pub mod memory;
pub mod numbers;
mod numpy;
pub mod output;
pub mod particles;
pub mod placement;
pub mod prices;
pub mod records;
pub mod reference;
pub mod render;
pub mod sampler;
pub mod sampling;
pub mod scene;
pub mod settings;
pub mod shader;
pub mod statistics;
pub mod study;
pub mod variance;
pub mod verify;

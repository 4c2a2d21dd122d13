//! A headless path tracer for scenes made of spheres, on the GPU through wgpu.
//!
//! Data flows one way; the modules stand in its order, and none decides again what an earlier one
//! decided:
//!
//! 1. [`cli`]: what was typed.
//! 2. [`settings`]: how it will be rendered. [`sampler`]: which samples are placed together.
//! 3. [`scene`]: the scene file, validated. [`particles`]: what files of other programs hold, which it takes spheres
//!    from.
//! 4. [`placement`]: where everything is, in f64, relative to where the picture is; what lies in what, which of
//!    several dielectrics fills the space, what light sampling chooses from.
//!    [`bvh`]: a tree over many spheres.
//! 5. [`effects`]: what the scene asks for; nothing else goes into the kernel.
//!    [`job`]: all of these, checked: renderers are made of jobs only. [`claims`]: what its estimator claims.
//! 6. [`shader`]: the kernel, linked for these effects from `shaders/`.
//! 7. [`gpu`] and [`reference`](mod@reference): two renderers, wgpu in f32 and the CPU in f64, that
//!    trace the same paths. [`backend`]: one of them, opened.
//! 8. [`render`]: the loop that asks a renderer for windows of samples until a stop rule holds.
//! 9. [`film`]: f64 sums and variances over all windows; mean and error; where further samples go.
//!    [`film_file`]: films kept, to go on with or to join.
//!    [`variance`]: whether samples can show their variance.
//! 10. [`forecast`]: what an error will cost, from a pilot. [`ledger`]: how much light inexact settings
//!     took.
//! 11. [`image`](mod@image): what is written and read. [`output`]: images, statistics, progress.
//! 12. [`input`] and [`compare`](mod@compare): images of any origin, and how far two are apart.
//!
//! [`study`] measures what accuracy costs in time, [`prices`] what each effect does.
//! [`check`] measures the hard cases of all this on a device, with the tests of [`statistics`]; what it shares
//! with `tests/` is [`verify`].
//! [`numbers`] is how people read them. [`error`] is what can go wrong anywhere.

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

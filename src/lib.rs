//! A headless path tracer for scenes made of spheres, on the GPU through wgpu.
//!
//! Data flows one way; the modules stand in its order, and none decides again what an earlier one
//! decided:
//!
//! 1. [`cli`]: what was typed.
//! 2. [`settings`]: what will be rendered, validated. [`sampler`]: which samples are placed together.
//! 3. [`scene`]: the scene file, validated.
//! 4. [`placement`]: where everything is, in f64, relative to where the picture is.
//!    [`lights`]: what light sampling chooses from.
//!    [`media`]: which of several dielectrics fills the space. [`containment`]: what lies in what.
//! 5. [`effects`]: what the scene asks for; nothing else goes into the kernel.
//! 6. [`shader`]: the kernel, linked for these effects from `shaders/`.
//! 7. [`gpu`] and [`reference`](mod@reference): two renderers, wgpu in f32 and the CPU in f64, that
//!    trace the same paths. [`backend`]: one of them, opened.
//! 8. [`render`]: the loop that asks a renderer for windows of samples until a stop rule holds.
//! 9. [`film`]: f64 sums and variances over all windows. [`aov`]: what it can hold beside the image.
//! 10. [`estimate`], [`intervals`] and [`allocation`]: mean and error; where further samples go.
//!     [`forecast`]: what an error will cost, from a pilot. [`ledger`]: how much light inexact settings
//!     took.
//! 11. [`output`]: images, statistics, progress.
//! 12. [`input`] and [`compare`](mod@compare): images of any origin, and how far two are apart.
//!
//! [`study`] measures what accuracy costs in time.
//! [`check`] measures the hard cases of all this on a device, with the tests of [`statistics`]; what it shares
//! with `tests/` is [`verify`].
//! [`error`] is what can go wrong anywhere.

pub mod allocation;
pub mod aov;
pub mod backend;
pub mod check;
pub mod cli;
pub mod compare;
pub mod containment;
pub mod effects;
pub mod error;
pub mod estimate;
pub mod film;
pub mod forecast;
pub mod gpu;
pub mod input;
pub mod intervals;
pub mod ledger;
pub mod lights;
pub mod materials;
pub mod media;
pub mod output;
pub mod placement;
pub mod reference;
pub mod render;
pub mod sampler;
pub mod scene;
pub mod settings;
pub mod shader;
pub mod statistics;
pub mod study;
pub mod verify;

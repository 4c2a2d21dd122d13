//! What `check`, the tests and the benchmarks verify with: inputs, scenes, renders, tolerances, and one
//! harness that every material has to pass.

pub mod bsdf;
mod cells;
mod crowds;
mod images;
mod measure;
mod random;
mod renders;
mod rows;
mod scenes;

pub use cells::{Cells, Outcome};
pub use crowds::{Crowd, HitRow, RayRows, crowds};
pub use images::{image_bits, leave_images, means, picture_of, share_beyond, share_off};
pub use measure::{Agreement, Measure};
pub use random::Random;
pub use renders::{reference_renderer, render_in_f64, render_on, renderer_on, settings};
pub use rows::{Row, U, ULP, to_row, vector};
pub use scenes::{EMPTY, SceneText};

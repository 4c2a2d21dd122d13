//! The film: sums over all samples, and what they say.
//!
//! 1. [`window`]: what a renderer hands over; [`aov`]: what a pixel can hold beside its light.
//! 2. [`allocation`]: how samples are shared out over the image.
//! 3. [`sums`]: f64 sums and variances over all windows.
//!    [`record`]: these as numbers, and films joined.
//! 4. [`estimate`]: mean and error. [`trust`]: whether that can be trusted. [`intervals`]: those of single
//!    values. `adaptive`: where further samples go.

mod adaptive;
pub mod allocation;
pub mod aov;
pub mod estimate;
pub mod intervals;
pub mod record;
pub mod sums;
pub mod trust;
pub mod window;

pub use adaptive::PILOT_SAMPLES;
pub use allocation::{Allocation, TILE, Tiles};
pub use aov::{AovSums, LightClass};
pub use estimate::Estimate;
pub(crate) use estimate::UPPER;
pub use intervals::half_widths;
pub use record::{Counts, Record};
pub use sums::Film;
pub(crate) use sums::PIXEL_BYTES;
pub use trust::{Trust, Verdict};
pub use window::{
    BLOCK, LEAST_SAMPLES, NonFinite, PixelSums, Tally, WINDOW, Window, cut, full_batches, half_of,
    next_look, window_end,
};

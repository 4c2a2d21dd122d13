//! What an estimator claims of the numbers that it makes. The error bars that are given follow from it,
//! and so do the tests: `tests/claims.rs` holds every estimator to all that it claims.

use crate::settings::{Offset, Settings};
use crate::variance::VarianceClass;

/// What holds of a render with some settings; `false` promises nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Claims {
    /// The expectation of every pixel is the light of the scene's paths of at most `max_bounces` scattering
    /// events, up to rounding; with the radiance cache also of such as have as many from a cell on. What a nudge
    /// of `offset` renders is another scene; and a render that stops by its error or its time has a number of samples that depends on these.
    pub unbiased: bool,
    /// Batches of samples ([`Sampler::batch`](crate::sampler::Sampler::batch)) are independent of each
    /// other and, in a window, alike: their spread estimates the variance of the mean without bias. So it
    /// is with every estimator of today; one that learns from its samples has no such batches.
    pub independent_batches: bool,
    /// Pixels are independent of each other, so that what is known of each one's error tells that of their mean. Those
    /// of the radiance cache have the noise of the same values in them, batch by batch.
    pub independent_pixels: bool,
    /// A sample's variance is finite, as far as is known before anything is rendered.
    pub finite_variance: bool,
    /// The samples of a pixel have the same bits whatever else is rendered with them: crops and dispatches
    /// change nothing, and ranges of samples add up to the whole. Not so if the image decides which samples
    /// are taken (`adaptive`) or how many (`error`), or the clock does (`time`).
    pub any_split_same_bits: bool,
}

impl Claims {
    /// What is claimed with `settings` where samples have a variance of this class; `cache`: by the radiance cache.
    #[must_use]
    pub fn of(settings: &Settings, variance: VarianceClass, cache: bool) -> Self {
        let fixed = settings.error.is_none() && settings.time.is_none();
        Self {
            unbiased: fixed && settings.offset == Offset::Exact,
            independent_batches: true,
            independent_pixels: !cache,
            finite_variance: variance != VarianceClass::Infinite,
            any_split_same_bits: fixed && !settings.adaptive,
        }
    }

    /// Whether the spread of a render's samples tells its error.
    #[must_use]
    pub fn has_error_bars(self) -> bool {
        self.independent_batches && self.finite_variance
    }
}

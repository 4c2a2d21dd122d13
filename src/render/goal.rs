//! How far a film is, and how far the settings want it to be.

use crate::film::{BLOCK, Estimate, Film, PILOT_SAMPLES};
use crate::settings::Settings;

/// What a film says; of the error only if the estimator has error bars.
pub(crate) fn estimate(film: &Film, error_bars: bool) -> Estimate {
    let estimate = Estimate::of(film);
    match error_bars {
        true => estimate,
        false => Estimate {
            error: None,
            error_at_most: None,
            trust: None,
            ..estimate
        },
    }
}

/// Whether a film has all samples that the settings ask for.
pub(crate) fn has_all(film: &Film, settings: &Settings) -> bool {
    let spp = settings.samples.end - settings.samples.start;
    let all = if settings.adaptive {
        end_of(film, spp)
    } else {
        spp
    };
    film.samples() >= all
}

/// The samples of step 0 of an adaptive render with `spp` samples a pixel on average, its pilot's among them.
pub(super) fn end_of(film: &Film, spp: u64) -> u64 {
    let left = spp.saturating_sub(PILOT_SAMPLES);
    (left as f64 / film.allocation().mean_weight()) as u64 / BLOCK * BLOCK
}

//! Errors after the same time, and times to the same error.

use serde::Serialize;

use super::fit::{Crossing, crossing, value_at};
use super::summary::Summary;

/// Times to one error, by series.
#[derive(Clone, Debug, Serialize)]
pub struct EqualError {
    /// relRMSE.
    pub error: f64,
    /// Seconds; `null` where it was not reached, and where that is unknown.
    pub seconds: Vec<Option<f64>>,
    /// Whether the first point was below it already, so that the time is an upper bound.
    pub at_once: Vec<bool>,
    /// Whether the reference's noise hides when it was reached, or if.
    pub unknown: Vec<bool>,
}

/// Errors after one time, by series.
#[derive(Clone, Debug, Serialize)]
pub struct EqualTime {
    /// Seconds, setup and compilation included.
    pub seconds: f64,
    /// relRMSE.
    pub errors: Vec<Option<f64>>,
    /// Samples a pixel.
    pub spp: Vec<Option<f64>>,
}

/// Times to round errors between the worst and the best that were reached.
pub(super) fn equal_error(series: &[Summary]) -> Vec<EqualError> {
    let curves: Vec<_> = series.iter().map(Summary::over_time).collect();
    let errors = || curves.iter().flatten().filter_map(|p| p.1);
    let (best, worst) = (
        errors().fold(f64::MAX, f64::min),
        errors().fold(0.0, f64::max),
    );
    let decades = (-8..6).rev().map(|power| 10f64.powi(power));
    let round = decades.flat_map(|power| [5.0, 2.0, 1.0].map(|digit| digit * power));
    let mut targets: Vec<f64> = round.filter(|e| (best..worst).contains(e)).collect();
    // The small ones are what renders are for.
    targets.drain(..targets.len().saturating_sub(5));
    let times = |error: f64| {
        let reached: Vec<Crossing> = curves.iter().map(|c| crossing(c, error)).collect();
        EqualError {
            error,
            at_once: reached
                .iter()
                .map(|r| matches!(r, Crossing::Before(_)))
                .collect(),
            unknown: reached.iter().map(|r| *r == Crossing::Unknown).collect(),
            seconds: reached
                .into_iter()
                .map(|r| match r {
                    Crossing::Before(t) | Crossing::At(t) => Some(t),
                    Crossing::Unknown | Crossing::Never => None,
                })
                .collect(),
        }
    };
    targets.into_iter().map(times).collect()
}

/// Errors at the last time that all series have, and at fractions of it.
pub(super) fn equal_time(series: &[Summary]) -> Vec<EqualTime> {
    let ends = series
        .iter()
        .filter_map(|s| s.levels.last())
        .map(|l| l.seconds);
    let begins = series
        .iter()
        .filter_map(|s| s.levels.first())
        .map(|l| l.seconds);
    let (end, begin) = (
        ends.fold(f64::MAX, f64::min),
        begins.fold(f64::MAX, f64::min),
    );
    if series.is_empty() {
        return Vec::new();
    }
    let times = [1.0 / 64.0, 1.0 / 16.0, 0.25, 1.0].map(|share| share * end);
    let row = |seconds: f64| EqualTime {
        seconds,
        errors: series
            .iter()
            .map(|s| value_at(&s.over_time(), seconds))
            .collect(),
        spp: series.iter().map(|s| s.spp_at(seconds)).collect(),
    };
    times.into_iter().filter(|t| *t >= begin).map(row).collect()
}

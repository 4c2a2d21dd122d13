//! What accuracy costs, before it is paid: samples and seconds to an error, from a short pilot.

mod pilot;
mod squares;
mod survey;

use crate::error::{Error, Result};
use crate::film::{LEAST_SAMPLES, WINDOW, next_look, window_end};
use crate::job::Job;
use crate::sampler::Sampler;

pub use pilot::run;
pub(crate) use squares::{spread, squares};

/// Two-sided quantile of the normal distribution for intervals of 95 %.
const Z: f64 = 1.96;

/// Refuses what a pilot says nothing about.
///
/// # Errors
/// [`Error::Usage`] for a job whose samples do not go everywhere alike, or whose error is unknown.
pub fn check(job: &Job) -> Result<()> {
    if job.settings().adaptive {
        return Err(Error::Usage(
            "price knows what samples cost that go everywhere alike: leave --adaptive out".into(),
        ));
    }
    if !job.claims().has_error_bars() {
        let why = job.variance().warning.clone();
        return Err(Error::Usage(format!(
            "no error can be forecast: {}",
            why.unwrap_or_default()
        )));
    }
    Ok(())
}

/// A measured figure and its relative standard error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measured {
    /// The figure.
    pub value: f64,
    /// Its standard error, as a share of it.
    pub spread: f64,
}

/// What a pilot has measured of a render on one device.
#[derive(Clone, Debug, PartialEq)]
pub struct Pilot {
    /// Pixels of the render.
    pub pixels: u64,
    /// Index of the first sample.
    pub start: u64,
    /// How samples are placed: the variance of one depends on its batch.
    pub sampler: Sampler,
    /// Relative variance of a sample, for each of [`Sampler::levels`]: the mean over pixels and channels
    /// of v/(m² + (0.1 M)²), v being the variance of a batch's sum over the batch's length.
    pub variance: Vec<Measured>,
    /// By how much the bound on the error's square, which decides when a render stops, is above it, as a
    /// share: small, but in small images.
    pub margin: f64,
    /// Seconds to trace a path.
    pub path_seconds: Measured,
    /// Seconds that a window takes besides: reading back, summing up, judging the error.
    pub window_seconds: f64,
    /// Seconds that the pilot took.
    pub seconds: f64,
}

/// What a render to some error, or of some length, will be like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forecast {
    /// The relative error at the end.
    pub error: f64,
    /// Samples a pixel.
    pub spp: u64,
    /// Seconds of rendering, without setup and compilation.
    pub seconds: f64,
    /// The ends of a 95 % interval for these.
    pub interval: [f64; 2],
}

impl Pilot {
    /// The render that stops at the estimated error `limit`; `None` if `most` samples do not reach it, or
    /// if nothing is known of the variance.
    #[must_use]
    pub fn to_error(&self, limit: f64, most: u64) -> Option<Forecast> {
        let spp = self.stop(limit, 0.0, most)?;
        let low = self.stop(limit, -Z, most).unwrap_or(spp);
        // Beyond the cap the upper end is the cap's.
        let high = self.sure_samples(limit, most);
        let high = high.unwrap_or_else(|| self.look(most));
        Some(Forecast {
            error: self.error(spp),
            spp,
            seconds: self.seconds(spp),
            interval: [
                self.seconds(low) * (-Z * self.path_seconds.spread).exp(),
                self.seconds(high) * (Z * self.path_seconds.spread).exp(),
            ],
        })
    }

    /// The samples a pixel that reach the error `limit` in 97.5 % of all renders, as far as the pilot can tell;
    /// `None` as in [`to_error`](Self::to_error).
    #[must_use]
    pub fn sure_samples(&self, limit: f64, most: u64) -> Option<u64> {
        self.stop(limit, Z, most)
    }

    /// The render of so many samples a pixel.
    #[must_use]
    pub fn to_samples(&self, spp: u64) -> Forecast {
        let seconds = self.seconds(spp);
        let factor = (Z * self.path_seconds.spread).exp();
        Forecast {
            error: self.error(spp),
            spp,
            seconds,
            interval: [seconds / factor, seconds * factor],
        }
    }

    /// The render that stops after so many seconds, or `most` samples.
    #[must_use]
    pub fn to_time(&self, seconds: f64, most: u64) -> Forecast {
        // Seconds grow with samples: bisection.
        let (mut low, mut high) = (0, most);
        while low < high {
            let middle = low + (high - low).div_ceil(2);
            if self.seconds(middle) <= seconds {
                low = middle;
            } else {
                high = middle - 1;
            }
        }
        self.to_samples(low.max(1))
    }

    /// Whether the pilot saw any variance: without, it saw no light, or too little.
    #[must_use]
    pub fn is_blind(&self) -> bool {
        !self.variance.iter().all(|v| v.value > 0.0)
    }

    /// The relative error after `spp` samples a pixel.
    fn error(&self, spp: u64) -> f64 {
        self.variance_of_sum(spp).sqrt() / spp as f64
    }

    /// Relative variance of the sum of the first `spp` samples of a pixel.
    fn variance_of_sum(&self, spp: u64) -> f64 {
        let end = self.start + spp;
        let levels = self.sampler.levels();
        let ends = levels.iter().skip(1).copied().chain([u64::MAX]);
        levels
            .iter()
            .zip(ends)
            .zip(&self.variance)
            .map(|((from, to), variance)| {
                let (from, to) = ((*from).max(self.start), to.min(end));
                to.saturating_sub(from) as f64 * variance.value
            })
            .sum()
    }

    /// The fewest samples whose variance, times `factor`, gives the error `limit`; none beyond `most`.
    fn least_samples(&self, limit: f64, factor: f64, most: u64) -> Option<u64> {
        let reached = |spp: u64| (factor * self.variance_of_sum(spp)).sqrt() <= limit * spp as f64;
        if self.is_blind() || !reached(most) {
            return None;
        }
        // The relative error falls with every sample: bisection.
        let (mut low, mut high) = (LEAST_SAMPLES.min(most), most);
        while low < high {
            let middle = low + (high - low) / 2;
            if reached(middle) {
                high = middle;
            } else {
                low = middle + 1;
            }
        }
        Some(low)
    }

    /// The samples at which a render stops if the variance is so many standard errors above what was measured.
    fn stop(&self, limit: f64, deviations: f64, most: u64) -> Option<u64> {
        let factor = (deviations * self.variance_spread()).exp();
        let least = self.least_samples(limit, (1.0 + self.margin) * factor, most)?;
        Some(self.look(least))
    }

    /// The first look at the error at or after `spp` samples.
    fn look(&self, spp: u64) -> u64 {
        let mut at = 0;
        while at < spp {
            let due = self.start.saturating_add(next_look(at));
            at = window_end(due - 1, u64::MAX) - self.start;
        }
        at
    }

    /// Seconds that `spp` samples take.
    fn seconds(&self, spp: u64) -> f64 {
        let end = self.start + spp;
        // Ends of windows (`film::window_end`) below x.
        let small = |x: u64| [16, 64, 128].iter().filter(|end| **end < x).count() as u64;
        let before = |x: u64| small(x) + x.saturating_sub(1) / WINDOW;
        let windows = 1 + before(end) - before(self.start + 1);
        let paths = spp as f64 * self.pixels as f64;
        paths * self.path_seconds.value + windows as f64 * self.window_seconds
    }

    /// Relative standard error of the last level's variance, which decides for long renders.
    fn variance_spread(&self) -> f64 {
        self.variance.last().map_or(0.0, |v| v.spread)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sampler with levels, seconds a path and a window as simple as can be.
    fn pilot() -> Pilot {
        let measured = |value, spread| Measured { value, spread };
        Pilot {
            pixels: 1000,
            start: 0,
            sampler: Sampler::Sobol,
            variance: vec![measured(9.0, 0.0), measured(4.0, 0.0), measured(1.0, 0.1)],
            margin: 0.0,
            path_seconds: measured(1.0e-6, 0.05),
            window_seconds: 0.25,
            seconds: 1.0,
        }
    }

    #[test]
    fn the_variance_of_all_levels_adds_up() {
        let pilot = pilot();
        for (spp, variance) in [
            (16, 144.0),
            (64, 576.0),
            (100, 576.0 + 144.0),
            (256, 576.0 + 768.0),
            (1256, 576.0 + 768.0 + 1000.0),
        ] {
            let error = f64::sqrt(variance) / spp as f64;
            assert!(
                (pilot.to_samples(spp).error / error - 1.0).abs() < 1.0e-12,
                "{spp}"
            );
        }
        let late = Pilot {
            start: 250,
            ..pilot
        };
        let error = f64::sqrt(6.0 * 4.0 + 94.0) / 100.0;
        assert!((late.to_samples(100).error / error - 1.0).abs() < 1.0e-12);
    }

    #[test]
    fn a_render_stops_at_the_first_look_that_suffices() {
        let pilot = pilot();
        let looks: Vec<u64> = std::iter::successors(Some(64), |look| Some(pilot.look(look + 1)))
            .take(40)
            .collect();
        assert_eq!(looks[..5], [64, 128, 256, 512, 768]);
        for limit in [0.3, 0.1, 0.05, 0.02, 0.01] {
            let forecast = pilot.to_error(limit, u64::MAX >> 1).expect("it is reached");
            assert!(forecast.error <= limit);
            assert_eq!(pilot.look(forecast.spp), forecast.spp, "{limit}");
            let before = looks
                .iter()
                .copied()
                .filter(|look| *look < forecast.spp)
                .max();
            let earlier = before.map(|spp| (spp, pilot.error(spp)));
            assert!(
                earlier.is_none_or(|(spp, e)| spp < LEAST_SAMPLES || e > limit),
                "{earlier:?}"
            );
            let [low, high] = forecast.interval;
            assert!(low < forecast.seconds && forecast.seconds < high);
        }
        assert_eq!(pilot.to_error(0.01, 1000), None);
        // With a variance that is known, one is as sure as the other.
        let mut known = pilot.clone();
        let of = |pilot: &Pilot| pilot.to_error(0.02, 1 << 20).map(|f| f.spp);
        assert!(pilot.sure_samples(0.02, 1 << 20) > of(&pilot));
        known.variance[2].spread = 0.0;
        assert_eq!(known.sure_samples(0.02, 1 << 20), of(&known));
        assert_eq!(pilot.sure_samples(0.01, 1000), None);
    }

    #[test]
    fn seconds_count_paths_and_windows() {
        let pilot = pilot();
        // Windows end at 16, 64, 128, 256, 512, 768.
        for (spp, windows) in [
            (1, 1),
            (16, 1),
            (17, 2),
            (64, 2),
            (128, 3),
            (256, 4),
            (257, 5),
            (769, 7),
        ] {
            let seconds = spp as f64 * 1.0e-3 + f64::from(windows) * 0.25;
            assert!((pilot.seconds(spp) - seconds).abs() < 1.0e-9, "{spp}");
        }
        let late = Pilot {
            start: 256,
            ..pilot
        };
        assert!((late.seconds(256) - 0.256 - 0.25).abs() < 1.0e-9);
        assert!((late.seconds(257) - 0.257 - 0.5).abs() < 1.0e-9);
        let forecast = late.to_time(late.seconds(1000) + 1.0e-4, 1 << 20);
        assert_eq!(forecast.spp, 1000);
    }

    #[test]
    fn without_variance_nothing_is_promised() {
        let mut pilot = pilot();
        pilot.variance[2].value = 0.0;
        assert!(pilot.is_blind());
        assert_eq!(pilot.to_error(0.5, 1 << 20), None);
    }
}

//! What the runs of one series say: errors at equal samples, slopes, bias, efficiency.

use serde::Serialize;

use super::bootstrap::{Interval, quantile};
use super::fit::{bias_fit, slope, value_at};
use super::measure::Noise;
use super::run::{Point, Run};
use super::series::{Key, Subject};
use crate::variance::VarianceClass;

/// Samples a pixel from which slopes are fitted, where there are enough points: before that, pixels
/// are black or bright by chance.
const SETTLED: u64 = 16;

/// What the runs of a series say.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// What tells it from the others.
    pub label: String,
    /// The series.
    pub series: Key,
    /// Where it is `infinite`, errors are medians over the runs, and there are no means.
    pub variance: VarianceClass,
    /// Runs, those cut short included.
    pub runs: usize,
    /// Median seconds of opening the device and placing the scene.
    pub setup: f64,
    /// Median seconds of linking and compiling.
    pub compile: f64,
    /// Median seconds of rendering one sample a pixel, at the last level.
    pub seconds_per_sample: f64,
    /// Samples that were no finite number, over all runs.
    pub non_finite: u64,
    /// At 1, 2, 4, ... samples a pixel.
    pub levels: Vec<Level>,
    /// Of ln error over ln samples.
    pub slope_spp: Option<Interval>,
    /// Of ln error over ln seconds of rendering.
    pub slope_time: Option<Interval>,
    /// The fit of MSE = b² + v/N; `null` where the variance is infinite, or there are too few levels.
    pub bias: Option<Bias>,
    /// 1/(MSE t) at the last level, t with setup and compilation; `null` where the variance is infinite.
    pub efficiency: Option<Interval>,
}

/// A series after some number of samples.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Level {
    /// Samples a pixel.
    pub spp: u64,
    /// Runs that came so far.
    pub runs: usize,
    /// Median seconds, setup and compilation included.
    pub seconds: f64,
    /// Median seconds of rendering alone.
    pub render: f64,
    /// relRMSE: the root of the mean square over the runs, or the median where the variance is infinite;
    /// `null` where the reference's own noise hides it.
    pub error: Option<f64>,
    /// The 5 % quantile of the runs' errors.
    pub low: Option<f64>,
    /// The 95 % quantile.
    pub high: Option<f64>,
    /// Mean square error; `null` where the variance is infinite.
    pub mse: Option<f64>,
    /// Mean relative error of the image's mean.
    pub mean_error: f64,
    /// Median of the errors that the renders estimate themselves.
    pub estimated: Option<f64>,
}

/// MSE = b² + v/N.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Bias {
    /// b², which may be negative: then it is 0 within its error.
    pub b_squared: Interval,
    /// b over the reference's mean; 0 where b² is negative.
    pub b: f64,
    /// The ends of b's interval over the reference's mean.
    pub range: Option<[f64; 2]>,
    /// v, the variance of a sample.
    pub variance: f64,
    /// Whether the interval excludes 0: the series is biased.
    pub biased: Option<bool>,
}

/// The runs of one series.
pub(super) struct Group<'a> {
    pub(super) subject: Subject,
    pub(super) runs: Vec<&'a Run>,
    /// What the reference adds to all errors.
    pub(super) noise: Noise,
}

impl Group<'_> {
    fn infinite(&self) -> bool {
        self.subject.variance == VarianceClass::Infinite
    }

    fn at(&self, run: usize, spp: u64) -> Option<&Point> {
        self.runs[run].points.iter().find(|p| p.spp == spp)
    }

    fn start(&self, run: usize) -> f64 {
        self.runs[run].setup + self.runs[run].compile
    }

    /// The values of a member of the chosen runs' points.
    fn values(&self, chosen: &[usize], spp: u64, of: impl Fn(&Point) -> f64) -> Vec<f64> {
        let found = chosen.iter().filter_map(|run| self.at(*run, spp));
        found.map(of).collect()
    }

    fn mse(&self, chosen: &[usize], spp: u64) -> Option<f64> {
        Some(mean(&self.values(chosen, spp, |p| p.mse))? - self.noise.mse)
    }

    fn error(&self, chosen: &[usize], spp: u64) -> Option<f64> {
        let mut squares = self.values(chosen, spp, |p| p.relmse - self.noise.relmse);
        let square = match self.infinite() {
            true => median(&mut squares),
            false => mean(&squares),
        };
        // What is within two standard errors of the reference's own noise is not known.
        square
            .filter(|s| *s > 2.0 * self.noise.relmse_error)
            .map(f64::sqrt)
    }

    /// `reference` is the mean of the reference.
    pub(super) fn summary(&self, label: String, reference: f64) -> Summary {
        let all: Vec<usize> = (0..self.runs.len()).collect();
        let levels = self.levels(&all);
        // Where half of the runs came: what is beyond rests on those that were fast.
        let shared: Vec<u64> = levels
            .iter()
            .filter(|l| 2 * l.runs >= all.len())
            .map(|l| l.spp)
            .collect();
        let last = shared.last().copied().unwrap_or_default();
        let settled: Vec<u64> = shared.iter().copied().filter(|n| *n >= SETTLED).collect();
        let fitted = if settled.len() >= 3 {
            &settled
        } else {
            &shared
        };
        let slope_over = |chosen: &[usize], x: &dyn Fn(u64) -> Option<f64>| {
            let point = |spp: &u64| Some((x(*spp)?, self.error(chosen, *spp)?));
            let points: Vec<(f64, f64)> = fitted.iter().filter_map(point).collect();
            slope(&points)
        };
        let render = |chosen: &[usize], spp| mean(&self.values(chosen, spp, |p| p.seconds));
        let medians = |of: &dyn Fn(usize) -> f64| {
            median(&mut all.iter().map(|r| of(*r)).collect::<Vec<f64>>()).unwrap_or_default()
        };
        Summary {
            label,
            series: self.subject.series.key(),
            variance: self.subject.variance,
            runs: self.runs.len(),
            setup: medians(&|r| self.runs[r].setup),
            compile: medians(&|r| self.runs[r].compile),
            seconds_per_sample: median(&mut self.values(&all, last, |p| p.seconds))
                .map_or(0.0, |s| s / last.max(1) as f64),
            non_finite: self.runs.iter().map(|r| r.non_finite).sum(),
            slope_spp: Interval::of(all.len(), |chosen| {
                slope_over(chosen, &|spp| Some(spp as f64))
            }),
            slope_time: Interval::of(all.len(), |chosen| {
                slope_over(chosen, &|spp| render(chosen, spp))
            }),
            bias: self.bias(&shared, reference),
            efficiency: self.efficiency(last),
            levels,
        }
    }

    fn levels(&self, all: &[usize]) -> Vec<Level> {
        let mut marks: Vec<u64> = self
            .runs
            .iter()
            .flat_map(|r| &r.points)
            .map(|p| p.spp)
            .collect();
        marks.sort_unstable();
        marks.dedup();
        let level = |spp: u64| {
            let there: Vec<usize> = all
                .iter()
                .copied()
                .filter(|r| self.at(*r, spp).is_some())
                .collect();
            let mut errors: Vec<f64> = there
                .iter()
                .filter_map(|r| self.error(&[*r], spp))
                .collect();
            errors.sort_by(f64::total_cmp);
            let whole = |run: &usize| Some(self.start(*run) + self.at(*run, spp)?.seconds);
            let mut wholes: Vec<f64> = there.iter().filter_map(whole).collect();
            let mut estimates: Vec<f64> = there
                .iter()
                .filter_map(|r| self.at(*r, spp)?.estimated)
                .collect();
            Level {
                spp,
                runs: there.len(),
                seconds: median(&mut wholes).unwrap_or_default(),
                render: median(&mut self.values(&there, spp, |p| p.seconds)).unwrap_or_default(),
                error: self.error(&there, spp),
                low: quantile(&errors, 0.05),
                high: quantile(&errors, 0.95),
                mse: self.mse(&there, spp).filter(|_| !self.infinite()),
                mean_error: mean(&self.values(&there, spp, |p| p.bias)).unwrap_or_default(),
                estimated: median(&mut estimates).filter(|_| !self.infinite()),
            }
        };
        marks.into_iter().map(level).collect()
    }

    fn bias(&self, levels: &[u64], reference: f64) -> Option<Bias> {
        if self.infinite() {
            return None;
        }
        let fit = |chosen: &[usize]| {
            let mse = |n: &u64| Some((*n, self.mse(chosen, *n)?));
            let points: Vec<(u64, f64)> = levels.iter().filter_map(mse).collect();
            let scale: Vec<f64> = points.iter().map(|p| p.1 + self.noise.mse).collect();
            bias_fit(self.subject.series.sampler, &points, &scale)
        };
        let all: Vec<usize> = (0..self.runs.len()).collect();
        let variance = fit(&all)?.variance;
        let b_squared = Interval::of(self.runs.len(), |chosen| {
            fit(chosen).map(|f| f.bias_squared)
        })?
        .widened(self.noise.mse_error);
        let root = |square: f64| square.max(0.0).sqrt() / reference;
        Some(Bias {
            b_squared,
            b: root(b_squared.value),
            range: b_squared.range.map(|r| r.map(root)),
            variance,
            biased: b_squared.range.map(|[low, _]| low > 0.0),
        })
    }

    fn efficiency(&self, last: u64) -> Option<Interval> {
        if self.infinite() {
            return None;
        }
        Interval::of(self.runs.len(), |chosen| {
            let there: Vec<usize> = chosen
                .iter()
                .copied()
                .filter(|r| self.at(*r, last).is_some())
                .collect();
            let whole = |run: &usize| Some(self.start(*run) + self.at(*run, last)?.seconds);
            let seconds = mean(&there.iter().filter_map(whole).collect::<Vec<f64>>())?;
            let mse = self
                .mse(&there, last)
                .filter(|m| *m > 2.0 * self.noise.mse_error)?;
            Some(1.0 / (mse * seconds))
        })
    }
}

impl Summary {
    /// (seconds, relRMSE) of all levels; the error is unknown where the reference's noise hides it.
    #[must_use]
    pub fn over_time(&self) -> Vec<(f64, Option<f64>)> {
        self.levels.iter().map(|l| (l.seconds, l.error)).collect()
    }

    /// The samples a pixel that are done after `seconds`, setup and compilation included.
    #[must_use]
    pub fn spp_at(&self, seconds: f64) -> Option<f64> {
        let curve: Vec<(f64, Option<f64>)> = self
            .levels
            .iter()
            .map(|l| (l.seconds, Some(l.spp as f64)))
            .collect();
        value_at(&curve, seconds)
    }
}

fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

fn median(values: &mut [f64]) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    quantile(values, 0.5)
}

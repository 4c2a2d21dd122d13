//! Variances of the whole image from those of its parts.

use super::Measured;
use crate::estimate::UPPER;
use crate::film::Window;
use crate::settings::Rect;

/// What few samples of the whole image show: coarse, but everywhere.
pub(super) struct Survey {
    crop: Rect,
    samples: f64,
    /// Sum of each value, by pixel and channel.
    sums: Vec<f64>,
    /// Variance of a sample of each value.
    variance: Vec<f64>,
    /// Square of a tenth of the image's mean.
    floor: f64,
    /// Relative variance, summed over the channels of each pixel.
    relative: Vec<f64>,
}

/// What a part of the image shows: sums over its values of the relative variance.
pub(super) struct Part {
    pixels: f64,
    /// As the survey has it, to compare with.
    survey: f64,
    /// At each level, the first from the survey, with the better means of all samples.
    levels: Vec<f64>,
    /// Sums of the squares of each pixel's share in `levels`.
    squares: Vec<f64>,
}

/// Variance of a sample of each value, without bias over the window's batches.
fn variances(window: &Window) -> impl Iterator<Item = f64> {
    let batches = window.full_batches() as f64;
    let scale = 1.0 / ((batches - 1.0) * window.batch as f64);
    window
        .pixels
        .iter()
        .flat_map(|pixel| pixel.m2)
        .map(move |m2| m2 * scale)
}

impl Survey {
    /// Joins windows of the whole image.
    pub(super) fn new(crop: Rect, windows: &[Window]) -> Self {
        let values = 3 * crop.pixels();
        let (mut sums, mut variance) = (vec![0.0; values], vec![0.0; values]);
        let mut samples = 0.0;
        for window in windows {
            samples += (window.samples.end - window.samples.start) as f64;
            let new = window
                .pixels
                .iter()
                .flat_map(|p| p.sum)
                .zip(variances(window));
            for ((sum, variance), (s, v)) in sums.iter_mut().zip(&mut variance).zip(new) {
                *sum += s;
                *variance += v / windows.len() as f64;
            }
        }
        let mean = sums.iter().sum::<f64>() / (samples * values as f64);
        let floor = (0.1 * mean).powi(2);
        let mut survey = Self {
            crop,
            samples,
            sums,
            variance,
            floor,
            relative: Vec::new(),
        };
        survey.relative = (0..crop.pixels())
            .map(|i| survey.relative(i, &survey.variance[3 * i..], 1.0, |_| 0.0))
            .collect();
        survey
    }

    /// Relative variance of pixel `i`, summed over its channels, of which `variance` are the variances;
    /// with the means of the survey and of `more` times its samples, of the sums `sum`.
    fn relative(&self, i: usize, variance: &[f64], more: f64, sum: impl Fn(usize) -> f64) -> f64 {
        (0..3)
            .map(|c| {
                let mean = (self.sums[3 * i + c] + sum(c)) / (self.samples * more);
                variance[c] / (mean * mean + self.floor)
            })
            .sum()
    }

    /// What the windows of a part of the image show, one window a level.
    pub(super) fn part(&self, windows: &[Window]) -> Part {
        let rect = windows[0].rect;
        let samples = windows.iter().map(|w| w.samples.end - w.samples.start);
        let more = 1.0 + samples.sum::<u64>() as f64 / self.samples;
        let own: Vec<Vec<f64>> = windows.iter().map(|w| variances(w).collect()).collect();
        let mut part = Part {
            pixels: rect.pixels() as f64,
            survey: 0.0,
            levels: vec![0.0; windows.len() + 1],
            squares: vec![0.0; windows.len() + 1],
        };
        for j in 0..rect.pixels() {
            let (x, y) = (j % rect.width as usize, j / rect.width as usize);
            let (x, y) = (
                x + (rect.x - self.crop.x) as usize,
                y + (rect.y - self.crop.y) as usize,
            );
            let i = y * self.crop.width as usize + x;
            part.survey += self.relative[i];
            let sum = |c: usize| windows.iter().map(|w| w.pixels[j].sum[c]).sum::<f64>();
            let levels = std::iter::once(&self.variance[3 * i..])
                .chain(own.iter().map(|variance| &variance[3 * j..]));
            for (level, variance) in levels.enumerate() {
                let relative = self.relative(i, variance, more, sum);
                part.levels[level] += relative;
                part.squares[level] += relative * relative;
            }
        }
        part
    }

    /// The relative variance of a sample at each of `count` levels, of the whole image: the parts' own,
    /// in proportion to what the survey has of them and of all (a ratio estimate: Cochran, "Sampling
    /// Techniques", 1977, chapter 6). A sampler with one level shows it in its last window.
    pub(super) fn pool(&self, parts: &[Part], count: usize) -> Vec<Measured> {
        let shown = parts.first().map_or(0, |part| part.levels.len());
        (shown - count..shown)
            .map(|level| self.pool_level(parts, level))
            .collect()
    }

    /// By how much the bound on the error's square, by which a render stops, is above it: see
    /// `Estimate::error_at_most`. A share of it.
    pub(super) fn margin(&self) -> f64 {
        let pixels = self.relative.len() as f64;
        let sum: f64 = self.relative.iter().sum();
        let squares: f64 = self.relative.iter().map(|x| x * x).sum();
        let variance = (pixels * squares / (sum * sum) - 1.0).max(0.0) / pixels;
        if sum > 0.0 {
            UPPER * variance.sqrt()
        } else {
            0.0
        }
    }

    fn pool_level(&self, parts: &[Part], level: usize) -> Measured {
        let sum = |of: &dyn Fn(&Part) -> f64| parts.iter().map(of).sum::<f64>();
        let (all, seen) = (sum(&|p| p.levels[level]), sum(&|p| p.survey));
        let values = self.relative.len() as f64;
        let surveyed = self.relative.iter().sum::<f64>();
        let ratio = all / seen;
        let value = ratio * surveyed / (3.0 * values);
        if !(value > 0.0 && value.is_finite()) {
            return Measured::default();
        }
        // Of the batches: pixels are independent.
        let noise = sum(&|p| p.squares[level]) / (all * all);
        // Of the choice of parts.
        let residual = sum(&|p| (p.levels[level] - ratio * p.survey).powi(2));
        let unseen = (1.0 - sum(&|p| p.pixels) / values).max(0.0);
        let n = parts.len() as f64;
        let choice = if n > 1.0 {
            unseen * residual * n / ((n - 1.0) * all * all)
        } else {
            0.0
        };
        Measured {
            value,
            spread: (noise + choice).sqrt(),
        }
    }
}

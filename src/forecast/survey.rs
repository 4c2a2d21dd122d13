//! Variances of the whole image from those of its parts.

use super::Measured;
use crate::film::{UPPER, Window};
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
    /// Joins windows of the same pixels. `floor`: see [`floor`].
    pub(super) fn new(windows: &[Window], floor: f64) -> Self {
        let crop = windows[0].rect;
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
}

/// Square of a tenth of the mean of the image, of which `window` has a few samples.
pub(super) fn floor(window: &Window) -> f64 {
    let samples = (window.samples.end - window.samples.start) as f64;
    let sum: f64 = window.pixels.iter().flat_map(|p| p.sum).sum();
    (0.1 * sum / (samples * 3.0 * window.pixels.len() as f64)).powi(2)
}

/// The relative variance of a sample at each of `count` levels, of an image of so many pixels: the parts'
/// own, in proportion to what a survey has of them and of all (a ratio estimate: Cochran, "Sampling
/// Techniques", 1977, chapter 6); without a survey, in proportion to their pixels. A sampler with one
/// level shows it in its last window.
pub(super) fn pool(
    parts: &[Part],
    survey: Option<&Survey>,
    pixels: usize,
    count: usize,
) -> Vec<Measured> {
    let shown = parts.first().map_or(0, |part| part.levels.len());
    (shown - count..shown)
        .map(|level| pool_level(parts, survey, pixels as f64, level))
        .collect()
}

fn pool_level(parts: &[Part], survey: Option<&Survey>, pixels: f64, level: usize) -> Measured {
    let sum = |of: &dyn Fn(&Part) -> f64| parts.iter().map(of).sum::<f64>();
    let size = |part: &Part| survey.map_or(part.pixels, |_| part.survey);
    let total = survey.map_or(pixels, |s| s.relative.iter().sum());
    let all = sum(&|p| p.levels[level]);
    let ratio = all / sum(&size);
    let value = ratio * total / (3.0 * pixels);
    if !(value > 0.0 && value.is_finite()) {
        return Measured::default();
    }
    // Of the batches: pixels are independent.
    let noise = sum(&|p| p.squares[level]) / (all * all);
    // Of the choice of parts.
    let residual = sum(&|p| (p.levels[level] - ratio * size(p)).powi(2));
    let unseen = (1.0 - sum(&|p| p.pixels) / pixels).max(0.0);
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

/// By how much the bound on the error's square, by which a render stops, is above it: see
/// `Estimate::error_at_most`. A share of it, from the survey or else from the parts' first levels.
pub(super) fn margin(parts: &[Part], survey: Option<&Survey>, pixels: usize) -> f64 {
    let part = |of: &dyn Fn(&Part) -> f64| parts.iter().map(of).sum::<f64>();
    let (sum, squares, seen) = match survey {
        Some(survey) => (
            survey.relative.iter().sum::<f64>(),
            survey.relative.iter().map(|x| x * x).sum::<f64>(),
            pixels as f64,
        ),
        None => (
            part(&|p| p.levels[0]),
            part(&|p| p.squares[0]),
            part(&|p| p.pixels),
        ),
    };
    let variance = (seen * squares / (sum * sum) - 1.0).max(0.0) / pixels as f64;
    if sum > 0.0 {
        UPPER * variance.sqrt()
    } else {
        0.0
    }
}

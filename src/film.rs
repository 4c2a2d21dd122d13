//! The film: f64 sums over all samples so far, and their variance from batches of samples.

use std::ops::Range;

use crate::settings::Rect;
use crate::statistics::student_quantile;

/// Samples a block: f32 sums run over one block, and every batch, whose spread gives the error
/// estimate, is some of them. The kernel's `BLOCK`.
pub const BLOCK: u64 = 4;

/// The largest window: what a renderer sums up by itself before the film gets it.
pub const WINDOW: u64 = 256;

/// The end of the window that starts at `start`, in a range that ends at `end`. Boundaries are at
/// fixed sample indices (16, 64, 256 and then every 256), so that no timing changes any sum.
#[must_use]
pub fn window_end(start: u64, end: u64) -> u64 {
    let boundary = [16, 64].into_iter().find(|b| start < *b);
    let boundary = boundary.unwrap_or((start / WINDOW + 1).saturating_mul(WINDOW));
    // A window's samples share the high word of the sample index.
    boundary.min(end)
}

/// One pixel's share of a window.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PixelSums {
    /// Sum of the radiance of all samples, W/(sr m²) per channel.
    pub sum: [f64; 3],
    /// Sum of the squared deviations of the full batches' sums from their mean.
    pub m2: [f64; 3],
}

/// What a renderer returns: sums over a range of samples for every pixel of a rectangle.
#[derive(Clone, Debug)]
pub struct Window {
    /// The pixels, by rows.
    pub rect: Rect,
    /// The samples.
    pub samples: Range<u64>,
    /// Samples of a batch: all batches of a window are of one length.
    pub batch: u64,
    /// One entry a pixel, rows from the top.
    pub pixels: Vec<PixelSums>,
    /// What else happened.
    pub tally: Tally,
}

impl Window {
    /// The number of batches that lie in the window as a whole.
    #[must_use]
    pub fn full_batches(&self) -> u64 {
        (self.samples.end / self.batch).saturating_sub(self.samples.start.div_ceil(self.batch))
    }
}

/// Counts over any set of samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tally {
    /// Rays traced.
    pub rays: u64,
    /// Paths that the bounce limit cut while they still carried light.
    pub cut_paths: u64,
    /// The throughput of these, averaged over the channels, summed.
    pub cut_throughput: f64,
    /// Samples that were no finite number; they are in no sum.
    pub non_finite: u64,
    /// The first of these.
    pub first_non_finite: Option<NonFinite>,
}

impl Tally {
    /// Adds the counts of further samples.
    pub fn add(&mut self, other: &Self) {
        self.rays += other.rays;
        self.cut_paths += other.cut_paths;
        self.cut_throughput += other.cut_throughput;
        self.non_finite += other.non_finite;
        self.first_non_finite = self.first_non_finite.or(other.first_non_finite);
    }
}

/// Where a sample was no finite number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub struct NonFinite {
    /// The pixel, in the whole image.
    pub pixel: [u32; 2],
    /// The sample index.
    pub sample: u64,
    /// The bounce after which it was seen.
    pub bounce: u32,
}

/// Sums over all samples so far.
#[derive(Clone, Debug)]
pub struct Film {
    rect: Rect,
    samples: u64,
    /// Batches, and the samples in them, of windows that have at least two.
    batches: u64,
    covered: u64,
    /// Of these windows: the samples in their batches squared, over one less than the batches.
    doubt: f64,
    sum: Vec<[f64; 3]>,
    /// Estimated variance of the covered samples' sum.
    variance: Vec<[f64; 3]>,
    tally: Tally,
}

impl Film {
    /// An empty film for the pixels of `rect`.
    #[must_use]
    pub fn new(rect: Rect) -> Self {
        let pixels = rect.pixels();
        Self {
            rect,
            samples: 0,
            batches: 0,
            covered: 0,
            doubt: 0.0,
            sum: vec![[0.0; 3]; pixels],
            variance: vec![[0.0; 3]; pixels],
            tally: Tally::default(),
        }
    }

    /// Folds a window in.
    ///
    /// The n batches of a window are independent and alike, so that n/(n - 1) times the sum of their
    /// squared deviations estimates the variance of their sum without bias; windows are independent,
    /// so that these add up, whatever the length of each one's batches.
    ///
    /// # Panics
    /// If the window is not of the film's pixels.
    pub fn add(&mut self, window: &Window) {
        assert_eq!(window.rect, self.rect, "a window of other pixels");
        let batches = window.full_batches();
        let scale = if batches > 1 {
            batches as f64 / (batches - 1) as f64
        } else {
            0.0
        };
        let pixels = self.sum.iter_mut().zip(&mut self.variance);
        for ((sum, variance), pixel) in pixels.zip(&window.pixels) {
            for c in 0..3 {
                sum[c] += pixel.sum[c];
                variance[c] += scale * pixel.m2[c];
            }
        }
        self.samples += window.samples.end - window.samples.start;
        if batches > 1 {
            self.batches += batches;
            let covered = batches * window.batch;
            self.covered += covered;
            self.doubt += (covered as f64).powi(2) / (batches - 1) as f64;
        }
        self.tally.add(&window.tally);
    }

    /// The film's pixels.
    #[must_use]
    pub fn rect(&self) -> Rect {
        self.rect
    }

    /// Samples a pixel so far.
    #[must_use]
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// Counts over all samples so far.
    #[must_use]
    pub fn tally(&self) -> &Tally {
        &self.tally
    }

    /// The mean radiance of pixel `i`, W/(sr m²) per channel; zero without samples.
    #[must_use]
    pub fn mean(&self, i: usize) -> [f64; 3] {
        let n = self.samples.max(1) as f64;
        self.sum[i].map(|s| s / n)
    }

    /// The estimated variance of [`mean`](Self::mean), from the spread of the batches; `None` below
    /// 16 batches, where it would be a guess. Samples that are in no full batch count as if they were.
    #[must_use]
    pub fn variance_of_mean(&self, i: usize) -> Option<[f64; 3]> {
        if self.batches < 16 {
            return None;
        }
        let scale = 1.0 / (self.covered as f64 * self.samples as f64);
        Some(self.variance[i].map(|v| v * scale))
    }

    /// The degrees of freedom of [`variance_of_mean`](Self::variance_of_mean); `None` where that is.
    ///
    /// Welch 1947 and Satterthwaite 1946, with one variance a sample throughout. Longer scrambles have
    /// less, so that the windows with few and long batches weigh less than this has it: it is on the
    /// cautious side.
    #[must_use]
    pub fn freedom(&self) -> Option<f64> {
        (self.batches >= 16).then(|| (self.covered as f64).powi(2) / self.doubt)
    }

    /// Half the width of the interval about [`mean`](Self::mean) that holds the truth in 95 % of all
    /// renders (Student 1908); `None` below 16 batches. `docs/accuracy.md` says how far that is true.
    #[must_use]
    pub fn half_width(&self, i: usize) -> Option<[f64; 3]> {
        let t = student_quantile(self.freedom()?, 0.95);
        self.variance_of_mean(i).map(|v| v.map(|v| t * v.sqrt()))
    }

    /// The means as linear f32, rows from the top.
    #[must_use]
    pub fn pixels(&self) -> Vec<[f32; 3]> {
        (0..self.sum.len())
            .map(|i| self.mean(i).map(|x| x as f32))
            .collect()
    }
}

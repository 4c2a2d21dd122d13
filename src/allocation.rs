//! Where samples go: how many each tile of the image gets (`--adaptive`).

use crate::estimate::Estimate;
use crate::film::{Film, LEAST_SAMPLES};
use crate::settings::Rect;

/// Pixels along the side of a tile: the kernel's workgroup.
pub const TILE: u32 = 8;

/// Samples a pixel of a pilot: as many as its error needs to be known.
pub const PILOT_SAMPLES: u64 = LEAST_SAMPLES;

/// Tiles get 2^step times the samples of those that get least, with a step of up to this.
const STEPS: u8 = 4;

/// Tiles of a rectangle of pixels, some of them chosen.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tiles {
    across: u32,
    chosen: Vec<bool>,
}

impl Tiles {
    /// Whether the tile at a column and a row of tiles is chosen.
    #[must_use]
    pub fn has(&self, column: u32, row: u32) -> bool {
        self.chosen[(row * self.across + column) as usize]
    }

    /// Whether the tile of a pixel, counted from the rectangle's corner, is chosen.
    #[must_use]
    pub fn has_pixel(&self, x: u32, y: u32) -> bool {
        self.has(x / TILE, y / TILE)
    }
}

/// A step for every tile of a rectangle. It is fixed before the first sample of the image is taken, and
/// by other samples: the mean of a pixel has then no bias, whatever the steps are.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Allocation {
    rect: Rect,
    across: u32,
    /// By rows of tiles.
    steps: Vec<u8>,
}

impl Allocation {
    /// The same for every tile.
    #[must_use]
    pub fn uniform(rect: Rect) -> Self {
        let across = rect.width.div_ceil(TILE);
        Self {
            rect,
            across,
            steps: vec![0; (across * rect.height.div_ceil(TILE)) as usize],
        }
    }

    /// What makes the image's relative error least for its samples, as far as `pilot` shows, with at
    /// most `most` times the samples of the least sampled tiles on average.
    ///
    /// The error is that of [`Estimate`], without its correction, which is noise in a tile: its square is a sum of V/n over tiles, which is least for
    /// samples n as the root of V. A tile counts as half as rough as its roughest neighbour at least,
    /// since what the pilot has not met in a tile, a caustic say, may be all of its error.
    #[must_use]
    pub fn of(pilot: &Film, most: f64) -> Self {
        let mut allocation = Self::uniform(pilot.rect());
        let Some(roughness) = allocation.roughness(pilot) else {
            return allocation;
        };
        let pixels = allocation.pixels();
        let largest = roughness.iter().copied().fold(0.0, f64::max);
        let mut least = f64::INFINITY;
        // By quarters of a power of two; beyond these all tiles are in the last step.
        for quarter in 0..=80 {
            let unit = largest * f64::exp2(-f64::from(quarter) / 4.0);
            let step = |r: &f64| ((r / unit).log2().round() as i32).clamp(0, STEPS.into()) as u8;
            let mut steps: Vec<u8> = roughness.iter().map(step).collect();
            let lowest = steps.iter().copied().min().unwrap_or(0);
            steps.iter_mut().for_each(|s| *s -= lowest);
            let (mut work, mut error, mut all) = (0.0, 0.0, 0.0);
            for ((s, r), n) in steps.iter().zip(&roughness).zip(&pixels) {
                let weight = f64::from(1u32 << s);
                work += n * weight;
                error += n * r * r / weight;
                all += n;
            }
            if work * error < least && work <= most * all {
                least = work * error;
                allocation.steps = steps;
            }
        }
        allocation
    }

    /// For each tile the root of the mean over pixels and channels of s²/(m² + (0.1 M)²), and at least
    /// half of that of its neighbours; `None` where nothing is known.
    fn roughness(&self, pilot: &Film) -> Option<Vec<f64>> {
        let mean = Estimate::of(pilot)
            .error
            .map(|_| Estimate::of(pilot).mean)?;
        let floor = (0.1 * mean).powi(2);
        let mut squares = vec![0.0; self.steps.len()];
        for i in 0..self.rect.pixels() {
            squares[self.tile(i)] += pilot.relative_variance(i, floor)?[0];
        }
        let own: Vec<f64> = squares
            .iter()
            .zip(self.pixels())
            .map(|(sum, n)| (sum / n).sqrt())
            .collect();
        let across = self.across as usize;
        let rows = own.len() / across;
        let spread = |tile: usize| {
            let (x, y) = (tile % across, tile / across);
            let near = |at: usize, end: usize| at.saturating_sub(1)..(at + 2).min(end);
            let around = near(y, rows).flat_map(|v| near(x, across).map(move |u| (u, v)));
            let largest = around.map(|(u, v)| own[v * across + u]).fold(0.0, f64::max);
            own[tile].max(0.5 * largest)
        };
        Some((0..own.len()).map(spread).collect())
    }

    /// The pixels.
    #[must_use]
    pub fn rect(&self) -> Rect {
        self.rect
    }

    /// The step of pixel `i`.
    #[must_use]
    pub fn step(&self, i: usize) -> u8 {
        self.steps[self.tile(i)]
    }

    /// Pixels of each step, from 0 on.
    #[must_use]
    pub fn counts(&self) -> Vec<u64> {
        let last = self.steps.iter().copied().max().unwrap_or(0);
        let mut counts = vec![0; usize::from(last) + 1];
        for (step, pixels) in self.steps.iter().zip(self.pixels()) {
            counts[usize::from(*step)] += pixels as u64;
        }
        counts
    }

    /// Samples of a pixel on average, in those of step 0.
    #[must_use]
    pub fn mean_weight(&self) -> f64 {
        let counts = self.counts().into_iter().enumerate();
        let work: f64 = counts.map(|(s, n)| n as f64 * f64::exp2(s as f64)).sum();
        work / self.rect.pixels() as f64
    }

    /// The tiles of a step; `None` if that is all of them.
    #[must_use]
    pub fn tiles(&self, step: u8) -> Option<Tiles> {
        let chosen: Vec<bool> = self.steps.iter().map(|s| *s == step).collect();
        (!chosen.iter().all(|c| *c)).then_some(Tiles {
            across: self.across,
            chosen,
        })
    }

    fn tile(&self, i: usize) -> usize {
        let (width, side) = (self.rect.width as usize, TILE as usize);
        i / width / side * self.across as usize + i % width / side
    }

    /// The pixels of each tile.
    fn pixels(&self) -> Vec<f64> {
        let tiles = self.rect.pieces(TILE);
        tiles.map(|tile| tile.pixels() as f64).collect()
    }
}

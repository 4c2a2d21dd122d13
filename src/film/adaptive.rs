//! Where samples go (`--adaptive`): what a pilot's film says of the tiles.

use super::allocation::Allocation;
use super::estimate::Estimate;
use super::sums::Film;
use super::window::LEAST_SAMPLES;

/// Samples a pixel of a pilot: as many as its error needs to be known.
pub const PILOT_SAMPLES: u64 = LEAST_SAMPLES;

/// Tiles get 2^step times the samples of those that get least, with a step of up to this.
pub(super) const STEPS: u8 = 4;

impl Allocation {
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
        for i in 0..self.rect().pixels() {
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
}

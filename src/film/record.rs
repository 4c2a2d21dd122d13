//! A film as the numbers that make it, for files; and films of other samples joined.

use serde::{Deserialize, Serialize};

use super::allocation::{Allocation, TILE};
use super::aov::AovSums;
use super::sums::{Film, Half, Level};
use super::window::Tally;
use crate::scene::{MAX_SIDE, MAX_SPP};
use crate::settings::Rect;

/// What a film counts beside the sums of its pixels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Counts {
    /// By step.
    levels: Vec<Level>,
    /// What happened on all paths.
    tally: Tally,
    /// The paths that the tally is of.
    paths: u64,
    /// Estimated variance of the sum over all pixels, where these are not independent of each other.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    image_variance: Option<[f64; 3]>,
}

impl Counts {
    /// Samples of the pixels of each step; 0 where none has it.
    #[must_use]
    pub fn samples(&self) -> Vec<u64> {
        let sum = |level: &Level| level.halves[0].saturating_add(level.halves[1]);
        self.levels.iter().map(sum).collect()
    }
}

/// All numbers of a film.
#[derive(Clone, Debug)]
pub struct Record {
    /// The step of each tile, by rows.
    pub steps: Vec<u8>,
    /// What is not by pixel.
    pub counts: Counts,
    /// Sums of the samples in each half of the windows, by pixel.
    pub sum: [Vec<[f64; 3]>; 2],
    /// Estimated variances of these.
    pub variance: [Vec<[f64; 3]>; 2],
    /// Sums beside the light, by pixel; empty if there are none.
    pub aovs: Vec<AovSums>,
}

impl Record {
    /// Columns and rows of tiles of `rect`.
    #[must_use]
    pub fn tiles(rect: Rect) -> [u32; 2] {
        [rect.width.div_ceil(TILE), rect.height.div_ceil(TILE)]
    }
}

impl Film {
    /// The step of each tile, by rows.
    #[must_use]
    pub fn tile_steps(&self) -> &[u8] {
        &self.allocation.steps
    }

    /// What the film counts.
    #[must_use]
    pub fn counts(&self) -> Counts {
        Counts {
            levels: self.levels.clone(),
            tally: self.tally,
            paths: self.paths,
            image_variance: self.image_variance,
        }
    }

    /// The sums of each half of the windows, by pixel, and their estimated variances.
    #[must_use]
    pub fn half_sums(&self) -> [[&[[f64; 3]]; 2]; 2] {
        let halves = self.halves.each_ref();
        [
            halves.map(|half| half.sum.as_slice()),
            halves.map(|half| half.variance.as_slice()),
        ]
    }

    /// The sums beside the light, by pixel; empty if there are none.
    #[must_use]
    pub fn aov_sums(&self) -> &[AovSums] {
        &self.aovs
    }

    /// The film of the pixels of `rect` that a record is of.
    ///
    /// # Errors
    /// What in the record contradicts the rest, or cannot be true of any film.
    pub fn of_record(rect: Rect, record: Record) -> Result<Self, String> {
        let sides = [rect.width, rect.height];
        if sides.iter().any(|side| !(1..=MAX_SIDE).contains(side)) {
            return Err(format!("an image of {}x{} pixels", rect.width, rect.height));
        }
        let pixels = rect.pixels();
        let sizes = record.sum.iter().chain(&record.variance).map(Vec::len);
        let [across, down] = Record::tiles(rect).map(|n| n as usize);
        let aovs = record.aovs.len();
        if sizes.into_iter().any(|n| n != pixels)
            || record.steps.len() != across * down
            || (aovs != 0 && aovs != pixels)
        {
            return Err("the arrays are not of the image's size".into());
        }
        if record.steps.iter().any(|step| *step > MOST_STEPS) {
            return Err(format!("a step above {MOST_STEPS}"));
        }
        let mut allocation = Allocation::uniform(rect);
        allocation.steps = record.steps;
        let levels = record.counts.levels;
        let pixels_of = |level: &Level| level.pixels;
        if !levels.iter().map(pixels_of).eq(allocation.counts()) {
            return Err("the counts are not those of the steps of the tiles".into());
        }
        for level in &levels {
            let most = MAX_SPP << MOST_STEPS;
            let known = level.halves.iter().all(|n| *n <= most)
                && level.covered <= level.samples()
                && level.batches <= level.covered
                && level.doubt >= 0.0
                && level.samples().saturating_mul(level.pixels) <= MOST_COUNTED;
            if !known {
                return Err("counts of samples that no film can have".into());
            }
        }
        let is_variance = |v: &f64| *v >= 0.0;
        if !record
            .counts
            .image_variance
            .iter()
            .flatten()
            .all(is_variance)
        {
            return Err("a variance of the image that is none".into());
        }
        let tally = &record.counts.tally;
        let counted = [
            record.counts.paths,
            tally.rays,
            tally.cut_paths,
            tally.non_finite,
        ];
        if counted.iter().any(|n| *n > MOST_COUNTED) {
            return Err("counts of paths that no film can have".into());
        }
        let [a, b] = record.sum;
        let [v, w] = record.variance;
        let half = |(sum, variance)| Half { sum, variance };
        Ok(Self {
            allocation,
            levels,
            halves: [(a, v), (b, w)].map(half),
            aovs: record.aovs,
            image_variance: record.counts.image_variance,
            tally: record.counts.tally,
            paths: record.counts.paths,
        })
    }

    /// Adds what another film of the same pixels has of other samples.
    ///
    /// # Panics
    /// If it is of other pixels, or these get other samples.
    pub fn join(&mut self, other: &Self) {
        assert_eq!(self.allocation, other.allocation, "a film of other pixels");
        for (half, more) in self.halves.iter_mut().zip(&other.halves) {
            let pairs = [
                (&mut half.sum, &more.sum),
                (&mut half.variance, &more.variance),
            ];
            for (sums, more) in pairs {
                let sums = sums.as_flattened_mut().iter_mut();
                sums.zip(more.as_flattened()).for_each(|(a, b)| *a += b);
            }
        }
        self.aovs
            .resize(self.aovs.len().max(other.aovs.len()), AovSums::default());
        for (sums, more) in self.aovs.iter_mut().zip(&other.aovs) {
            sums.add(more);
        }
        for (level, more) in self.levels.iter_mut().zip(&other.levels) {
            for half in [0, 1] {
                level.halves[half] += more.halves[half];
            }
            level.batches += more.batches;
            level.covered += more.covered;
            level.doubt += more.doubt;
        }
        if let Some(more) = other.image_variance {
            let total = self.image_variance.get_or_insert_default();
            (0..3).for_each(|c| total[c] += more[c]);
        }
        self.count(&other.tally, other.paths);
    }

    /// How far the pixels of `step` are: their samples.
    #[must_use]
    pub fn samples_of_step(&self, step: u8) -> u64 {
        self.levels[usize::from(step)].samples()
    }
}

/// No allocation has a larger step.
const MOST_STEPS: u8 = super::adaptive::STEPS;
/// No film counts as many rays: so those of several can be added.
const MOST_COUNTED: u64 = 1 << 58;

//! What light sampling draws directions to an image around the scene from: a row of texels, and a texel of that row,
//! from alias tables; in the texel the direction is uniform by solid angle.
//!
//! A texel counts by the luminance that is seen in it, of which interpolation brings some of its neighbours': so the
//! pdf is positive wherever light comes from. Thresholds have 16 bits, and pdfs are computed from those:
//! they are exactly what is drawn, however small.

use std::f64::consts::PI;

use super::lights::alias_table;
use crate::materials::luminance;
use crate::scene::Sky;

/// Thresholds are in units of one over this.
pub const STEPS: u32 = 1 << 16;

/// An entry of an alias table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Entry {
    /// The entry is itself where a uniform number is below this over [`STEPS`], else `other`.
    pub threshold: u16,
    /// Another entry, or the same.
    pub other: u16,
}

impl Entry {
    /// The entry that the uniform number `u` gives where this one is at `own`.
    #[must_use]
    pub fn choose(self, own: u32, u: f64) -> u32 {
        if u * f64::from(STEPS) < f64::from(self.threshold) {
            own
        } else {
            self.other.into()
        }
    }
}

/// Where a row of texels is, by sin^2 of half the angle to the nearer pole: measured from there, so that it keeps its
/// digits next to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Band {
    /// At the edge towards the nearer pole.
    pub near: f64,
    /// How much more it is at the other edge.
    pub step: f64,
    /// Whether the nearer pole is the one below.
    pub lower: bool,
}

impl Band {
    /// That of row `row` of `rows`.
    #[must_use]
    pub fn of(row: u32, rows: u32) -> Self {
        let lower = 2 * row >= rows;
        let rows_before = if lower { rows - 1 - row } else { row };
        let edge = |row: u32| (0.5 * PI * f64::from(row) / f64::from(rows)).sin().powi(2);
        Self {
            near: edge(rows_before),
            step: edge(rows_before + 1) - edge(rows_before),
            lower,
        }
    }

    /// The square where `part` of the row's solid angle is above.
    #[must_use]
    pub fn square(self, part: f64) -> f64 {
        self.near + self.step * if self.lower { 1.0 - part } else { part }
    }

    /// Solid angle of the whole row.
    #[must_use]
    pub fn solid_angle(self) -> f64 {
        4.0 * PI * self.step
    }
}

/// An image as a distribution of directions.
#[derive(Clone, Debug, PartialEq)]
pub struct SkyTable {
    width: u32,
    rows: Vec<Entry>,
    columns: Vec<Entry>,
    pdf: Vec<f32>,
}

impl SkyTable {
    /// That of an image that is not black.
    #[must_use]
    pub fn new(sky: &Sky) -> Self {
        Self::by(sky, |row| strengths(sky, row))
    }

    /// The same by other strengths of the texels of each row, for tests of a table that is made wrongly.
    pub fn by(sky: &Sky, strengths: impl Fn(u32) -> Vec<f64>) -> Self {
        let [width, height] = [sky.image().width, sky.image().height];
        let mut columns = Vec::with_capacity((width * height) as usize);
        let mut pdf = Vec::with_capacity((width * height) as usize);
        let mut powers = Vec::with_capacity(height as usize);
        for row in 0..height {
            let strengths = strengths(row);
            let band = Band::of(row, height).solid_angle();
            let sum: f64 = strengths.iter().sum();
            powers.push(sum * band);
            let entries = quantised(&strengths, sum);
            let texel = band / f64::from(width);
            // In the row, until the rows are known.
            pdf.extend(probabilities(&entries).map(|p| (p / texel) as f32));
            columns.extend(entries);
        }
        let rows = quantised(&powers, powers.iter().sum());
        let of_rows: Vec<f64> = probabilities(&rows).collect();
        for (place, pdf) in pdf.iter_mut().enumerate() {
            *pdf = (f64::from(*pdf) * of_rows[place / width as usize]) as f32;
        }
        Self {
            width,
            rows,
            columns,
            pdf,
        }
    }

    /// The same with what another table says of its pdfs, for tests of one that is made wrongly.
    #[must_use]
    pub fn that_claims(mut self, other: &Self) -> Self {
        self.pdf.clone_from(&other.pdf);
        self
    }

    /// By which a row is chosen.
    #[must_use]
    pub fn rows(&self) -> &[Entry] {
        &self.rows
    }

    /// By which a texel of a row is chosen, row by row.
    #[must_use]
    pub fn columns(&self) -> &[Entry] {
        &self.columns
    }

    /// By which a texel of row `row` is chosen, where `place` is.
    #[must_use]
    pub fn column(&self, place: u32, row: u32) -> Entry {
        self.columns[row as usize * self.width as usize + place as usize]
    }

    /// The pdf in solid angle with which directions in a texel are drawn.
    #[must_use]
    pub fn pdf(&self, column: u32, row: u32) -> f64 {
        self.pdf[row as usize * self.width as usize + column as usize].into()
    }
}

/// The means of what is seen in the texels of a row: interpolated, a texel has three quarters of its own along each
/// axis, and an eighth of each neighbour's.
fn strengths(sky: &Sky, row: u32) -> Vec<f64> {
    let [width, height] = [sky.image().width, sky.image().height];
    let above = row.saturating_sub(1);
    let below = (row + 1).min(height - 1);
    let down = |column: u32| {
        let texel = |row| luminance(sky.texel(column, row));
        0.125 * (texel(above) + texel(below)) + 0.75 * texel(row)
    };
    let values: Vec<f64> = (0..width).map(down).collect();
    let count = values.len();
    let across = |i: usize| {
        let (left, right) = (values[(i + count - 1) % count], values[(i + 1) % count]);
        0.125 * (left + right) + 0.75 * values[i]
    };
    (0..count).map(across).collect()
}

/// An alias table by `strengths`, the sum of which is `sum`. What has any strength is drawn with at least one of
/// [`STEPS`] of its entry.
fn quantised(strengths: &[f64], sum: f64) -> Vec<Entry> {
    let count = strengths.len();
    let shares: Vec<f64> = match sum > 0.0 {
        true => strengths.iter().map(|s| s / sum).collect(),
        // A row that is never chosen.
        false => vec![1.0 / count as f64; count],
    };
    let entry = |(own, (threshold, other)): (usize, (f64, usize))| {
        let steps = (threshold * f64::from(STEPS)).round();
        let least = if strengths[own] > 0.0 { 1.0 } else { 0.0 };
        let steps = steps.max(least) as u32;
        match u16::try_from(steps) {
            Ok(threshold) if other != own => Entry {
                threshold,
                other: other as u16,
            },
            // Always itself.
            _ => Entry {
                threshold: 0,
                other: own as u16,
            },
        }
    };
    alias_table(&shares)
        .into_iter()
        .enumerate()
        .map(entry)
        .collect()
}

/// With which the entries of an alias table are chosen, exactly.
fn probabilities(entries: &[Entry]) -> impl Iterator<Item = f64> {
    let mut steps = vec![0u64; entries.len()];
    for (own, entry) in entries.iter().enumerate() {
        steps[own] += u64::from(entry.threshold);
        steps[usize::from(entry.other)] += u64::from(STEPS) - u64::from(entry.threshold);
    }
    let all = entries.len() as f64 * f64::from(STEPS);
    steps.into_iter().map(move |steps| steps as f64 / all)
}

//! Cells of the sphere, for chi-square tests of directions.

use std::f64::consts::TAU;

use glam::DVec3;
use rayon::prelude::*;

use crate::sampling::directions::basis_around;
use crate::statistics::chi_square;

/// What was tested, and the p-value.
pub type Outcome = (String, f64);

/// Cells of the sphere about an axis: rings between heights 1 - cos, cut into sectors.
#[derive(Clone, Debug)]
pub struct Cells {
    axes: [DVec3; 3],
    heights: Vec<f64>,
    sectors: usize,
}

/// Points of the quadrature along the sides of a rectangle, its borders among them, and their weights:
/// Simpson's rule.
const POINTS: usize = 9;
const WEIGHTS: [f64; POINTS] = [1.0, 4.0, 2.0, 4.0, 2.0, 4.0, 2.0, 4.0, 1.0];

/// Halvings at most of a cell's rectangle.
const DEPTH: u32 = 24;

/// A part of a cell: heights, and turns in shares of the circle.
#[derive(Clone, Copy)]
struct Rectangle {
    heights: [f64; 2],
    turns: [f64; 2],
}

impl Cells {
    /// Rings of equal solid angle from height to height of `edges`, so many between each two.
    #[must_use]
    pub fn new(axis: DVec3, edges: &[f64], rings: usize, sectors: usize) -> Self {
        let axis = axis.normalize();
        let basis = basis_around(axis);
        let between = |pair: &[f64]| {
            let (low, step) = (pair[0], (pair[1] - pair[0]) / rings as f64);
            (1..=rings).map(move |i| low + step * i as f64)
        };
        let inner = edges.windows(2).flat_map(between);
        Self {
            axes: [basis.tangent, basis.bitangent, axis],
            heights: edges[..1].iter().copied().chain(inner).collect(),
            sectors,
        }
    }

    /// The same with a border of sectors in the half plane of `direction` from the axis: what lies there as a streak,
    /// thinner than a sector, is then met by the quadrature.
    #[must_use]
    pub fn with_border(mut self, direction: DVec3) -> Self {
        /// Sines of angles between the two that are rounding.
        const LEAST: f64 = 1.0e-8;
        let axis = self.axes[2];
        let across = axis.cross(direction);
        if across.length() > LEAST * direction.length() {
            let bitangent = across.normalize();
            self.axes = [bitangent.cross(axis), bitangent, axis];
        }
        self
    }

    /// How many there are.
    #[must_use]
    pub fn count(&self) -> usize {
        (self.heights.len() - 1) * self.sectors
    }

    /// The cell of a direction.
    #[must_use]
    pub fn of(&self, w: DVec3) -> usize {
        let [tangent, bitangent, axis] = self.axes;
        // 1 - cos without the cancellation.
        let height = 0.5 * (w.normalize() - axis).length_squared();
        let ring = self.heights[1..].partition_point(|h| *h <= height);
        let turn = w.dot(bitangent).atan2(w.dot(tangent)).rem_euclid(TAU) / TAU;
        let sector = (turn * self.sectors as f64) as usize;
        ring.min(self.heights.len() - 2) * self.sectors + sector.min(self.sectors - 1)
    }

    /// The integral of a function over all cells, one by one, each of their parts to `tolerance`.
    ///
    /// A rectangle in height and turn, whose solid angle is its area times 2 pi, is halved across the side along
    /// which the function is less smooth until its error is small enough. Jumps count in full: the function may
    /// end at a horizon or at the rim of a lobe.
    pub fn integrals<const N: usize>(
        &self,
        f: impl Fn(DVec3) -> [f64; N] + Sync,
        tolerance: f64,
    ) -> Vec<[f64; N]> {
        let cells = (0..self.count()).into_par_iter();
        cells
            .map(|cell| {
                let (ring, sector) = (cell / self.sectors, cell % self.sectors);
                let turn = |i: usize| i as f64 / self.sectors as f64;
                let whole = Rectangle {
                    heights: [self.heights[ring], self.heights[ring + 1]],
                    turns: [turn(sector), turn(sector + 1)],
                };
                self.integral(&whole, &f, tolerance, DEPTH)
            })
            .collect()
    }

    fn integral<const N: usize>(
        &self,
        part: &Rectangle,
        f: &impl Fn(DVec3) -> [f64; N],
        tolerance: f64,
        depth: u32,
    ) -> [f64; N] {
        let values = self.values(part, f);
        let [low, high] = part.heights;
        let area = TAU * (high - low) * (part.turns[1] - part.turns[0]);
        // A jump by J shows as J at least, and moves the sum by a twelfth of it at most.
        let lines = |line: &dyn Fn(usize, usize) -> [f64; N]| {
            let roughness = (0..POINTS).map(|i| roughness(&|j| line(i, j)));
            roughness.sum::<f64>() / POINTS as f64 * area / 12.0
        };
        let by_height = lines(&|i, j| values[j][i]);
        let by_turn = lines(&|i, j| values[i][j]);
        if depth == 0 || by_height + by_turn <= tolerance {
            let mut sum = [0.0; N];
            for (row, across) in values.iter().zip(WEIGHTS) {
                for (value, along) in row.iter().zip(WEIGHTS) {
                    for (sum, x) in sum.iter_mut().zip(value) {
                        *sum += across * along * x;
                    }
                }
            }
            let whole = WEIGHTS.iter().sum::<f64>().powi(2);
            return sum.map(|sum| sum * area / whole);
        }
        let halves = |[low, high]: [f64; 2]| {
            let middle = 0.5 * (low + high);
            [[low, middle], [middle, high]]
        };
        let parts = if by_height >= by_turn {
            halves(part.heights).map(|heights| Rectangle { heights, ..*part })
        } else {
            halves(part.turns).map(|turns| Rectangle { turns, ..*part })
        };
        let [a, b] = parts.map(|part| self.integral(&part, f, tolerance, depth - 1));
        std::array::from_fn(|i| a[i] + b[i])
    }

    /// The function at the points of a rectangle, by height and turn.
    fn values<const N: usize>(
        &self,
        part: &Rectangle,
        f: &impl Fn(DVec3) -> [f64; N],
    ) -> [[[f64; N]; POINTS]; POINTS] {
        let [tangent, bitangent, axis] = self.axes;
        // Within the borders by a little: there the function may jump.
        let place = |[low, high]: [f64; 2], i: usize| {
            let share = 1.0e-6 + (1.0 - 2.0e-6) * i as f64 / (POINTS - 1) as f64;
            low + (high - low) * share
        };
        let turns: [(f64, f64); POINTS] =
            std::array::from_fn(|j| (TAU * place(part.turns, j)).sin_cos());
        std::array::from_fn(|i| {
            let x = place(part.heights, i);
            let sine = (x * (2.0 - x)).max(0.0).sqrt();
            turns.map(|(s, c)| f((1.0 - x) * axis + sine * (c * tangent + s * bitangent)))
        })
    }

    /// p-value of directions against a pdf. What has none ended its path: a cell of its own, with
    /// what is left of the probability.
    ///
    /// # Panics
    /// If the pdf integrates to more than 1.
    pub fn test(
        &self,
        directions: impl Iterator<Item = Option<DVec3>>,
        pdf: impl Fn(DVec3) -> f64 + Sync,
    ) -> f64 {
        let mut counts = vec![0; self.count() + 1];
        for w in directions {
            counts[w.map_or(self.count(), |w| self.of(w))] += 1;
        }
        // A tenth of the noise of the smallest cell that counts, which has 5 of all.
        let samples = counts.iter().sum::<u64>() as f64;
        let masses = self.integrals(|w| [pdf(w)], 0.1 * 5f64.sqrt() / samples);
        let mut masses: Vec<f64> = masses.into_iter().map(|[mass]| mass).collect();
        let rest = 1.0 - masses.iter().sum::<f64>();
        assert!(rest > -1.0e-3, "the pdf integrates to {}", 1.0 - rest);
        // What quadrature leaves is no cell.
        let none_ended = counts[self.count()] == 0 && rest < 1.0e-3;
        masses.push(if none_ended { 0.0 } else { rest.max(0.0) });
        chi_square(&counts, &masses).p
    }
}

/// The sum of the sizes of the fourth differences along a line of points, the largest of all components.
fn roughness<const N: usize>(line: &dyn Fn(usize) -> [f64; N]) -> f64 {
    let mut sums = [0.0f64; N];
    for start in 0..POINTS - 4 {
        let [a, b, c, d, e] = [0, 1, 2, 3, 4].map(|i| line(start + i));
        for (i, sum) in sums.iter_mut().enumerate() {
            *sum += (a[i] - 4.0 * b[i] + 6.0 * c[i] - 4.0 * d[i] + e[i]).abs();
        }
    }
    sums.into_iter().fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integrals_are_exact_at_jumps() {
        let axis = DVec3::new(0.3, -0.5, 0.8).normalize();
        let cells = Cells::new(axis, &[0.0, 0.1, 1.0, 2.0], 4, 12);
        let sum = |f: &(dyn Fn(DVec3) -> f64 + Sync)| -> f64 {
            let parts = cells.integrals(|w| [f(w)], 1.0e-8);
            parts.iter().map(|[x]| x).sum()
        };
        let other = DVec3::new(0.9, 0.1, -0.2).normalize();
        let pi = 0.5 * TAU;
        // A cosine, half of a sphere across the cells, and caps of any size about the axis.
        assert!((sum(&|w| w.dot(other).max(0.0)) - pi).abs() < 1.0e-6);
        let half = sum(&|w| f64::from(u8::from(w.dot(other) > 0.0)));
        assert!((half - TAU).abs() < 1.0e-5, "{half}");
        for height in [0.013, 0.1, 0.222, 1.1] {
            let cap = sum(&|w| f64::from(u8::from(w.dot(axis) > 1.0 - height)));
            assert!((cap - TAU * height).abs() < 1.0e-6, "{cap}");
        }
    }
}

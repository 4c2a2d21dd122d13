//! The lobe that directions are drawn from, fitted to a table.

use std::f64::consts::FRAC_1_PI;

use glam::{DVec2, DVec3};

use crate::materials::ggx::{LEAST_ALPHA, ggx_normal, ggx_pdf};
use crate::materials::lobes::Pair;
use crate::materials::luminance;
use crate::sampling::directions::cosine_direction;

/// What directions are drawn from: visible GGX normals of one alpha, and the cosine. Their shares depend on the cosine
/// of o with the normal, and are linear between six values of it: 0, 0.2, ... 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lobe {
    /// Of the normals, along both tangents.
    pub alpha: f64,
    /// Their shares.
    pub lobe: [f64; KNOTS],
    /// Those of the cosine, each 1 less the other one.
    pub cosine: [f64; KNOTS],
}

const KNOTS: usize = 6;

/// The largest share of the lobe: whatever it misses, the cosine finds.
const MOST: f64 = 0.98;

/// Grazing incidence, where the lobe is of no use for its share at 0.
const GRAZING: f64 = 0.02;

/// Of the pdfs that a table is looked at with.
const ALPHAS: [f64; 5] = [0.002, 0.01, 0.05, 0.2, 0.6];
const POINTS: u32 = 256;

/// Alphas that are tried: from the least to 1, evenly by their logarithms.
const TRIED: u32 = 49;

/// Halvings of the interval in which the best share is.
const HALVINGS: u32 = 24;

/// A direction at which the table is looked at.
struct Point {
    pair: Pair,
    /// The square of f cos by luminance, over the pdf with which the direction was drawn.
    square: f64,
}

/// What a table is at one angle of incidence.
struct Incidence {
    points: Vec<Point>,
    /// The share of the light that is scattered.
    albedo: DVec3,
}

fn lobe_pdf(pair: &Pair, alpha: f64) -> f64 {
    ggx_pdf(pair.o, pair.h, DVec2::splat(alpha))
}

fn cosine_pdf(pair: &Pair) -> f64 {
    FRAC_1_PI * pair.i.z
}

impl Incidence {
    /// Looks at f where o makes that cosine, by evenly spread numbers (Roberts, "The Unreasonable Effectiveness of
    /// Quasirandom Sequences", 2018) through the cosine's pdf and those of lobes from narrow to wide.
    fn of(f: &impl Fn(&Pair) -> DVec3, cosine: f64) -> Self {
        // Powers of the inverse of the root of x^3 = x + 1.
        const STEP: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];
        let o = DVec3::new(((1.0 - cosine) * (1.0 + cosine)).sqrt(), 0.0, cosine);
        let place = |n: u32| DVec2::from(STEP.map(|step| (0.5 + f64::from(n) * step).fract()));
        let drawn = (0..POINTS).flat_map(|n| {
            let diffuse = Pair::between(o, cosine_direction(DVec3::Z, place(n)));
            let lobes = ALPHAS.map(|alpha| {
                let (h, cos_h) = ggx_normal(o, DVec2::splat(alpha), place(n));
                Pair::of(o, h, cos_h.min(1.0))
            });
            std::iter::once(diffuse).chain(lobes)
        });
        let count = f64::from(POINTS) * (1 + ALPHAS.len()) as f64;
        let mut albedo = DVec3::ZERO;
        let mut points = Vec::new();
        for pair in drawn.filter(|pair| pair.i.z > 0.0) {
            let lobes: f64 = ALPHAS.iter().map(|alpha| lobe_pdf(&pair, *alpha)).sum();
            let drawn = (cosine_pdf(&pair) + lobes) / (1 + ALPHAS.len()) as f64;
            let f_cos = pair.i.z * f(&pair);
            albedo += f_cos / drawn / count;
            points.push(Point {
                square: luminance(f_cos).powi(2) / drawn,
                pair,
            });
        }
        Self { points, albedo }
    }

    /// The lobe's share with which the second moment of a sample's weight is least, and that moment, but for a factor
    /// that is the same for all alphas.
    fn best(&self, alpha: f64) -> (f64, f64) {
        let pdfs: Vec<[f64; 3]> = self
            .points
            .iter()
            .map(|point| {
                let cosine = cosine_pdf(&point.pair);
                [point.square, cosine, lobe_pdf(&point.pair, alpha) - cosine]
            })
            .collect();
        // It is convex in the share.
        let rises = |share: f64| {
            let slopes = pdfs
                .iter()
                .map(|[square, cosine, more]| -square * more / (cosine + share * more).powi(2));
            slopes.sum::<f64>() > 0.0
        };
        let (mut low, mut high) = (0.0, MOST);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if rises(middle) {
                high = middle;
            } else {
                low = middle;
            }
        }
        let moments = pdfs
            .iter()
            .map(|[square, cosine, more]| square / (cosine + high * more));
        // Where none at all is best.
        let share = if low == 0.0 { 0.0 } else { high };
        (share, moments.sum())
    }
}

impl Lobe {
    /// The cosine alone.
    pub(super) const COSINE: Self = Self {
        alpha: 1.0,
        lobe: [0.0; KNOTS],
        cosine: [1.0; KNOTS],
    };

    /// The one with which samples of what `f` scatters vary least, by luminance, in the mean over all angles of
    /// incidence by the logarithm; and the share of the light that is scattered at about 45 degrees.
    pub(super) fn fitted(f: &impl Fn(&Pair) -> DVec3) -> (Self, DVec3) {
        let cosine = |k: usize| (k as f64 / (KNOTS - 1) as f64).max(GRAZING);
        let all: [Incidence; KNOTS] = std::array::from_fn(|k| Incidence::of(f, cosine(k)));
        let color = 0.5 * (all[3].albedo + all[4].albedo);
        if all.iter().all(|at| luminance(at.albedo) == 0.0) {
            return (Self::COSINE, color);
        }
        let spread = |alpha: f64| -> f64 {
            let moments = all.iter().map(|at| at.best(alpha).1);
            let light = moments.filter(|moment| *moment > 0.0);
            light.map(f64::ln).sum()
        };
        let tried = (0..TRIED).map(|n| LEAST_ALPHA.powf(f64::from(n) / f64::from(TRIED - 1)));
        let best = tried
            .map(|alpha| (spread(alpha), alpha))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        let alpha = best.map_or(1.0, |(_, alpha)| alpha);
        let lobe = std::array::from_fn(|k| all[k].best(alpha).0);
        let fitted = Self {
            alpha,
            lobe,
            cosine: lobe.map(|share| 1.0 - share),
        };
        (fitted, color)
    }

    /// The shares of the lobe and of the cosine, neither as what the other one leaves of 1.
    #[must_use]
    pub fn shares(&self, cos_o: f64) -> [f64; 2] {
        let near = |k: usize| (1.0 - ((KNOTS - 1) as f64 * cos_o - k as f64).abs()).max(0.0);
        let weighed = |all: [f64; KNOTS]| (0..KNOTS).map(|k| near(k) * all[k]).sum();
        [weighed(self.lobe), weighed(self.cosine)]
    }
}

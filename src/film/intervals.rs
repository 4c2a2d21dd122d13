//! Intervals that hold the truth in 95 % of all renders.
//!
//! Student's t with a pixel's own variance fails where what brings most of the light is rare: a pixel
//! that has not met it is too dark and looks exact, both for the same reason. So a quarter of the variance
//! comes from the 3 x 3 pixels around, whose luck is their own and whose light is mostly alike; that
//! also adds degrees of freedom. Shrinking variances towards those of others is Smyth's moderated t
//! (2004); that a quarter is right is measured: `docs/accuracy.md`.

use super::sums::Film;
use crate::statistics::student_quantile;

/// The share of the variance that is the mean over the neighbourhood, the pixel's own included.
const SHARED: f64 = 0.25;

/// Half the width of each value's interval about [`Film::mean`]; `None` where some pixel has fewer than
/// 16 batches.
#[must_use]
pub fn half_widths(film: &Film) -> Option<Vec<[f64; 3]>> {
    let rect = film.rect();
    let (width, height) = (rect.width as usize, rect.height as usize);
    // Of one sample: neighbours may have more samples or fewer.
    let single: Vec<([f64; 3], f64)> = (0..rect.pixels())
        .map(|i| {
            let n = film.samples_of(i) as f64;
            let variance = film.variance_of_mean(i)?;
            Some((variance.map(|v| v * n), film.freedom_of(i)?))
        })
        .collect::<Option<_>>()?;
    // Few pixels differ in their degrees of freedom.
    let mut known: Vec<(f64, f64)> = Vec::new();
    let mut quantile = |freedom: f64| {
        if let Some((_, t)) = known.iter().find(|(f, _)| *f == freedom) {
            return *t;
        }
        let t = student_quantile(freedom, 0.95);
        known.push((freedom, t));
        t
    };
    let near = |at: usize, end: usize| at.saturating_sub(1)..(at + 2).min(end);
    let interval = |i: usize| {
        let (columns, rows) = (near(i % width, width), near(i / width, height));
        let share = SHARED / (columns.len() * rows.len()) as f64;
        let (mut variance, mut doubt) = ([0.0; 3], 0.0);
        for j in rows.flat_map(|y| columns.clone().map(move |x| y * width + x)) {
            let weight = share + if j == i { 1.0 - SHARED } else { 0.0 };
            let (single, freedom) = &single[j];
            for c in 0..3 {
                variance[c] += weight * single[c];
            }
            // Welch and Satterthwaite, of equal variances.
            doubt += weight * weight / freedom;
        }
        let t = quantile(1.0 / doubt);
        variance.map(|v| t * (v / film.samples_of(i) as f64).sqrt())
    };
    Some((0..rect.pixels()).map(interval).collect())
}

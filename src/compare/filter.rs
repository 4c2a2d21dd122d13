//! Convolution of planes.

use rayon::prelude::*;

/// Convolves a plane with the product of two symmetric or antisymmetric kernels of odd length, one
/// along rows and one along columns. Beyond its border the plane goes on with the value there.
///
/// An antisymmetric kernel comes out with the sign of a correlation, which no caller looks at.
pub(super) fn separable(plane: &[f64], width: usize, across: &[f64], down: &[f64]) -> Vec<f64> {
    let height = plane.len() / width;
    let mut rows = vec![0.0; plane.len()];
    rows.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
        let row = &plane[y * width..(y + 1) * width];
        let radius = across.len() / 2;
        for (x, value) in out.iter_mut().enumerate() {
            let tap = |(k, weight): (usize, &f64)| weight * row[near(x, k, radius, width)];
            *value = across.iter().enumerate().map(tap).sum();
        }
    });
    let mut result = vec![0.0; plane.len()];
    result
        .par_chunks_mut(width)
        .enumerate()
        .for_each(|(y, out)| {
            let radius = down.len() / 2;
            for (k, weight) in down.iter().enumerate() {
                let from = near(y, k, radius, height) * width;
                let row = &rows[from..from + width];
                for (value, from) in out.iter_mut().zip(row) {
                    *value += weight * from;
                }
            }
        });
    result
}

/// The index of tap `k` about `x`, held within the border.
fn near(x: usize, k: usize, radius: usize, size: usize) -> usize {
    (x + k).saturating_sub(radius).min(size - 1)
}

/// The values of `function` at -radius..=radius.
pub(super) fn kernel(radius: usize, function: impl Fn(f64) -> f64) -> Vec<f64> {
    (0..=2 * radius)
        .map(|k| function(k as f64 - radius as f64))
        .collect()
}

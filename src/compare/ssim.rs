//! Structural similarity: Wang, Bovik, Sheikh, Simoncelli: "Image Quality Assessment: From Error
//! Visibility to Structural Similarity", IEEE Trans. Image Process. 13(4), 2004.

use super::filter::{kernel, separable};
use super::mean;

/// The window's standard deviation, pixels.
const SIGMA: f64 = 1.5;
/// The window has 11x11 pixels.
const RADIUS: usize = 5;
/// (0.01 L)² and (0.03 L)² with the range L = 1 of values.
const C: [f64; 2] = [1.0e-4, 9.0e-4];

/// The mean over all windows that lie within the image, for two planes of values in 0..=1; `None` if
/// none does.
///
/// # Panics
/// If the planes have different sizes.
#[must_use]
pub fn ssim(image: &[f64], reference: &[f64], width: usize) -> Option<f64> {
    assert_eq!(image.len(), reference.len(), "the sizes");
    let height = image.len() / width;
    if width.min(height) <= 2 * RADIUS {
        return None;
    }
    let mut window = kernel(RADIUS, |x| (-x * x / (2.0 * SIGMA * SIGMA)).exp());
    let total: f64 = window.iter().sum();
    window.iter_mut().for_each(|weight| *weight /= total);
    let blur = |plane: &[f64]| separable(plane, width, &window, &window);
    let product =
        |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| a * b).collect() };
    let (mean_a, mean_b) = (blur(image), blur(reference));
    let aa = blur(&product(image, image));
    let bb = blur(&product(reference, reference));
    let ab = blur(&product(image, reference));
    let at = |i: usize| {
        let (ma, mb) = (mean_a[i], mean_b[i]);
        let (va, vb, covariance) = (aa[i] - ma * ma, bb[i] - mb * mb, ab[i] - ma * mb);
        (2.0 * ma * mb + C[0]) * (2.0 * covariance + C[1])
            / ((ma * ma + mb * mb + C[0]) * (va + vb + C[1]))
    };
    let values: Vec<f64> = (RADIUS..height - RADIUS)
        .flat_map(|y| (RADIUS..width - RADIUS).map(move |x| y * width + x))
        .map(at)
        .collect();
    Some(mean(&values))
}

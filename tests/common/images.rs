//! Comparisons of images, and what they are compared by. One that fails leaves both images.

use std::fmt::Display;
use std::path::Path;

use gpu_trace::film::Film;
use gpu_trace::image::Picture;
use gpu_trace::statistics::mean_and_error;
use gpu_trace::verify::{leave_images, means, picture_of};

/// Leaves the pictures of a comparison that failed, and says where.
fn leave(name: &str, found: &Picture, wanted: &Picture) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/test-images");
    leave_images(&folder, name, found, wanted)
}

/// What is wrong with a film that should be like a reference; `None` where it `holds`, else with both left.
pub(crate) fn fault(
    name: &str,
    film: &Film,
    reference: &Film,
    holds: bool,
    what: impl Display,
) -> Option<String> {
    fault_of(name, film, &picture_of(reference), holds, what)
}

/// The same of a reference that is a picture.
pub(crate) fn fault_of(
    name: &str,
    film: &Film,
    reference: &Picture,
    holds: bool,
    what: impl Display,
) -> Option<String> {
    let left = || leave(name, &picture_of(film), reference);
    (!holds).then(|| format!("{name}: {what}; {}", left()))
}

/// Fails unless it `holds` that a film is like a reference.
#[track_caller]
pub(crate) fn assert_alike(
    name: &str,
    film: &Film,
    reference: &Film,
    holds: bool,
    what: impl Display,
) {
    if let Some(fault) = fault(name, film, reference, holds, what) {
        panic!("{fault}");
    }
}

/// Fails unless it `holds` that a film is this value everywhere.
#[track_caller]
pub(crate) fn assert_uniform(name: &str, film: &Film, value: f64, holds: bool, what: impl Display) {
    let rect = film.rect();
    let pixels = vec![[value as f32; 3]; rect.pixels()];
    let reference = Picture::new(rect.width, rect.height, pixels);
    if let Some(fault) = fault_of(name, film, &reference, holds, what) {
        panic!("{fault}");
    }
}

/// The mean of some values.
pub(crate) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The mean of each channel of an image and its standard error, the pixels being independent.
pub(crate) fn channels(film: &Film) -> [[f64; 2]; 3] {
    assert_eq!(film.tally().non_finite, 0);
    let pixels = film.rect().pixels();
    std::array::from_fn(|c| {
        let variance = |i| film.variance_of_mean(i).expect("16 batches")[c];
        let sum: f64 = (0..pixels).map(|i| film.mean(i)[c]).sum();
        let error: f64 = (0..pixels).map(variance).sum::<f64>().sqrt();
        [sum, error].map(|x| x / pixels as f64)
    })
}

/// The same by the means of batches over the image, whether its pixels are independent or not.
pub(crate) fn channels_by_batches(film: &Film) -> [[f64; 2]; 3] {
    let pixels = film.rect().pixels();
    let variance = film.variance_of_image_mean().expect("16 batches");
    std::array::from_fn(|c| {
        let sum: f64 = (0..pixels).map(|i| film.mean(i)[c]).sum();
        [sum / pixels as f64, variance[c].sqrt()]
    })
}

/// By how many standard errors the mean of an image, times `scale`, is above that of another one whose samples are
/// others, and by what share of it.
pub(crate) fn bias(film: &Film, reference: &Film, scale: f64) -> (f64, f64) {
    let mean = |film: &Film| mean_and_error(&means(film)).0;
    let variance = |film: &Film| -> f64 {
        let pixels = 0..film.rect().pixels();
        // The channels of a pixel go together: their deviations add.
        let all = pixels.map(|i| film.variance_of_mean(i).expect("16 batches"));
        let sum: f64 = all
            .map(|v| v.iter().map(|v| v.sqrt()).sum::<f64>().powi(2))
            .sum();
        sum / (3.0 * film.rect().pixels() as f64).powi(2)
    };
    let (x, y) = (scale * mean(film), mean(reference));
    let error = (variance(film) + variance(reference)).sqrt();
    ((x - y) / error, x / y - 1.0)
}

/// The largest difference of two images' values, over the largest value.
pub(crate) fn largest_difference(film: &Film, reference: &Film) -> f64 {
    let (a, b) = (means(film), means(reference));
    let largest = b.iter().copied().fold(0.0, f64::max);
    let differences = a.iter().zip(&b).map(|(a, b)| (a - b).abs());
    differences.fold(0.0, f64::max) / largest
}

/// The largest relative difference of two images' values.
pub(crate) fn largest_relative_difference(film: &Film, reference: &Film) -> f64 {
    let pairs = std::iter::zip(means(film), means(reference));
    pairs.map(|(a, b)| (a - b).abs() / b).fold(0.0, f64::max)
}

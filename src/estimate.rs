//! Mean and error of a film.

use crate::film::Film;

/// What a film says about the image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Mean over all pixels and channels, W/(sr m²).
    pub mean: f64,
    /// The relative error: sqrt of the mean over pixels and channels of s²/(m² + (0.1 M)²), with
    /// the pixel's mean m and standard error s and the image's mean M. A fraction. `None` while
    /// there are fewer than 16 blocks of samples, and for a black image.
    pub error: Option<f64>,
}

impl Estimate {
    /// The estimate of a film.
    #[must_use]
    pub fn of(film: &Film) -> Self {
        let count = film.rect().pixels();
        let values = (count * 3) as f64;
        let mean = (0..count).flat_map(|i| film.mean(i)).sum::<f64>() / values;
        let floor = (0.1 * mean).powi(2);
        let mut sum = Some(0.0);
        for i in 0..count {
            sum = sum.zip(film.variance_of_mean(i)).map(|(sum, v)| {
                let m = film.mean(i);
                sum + (0..3).map(|c| v[c] / (m[c] * m[c] + floor)).sum::<f64>()
            });
        }
        let error = sum.map(|sum| (sum / values).sqrt()).filter(|e| e.is_finite() && floor > 0.0);
        Self { mean, error }
    }

    /// Whether nothing has been seen but black.
    #[must_use]
    pub fn is_black(&self) -> bool {
        self.mean == 0.0
    }
}

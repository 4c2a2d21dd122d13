//! Mean and error of a film.

use super::sums::Film;
use super::trust::Trust;

/// What a film says about the image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Mean over all pixels and channels, W/(sr m²).
    pub mean: f64,
    /// The relative error: sqrt of the mean over pixels and channels of s²/(m² + (0.1 M)²), with
    /// the pixel's mean m and standard error s and the image's mean M; without the bias of first order
    /// that a ratio has ([`Film::relative_variance`]), but where noise leaves nothing else. A fraction. `None` while
    /// there are fewer than 16 batches of samples, and for a black image.
    pub error: Option<f64>,
    /// What the error is at most, with a confidence of 95 %, as far as its spread over the pixels tells;
    /// known where it is. Little more than the error itself, unless a few pixels have most of it: then
    /// others may be as bad, and have not met what makes them so.
    pub error_at_most: Option<f64>,
    /// Whether the error can be trusted; known where it is.
    pub trust: Option<Trust>,
}

/// What a standard normal deviate exceeds in 5 % of all cases.
pub(crate) const UPPER: f64 = 1.6449;

impl Estimate {
    /// The estimate of a film.
    #[must_use]
    pub fn of(film: &Film) -> Self {
        let count = film.rect().pixels();
        let values = (count * 3) as f64;
        let mean = (0..count).flat_map(|i| film.mean(i)).sum::<f64>() / values;
        let mean_squared = mean * mean;
        let floor = 0.01 * mean_squared;
        // Sums and sums of squares, plain and of the jackknife.
        let mut sums = Some([[0.0; 2]; 2]);
        for i in 0..count {
            let add = |(sums, said): ([[f64; 2]; 2], [f64; 2])| {
                [0, 1].map(|k| [sums[k][0] + said[k], sums[k][1] + said[k] * said[k]])
            };
            sums = sums.zip(film.relative_variance(i, floor)).map(add);
        }
        // In images of few pixels noise may leave the jackknife less than nothing.
        let best = |[plain, better]: [[f64; 2]; 2]| if better[0] > 0.0 { better } else { plain };
        let correction = sums.map(|[plain, better]| better[0] / plain[0] - 1.0);
        let sums = sums.map(best);
        let known = |e: &f64| e.is_finite() && floor > 0.0;
        let pixels = count as f64;
        let error = sums.map(|[sum, _]| (sum / pixels).sqrt()).filter(known);
        let error_at_most = sums
            .map(|[sum, squares]| {
                let mean = sum / pixels;
                let variance = (squares / pixels - mean * mean).max(0.0) / pixels;
                let variance = variance + shared_doubt(film, mean_squared).unwrap_or(0.0);
                (mean + UPPER * variance.sqrt()).sqrt()
            })
            .filter(known);
        let spread = error_at_most.zip(error).map(|(most, error)| most / error);
        let trust = spread.zip(correction);
        Self {
            mean,
            error,
            error_at_most,
            trust: trust.map(|(spread, correction)| Trust { spread, correction }),
        }
    }

    /// Whether nothing has been seen but black.
    #[must_use]
    pub fn is_black(&self) -> bool {
        self.mean == 0.0
    }
}

/// What is not known of a mean of relative variances beside its spread over the pixels: where pixels of a batch have the
/// same noise in them, as much of it as the image's mean has is estimated from the batches alone, and not once more by
/// each pixel. The variance of such an estimate is 2/f of its square, with f degrees of freedom.
fn shared_doubt(film: &Film, mean_squared: f64) -> Option<f64> {
    let variance = film
        .pixels_are_dependent()
        .then(|| film.variance_of_image_mean())??;
    let relative = variance.iter().sum::<f64>() / (3.0 * mean_squared);
    Some(2.0 / film.freedom()? * relative * relative)
}

#[cfg(test)]
mod tests {
    use super::super::{PixelSums, Tally, Window};
    use super::*;
    use crate::settings::Rect;

    /// One pixel that was dark, but for one batch, and then bright: its dark half alone would be off by so
    /// much that nothing is left of twice what both say.
    #[test]
    fn an_error_is_known_whatever_the_noise() {
        let rect = Rect::whole(1, 1);
        let mut film = Film::new(rect);
        // Sum, and squared deviations of the batches' sums from their mean.
        for (samples, sum, m2) in [(0..16, 0.4, 0.12), (16..64, 48.0, 0.0)] {
            film.add(&Window {
                rect,
                samples,
                batch: 4,
                aovs: Vec::new(),
                image: Vec::new(),
                pixels: vec![PixelSums {
                    sum: [sum; 3],
                    m2: [m2; 3],
                }],
                tally: Tally::default(),
            });
        }
        let floor = (0.1 * film.mean(0)[0]).powi(2);
        let [plain, jackknife] = film.relative_variance(0, floor).expect("16 batches");
        assert!(jackknife < 0.0 && plain > 0.0, "{plain} {jackknife}");
        let estimate = Estimate::of(&film);
        assert_eq!(estimate.error, Some(plain.sqrt()));
        assert_eq!(estimate.error_at_most, Some(plain.sqrt()));
        let trust = estimate.trust.expect("an error");
        assert_eq!((trust.spread, trust.is_good()), (1.0, false), "{trust:?}");
    }
}

//! Whether two images differ by more than their standard errors explain.

use serde::Serialize;

use super::is_finite;
use crate::image::Picture;
use crate::input::Input;
use crate::statistics::{as_normal, normal_limit};

/// What a value can be off by without any noise, relative: rounding in f32 and in the device's
/// functions. Pixels of constant radiance have no other error.
const ROUNDING: f64 = 1.0e-5;

/// Tests of the hypothesis that both images estimate the same, with a significance of 0.1 % each.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ZTest {
    /// Values that were tested: pixels times channels.
    pub values: usize,
    /// Values whose standard error is unknown, or that are not finite themselves.
    pub untested: usize,
    /// Which of the images have standard errors: `both`, `image` or `reference`; the other is taken
    /// as exact.
    pub known: Known,
    /// The largest |z| of a value: where a file tells the degrees of freedom of its standard errors,
    /// the normal deviate that is as improbable as Student's t.
    pub worst: f64,
    /// Where that is: column and row.
    pub worst_at: [u32; 2],
    /// What `worst` exceeds with a probability of 0.1 % (Sidak's correction).
    pub limit: f64,
    /// Pixels with a |z| beyond the limit.
    pub beyond: usize,
    /// The root mean square of z, where it is not exact: 1 where the standard errors are right.
    pub rms: f64,
    /// The largest |z| of a channel's mean over all pixels.
    pub pooled: f64,
    /// What `pooled` exceeds with a probability of 0.1 %.
    pub pooled_limit: f64,
    /// Whether neither is exceeded, and every value was tested.
    pub passed: bool,
}

/// See [`ZTest::known`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Known {
    /// Both images have standard errors.
    Both,
    /// Only the image has.
    Image,
    /// Only the reference has.
    Reference,
}

/// Tests every value and the channels' means; `None` if no standard errors are known.
#[must_use]
pub fn ztest(image: &Input, reference: &Input) -> Option<ZTest> {
    let known = match (&image.stderr, &reference.stderr) {
        (Some(_), Some(_)) => Known::Both,
        (Some(_), None) => Known::Image,
        (None, Some(_)) => Known::Reference,
        (None, None) => return None,
    };
    let width = image.picture.width as usize;
    let (mut values, mut untested, mut noisy) = (0, 0, 0);
    let (mut worst, mut squares) = ((0.0, 0), 0.0);
    let (mut difference, mut variance) = ([0.0; 3], [0.0; 3]);
    // |z| of each pixel's worst channel: the limit depends on how many values there are.
    let mut largest = Vec::with_capacity(image.picture.pixels.len());
    for index in 0..image.picture.pixels.len() {
        let mut here = 0.0f64;
        for channel in 0..3 {
            let Some(Deviation { d, v, freedom }) = deviation(image, reference, index, channel)
            else {
                untested += 1;
                continue;
            };
            values += 1;
            difference[channel] += d;
            variance[channel] += v;
            // Without a difference there is nothing to explain, even if both are exactly 0.
            let t = if d == 0.0 { 0.0 } else { d.abs() / v.sqrt() };
            let z = as_normal(t, freedom);
            squares += z * z;
            // What is exact in both says nothing about standard errors.
            noisy += usize::from(v > 0.0);
            here = here.max(z);
        }
        if here > worst.0 {
            worst = (here, index);
        }
        largest.push(here);
    }
    let limit = normal_limit(values.max(1));
    let pooled_limit = normal_limit(3);
    let z = |c: usize| match difference[c] == 0.0 {
        true => 0.0,
        false => f64::abs(difference[c]) / f64::sqrt(variance[c]),
    };
    let pooled = [0, 1, 2].map(z).into_iter().fold(0.0, f64::max);
    Some(ZTest {
        values,
        untested,
        known,
        worst: worst.0,
        worst_at: [(worst.1 % width) as u32, (worst.1 / width) as u32],
        limit,
        beyond: largest.iter().filter(|z| **z > limit).count(),
        rms: (squares / noisy.max(1) as f64).sqrt(),
        pooled,
        pooled_limit,
        passed: untested == 0 && worst.0 <= limit && pooled <= pooled_limit,
    })
}

/// A difference, its variance, and that one's degrees of freedom.
struct Deviation {
    d: f64,
    v: f64,
    freedom: f64,
}

/// The difference of a value; `None` where its variance is unknown.
fn deviation(image: &Input, reference: &Input, index: usize, channel: usize) -> Option<Deviation> {
    let (a, b) = (
        &image.picture.pixels[index],
        &reference.picture.pixels[index],
    );
    if !(is_finite(a) && is_finite(b)) {
        return None;
    }
    let error = |stderr: &Option<Picture>| match stderr {
        None => Some(0.0),
        Some(picture) => {
            let error = f64::from(picture.pixels[index][channel]);
            (error.is_finite() && error >= 0.0).then_some(error)
        }
    };
    let (a, b) = (f64::from(a[channel]), f64::from(b[channel]));
    let (error_a, error_b) = (error(&image.stderr)?, error(&reference.stderr)?);
    let rounding = ROUNDING * a.abs().max(b.abs());
    let v = error_a.powi(2) + error_b.powi(2) + rounding.powi(2);
    // Welch and Satterthwaite; that of rounding is known.
    let doubt = error_a.powi(4) / freedom(image) + error_b.powi(4) / freedom(reference);
    Some(Deviation {
        d: a - b,
        v,
        freedom: if doubt > 0.0 {
            v * v / doubt
        } else {
            f64::INFINITY
        },
    })
}

/// The degrees of freedom of an image's standard errors; infinite if its file does not say.
fn freedom(input: &Input) -> f64 {
    let told = input.about.get("degrees_of_freedom");
    let told = told.and_then(|text| text.parse::<f64>().ok());
    told.filter(|f| *f >= 1.0).unwrap_or(f64::INFINITY)
}

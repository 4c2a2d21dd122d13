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
    let mut difference = [0.0; 3];
    // Of the sum over all pixels: of the image, of the reference, and of rounding.
    let mut variance = [[0.0; 3]; 3];
    // |z| of each pixel's worst channel: the limit depends on how many values there are.
    let mut largest = Vec::with_capacity(image.picture.pixels.len());
    for index in 0..image.picture.pixels.len() {
        let mut here = 0.0f64;
        for channel in 0..3 {
            let Some(deviation) = deviation(image, reference, index, channel) else {
                untested += 1;
                continue;
            };
            values += 1;
            let Deviation { d, parts, freedom } = deviation;
            let v: f64 = parts.iter().sum();
            difference[channel] += d;
            (0..3).for_each(|i| variance[channel][i] += parts[i]);
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
    let z = |c: usize| {
        let (d, pixels) = (f64::abs(difference[c]), image.picture.pixels.len());
        if d == 0.0 {
            return 0.0;
        }
        // Where pixels are not independent of each other, the file tells what their mean has.
        let told = [image, reference].map(|input| Some((mean_stderr(input)?[c], freedom(input))));
        let of = |told: Option<(f64, f64)>, independent: f64| match told {
            Some((error, freedom)) => ((error * pixels as f64).powi(2), freedom),
            None => (independent, f64::INFINITY),
        };
        let parts = [0, 1].map(|i| of(told[i], variance[c][i]));
        let v = parts[0].0 + parts[1].0 + variance[c][2];
        as_normal(d / v.sqrt(), welch(v, parts))
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

/// A difference, the parts of its variance, and that one's degrees of freedom.
struct Deviation {
    d: f64,
    /// Of the image, of the reference, and of rounding.
    parts: [f64; 3],
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
    let parts = [error_a, error_b, rounding].map(|error| error * error);
    let freedom = welch(
        parts.iter().sum(),
        [(parts[0], freedom(image)), (parts[1], freedom(reference))],
    );
    Some(Deviation {
        d: a - b,
        parts,
        freedom,
    })
}

/// The degrees of freedom of a variance `v`, parts of which have been estimated with so many (Welch 1947, Satterthwaite
/// 1946); the rest is known.
fn welch(v: f64, parts: [(f64, f64); 2]) -> f64 {
    let doubt: f64 = parts.iter().map(|(v, freedom)| v * v / freedom).sum();
    if doubt > 0.0 {
        v * v / doubt
    } else {
        f64::INFINITY
    }
}

/// The standard error of an image's mean, by channel, where its file tells: else pixels are independent of each other.
fn mean_stderr(input: &Input) -> Option<[f64; 3]> {
    let told = input.about.get("mean_stderr")?;
    let numbers: Vec<f64> = told
        .split_whitespace()
        .map(|word| {
            word.parse()
                .ok()
                .filter(|x| (0.0..f64::INFINITY).contains(x))
        })
        .collect::<Option<_>>()?;
    numbers.try_into().ok()
}

/// The degrees of freedom of an image's standard errors; infinite if its file does not say.
fn freedom(input: &Input) -> f64 {
    let told = input.about.get("degrees_of_freedom");
    let told = told.and_then(|text| text.parse::<f64>().ok());
    told.filter(|f| *f >= 1.0).unwrap_or(f64::INFINITY)
}

//! Errors of values: relative, absolute, and of the mean.

use serde::Serialize;

use super::is_finite;
use crate::image::Picture;

/// The share of the reference's mean below which errors are no longer relative to the pixel: noise
/// in the dark would else outweigh all that is seen. The same as in the error that a render
/// estimates (`estimate`).
const FLOOR: f64 = 0.1;

/// Errors of an image with values m against a reference with values r and mean M over all pixels and
/// channels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Errors {
    /// sqrt of the mean over pixels and channels of (m - r)²/(r² + (0.1 M)²): a fraction. Infinite if
    /// the reference is black and the image is not.
    pub relrmse: f64,
    /// Mean of |m - r|/sqrt(r² + (0.1 M)²): a fraction.
    pub mape: f64,
    /// Mean of (m - r)², in the square of the images' unit.
    pub mse: f64,
    /// The largest relative error of a pixel.
    pub worst: f64,
    /// Where that is: column and row.
    pub worst_at: [u32; 2],
    /// Of the mean.
    pub bias: Bias,
    /// The reference's mean M.
    pub reference_mean: f64,
    /// Pixels that this is over.
    pub pixels: usize,
}

/// Relative differences of means, (mean of m - mean of r)/(mean of r); `None` where that is 0.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Bias {
    /// Over all channels.
    pub overall: Option<f64>,
    /// Of the red values.
    pub red: Option<f64>,
    /// Of the green values.
    pub green: Option<f64>,
    /// Of the blue values.
    pub blue: Option<f64>,
}

impl Errors {
    /// Over the pixels that are finite in both; `None` without any.
    #[must_use]
    pub fn of(image: &Picture, reference: &Picture) -> Option<Self> {
        let floor = floor(image, reference)?;
        let mut sums = Sums::default();
        for (index, (a, b)) in pairs(image, reference).enumerate() {
            if !(is_finite(a) && is_finite(b)) {
                continue;
            }
            let squares = squares(a, b, floor);
            sums.pixels += 1;
            for c in 0..3 {
                let (m, r) = (f64::from(a[c]), f64::from(b[c]));
                sums.relative += squares[c];
                sums.absolute_relative += squares[c].sqrt();
                sums.square += (m - r).powi(2);
                sums.image[c] += m;
                sums.reference[c] += r;
            }
            let error = (squares.iter().sum::<f64>() / 3.0).sqrt();
            if error > sums.worst.0 {
                sums.worst = (error, index);
            }
        }
        Some(sums.finish(image.width as usize))
    }
}

/// The relative error of each pixel, sqrt of the mean over channels of (m - r)²/(r² + (0.1 M)²); NaN
/// where a value is not finite.
pub(super) fn map(image: &Picture, reference: &Picture) -> Vec<f64> {
    let floor = floor(image, reference).unwrap_or(f64::NAN);
    let error = |(a, b): (&[f32; 3], &[f32; 3])| match is_finite(a) && is_finite(b) {
        true => (squares(a, b, floor).iter().sum::<f64>() / 3.0).sqrt(),
        false => f64::NAN,
    };
    pairs(image, reference).map(error).collect()
}

fn pairs<'a>(
    image: &'a Picture,
    reference: &'a Picture,
) -> impl Iterator<Item = (&'a [f32; 3], &'a [f32; 3])> {
    image.pixels.iter().zip(&reference.pixels)
}

/// (0.1 M)² of the pixels that are finite in both; `None` without any.
fn floor(image: &Picture, reference: &Picture) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0_usize);
    for (_, b) in pairs(image, reference).filter(|(a, b)| is_finite(a) && is_finite(b)) {
        sum += b.iter().copied().map(f64::from).sum::<f64>();
        count += 3;
    }
    (count > 0).then(|| (FLOOR * sum / count as f64).powi(2))
}

/// (m - r)²/(r² + floor) of each channel. 0 where there is no difference, even if all is black.
fn squares(a: &[f32; 3], b: &[f32; 3], floor: f64) -> [f64; 3] {
    [0, 1, 2].map(|c| {
        let (m, r) = (f64::from(a[c]), f64::from(b[c]));
        let difference = m - r;
        if difference == 0.0 {
            0.0
        } else {
            difference * difference / (r * r + floor)
        }
    })
}

#[derive(Default)]
struct Sums {
    pixels: usize,
    relative: f64,
    absolute_relative: f64,
    square: f64,
    image: [f64; 3],
    reference: [f64; 3],
    worst: (f64, usize),
}

impl Sums {
    fn finish(self, width: usize) -> Errors {
        let values = 3.0 * self.pixels as f64;
        let bias = |m: f64, r: f64| (r != 0.0).then(|| (m - r) / r);
        let [red, green, blue] = [0, 1, 2].map(|c| bias(self.image[c], self.reference[c]));
        let total = self.reference.iter().sum::<f64>();
        let (worst, at) = self.worst;
        Errors {
            relrmse: (self.relative / values).sqrt(),
            mape: self.absolute_relative / values,
            mse: self.square / values,
            worst,
            worst_at: [(at % width) as u32, (at / width) as u32],
            bias: Bias {
                overall: bias(self.image.iter().sum(), total),
                red,
                green,
                blue,
            },
            reference_mean: total / values,
            pixels: self.pixels,
        }
    }
}

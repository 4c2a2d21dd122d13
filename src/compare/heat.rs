//! A picture of where the errors are.

use std::io;

use super::error;
use crate::image::{Format, Picture, linear};
use crate::output::{Contents, Metadata};

/// Seventeenths of the colour map "magma" by N. Smith and S. van der Walt (CC0), whose steps look
/// equally large; between them it is linear, off by at most 2 of 255 levels.
const MAGMA: [[u8; 3]; 16] = [
    [0, 0, 4],
    [11, 9, 36],
    [32, 17, 75],
    [59, 15, 112],
    [87, 21, 126],
    [114, 31, 129],
    [140, 41, 129],
    [168, 50, 125],
    [196, 60, 117],
    [222, 73, 104],
    [241, 96, 93],
    [250, 127, 94],
    [254, 159, 109],
    [254, 191, 132],
    [253, 222, 160],
    [252, 253, 191],
];

/// Of pixels that are not finite in both images: no colour of the map is near it.
const UNKNOWN: [u8; 3] = [0, 255, 255];

/// The relative error of each pixel as colours from black (none) over red to pale yellow.
#[derive(Clone, Debug)]
pub struct HeatMap {
    /// Columns.
    pub width: u32,
    /// The error of each pixel, a fraction; NaN where unknown.
    pub errors: Vec<f64>,
    /// The error of the brightest colour, a fraction: a round number that 99 % of the errors stay
    /// below.
    pub range: f64,
    /// The share of pixels beyond the range.
    pub beyond: f64,
}

impl HeatMap {
    /// The map of two pictures of the same size.
    #[must_use]
    pub fn of(image: &Picture, reference: &Picture) -> Self {
        Self::new(image.width, error::map(image, reference))
    }

    /// The map of any numbers, row by row.
    #[must_use]
    pub fn new(width: u32, errors: Vec<f64>) -> Self {
        let mut sorted: Vec<f64> = errors.iter().copied().filter(|e| e.is_finite()).collect();
        sorted.sort_by(f64::total_cmp);
        let high = sorted
            .get(sorted.len().saturating_sub(1) * 99 / 100)
            .copied();
        let range = round_up(high.unwrap_or(0.0));
        let beyond = errors.iter().filter(|e| **e > range).count();
        Self {
            width,
            beyond: beyond as f64 / errors.len() as f64,
            errors,
            range,
        }
    }

    /// Its colours.
    #[must_use]
    pub fn picture(&self) -> Picture {
        let colour = |error: &f64| match error.is_nan() {
            true => UNKNOWN,
            false => colour(error / self.range),
        };
        // The encoder takes linear values and gives these levels back.
        let level = |level: u8| linear(f64::from(level) / 255.0) as f32;
        let pixels: Vec<[f32; 3]> = self.errors.iter().map(|e| colour(e).map(level)).collect();
        let height = (pixels.len() / self.width as usize) as u32;
        Picture::new(self.width, height, pixels)
    }

    /// The bytes of a PNG file, whose comment says the range.
    ///
    /// # Errors
    /// If the size is beyond what PNG can hold.
    pub fn encode(&self) -> io::Result<Vec<u8>> {
        let contents = Contents {
            picture: &self.picture(),
            layers: &[],
            metadata: &Metadata::new()
                .with(
                    "shows",
                    "relative error of each pixel, as gpu-trace compare defines it",
                )
                .with("black", 0.0)
                .with("pale_yellow", self.range)
                .with("beyond", self.beyond),
            exposure: 0.0,
        };
        contents.encode(Format::Png)
    }
}

/// The colour of a share of the range; beyond it, the last.
#[must_use]
pub fn colour(share: f64) -> [u8; 3] {
    let last = MAGMA.len() - 1;
    let at = share.clamp(0.0, 1.0) * last as f64;
    let low = (at as usize).min(last - 1);
    let blend = |c: usize| {
        let (a, b) = (f64::from(MAGMA[low][c]), f64::from(MAGMA[low + 1][c]));
        (a + (at - low as f64) * (b - a)).round() as u8
    };
    [0, 1, 2].map(blend)
}

/// The next of 1, 2 and 5 times a power of ten, at least 1e-6: below that is rounding.
fn round_up(error: f64) -> f64 {
    let powers = (-6..=308).map(|power| 10f64.powi(power));
    powers
        .flat_map(|power| [1.0, 2.0, 5.0].map(|digit| digit * power))
        .find(|range| *range >= error)
        .unwrap_or(f64::MAX)
}

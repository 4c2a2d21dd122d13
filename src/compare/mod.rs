//! How far an image is from a reference: figures, tests and maps.
//!
//! All of it is in f64 on linear values, unless a measure is one of what is seen: those take the
//! display values, sRGB of the linear ones times 2^exposure, clipped to 0..=1.

mod error;
mod filter;
mod flip;
mod heat;
mod ssim;
mod ztest;

use serde::Serialize;

pub use error::{Bias, Errors};
pub use flip::{DEFAULT_PPD, flip};
pub use heat::{HeatMap, colour as heat_colour};
pub use ssim::ssim;
pub use ztest::{Known, ZTest, ztest};

use crate::error::{Error, Result};
use crate::image::{Picture, srgb};
use crate::input::Input;

/// What the measures of seen differences take for granted.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// EV steps that brighten both images, a factor of 2^exposure.
    pub exposure: f64,
    /// Pixels that an observer sees in a degree: what FLIP depends on.
    pub pixels_per_degree: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            exposure: 0.0,
            pixels_per_degree: DEFAULT_PPD,
        }
    }
}

/// All figures of a comparison. The names are those of the JSON, which users' scripts rely on: add
/// members, but rename and remove none. What is unknown or infinite is `null` there.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// What is not a number.
    pub non_finite: NonFinite,
    /// Relative and absolute errors, over the pixels that are finite in both; `None` without any.
    #[serde(flatten)]
    pub errors: Option<Errors>,
    /// Mean FLIP, 0 to 1; `None` if a pixel is not finite.
    pub flip: Option<f64>,
    /// Mean structural similarity, at most 1; `None` if a pixel is not finite or the image smaller
    /// than 11x11.
    pub ssim: Option<f64>,
    /// The share of the reference's pixels that the display would clip: FLIP and SSIM cannot see
    /// differences in them.
    pub clipped: f64,
    /// The exposure of FLIP and SSIM in EV.
    pub exposure: f64,
    /// The pixels per degree of FLIP.
    pub pixels_per_degree: f64,
    /// The tests against the standard errors; `None` if neither image has such.
    pub z: Option<ZTest>,
}

/// Pixels with a NaN or an infinity in any channel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct NonFinite {
    /// In the image.
    pub image: usize,
    /// In the reference.
    pub reference: usize,
    /// In either.
    pub either: usize,
}

/// Refuses two images that are not of the same: of another size, or, unless `any_scene`, of scenes
/// that both files name and that differ.
///
/// # Errors
/// [`Error::Usage`] with both facts.
pub fn check_same(image: &Input, reference: &Input, any_scene: bool) -> Result<()> {
    let size = |input: &Input| (input.picture.width, input.picture.height);
    let (a, b) = (size(image), size(reference));
    let (path_a, path_b) = (image.path.display(), reference.path.display());
    if a != b {
        return Err(Error::Usage(format!(
            "the sizes differ: {path_a} has {}x{} pixels, {path_b} {}x{}",
            a.0, a.1, b.0, b.1
        )));
    }
    let hash = |input: &Input| input.about.get("scene_hash").cloned();
    let (Some(hash_a), Some(hash_b)) = (hash(image), hash(reference)) else {
        return Ok(());
    };
    if hash_a == hash_b || any_scene {
        return Ok(());
    }
    let named = |input: &Input, hash: &str| {
        let scene = input.about.get("scene").map_or("?", String::as_str);
        let short: String = hash.chars().take(12).collect();
        format!("{} ({})", scene.escape_debug(), short.escape_debug())
    };
    Err(Error::Usage(format!(
        "the scenes differ: {path_a} shows {}, {path_b} {}; --any-scene compares them all the same",
        named(image, &hash_a),
        named(reference, &hash_b)
    )))
}

/// Compares two images of the same size.
///
/// # Panics
/// If the sizes differ: [`check_same`] comes first.
#[must_use]
pub fn compare(image: &Input, reference: &Input, options: &Options) -> Report {
    let (a, b) = (&image.picture, &reference.picture);
    assert_eq!((a.width, a.height), (b.width, b.height), "the sizes");
    let non_finite = NonFinite::of(a, b);
    let gain = options.exposure.exp2();
    let seen = || (non_finite.either == 0).then(|| (clipped(a, gain), clipped(b, gain)));
    let bright = |p: &&[f32; 3]| p.iter().any(|&v| f64::from(v) * gain > 1.0);
    Report {
        width: a.width,
        height: a.height,
        non_finite,
        errors: Errors::of(a, b),
        flip: seen().map(|(a, b)| mean(&flip(&a, &b, options.pixels_per_degree))),
        ssim: seen().and_then(|(a, b)| ssim(&a.luma(), &b.luma(), a.width)),
        clipped: b.pixels.iter().filter(bright).count() as f64 / b.pixels.len() as f64,
        exposure: options.exposure,
        pixels_per_degree: options.pixels_per_degree,
        z: ztest(image, reference),
    }
}

/// Whether a pixel holds numbers only.
fn is_finite(pixel: &[f32; 3]) -> bool {
    pixel.iter().all(|value| value.is_finite())
}

impl NonFinite {
    fn of(image: &Picture, reference: &Picture) -> Self {
        let mut count = Self::default();
        for (a, b) in image.pixels.iter().zip(&reference.pixels) {
            let (a, b) = (!is_finite(a), !is_finite(b));
            count.image += usize::from(a);
            count.reference += usize::from(b);
            count.either += usize::from(a || b);
        }
        count
    }
}

/// Linear values that a display can show, 0..=1.
#[derive(Clone, Debug)]
pub struct Seen {
    /// Columns.
    pub width: usize,
    /// Red, green and blue, row by row.
    pub pixels: Vec<[f64; 3]>,
}

/// What a display shows of a picture that is brightened by `gain`. NaNs become black: ask before.
#[must_use]
pub fn clipped(picture: &Picture, gain: f64) -> Seen {
    let clip = |v: f32| (f64::from(v) * gain).clamp(0.0, 1.0);
    let pixels = picture.pixels.iter().map(|p| p.map(clip)).collect();
    Seen {
        width: picture.width as usize,
        pixels,
    }
}

impl Seen {
    /// Luma: display values (sRGB) weighted as in ITU-R BT.709, whose primaries are those of sRGB.
    #[must_use]
    pub fn luma(&self) -> Vec<f64> {
        let luma = |p: &[f64; 3]| {
            let [r, g, b] = p.map(srgb);
            0.2126 * r + 0.7152 * g + 0.0722 * b
        };
        self.pixels.iter().map(luma).collect()
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

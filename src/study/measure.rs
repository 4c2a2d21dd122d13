//! How far a film is from the reference, and how much of that is the reference's own noise.

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::film::Film;
use crate::input::Input;

/// The share of the mean below which errors are no longer relative to the pixel: as in `compare`.
const FLOOR: f64 = 0.1;

/// The image that errors are measured against.
#[derive(Clone, Debug)]
pub struct Reference {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// The values r, by rows.
    values: Vec<[f64; 3]>,
    /// Their variances, where known.
    variance: Option<Vec<[f64; 3]>>,
    /// (0.1 M)².
    floor: f64,
    /// The mean M over pixels and channels.
    pub mean: f64,
}

/// What the reference's own noise adds to every measured error, on average.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Noise {
    /// To the mean square error: the mean of the values' variances.
    pub mse: f64,
    /// To the mean square relative error.
    pub relmse: f64,
    /// Standard error of what is left of `mse` once it is subtracted: the noise of one reference is
    /// the same in all runs, so that no number of seeds averages it away.
    pub mse_error: f64,
    /// The same of `relmse`.
    pub relmse_error: f64,
}

/// Errors of an image with values m against the reference, its noise still in them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Mean of (m - r)², (W/(sr m²))².
    pub mse: f64,
    /// Mean of (m - r)²/(r² + (0.1 M)²): the square of relRMSE.
    pub relmse: f64,
    /// (mean of m)/(mean of r) - 1.
    pub bias: f64,
}

impl Reference {
    /// The reference in a file.
    ///
    /// # Errors
    /// [`Error::Usage`] if it is black or not finite.
    pub fn new(input: &Input) -> Result<Self> {
        let picture = &input.picture;
        let name = input.path.display();
        let wide = |p: &[f32; 3]| p.map(f64::from);
        let values: Vec<[f64; 3]> = picture.pixels.iter().map(wide).collect();
        if let Some(i) = values.iter().position(|p| !p.iter().all(|v| v.is_finite())) {
            let (x, y) = (i % picture.width as usize, i / picture.width as usize);
            return Err(Error::Usage(format!(
                "the reference {name} is not finite at {x},{y}: no error can be measured against it"
            )));
        }
        let mean = values.iter().flatten().sum::<f64>() / (3 * values.len()) as f64;
        if mean <= 0.0 {
            return Err(Error::Usage(format!(
                "the mean of the reference {name} is {mean}: there is no relative error"
            )));
        }
        let square = |p: &[f32; 3]| p.map(|s| f64::from(s).powi(2));
        let variance = input.stderr.as_ref().map(|s| s.pixels.iter().map(square));
        let variance: Option<Vec<[f64; 3]>> = variance.map(Iterator::collect);
        Ok(Self {
            width: picture.width,
            height: picture.height,
            values,
            // A file may say that it does not know some of its errors.
            variance: variance.filter(|v| v.iter().flatten().all(|v| v.is_finite())),
            floor: (FLOOR * mean).powi(2),
            mean,
        })
    }

    /// What the reference's noise adds to all measured errors; `None` if its file has no standard
    /// errors.
    ///
    /// Channels of a pixel may be wholly correlated, so that their errors add up by size; the
    /// variance of (r - truth)² - s² is 2 s⁴ for a normal r, and little more for an s² of 16 batches
    /// or more.
    #[must_use]
    pub fn noise(&self) -> Option<Noise> {
        let variance = self.variance.as_ref()?;
        let count = (3 * variance.len()) as f64;
        let mut noise = Noise::default();
        for (v, r) in variance.iter().zip(&self.values) {
            let total: f64 = v.iter().sum();
            let relative: f64 = (0..3).map(|c| v[c] / (r[c] * r[c] + self.floor)).sum();
            noise.mse += total;
            noise.relmse += relative;
            noise.mse_error += 2.0 * total * total;
            noise.relmse_error += 2.0 * relative * relative;
        }
        Some(Noise {
            mse: noise.mse / count,
            relmse: noise.relmse / count,
            mse_error: noise.mse_error.sqrt() / count,
            relmse_error: noise.relmse_error.sqrt() / count,
        })
    }

    /// The errors of a film of the same pixels.
    ///
    /// # Errors
    /// [`Error::NonFinite`] if a mean is.
    ///
    /// # Panics
    /// If the film has another number of pixels.
    pub fn measure(&self, film: &Film) -> Result<Measured> {
        assert_eq!(film.rect().pixels(), self.values.len(), "the sizes");
        let mut sums = [0.0; 3];
        for (i, r) in self.values.iter().enumerate() {
            let m = film.mean(i);
            for c in 0..3 {
                let square = (m[c] - r[c]).powi(2);
                sums[0] += square;
                sums[1] += square / (r[c] * r[c] + self.floor);
                sums[2] += m[c];
            }
        }
        if !sums.iter().all(|s| s.is_finite()) {
            return Err(Error::NonFinite(format!(
                "the image is not finite after {} samples a pixel: there is no error to measure",
                film.samples()
            )));
        }
        let [mse, relmse, mean] = sums.map(|s| s / (3 * self.values.len()) as f64);
        Ok(Measured {
            mse,
            relmse,
            bias: mean / self.mean - 1.0,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compare::Errors;
    use crate::film::{PixelSums, Tally, Window};
    use crate::image::{Format, Picture};
    use crate::input::Encoding;
    use crate::settings::Rect;
    use crate::verify::Random;
    use statrs::distribution::{ContinuousCDF, Normal};
    use std::collections::BTreeMap;

    const SIDE: u32 = 32;

    fn input(values: &[[f64; 3]], stderr: Option<f64>) -> Input {
        let narrow = |p: &[f64; 3]| p.map(|v| v as f32);
        let picture = |pixels| Picture::new(SIDE, SIDE, pixels);
        Input {
            path: "r.exr".into(),
            format: Format::Exr,
            encoding: Encoding::Linear,
            picture: picture(values.iter().map(narrow).collect()),
            stderr: stderr.map(|s| picture(vec![[s as f32; 3]; values.len()])),
            about: BTreeMap::new(),
            notes: Vec::new(),
        }
    }

    fn film(values: &[[f64; 3]]) -> Film {
        let rect = Rect::whole(SIDE, SIDE);
        let pixel = |v: &[f64; 3]| PixelSums {
            sum: *v,
            m2: [0.0; 3],
        };
        let mut film = Film::new(rect);
        film.add(&Window {
            image: Vec::new(),
            rect,
            samples: 0..1,
            batch: 4,
            aovs: Vec::new(),
            pixels: values.iter().map(pixel).collect(),
            tally: Tally::default(),
        });
        film
    }

    fn noisy(truth: &[[f64; 3]], sigma: f64, random: &mut Random) -> Vec<[f64; 3]> {
        let normal = Normal::standard();
        let mut deviate = || normal.inverse_cdf(random.unit() + 1.0e-9);
        truth
            .iter()
            .map(|p| p.map(|v| v + sigma * deviate()))
            .collect()
    }

    fn truth() -> Vec<[f64; 3]> {
        (0..SIDE * SIDE)
            .map(|i| [0.2, 1.0, 3.0].map(|v| v * (1.0 + f64::from(i % SIDE))))
            .collect()
    }

    #[test]
    fn relrmse_is_that_of_compare() {
        let truth = truth();
        let image = noisy(&truth, 0.3, &mut Random::new("measure"));
        let reference = input(&truth, None);
        let measured = Reference::new(&reference)
            .and_then(|r| r.measure(&film(&image)))
            .expect("finite");
        let errors = Errors::of(&input(&image, None).picture, &reference.picture).expect("finite");
        // The picture is rounded to f32.
        assert!((measured.relmse.sqrt() / errors.relrmse - 1.0).abs() < 1.0e-5);
        assert!((measured.mse / errors.mse - 1.0).abs() < 1.0e-5);
        assert!((measured.bias - errors.bias.overall.expect("light")).abs() < 1.0e-6);
    }

    /// The mean over pixels of the error's square is that against the truth once the noise of the
    /// reference is subtracted, within its stated error; without that it is not.
    #[test]
    fn the_noise_of_the_reference_can_be_subtracted() {
        let truth = truth();
        let mut worst: f64 = 0.0;
        for trial in 0..20 {
            let random = &mut Random::new(&format!("noise {trial}"));
            let (sigma, image_sigma) = (0.2, 0.1);
            let reference = input(&noisy(&truth, sigma, random), Some(sigma));
            let reference = Reference::new(&reference).expect("a reference");
            let noise = reference.noise().expect("known");
            assert!(
                (noise.mse / sigma.powi(2) - 1.0).abs() < 1.0e-5,
                "{noise:?}"
            );
            let image = noisy(&truth, image_sigma, random);
            let measured = reference.measure(&film(&image)).expect("finite");
            // The image's own noise, its cross term with the reference's, and the reference's, which
            // are independent.
            let count = f64::from(3 * SIDE * SIDE);
            let own = 2.0 * image_sigma.powi(4) / count;
            let cross = 4.0 * (image_sigma * sigma).powi(2) / count;
            let error = (own + cross + noise.mse_error.powi(2)).sqrt();
            let off = measured.mse - noise.mse - image_sigma.powi(2);
            worst = worst.max(off.abs() / error);
            assert!(
                (measured.mse - image_sigma.powi(2)) / error > 5.0,
                "a companion"
            );
        }
        // Of 20 normal deviates, 4.1 is exceeded once in a thousand times; the stated error is an upper
        // bound here, where channels are independent.
        assert!(worst < 4.1, "{worst}");
    }

    #[test]
    fn references_that_say_nothing_are_refused() {
        let black = vec![[0.0; 3]; 1024];
        assert!(Reference::new(&input(&black, None)).is_err());
        let mut hole = truth();
        hole[35][1] = f64::NAN;
        let error = Reference::new(&input(&hole, None)).expect_err("a hole");
        assert!(error.to_string().contains("at 3,1"), "{error}");
    }
}

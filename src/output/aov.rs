//! What an EXR file can hold beside the image (`--aov`), and its values.

use super::Layer;
use crate::film::{AovSums, Estimate, Film, LightClass};
use crate::image::exr::{RGB, STDERR};

/// A layer, by its name in the file and on the command line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Aov {
    /// The standard error of each value, in its unit; not a number where it is unknown.
    Stderr,
    /// Samples of the pixel.
    Samples,
    /// The image's light that is seen itself.
    Emission,
    /// The image's light from what lights shine on directly.
    Direct,
    /// The image's light that goes from one diffuse surface to another.
    Indirect,
    /// The image's light that is seen in mirrors and glass.
    Specular,
    /// The image's light on diffuse surfaces that comes from mirrors or through glass.
    Caustic,
    /// Mean unit normal of what is seen first, on the viewer's side; 0 where nothing is seen.
    Normal,
    /// Mean colour of what is seen first: albedo or reflectance, 1 for glass.
    Albedo,
    /// Mean distance along the view axis of what is seen first, in scene units; infinite where nothing is.
    Depth,
}

impl Aov {
    /// The layer's name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Stderr => STDERR,
            Self::Samples => "samples",
            Self::Emission => "emission",
            Self::Direct => "direct",
            Self::Indirect => "indirect",
            Self::Specular => "specular",
            Self::Caustic => "caustic",
            Self::Normal => "normal",
            Self::Albedo => "albedo",
            Self::Depth => "depth",
        }
    }

    /// The names of its channels.
    #[must_use]
    pub fn channels(self) -> &'static [&'static str] {
        match self {
            Self::Samples => &["N"],
            Self::Normal => &["X", "Y", "Z"],
            Self::Depth => &["Z"],
            _ => RGB,
        }
    }

    /// The kind of paths whose light it is; `None` if it is not light.
    #[must_use]
    pub fn class(self) -> Option<LightClass> {
        match self {
            Self::Emission => Some(LightClass::Emission),
            Self::Direct => Some(LightClass::Direct),
            Self::Indirect => Some(LightClass::Indirect),
            Self::Specular => Some(LightClass::Specular),
            Self::Caustic => Some(LightClass::Caustic),
            _ => None,
        }
    }

    /// Whether it is about what is seen first.
    #[must_use]
    pub fn is_feature(self) -> bool {
        matches!(self, Self::Normal | Self::Albedo | Self::Depth)
    }

    /// The means of its values in `film`, for pixel `i`.
    fn means(self, film: &Film, i: usize) -> Vec<f32> {
        let none = AovSums::default();
        let sums = film.aovs(i).unwrap_or(&none);
        let mean = |sum: [f64; 3]| sum.map(|x| (x / film.samples_of(i) as f64) as f32).to_vec();
        if let Some(class) = self.class() {
            return mean(sums.classes[class as usize]);
        }
        match self {
            Self::Normal => mean(sums.normal),
            Self::Albedo => mean(sums.albedo),
            Self::Depth if sums.hits == 0.0 => vec![f32::INFINITY],
            Self::Depth => vec![(sums.depth / sums.hits) as f32],
            _ => Vec::new(),
        }
    }
}

/// A layer with its values.
#[derive(Clone, Debug)]
pub struct Plane {
    aov: Aov,
    values: Vec<f32>,
}

impl Plane {
    /// What `film` has of `aov`.
    #[must_use]
    pub fn of(aov: Aov, film: &Film, estimate: &Estimate) -> Self {
        let pixels = 0..film.rect().pixels();
        // Of known length, so that no room is left over.
        let mut values = Vec::with_capacity(aov.channels().len() * pixels.len());
        match aov {
            Aov::Stderr if Self::stderr_unknown(film, estimate) => {
                values.resize(3 * pixels.len(), f32::NAN);
            }
            Aov::Stderr => values.extend(
                pixels
                    .flat_map(|i| film.variance_of_mean(i).unwrap_or([f64::NAN; 3]))
                    .map(|v| v.sqrt() as f32),
            ),
            Aov::Samples => values.extend(pixels.map(|i| film.samples_of(i) as f32)),
            _ => values.extend(pixels.flat_map(|i| aov.means(film, i))),
        }
        Self { aov, values }
    }

    /// Whether there are no standard errors: too few batches, or an infinite variance, of which the
    /// estimate has no error either. A black image has such, all 0.
    #[must_use]
    pub fn stderr_unknown(film: &Film, estimate: &Estimate) -> bool {
        film.freedom().is_none() || (estimate.error.is_none() && !estimate.is_black())
    }

    /// As the file takes it.
    #[must_use]
    pub fn layer(&self) -> Layer<'_> {
        Layer {
            name: self.aov.name(),
            channels: self.aov.channels(),
            values: &self.values,
        }
    }
}

//! What an EXR file can hold beside the image (`--aov`), and its values.

use super::Layer;
use crate::estimate::Estimate;
use crate::film::Film;

/// A layer, by its name in the file and on the command line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Aov {
    /// The standard error of each value, in its unit; not a number where it is unknown.
    Stderr,
    /// Samples of the pixel.
    Samples,
}

impl Aov {
    /// The layer's name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Stderr => "stderr",
            Self::Samples => "samples",
        }
    }

    /// The names of its channels.
    #[must_use]
    pub fn channels(self) -> &'static [&'static str] {
        match self {
            Self::Stderr => &["R", "G", "B"],
            Self::Samples => &["N"],
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
        let values = match aov {
            Aov::Stderr if Self::stderr_unknown(film, estimate) => {
                vec![f32::NAN; 3 * film.rect().pixels()]
            }
            Aov::Stderr => pixels
                .flat_map(|i| film.variance_of_mean(i).unwrap_or([f64::NAN; 3]))
                .map(|v| v.sqrt() as f32)
                .collect(),
            Aov::Samples => pixels.map(|_| film.samples() as f32).collect(),
        };
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

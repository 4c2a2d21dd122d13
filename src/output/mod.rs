//! What a render leaves behind: images (`.png`, `.exr`, `.npy`), the statistics as JSON, and the
//! progress on stderr.
//!
//! Every target is checked before any work starts ([`check_all`]) and replaced in one step once its
//! content is complete ([`write_all`]), so that neither a typing error nor a full disk costs a
//! render or an older result.

pub mod aov;
pub mod atomic;
pub mod exr;
pub mod metadata;
pub mod npy;
pub mod png;
pub mod progress;
pub mod stats;
mod target;

pub use aov::{Aov, Plane};
pub use exr::Layer;
pub use metadata::{Metadata, Value};
pub use progress::{Progress, ProgressMode, Snapshot};
pub use stats::Stats;
pub use target::{Target, check_all, check_layers};

use std::io;

use crate::error::{Action, Error, Result};
use crate::image::{Format, Picture};

/// Everything that an image file can say about a render. Each format takes what it can hold.
#[derive(Clone, Copy, Debug)]
pub struct Contents<'a> {
    /// The image: all formats.
    pub picture: &'a Picture,
    /// Further channels beside `R G B`, of the same size: EXR only.
    pub layers: &'a [Layer<'a>],
    /// How the image was made: EXR attributes, PNG text; `.npy` has no place for it.
    pub metadata: &'a Metadata,
    /// EV steps that brighten the image, a factor of `2^exposure`: PNG only, the others stay linear.
    pub exposure: f64,
}

impl Contents<'_> {
    /// The bytes of a file.
    ///
    /// # Errors
    /// What the encoder refuses: a size beyond the format's limits, layers of another size than the
    /// picture or with a channel name that is used twice.
    pub fn encode(&self, format: Format) -> io::Result<Vec<u8>> {
        match format {
            Format::Png => png::encode(self.picture, self.exposure, self.metadata),
            Format::Exr => exr::encode(self.picture, self.layers, self.metadata),
            Format::Npy => Ok(npy::encode(self.picture)),
        }
    }
}

/// Writes the render to every target, each in one step.
///
/// # Errors
/// [`Error::File`] for the first target that could not be written; its text also names the others
/// that failed. A failure does not keep the remaining targets from being written: a long render
/// should leave as much as it can.
pub fn write_all(targets: &[Target], contents: &Contents<'_>) -> Result<()> {
    let mut failures = targets.iter().filter_map(|target| {
        let written = contents
            .encode(target.format)
            .and_then(|bytes| atomic::replace(&target.path, &bytes));
        written.err().map(|error| (target, error))
    });
    let Some((first, mut source)) = failures.next() else {
        return Ok(());
    };
    for (target, error) in failures {
        let text = format!("{source}; cannot write {}: {error}", target.path.display());
        source = io::Error::new(source.kind(), text);
    }
    Err(Error::File {
        action: Action::Write,
        path: first.path.clone(),
        source,
    })
}

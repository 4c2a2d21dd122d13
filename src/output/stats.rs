//! What a render did, in numbers: the JSON of `--stats`.

use std::io;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::{Metadata, atomic};
use crate::error::{Action, Error, Result};
pub use crate::film::{NonFinite, Verdict};
pub use crate::ledger::Entry;
pub use crate::render::StoppedBy;
pub use crate::variance::VarianceClass;

/// All that is known of a finished render. The names are those of the JSON, which users' scripts
/// rely on: add members, but rename and remove none.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Stats {
    /// The version of this program.
    pub version: String,
    /// The scene's file as it was typed, or the name of a built-in scene.
    pub scene: String,
    /// Identifies the scene's content.
    pub scene_hash: String,
    /// Selects the random numbers.
    pub seed: u64,
    /// The samples of each pixel that were taken: first, and one past the last.
    pub sample_range: [u64; 2],
    /// Samples per pixel that the image has: their mean, rounded, with adaptive sampling.
    pub spp: u64,
    /// The samples of the pixels that have fewest and most.
    pub spp_range: [u64; 2],
    /// Samples per pixel that decided where the others went, and are in no pixel.
    pub pilot_spp: u64,
    /// Columns of the image.
    pub width: u32,
    /// Rows of the image.
    pub height: u32,
    /// What rendered: `gpu` or `cpu`.
    pub backend: String,
    /// The device that rendered.
    pub device: Device,
    /// The names of the effects in the kernel.
    pub effects: Vec<String>,
    /// The form of the geometry: `baked`, `list` or `bvh`.
    pub geometry: String,
    /// The name of the integrator.
    pub integrator: String,
    /// The name of the sampler.
    pub sampler: String,
    /// The most scattering events of a path.
    pub max_bounces: u32,
    /// Whether diffuse surfaces reflected by values of the radiance cache.
    pub radiance_cache: bool,
    /// Whether vertices looked for images of lamps.
    pub lamp_images: bool,
    /// Whether paths ended by Russian roulette.
    pub roulette: bool,
    /// Where the time went.
    pub seconds: Seconds,
    /// Paths that were started, over all pixels, the pilot's too.
    pub samples: u64,
    /// `samples` over the time of rendering.
    pub paths_per_second: f64,
    /// Rays that were traced, shadow rays too.
    pub rays: u64,
    /// The relative error, a fraction; `null` where unknown.
    pub estimated_error: Option<f64>,
    /// Whether that can be trusted; `null` where it is unknown.
    pub trust: Option<Verdict>,
    /// Degrees of freedom of the pixels' standard errors, for Student's t; `null` where these are
    /// unknown.
    pub degrees_of_freedom: Option<f64>,
    /// Standard errors of the image's mean, by channel, W/(sr m²); `null` where unknown. Where the radiance cache is used,
    /// pixels of a batch are not independent of each other, and these are from the batches' means over the whole image.
    pub mean_stderr: Option<[f64; 3]>,
    /// Whether the variance, and with it the error, is one that samples can show: `finite`,
    /// `heavy-tailed`, or `infinite`, where the error is unknown.
    pub variance: VarianceClass,
    /// Whether no light at all was found, which leaves the error without meaning.
    pub black: bool,
    /// Samples that were not finite; they are in no sum.
    pub non_finite: u64,
    /// The first of these; `null` without any.
    pub first_non_finite: Option<NonFinite>,
    /// What the limit on bounces cut off.
    pub bounce_limit: BounceLimit,
    /// How much light each setting that is not exact took: empty if all are, or were without effect; `null`
    /// if it could not be measured.
    pub ledger: Option<Vec<Entry>>,
    /// What ended the render.
    pub stopped_by: StoppedBy,
    /// What the user was warned of, in order.
    pub warnings: Vec<String>,
}

/// A device as the system names it.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Device {
    /// The product.
    pub name: String,
    /// The interface to it: `vulkan`, `metal`, `dx12`, `gl` or `cpu`.
    pub backend: String,
    /// The driver and its version; empty where there is none.
    pub driver: String,
}

/// Wall-clock times, in seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Seconds {
    /// From the start to the last image.
    pub total: f64,
    /// Loading the scene and opening the device.
    pub setup: f64,
    /// Linking and compiling the kernel.
    pub compile: f64,
    /// Tracing paths.
    pub render: f64,
    /// Measuring what inexact settings took.
    pub ledger: f64,
}

/// Paths that the limit on bounces ended while they could still have found light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct BounceLimit {
    /// How many.
    pub paths: u64,
    /// Their throughput, summed.
    pub throughput: f64,
    /// A bound on the share of the image's energy that they could have brought, a fraction; `null`
    /// where no bound is known.
    pub energy_at_most: Option<f64>,
}

impl Stats {
    /// Indented JSON that ends with a line feed. Numbers that are not finite become `null`.
    ///
    /// # Errors
    /// None that are known: no member can fail to serialise.
    pub fn to_json(&self) -> io::Result<String> {
        let mut json = serde_json::to_string_pretty(self)?;
        json.push('\n');
        Ok(json)
    }

    /// Writes the JSON, all or nothing.
    ///
    /// # Errors
    /// [`Error::File`] if the file cannot be written; an older one is then unchanged.
    pub fn write(&self, path: &Path) -> Result<()> {
        self.to_json()
            .and_then(|json| atomic::replace(path, json.as_bytes()))
            .map_err(|source| Error::File {
                action: Action::Write,
                path: path.to_path_buf(),
                source,
            })
    }

    /// What image files say about how they were made.
    #[must_use]
    pub fn metadata(&self) -> Metadata {
        let [start, end] = self.sample_range;
        let metadata = Metadata::new()
            .with("version", self.version.as_str())
            .with("scene", self.scene.as_str())
            .with("scene_hash", self.scene_hash.as_str())
            .with("seed", self.seed)
            .with("sample_range", format!("{start}..{end}"))
            .with("spp", self.spp)
            .with("integrator", self.integrator.as_str())
            .with("sampler", self.sampler.as_str())
            .with("max_bounces", self.max_bounces)
            .with("device", self.device.name.as_str())
            .with("backend", self.device.backend.as_str())
            .with("seconds", self.seconds.total);
        let metadata = match &self.trust {
            Some(verdict) => metadata.with("trust", verdict.to_string()),
            None => metadata,
        };
        let metadata = match self.mean_stderr.filter(|_| self.radiance_cache) {
            Some([r, g, b]) => metadata.with("mean_stderr", format!("{r} {g} {b}")),
            None => metadata,
        };
        match self.degrees_of_freedom {
            Some(freedom) => metadata.with("degrees_of_freedom", freedom),
            None => metadata,
        }
    }
}

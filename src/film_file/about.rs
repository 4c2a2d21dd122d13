//! The text in a film file: what was rendered, how, and how far.

use std::ops::Range;
use std::time::Duration;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::film::Counts;
use crate::render::StoppedBy;
use crate::sampler::Sampler;
use crate::settings::{GeometryChoice, Integrator, LightSampling, Rect, Settings};

/// The form of the file that this program writes, and the only one that it reads.
pub const FORMAT: u32 = 1;

/// All that a film file says beside its arrays. The names are those of the JSON, which users' scripts rely
/// on: add members, but rename and remove none.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct About {
    /// [`FORMAT`].
    pub format: u32,
    /// The version of the program.
    pub version: String,
    /// Hashes of the kernels that rendered; one, unless parts of several were joined.
    pub kernels: Vec<String>,
    /// The devices that rendered.
    pub devices: Vec<Device>,
    /// What was rendered.
    pub scene: SceneText,
    /// How.
    pub settings: Choices,
    /// What will end it.
    pub goal: Goal,
    /// The sample indices that are in, first and one past the last of each run of them, in order; those of the
    /// pixels that have fewest.
    pub ranges: Vec<[u64; 2]>,
    /// Samples of a pixel, by the step of its tile.
    pub samples: Vec<u64>,
    /// What the film counts.
    pub counts: Counts,
    /// Samples a pixel of the pilot, which are in no sum.
    pub pilot: u64,
    /// The number of samples at which the error is looked at next.
    pub look: u64,
    /// Seconds in the render loop.
    pub seconds: f64,
    /// What ended the render; `null` while it is under way.
    pub stopped_by: Option<StoppedBy>,
    /// What was asked for beside.
    pub command: Command,
}

/// A scene as it was loaded.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SceneText {
    /// Its name.
    pub name: String,
    /// The scene file.
    pub text: String,
    /// The folder of the file, where files are that it names; `null` for a built-in scene.
    pub folder: Option<String>,
    /// Hash of its content.
    pub hash: String,
}

/// A device that rendered.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Device {
    /// `gpu` or `cpu`.
    pub kind: String,
    /// The product.
    pub name: String,
    /// The interface to it.
    pub backend: String,
    /// The driver and its version.
    pub driver: String,
}

/// When a render ends: whichever comes first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Goal {
    /// The first sample index, and one past the last.
    pub samples: [u64; 2],
    /// The error to reach.
    pub error: Option<f64>,
    /// Seconds of rendering.
    pub time: Option<f64>,
}

/// The settings that decide what a sample is: those of parts of one image are the same.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Choices {
    size: [u32; 2],
    /// Left, top, columns, rows.
    crop: [u32; 4],
    seed: u64,
    integrator: String,
    termination: Option<f64>,
    light_sampling: String,
    sampler: String,
    max_bounces: u32,
    roulette: bool,
    offset: String,
    adaptive: bool,
    classes: bool,
    features: bool,
    /// The form of the kernel: parts may differ in it.
    geometry: String,
}

/// What the command that began the render asked for beside samples.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Command {
    /// Images, as absolute paths.
    pub outputs: Vec<String>,
    /// The file of the statistics.
    pub stats: Option<String>,
    /// Layers of EXR files.
    pub layers: Vec<String>,
    /// EV steps of PNG files.
    pub exposure: f64,
    /// The device, as it was named.
    pub device: Option<String>,
    /// Threads of the CPU reference.
    pub threads: Option<u16>,
    /// Whether samples that are not finite are no failure.
    pub allow_non_finite: bool,
}

impl Goal {
    /// What ends a render with these settings.
    #[must_use]
    pub fn of(settings: &Settings) -> Self {
        Self {
            samples: [settings.samples.start, settings.samples.end],
            error: settings.error,
            time: settings.time.map(|time| time.as_secs_f64()),
        }
    }
}

impl Choices {
    /// Those of settings.
    #[must_use]
    pub fn of(settings: &Settings) -> Self {
        let Rect {
            x,
            y,
            width,
            height,
        } = settings.crop;
        Self {
            size: [settings.width, settings.height],
            crop: [x, y, width, height],
            seed: settings.seed,
            integrator: settings.integrator.name().into(),
            termination: match settings.integrator {
                Integrator::Lecture { termination } => Some(termination),
                _ => None,
            },
            light_sampling: settings.light_sampling.name().into(),
            sampler: settings.sampler.name().into(),
            max_bounces: settings.max_bounces,
            roulette: settings.roulette,
            offset: settings.offset.to_string(),
            adaptive: settings.adaptive,
            classes: settings.classes,
            features: settings.features,
            geometry: settings.geometry.name().into(),
        }
    }

    /// The pixels.
    #[must_use]
    pub fn crop(&self) -> Rect {
        let [x, y, width, height] = self.crop;
        Rect {
            x,
            y,
            width,
            height,
        }
    }

    /// Whether pixels have sums beside their light.
    #[must_use]
    pub fn has_layers(&self) -> bool {
        self.classes || self.features
    }

    /// The settings, with what will end the render.
    ///
    /// # Errors
    /// The name that is not known here.
    pub fn settings(&self, goal: &Goal) -> Result<Settings, String> {
        let integrator = named("integrator", &self.integrator, Integrator::ALL, |i| {
            i.name()
        })?;
        let time = goal.time.map(Duration::try_from_secs_f64).transpose();
        let [start, end] = goal.samples;
        Ok(Settings {
            width: self.size[0],
            height: self.size[1],
            crop: self.crop(),
            samples: Range { start, end },
            seed: self.seed,
            max_bounces: self.max_bounces,
            integrator: integrator.with_termination(self.termination.unwrap_or_default()),
            light_sampling: named(
                "light sampling",
                &self.light_sampling,
                LightSampling::ALL,
                |l| l.name(),
            )?,
            sampler: named("sampler", &self.sampler, Sampler::ALL, |s| s.name())?,
            roulette: self.roulette,
            geometry: named("geometry", &self.geometry, GeometryChoice::ALL, |g| {
                g.name()
            })?,
            offset: self
                .offset
                .parse()
                .map_err(|e| format!("its offset: {e}"))?,
            adaptive: self.adaptive,
            classes: self.classes,
            features: self.features,
            error: goal.error,
            time: time.map_err(|e| format!("its time: {e}"))?,
        })
    }

    /// The first setting in which another film differs, with both values; `None` if samples of the two
    /// belong to one image.
    #[must_use]
    pub fn differs(&self, other: &Self) -> Option<[String; 3]> {
        let (here, there) = (value(self), value(other));
        let here = here.as_object()?.iter();
        let (name, (a, b)) = here
            .map(|(name, a)| (name, (a, &there[name])))
            .find(|(name, (a, b))| *name != "geometry" && a != b)?;
        Some([name.replace('_', "-"), a.to_string(), b.to_string()])
    }
}

fn value(choices: &Choices) -> Value {
    // Names and numbers: nothing that JSON cannot hold.
    serde_json::to_value(choices).unwrap_or_default()
}

/// The one of `all` with that name.
fn named<T: Copy>(
    what: &str,
    name: &str,
    all: &[T],
    name_of: impl Fn(&T) -> &str,
) -> Result<T, String> {
    let found = all.iter().find(|one| name_of(one) == name);
    found
        .copied()
        .ok_or_else(|| format!("the {what} {name:?} is not known here"))
}

//! The text in a film file: what was rendered, how, and how far.

use std::ops::Range;
use std::time::Duration;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::scene::SceneRecord;
use crate::backend::BackendKind;
use crate::error::{self, Error};
use crate::film::Counts;
use crate::output::stats::Device;
use crate::render::StoppedBy;
use crate::sampler::Sampler;
use crate::settings::{GeometryChoice, Integrator, LightSampling, Rect, Settings};

/// The form of the file that this program writes, and the only one that it reads.
pub const FORMAT: u32 = 1;

/// No render takes longer, in seconds: some thousand years.
const MOST_SECONDS: f64 = 1e11;

/// Refuses settings whose film no file keeps.
///
/// # Errors
/// [`Error::Usage`] for a view.
pub fn check(settings: &Settings) -> error::Result<()> {
    settings.view.map_or(Ok(()), |view| {
        Err(Error::Usage(format!(
            "--checkpoint keeps light, and --view {} is none",
            view.name()
        )))
    })
}

/// All that a film file says beside its arrays. The names are those of the JSON, which users' scripts rely
/// on: add members, but rename and remove none.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct About {
    /// [`FORMAT`].
    pub format: u32,
    /// What rendered: one, unless others went on or parts were joined.
    pub makers: Vec<Maker>,
    /// What was rendered.
    pub scene: SceneRecord,
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

/// What rendered samples.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Maker {
    /// The version of the program.
    pub version: String,
    /// Hash of the kernel.
    pub kernel: String,
    /// The device's kind.
    pub backend: BackendKind,
    /// The device.
    pub device: Device,
}

impl Maker {
    /// In what this one differs from those before: version, kernel or device, with its own. Samples of both
    /// make one image all the same, for they are of the same paths.
    #[must_use]
    pub fn differs(&self, before: &[Self]) -> Vec<String> {
        let mut new = Vec::new();
        let mut check = |what: &str, own: &str, of: fn(&Self) -> &str| {
            let known = before.iter().map(of).collect::<Vec<_>>();
            if !known.contains(&own) {
                new.push(format!("{what} {own} (before: {})", known.join(", ")));
            }
        };
        check("version", &self.version, |maker| &maker.version);
        check("kernel", &self.kernel, |maker| &maker.kernel);
        check("device", &self.device.name, |maker| &maker.device.name);
        new
    }
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
    /// Absent in files of before it was there.
    #[serde(default)]
    radiance_cache: bool,
    #[serde(default)]
    lamp_images: bool,
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
    /// Seconds between two film files.
    pub checkpoint_every: f64,
}

impl About {
    /// What in it contradicts the rest, or cannot be true of any render.
    pub(super) fn check(&self) -> Result<(), String> {
        self.settings.settings(&self.goal)?;
        let ([x, y, width, height], [across, down]) = (self.settings.crop, self.settings.size);
        let fits =
            |at: u32, length: u32, all: u32| at.checked_add(length).is_some_and(|end| end <= all);
        if !(fits(x, width, across) && fits(y, height, down)) {
            return Err("its crop reaches beyond its image".into());
        }
        let mut last = None;
        for [start, end] in &self.ranges {
            if start >= end || last.is_some_and(|last| *start <= last) {
                return Err("the ranges of its samples are in no order".into());
            }
            last = Some(*end);
        }
        let first = self.ranges.first().map(|range| range[0]);
        if first.is_some_and(|first| first != self.goal.samples[0]) {
            return Err("its first sample is not that of its goal".into());
        }
        if self.samples != self.counts.samples() {
            return Err("its samples are not those of its counts".into());
        }
        let times = [self.seconds, self.command.checkpoint_every];
        if times
            .iter()
            .any(|time| !(0.0..=MOST_SECONDS).contains(time))
        {
            return Err("its seconds are no time".into());
        }
        Ok(())
    }

    /// Time in the render loop.
    #[must_use]
    pub fn elapsed(&self) -> Duration {
        Duration::try_from_secs_f64(self.seconds).unwrap_or_default()
    }
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
    ///
    /// # Errors
    /// Those of [`check`].
    pub fn of(settings: &Settings) -> error::Result<Self> {
        check(settings)?;
        let Rect {
            x,
            y,
            width,
            height,
        } = settings.crop;
        Ok(Self {
            size: [settings.width, settings.height],
            crop: [x, y, width, height],
            seed: settings.seed,
            integrator: settings.integrator.name().into(),
            termination: match settings.integrator {
                Integrator::Lecture { termination } => Some(termination),
                _ => None,
            },
            light_sampling: settings.light_sampling().name().into(),
            sampler: settings.sampler.name().into(),
            max_bounces: settings.max_bounces,
            radiance_cache: settings.radiance_cache,
            lamp_images: settings.lamp_images,
            roulette: settings.has_roulette(),
            offset: settings.offset.to_string(),
            adaptive: settings.adaptive,
            classes: settings.classes,
            features: settings.features,
            geometry: settings.geometry.name().into(),
        })
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
        let sampling = &self.light_sampling;
        let light_sampling = named("light sampling", sampling, LightSampling::ALL, |l| l.name())?;
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
            // The file has what is done, also by an estimator that does nothing of it.
            light_sampling: integrator.samples_lights().then_some(light_sampling),
            sampler: named("sampler", &self.sampler, Sampler::ALL, |s| s.name())?,
            radiance_cache: self.radiance_cache,
            lamp_images: self.lamp_images,
            roulette: (!integrator.is_lecture()).then_some(self.roulette),
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
            view: None,
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

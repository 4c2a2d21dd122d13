//! The options of `render` as they are typed.

use std::ops::Range;
use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, Parser};
use glam::DVec3;

use super::choices::{self, Caching, Estimator, Wanted};
use super::fault::Fault;
use super::values;
use crate::backend::BackendChoice;
use crate::choice::{Choice, Open, choose};
use crate::error::{Error, Result};
use crate::output::{Aov, ProgressMode};
use crate::sampler::Sampler;
use crate::scene::color_map::Map;
use crate::scene::particles::look::Look;
use crate::scene::trajectory::Frames;
use crate::scene::{Loaded, MAX_BOUNCES, Scene, builtin};
use crate::settings::{
    DEFAULT_TERMINATION, GeometryChoice, Integrator, LightSampling, MAXIMUM_SPP, Offset, Rect,
    Settings, View,
};

/// The options of `render`.
#[derive(Clone, Debug, Args)]
#[expect(
    missing_docs,
    reason = "the help text says more: it would show here too"
)]
pub struct RenderArgs {
    #[arg(
        value_name = "SCENE",
        help = "A scene file, a particle file (.pdb, .cif, .xyz, .dump, .data, .csv, .npy, .ply; plain or .gz), or the name of a built-in scene [default: lecture]"
    )]
    pub scene: Option<String>,

    #[arg(
        short,
        long,
        value_name = "FILE",
        help_heading = "Output",
        help = "Image to write: .png, .exr or .npy; may be repeated [default: SCENE.png]"
    )]
    pub output: Vec<PathBuf>,
    #[arg(
        long,
        value_name = "FILE.json",
        help_heading = "Output",
        help = "Write statistics as JSON"
    )]
    pub stats: Option<PathBuf>,
    #[arg(
        long,
        value_name = "LIST",
        value_enum,
        value_delimiter = ',',
        help_heading = "Output",
        hide_possible_values = true,
        help = "Layers of EXR files beside the image, as in stderr,normal: stderr, samples; emission, direct, indirect, specular, caustic (the image by kinds of paths); normal, albedo, depth"
    )]
    pub aov: Vec<Aov>,
    #[arg(
        long, value_name = "EV", value_parser = values::exposure, default_value = "0",
        allow_hyphen_values = true, hide_default_value = true, help_heading = "Output",
        help = "Brighten the PNG by a factor of 2^EV"
    )]
    pub exposure: f64,
    #[arg(
        long,
        value_name = "NAME",
        value_enum,
        hide_possible_values = true,
        help_heading = "Output",
        help = "Show something else than light: bvh-cost, the steps through the tree that a sample takes"
    )]
    pub view: Option<View>,
    #[arg(
        long,
        value_name = "FILE",
        help_heading = "Output",
        help = "Write the kernel as plain WGSL before rendering"
    )]
    pub dump_wgsl: Option<PathBuf>,
    #[arg(
        long,
        value_name = "FILE",
        help_heading = "Output",
        help = "Keep all sums in this new film file: `resume` goes on from there, `merge` joins parts"
    )]
    pub checkpoint: Option<PathBuf>,
    #[arg(
        long, value_name = "TIME", value_parser = values::time, allow_hyphen_values = true,
        requires = "checkpoint", help_heading = "Output",
        help = "How often to write the film file [default: 60s]"
    )]
    pub checkpoint_every: Option<Duration>,
    #[arg(
        long,
        help_heading = "Output",
        help = "Only warn of samples that are not finite; without it they make the render fail"
    )]
    pub allow_non_finite: bool,
    #[arg(
        long,
        value_name = "MODE",
        value_enum,
        default_value = "auto",
        hide_possible_values = true,
        hide_default_value = true,
        help_heading = "Output",
        help = "Progress on stderr: auto (a bar on a terminal), plain, json, none"
    )]
    pub progress: ProgressMode,
    #[arg(
        short,
        long,
        conflicts_with = "verbose",
        help_heading = "Output",
        help = "Say nothing but warnings and errors"
    )]
    pub quiet: bool,
    #[arg(
        short,
        long,
        help_heading = "Output",
        help = "Say more: device, effects, times"
    )]
    pub verbose: bool,

    #[arg(
        long, value_name = "N", value_parser = values::count, allow_negative_numbers = true,
        help_heading = "How long",
        help = "Samples a pixel [default: the scene's, or 256]"
    )]
    pub spp: Option<u64>,
    #[arg(
        long, value_name = "P", value_parser = values::error, allow_hyphen_values = true,
        help_heading = "How long",
        help = "Stop at this estimated error: 1% or 0.01"
    )]
    pub error: Option<f64>,
    #[arg(
        long, value_name = "TIME", value_parser = values::time, allow_hyphen_values = true,
        help_heading = "How long",
        help = "Stop after this time: 30s, 2m, 1h; whichever of --spp, --error and --time comes first"
    )]
    pub time: Option<Duration>,
    #[arg(
        long,
        conflicts_with = "sample_range",
        help_heading = "How long",
        help = "Let 64 samples a pixel, which are then discarded, decide where the others go"
    )]
    pub adaptive: bool,
    #[arg(
        long, value_name = "A..B", value_parser = values::range, conflicts_with = "spp",
        help_heading = "How long",
        help = "Render only the sample indices A up to B - 1: parts average to the whole"
    )]
    pub sample_range: Option<Range<u64>>,

    #[arg(
        long, value_name = "WxH", value_parser = values::size, help_heading = "Image",
        help = "Size of the image [default: the scene's]"
    )]
    pub size: Option<(u32, u32)>,
    #[arg(
        long, value_name = "X,Y,WxH", value_parser = values::crop, help_heading = "Image",
        help = "Render only these pixels of the image"
    )]
    pub crop: Option<Rect>,
    #[arg(
        long,
        value_name = "N",
        value_parser = values::seed,
        allow_negative_numbers = true,
        default_value = "0",
        hide_default_value = true,
        help_heading = "Image",
        help = "Seed of the random numbers [default: 0]"
    )]
    pub seed: u64,

    #[arg(
        long,
        value_name = "NAME",
        value_parser = choices::estimator(),
        default_value = "auto",
        hide_possible_values = true,
        hide_default_value = true,
        help_heading = "Light transport",
        help = "Estimator: path (BSDF and light sampling), bsdf, nee (light sampling alone), lecture (uniform hemisphere, constant p), or auto: path or bsdf, whichever pays on the scene [default: auto]"
    )]
    pub integrator: Estimator,
    #[arg(
        long,
        value_name = "NAME",
        value_enum,
        hide_possible_values = true,
        help_heading = "Light transport",
        help = "Directions to lights: projected (by projected solid angle), or for comparison cone (by solid angle, lights by power) [default: projected]"
    )]
    pub light_sampling: Option<LightSampling>,
    #[arg(
        long,
        value_name = "NAME",
        value_enum,
        default_value = "sobol",
        hide_possible_values = true,
        hide_default_value = true,
        help_heading = "Light transport",
        help = "Sample placement: sobol (scrambled Sobol' sequences) or independent [default: sobol]"
    )]
    pub sampler: Sampler,
    #[arg(
        long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=i64::from(MAX_BOUNCES)),
        allow_negative_numbers = true, help_heading = "Light transport",
        help = "Most scattering events of a path [default: the scene's, or 64]"
    )]
    pub max_bounces: Option<u32>,
    #[arg(
        long,
        value_name = "auto|on|off",
        value_parser = choices::caching(),
        help_heading = "Light transport",
        hide_possible_values = true,
        help = "Let diffuse surfaces reflect by values of cells, drawn anew for every scramble and corrected without bias; auto: where a pilot says that it pays [default: off]"
    )]
    pub radiance_cache: Option<Caching>,
    #[arg(
        long,
        value_name = "on|off",
        value_parser = choices::switch(),
        help_heading = "Light transport",
        hide_possible_values = true,
        help = "Look for images of lamps in smooth mirrors and glass spheres, too, without bias [default: off]"
    )]
    pub lamp_images: Option<bool>,
    #[arg(
        long,
        value_name = "on|off",
        value_parser = choices::switch(),
        help_heading = "Light transport",
        hide_possible_values = true,
        help = "End weak paths early by Russian roulette, without bias [default: on]"
    )]
    pub roulette: Option<bool>,
    #[arg(
        long, value_name = "P", value_parser = values::termination, allow_negative_numbers = true,
        help_heading = "Light transport",
        help = "Probability that the lecture's estimator ends at a vertex [default: 0.2]"
    )]
    pub termination: Option<f64>,

    #[arg(
        long,
        value_name = "MODE",
        default_value = "exact",
        hide_default_value = true,
        help_heading = "Light transport",
        help = "How paths leave a surface: exact, or for comparison none, back:X, out:X (a nudge by X), ulp [default: exact]"
    )]
    pub offset: Offset,

    #[arg(
        long,
        value_name = "NAME",
        value_parser = choices::backend(),
        default_value = "auto",
        hide_possible_values = true,
        hide_default_value = true,
        help_heading = "Device",
        help = "What renders: auto, gpu, or cpu (the f64 reference) [default: auto]"
    )]
    pub backend: Wanted,
    #[arg(
        long,
        value_name = "INDEX|NAME",
        help_heading = "Device",
        help = "Which adapter, as `gpu-trace devices` lists them"
    )]
    pub device: Option<String>,
    #[arg(
        long,
        value_name = "FORM",
        value_enum,
        default_value = "auto",
        hide_possible_values = true,
        hide_default_value = true,
        help_heading = "Device",
        help = "Spheres in the kernel: auto, baked (constants), list (a buffer) or bvh (a tree) [default: auto]"
    )]
    pub geometry: GeometryChoice,
    #[arg(
        long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024),
        allow_negative_numbers = true, help_heading = "Device", help = "Threads of the CPU reference [default: one a core]"
    )]
    pub threads: Option<u16>,
    #[arg(
        long,
        value_name = "COLUMN",
        help_heading = "Particle files",
        help = "What colours the particles: element, or a column [default: element where the file has them]"
    )]
    pub color_by: Option<String>,
    #[arg(
        long,
        value_name = "RADIUS",
        help_heading = "Particle files",
        help = "Their radii: a number, a column, or vdw or covalent, in ångström [default: the column radius, or vdw]"
    )]
    pub radius_by: Option<String>,
    #[arg(
        long,
        value_name = "NAME",
        help_heading = "Particle files",
        value_parser = choices::map(),
        help = "The colour map of a column [default: viridis]"
    )]
    pub map: Option<Map>,
    #[arg(
        long,
        value_name = "R,G,B",
        help_heading = "Particle files",
        value_parser = values::background,
        allow_hyphen_values = true,
        help = "Radiance of the background, and of the light from all around: white, black or R,G,B [default: white]"
    )]
    pub background: Option<DVec3>,
    #[arg(
        long,
        value_name = "A..B..STEP",
        help_heading = "Particle files",
        value_parser = values::frames,
        allow_hyphen_values = true,
        help = "An image for each STEP-th frame of a trajectory from A to B - 1, as in 0..100..10 or 0.. for all; `{frame}` in the names of outputs is its number, `{frame:04}` with zeros before it"
    )]
    pub frames: Option<Frames>,
    #[arg(
        long,
        value_name = "KIND@WINDOW",
        hide = true,
        help = "Let something fail, for tests"
    )]
    pub inject_fault: Option<Fault>,
}

/// The options of `render`, as a command of their own.
#[derive(Parser)]
struct Alone {
    #[command(flatten)]
    render: RenderArgs,
}

impl RenderArgs {
    /// Those of a command line without any.
    pub(super) fn none() -> Result<Self> {
        Alone::try_parse_from(["gpu-trace"])
            .map(|alone| alone.render)
            .map_err(|error| Error::Usage(error.to_string()))
    }

    /// The scene.
    ///
    /// # Errors
    /// Those of [`builtin::resolve_as`], and [`Error::Usage`] if several are asked for.
    pub(super) fn load(&self) -> Result<Loaded> {
        if self.frames.is_some() {
            return Err(Error::Usage("--frames is for `render`".into()));
        }
        builtin::resolve_as(self.scene.as_deref(), &self.look(), None)
    }

    /// How a particle file is shown.
    pub(super) fn look(&self) -> Look {
        Look {
            color_by: self.color_by.clone(),
            radius_by: self.radius_by.clone(),
            map: self.map,
            background: self.background,
        }
    }

    /// The layers, each once.
    pub(super) fn layers(&self) -> Vec<Aov> {
        let mut layers = Vec::new();
        for aov in &self.aov {
            if !layers.contains(aov) {
                layers.push(*aov);
            }
        }
        layers
    }

    /// What should render.
    pub(super) fn backend_choice(&self) -> BackendChoice<'_> {
        BackendChoice {
            kind: self.backend.kind(),
            device: self.device.as_deref(),
            threads: self.threads.map_or(0, usize::from),
        }
    }

    /// The settings for `scene`: the command line wins over the scene, the scene over the defaults.
    ///
    /// # Errors
    /// [`Error::Usage`] for options without meaning beside the others; where the estimator is left to the scene,
    /// those of [`choose`]. Whether the settings can be rendered is for [`prepare`](crate::job::prepare) to say.
    pub fn settings(&self, scene: &Scene) -> Result<Settings> {
        self.decide(scene).map(|(settings, _)| settings)
    }

    /// The same, and where the estimator is left to the scene, why it is the one that it is.
    ///
    /// # Errors
    /// Those of [`settings`](Self::settings).
    pub(super) fn decide(&self, scene: &Scene) -> Result<(Settings, Option<Choice>)> {
        let settings = self.settings_but_integrator(scene)?;
        let open = Open {
            integrator: self.integrator == Estimator::Auto,
            radiance_cache: self.radiance_cache == Some(Caching::Auto),
        };
        let rivals = open.rivals(&settings);
        if rivals.is_empty() {
            return Ok((settings, None));
        }
        let choice = choose(scene, &settings, &rivals)?;
        let settings = choice.candidate.settings(&settings);
        Ok((settings, Some(choice)))
    }

    /// The settings, with `path` where the estimator is left to the scene.
    fn settings_but_integrator(&self, scene: &Scene) -> Result<Settings> {
        self.check_company()?;
        let mut settings = Settings::for_scene(scene);
        if let Some((width, height)) = self.size {
            (settings.width, settings.height) = (width, height);
        }
        settings.crop = self
            .crop
            .unwrap_or(Rect::whole(settings.width, settings.height));
        if let Some(spp) = self.spp {
            settings.samples = 0..spp;
        } else if self.error.is_some() || self.time.is_some() {
            // Only what was asked for ends the render, or a cap.
            settings.samples = 0..MAXIMUM_SPP;
        }
        if let Some(range) = &self.sample_range {
            settings.samples = range.clone();
        }
        let termination = self.termination.unwrap_or(DEFAULT_TERMINATION);
        let integrator = self.integrator.integrator().unwrap_or(Integrator::Path);
        Ok(Settings {
            seed: self.seed,
            max_bounces: self.max_bounces.unwrap_or(settings.max_bounces),
            integrator: integrator.with_termination(termination),
            light_sampling: self.light_sampling,
            radiance_cache: self.radiance_cache == Some(Caching::On),
            lamp_images: self.lamp_images == Some(true),
            roulette: self.roulette,
            sampler: self.sampler,
            geometry: self.geometry,
            view: self.view,
            offset: self.offset,
            adaptive: self.adaptive,
            classes: self.aov.iter().any(|aov| aov.class().is_some()),
            features: self.aov.iter().any(|aov| aov.is_feature()),
            error: self.error,
            time: self.time,
            ..settings
        })
    }

    /// Refuses options that say nothing beside the others.
    fn check_company(&self) -> Result<()> {
        let named = self.integrator.integrator();
        let lecture = named.is_some_and(Integrator::is_lecture);
        if self.termination.is_some() && !lecture {
            return Err(Error::Usage(
                "--termination is the lecture's: add --integrator lecture".into(),
            ));
        }
        self.backend_choice().check()
    }
}

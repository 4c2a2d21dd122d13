//! The options of `converge` as they are typed.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;

use crate::backend::{BackendChoice, BackendKind};
use crate::cli::choices::{self, Wanted};
use crate::cli::values;
use crate::output::ProgressMode;
use crate::sampler::Sampler;
use crate::scene::MAX_BOUNCES;
use crate::settings::{Integrator, Offset};
use crate::study::presets::PRESETS;

/// Examples, and the built-in studies.
pub(in crate::cli) fn after_help() -> String {
    let mut text = String::from("Studies (options that are given beside --study win):\n");
    for preset in &PRESETS {
        text += &format!("  {:<10} {}\n", preset.name, preset.about);
    }
    text + "
Examples:
  gpu-trace converge                                    the lecture's scene, some two minutes
  gpu-trace converge glass --integrators path,bsdf,nee
  gpu-trace converge my.toml --size 320x240 --time 30s -o study
  gpu-trace converge glass --max-bounces 4,64 --reference long.exr
  gpu-trace converge --study cpu-gpu -o cpu-gpu

A series is one combination of the lists, a run is a series with a seed. Errors are measured at
1, 2, 4, ... samples a pixel; their time has setup and compilation in it, but neither the measuring
nor the reference. The directory gets report.html, converge.csv, converge.json, error-time.svg,
error-spp.svg, the reference, and runs.jsonl with every finished run: the same command, or one with
more seeds or series, goes on from there. What was cut short starts again: a run, or the reference."
}

/// The options of `converge`.
#[derive(Clone, Debug, Args)]
pub(in crate::cli) struct ConvergeArgs {
    /// A scene file, or the name of a built-in scene [default: lecture].
    #[arg(value_name = "SCENE")]
    pub(super) scene: Option<String>,
    /// A built-in study: cpu-gpu, precision, lecture or estimators; see below.
    #[arg(long, value_name = "NAME", value_parser = study)]
    pub(super) study: Option<&'static str>,

    /// Estimators: path, bsdf, nee, lecture [default: path,lecture].
    #[arg(
        long,
        alias = "integrator",
        value_name = "LIST",
        value_enum,
        value_delimiter = ',',
        hide_possible_values = true,
        help_heading = "What is compared"
    )]
    pub(super) integrators: Vec<Integrator>,
    /// Sample placements: sobol, independent [default: both].
    #[arg(
        long,
        alias = "sampler",
        value_name = "LIST",
        value_enum,
        value_delimiter = ',',
        hide_possible_values = true,
        help_heading = "What is compared"
    )]
    pub(super) samplers: Vec<Sampler>,
    /// What renders: gpu (f32), cpu (f64), or auto [default: auto].
    #[arg(
        long,
        alias = "backend",
        value_name = "LIST",
        value_parser = choices::backend(),
        value_delimiter = ',',
        hide_possible_values = true,
        help_heading = "What is compared"
    )]
    pub(super) backends: Vec<Wanted>,
    /// How paths leave a surface: exact, none, back:X, out:X, ulp [default: exact].
    #[arg(
        long,
        alias = "offset",
        value_name = "LIST",
        value_delimiter = ',',
        help_heading = "What is compared"
    )]
    pub(super) offsets: Vec<Offset>,
    /// The radiance cache of path with sobol: on, off, or both, as in off,on [default: off].
    #[arg(long, value_name = "LIST", value_parser = choices::switch(), value_delimiter = ',',
          hide_possible_values = true, help_heading = "What is compared")]
    pub(super) radiance_cache: Vec<bool>,
    /// Most scattering events of a path [default: the scene's, or 64].
    #[arg(long, value_name = "LIST", value_delimiter = ',',
          value_parser = clap::value_parser!(u32).range(0..=i64::from(MAX_BOUNCES)),
          allow_negative_numbers = true, help_heading = "What is compared")]
    pub(super) max_bounces: Vec<u32>,
    /// Probability that the lecture's estimator ends at a vertex [default: 0.2].
    #[arg(long, value_name = "P", value_parser = values::termination,
          allow_negative_numbers = true, help_heading = "What is compared")]
    pub(super) termination: Option<f64>,

    /// Runs of each series; intervals need 4 [default: 8].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=10_000),
          allow_negative_numbers = true, help_heading = "How long")]
    pub(super) seeds: Option<u64>,
    /// The first seed [default: 0].
    #[arg(long, value_name = "N", value_parser = values::seed, allow_negative_numbers = true,
          default_value = "0", hide_default_value = true, help_heading = "How long")]
    pub(super) seed: u64,
    /// The most samples a pixel [default: 1024].
    #[arg(long, value_name = "N", value_parser = values::count, allow_negative_numbers = true,
          help_heading = "How long")]
    pub(super) spp: Option<u64>,
    /// The most time of a run: it ends at the last doubling of samples that should fit.
    #[arg(long, value_name = "TIME", value_parser = values::time, allow_hyphen_values = true,
          help_heading = "How long")]
    pub(super) time: Option<Duration>,
    /// Size of the images [default: the scene's, made smaller to 160 pixels on its longer side].
    #[arg(long, value_name = "WxH", value_parser = values::size, help_heading = "How long")]
    pub(super) size: Option<(u32, u32)>,

    /// An image to measure errors against: EXR or NPY, of this scene and size.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["reference_spp", "reference_backend"],
          help_heading = "Reference")]
    pub(super) reference: Option<PathBuf>,
    /// Samples a pixel of the study's own reference [default: 4 times --spp].
    #[arg(long, value_name = "N", value_parser = values::count, allow_negative_numbers = true,
          help_heading = "Reference")]
    pub(super) reference_spp: Option<u64>,
    /// What renders it: gpu or cpu [default: gpu if there is one; cpu in the studies cpu-gpu and precision].
    #[arg(
        long,
        value_name = "NAME",
        value_parser = choices::backend(),
        hide_possible_values = true,
        help_heading = "Reference"
    )]
    pub(super) reference_backend: Option<Wanted>,

    /// Directory for report, plots, figures and runs [default: SCENE-converge, or SCENE-STUDY].
    #[arg(short, long, value_name = "DIR", help_heading = "Output")]
    pub(super) output: Option<PathBuf>,
    /// Remove what an earlier study wrote to the directory, its reference too, and start over.
    #[arg(long, help_heading = "Output")]
    pub(super) fresh: bool,
    /// Brighten the report's images by a factor of 2^EV.
    #[arg(long, value_name = "EV", value_parser = values::exposure, default_value = "0",
          allow_hyphen_values = true, hide_default_value = true, help_heading = "Output")]
    pub(super) exposure: f64,
    /// Progress on stderr: auto (a bar on a terminal), plain, json, none.
    #[arg(
        long,
        value_name = "MODE",
        value_enum,
        default_value = "auto",
        hide_possible_values = true,
        hide_default_value = true,
        help_heading = "Output"
    )]
    pub(super) progress: ProgressMode,
    /// Say nothing but warnings and errors.
    #[arg(short, long, help_heading = "Output")]
    pub(super) quiet: bool,

    /// Which adapter, as `gpu-trace devices` lists them.
    #[arg(long, value_name = "INDEX|NAME", help_heading = "Device")]
    pub(super) device: Option<String>,
    /// Threads of the CPU reference [default: one a core].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024),
          allow_negative_numbers = true, help_heading = "Device")]
    pub(super) threads: Option<u16>,
}

impl ConvergeArgs {
    /// How a device is opened.
    pub(super) fn choice(&self, wanted: Wanted) -> BackendChoice<'_> {
        BackendChoice {
            kind: wanted.kind(),
            // Of several backends those that have devices.
            device: self
                .device
                .as_deref()
                .filter(|_| wanted.kind() != Some(BackendKind::Cpu)),
            threads: self.threads.map_or(0, usize::from),
        }
    }
}

/// The name of a built-in study.
fn study(text: &str) -> Result<&'static str, String> {
    let found = PRESETS.iter().map(|p| p.name).find(|name| *name == text);
    found.ok_or_else(|| {
        let names: Vec<&str> = PRESETS.iter().map(|p| p.name).collect();
        format!("there are {}", names.join(", "))
    })
}

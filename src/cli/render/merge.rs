//! `gpu-trace merge`: the film files of parts become one image.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::Args;

use super::checkpoint::check_new;
use super::resume::layers;
use super::statistics::statistics;
use super::summary::{no_stderr, not_finite, observations};
use super::{Request, finish};
use crate::backend::BackendKind;
use crate::cli::args::RenderArgs;
use crate::cli::values;
use crate::error::{Error, Result};
use crate::film_file::join::{Part, join};
use crate::film_file::{self, FilmFile};
use crate::job::prepare;
use crate::output::stats::{Device, Seconds};
use crate::output::{Progress, ProgressMode, Stats, Target, check_all};
use crate::render::{Outcome, StoppedBy, estimate};

/// The options of `merge`.
#[derive(Clone, Debug, Args)]
pub(crate) struct MergeArgs {
    /// Film files of one scene and one set of options, with other samples each, in any order
    #[arg(value_name = "PART", required = true)]
    parts: Vec<PathBuf>,
    /// Image to write: .png, .exr or .npy; may be repeated
    #[arg(
        short,
        long,
        value_name = "OUT",
        required_unless_present = "checkpoint"
    )]
    output: Vec<PathBuf>,
    /// Write all sums to this new film file
    #[arg(long, value_name = "FILE")]
    checkpoint: Option<PathBuf>,
    /// Write statistics as JSON
    #[arg(long, value_name = "FILE.json")]
    stats: Option<PathBuf>,
    /// Take parts between which samples are missing
    #[arg(long)]
    allow_gaps: bool,
    /// Brighten the PNG by a factor of 2^EV
    #[arg(long, value_name = "EV", value_parser = values::exposure, default_value = "0",
          allow_hyphen_values = true, hide_default_value = true)]
    exposure: f64,
    /// Only warn of samples that are not finite
    #[arg(long)]
    allow_non_finite: bool,
    /// Say nothing but warnings and errors
    #[arg(short, long)]
    quiet: bool,
}

/// Runs `merge`.
pub(crate) fn run(args: &MergeArgs) -> Result<()> {
    let begin = Instant::now();
    let targets = args.output.iter().map(Target::parse);
    let targets: Vec<Target> = targets.collect::<Result<_>>()?;
    let mut outputs: Vec<&Path> = targets.iter().map(|t| t.path.as_path()).collect();
    outputs.extend(args.stats.as_deref());
    outputs.extend(args.checkpoint.as_deref());
    if let Some(path) = &args.checkpoint {
        check_new(path)?;
    }
    let inputs: Vec<&Path> = args.parts.iter().map(PathBuf::as_path).collect();
    check_all(&outputs, &inputs)?;

    let part = |path: &PathBuf| {
        let name = path.display().to_string();
        film_file::read(path).map(|file| Part { name, file })
    };
    let parts = args.parts.iter().map(part).collect::<Result<Vec<_>>>()?;
    let file = join(parts, args.allow_gaps)?;
    let loaded = file.scene()?;
    let FilmFile { about, film } = file;
    let settings = about.settings.settings(&about.goal).map_err(Error::Usage)?;
    let job = prepare(&loaded.scene, &settings)?;
    let saved = match &args.checkpoint {
        Some(path) => film_file::write(path, &about, &film),
        None => Ok(()),
    };
    let outcome = Outcome {
        estimate: estimate(&film, job.claims().has_error_bars()),
        film,
        pilot: about.pilot,
        stopped_by: about.stopped_by.unwrap_or(StoppedBy::Interrupt),
        elapsed: Duration::try_from_secs_f64(about.seconds).unwrap_or_default(),
        failure: None,
    };
    let render = RenderArgs {
        stats: args.stats.clone(),
        aov: layers(&about.command),
        exposure: args.exposure,
        quiet: args.quiet,
        checkpoint: args.checkpoint.clone(),
        ..RenderArgs::none()?
    };
    let mut warnings = Vec::new();
    if about.kernels.len() > 1 {
        let kernels = about.kernels.join(", ");
        warnings.push(format!("the parts are of several kernels: {kernels}"));
    }
    if let [first, .., last] = about.ranges[..] {
        warnings.push(format!(
            "samples are missing between {} and {}",
            first[0], last[1]
        ));
    }
    warnings.extend(observations(&outcome, &settings));
    warnings.extend(no_stderr(&render, &outcome));
    warnings.extend(not_finite(&outcome).filter(|_| args.allow_non_finite));
    let progress = Progress::new(ProgressMode::None, args.quiet);
    for warning in &warnings {
        progress.warning(warning);
    }
    let request = Request {
        loaded,
        job,
        targets,
        begun: None,
    };
    let kind = about.devices.first().map(|device| device.kind.as_str());
    let kind = kind.and_then(BackendKind::of_name);
    let names = |of: fn(&film_file::Device) -> &String| {
        let mut names: Vec<&str> = about.devices.iter().map(|d| of(d).as_str()).collect();
        names.dedup();
        names.join(" and ")
    };
    let device = Device {
        name: names(|d| &d.name),
        backend: names(|d| &d.backend),
        driver: names(|d| &d.driver),
    };
    let kind = kind.unwrap_or(BackendKind::Cpu);
    let stats = statistics(&request.loaded, &request.job, &outcome, kind, device);
    let stats = Stats {
        seconds: Seconds {
            total: begin.elapsed().as_secs_f64(),
            render: about.seconds,
            ..Seconds::default()
        },
        // There is a part, and it has samples.
        sample_range: [about.ranges[0][0], about.ranges[about.ranges.len() - 1][1]],
        warnings,
        ..stats
    };
    finish(&render, &request, &outcome, &stats)?;
    saved?;
    match not_finite(&outcome).filter(|_| !args.allow_non_finite) {
        None => Ok(()),
        Some(text) => Err(Error::NonFinite(format!(
            "{text} (--allow-non-finite makes this a warning)"
        ))),
    }
}

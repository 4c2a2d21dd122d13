//! `gpu-trace merge`: the film files of parts become one image.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;

use super::checkpoint::{check_new, command};
use super::resume::{folder_of, layers};
use super::statistics::statistics;
use super::summary::{no_stderr, not_finite, observations};
use super::{Request, check_finite, finish};
use crate::backend::BackendKind;
use crate::cli::args::RenderArgs;
use crate::cli::format::percent;
use crate::cli::values;
use crate::error::{Error, Result};
use crate::film::WINDOW;
use crate::film_file::join::Parts;
use crate::film_file::{self, About, FilmFile, Maker};
use crate::job::prepare;
use crate::ledger;
use crate::memory::{check_memory, joined_pixel_bytes};
use crate::output::stats::{Device, Seconds};
use crate::output::{Progress, ProgressMode, Stats, Target, check_all};
use crate::render::{Outcome, StoppedBy, estimate};
use crate::settings::Settings;

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
    /// The samples that the parts must have together, or they are refused
    #[arg(long, value_name = "A..B", value_parser = values::range, conflicts_with = "allow_gaps")]
    sample_range: Option<Range<u64>>,
    /// Exit with 3 if the estimated error is above this: 1% or 0.01
    #[arg(long, value_name = "P", value_parser = values::error, allow_hyphen_values = true)]
    error: Option<f64>,
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
    let parts = Parts::of(&args.parts, args.allow_gaps)?;
    if let Some(range) = &args.sample_range {
        parts.check_samples(range)?;
    }
    let (about, path) = parts.first();
    let settings = about.settings.settings(&about.goal).map_err(Error::Usage)?;
    // What was to end a part is not what ends the whole.
    let settings = Settings {
        error: None,
        time: None,
        ..settings
    };
    let loaded = about.scene.load(folder_of(path))?;
    let mut inputs = loaded.inputs();
    inputs.extend(args.parts.iter().map(PathBuf::as_path));
    check_outputs(args, &targets, &inputs)?;
    let job = prepare(&loaded.scene, &settings)?;
    check_memory(&settings.crop, joined_pixel_bytes(&settings))?;

    let FilmFile { mut about, film } = parts.join()?;
    let request = Request {
        loaded,
        job,
        targets,
        before: None,
    };
    let render = RenderArgs {
        stats: args.stats.clone(),
        aov: layers(&about.command),
        exposure: args.exposure,
        allow_non_finite: args.allow_non_finite,
        quiet: args.quiet,
        checkpoint: args.checkpoint.clone(),
        ..RenderArgs::none()?
    };
    let saved = args.checkpoint.as_ref().map(|path| {
        about.command = command(&render, &request)?;
        film_file::write(path, &about, &film)
    });
    let outcome = Outcome {
        estimate: estimate(&film, request.job.claims().has_error_bars()),
        film,
        pilot: about.pilot,
        stopped_by: about.stopped_by.unwrap_or(StoppedBy::Interrupt),
        elapsed: about.elapsed(),
        failure: None,
    };
    let mut warnings = joined(&about);
    for setting in ledger::suspected(&settings, &outcome.film) {
        warnings.push(format!(
            "what {setting} took is not measured here: gpu-trace resume measures it for a film file of all \
             (--checkpoint)"
        ));
    }
    warnings.extend(observations(&outcome, &settings));
    warnings.extend(no_stderr(&render, &outcome));
    warnings.extend(not_finite(&outcome).filter(|_| args.allow_non_finite));
    let progress = Progress::new(ProgressMode::None, args.quiet);
    for warning in &warnings {
        progress.warning(warning);
    }
    let kind = about.makers.first().map(|maker| maker.backend);
    let stats = statistics(
        &request.loaded,
        &request.job,
        &outcome,
        kind.unwrap_or(BackendKind::Cpu),
        device(&about.makers),
    );
    let stats = Stats {
        seconds: Seconds {
            total: begin.elapsed().as_secs_f64(),
            render: about.seconds,
            ..Seconds::default()
        },
        sample_range: match about.ranges[..] {
            [first, .., last] => [first[0], last[1]],
            _ => stats.sample_range,
        },
        warnings,
        ..stats
    };
    finish(&render, &request, &outcome, &stats)?;
    saved.transpose()?;
    check_finite(&outcome, args.allow_non_finite)?;
    args.error.map_or(Ok(()), |limit| judge(&stats, limit))
}

/// Whether the error that was asked for is reached.
fn judge(stats: &Stats, limit: f64) -> Result<()> {
    let Some(error) = stats.estimated_error else {
        return Err(Error::Check(format!(
            "the error is unknown: that it is {} at most cannot be said",
            percent(limit)
        )));
    };
    if error <= limit {
        return Ok(());
    }
    // It falls with the root of the samples.
    let wanted = stats.spp as f64 * (error / limit).powi(2);
    Err(Error::Check(format!(
        "the error is {}, above {}: some {} samples a pixel should do; --sample-range {}..B renders those that \
         are missing, and merge takes all parts",
        percent(error),
        percent(limit),
        (wanted as u64).next_multiple_of(WINDOW),
        stats.sample_range[1],
    )))
}

fn check_outputs(args: &MergeArgs, targets: &[Target], inputs: &[&Path]) -> Result<()> {
    let mut outputs: Vec<&Path> = targets.iter().map(|t| t.path.as_path()).collect();
    outputs.extend(args.stats.as_deref());
    outputs.extend(args.checkpoint.as_deref());
    if let Some(path) = &args.checkpoint {
        check_new(path)?;
    }
    check_all(&outputs, inputs)
}

/// What to warn of in how parts were joined.
fn joined(about: &About) -> Vec<String> {
    let mut said = Vec::new();
    for (at, maker) in about.makers.iter().enumerate().skip(1) {
        for other in maker.differs(&about.makers[..at]) {
            said.push(format!("a part is of another {other}"));
        }
    }
    for gap in about.ranges.windows(2) {
        let [from, to] = [gap[0][1], gap[1][0]];
        said.push(format!("the samples {from}..{to} are missing"));
    }
    said
}

/// The devices of all makers as one.
fn device(makers: &[Maker]) -> Device {
    let names = |of: fn(&Device) -> &String| {
        let mut names: Vec<&str> = Vec::new();
        for name in makers.iter().map(|maker| of(&maker.device).as_str()) {
            if !names.contains(&name) {
                names.push(name);
            }
        }
        names.join(" and ")
    };
    Device {
        name: names(|device| &device.name),
        backend: names(|device| &device.backend),
        driver: names(|device| &device.driver),
    }
}

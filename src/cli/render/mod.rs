//! `gpu-trace render`: from a scene file to images.

mod checkpoint;
mod display;
mod merge;
mod resume;
mod statistics;
mod summary;

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use self::checkpoint::Checkpoint;
use self::display::Display;
pub(super) use self::merge::{MergeArgs, run as merge};
use self::resume::Before;
pub(super) use self::resume::{ResumeArgs, run as resume};
use self::statistics::statistics;
use self::summary::{left_out, no_stderr, not_finite, observations, summary};
use super::args::RenderArgs;
use super::fault::Faulty;
use super::print;
use super::signals::Signals;
use crate::backend::{Backend, BackendKind, LEAST_PIXEL_BYTES, check_memory};
use crate::error::{Error, Result};
use crate::gpu::device::Gpu;
use crate::image::{Format, Picture};
use crate::job::{Job, prepare};
use crate::ledger::{self, Entry};
use crate::output::stats::{Device, Seconds};
use crate::output::{
    Contents, Layer, Plane, Progress, Stats, Target, atomic, check_all, write_all,
};
use crate::render::{Keep, Outcome, Renderer, StoppedBy, go_on};
use crate::scene::load::Loaded;
use crate::shader::{Stage, link};

/// Everything about a render that is decided before a device is touched.
struct Request {
    loaded: Loaded,
    job: Job,
    targets: Vec<Target>,
    /// The film file of a render that goes on.
    before: Option<Before>,
}

impl Request {
    /// The images, as they were typed; the film file where there are none.
    fn files(&self, args: &RenderArgs) -> String {
        let mut files: Vec<String> = self.targets.iter().map(ToString::to_string).collect();
        if files.is_empty() {
            files.extend(
                args.checkpoint
                    .iter()
                    .map(|path| path.display().to_string()),
            );
        }
        files.join(", ")
    }
}

/// Runs `render`.
pub(super) fn run(args: &RenderArgs) -> Result<()> {
    let begin = Instant::now();
    perform(args, request(args)?, begin)
}

/// Renders what was decided.
fn perform(args: &RenderArgs, request: Request, begin: Instant) -> Result<()> {
    let job = &request.job;
    let signals = Signals::listen()?;
    let progress = Progress::new(args.progress, args.quiet);
    let bare = |warning: &String| warning.trim_start_matches("warning: ").to_owned();
    let mut warnings: Vec<String> = request.loaded.warnings.iter().map(bare).collect();
    warnings.extend(job.variance().warning.clone());
    warnings.extend(left_out(job.placement()));
    let opening = Instant::now();
    let backend = Backend::open(&args.backend_choice(), &mut warnings)?;
    let opened = opening.elapsed();
    if let Some(path) = &args.dump_wgsl {
        let kernel = link(Stage::Path, job.scene(), job.placement(), job.effects())?;
        write_file(path, kernel.wgsl.as_bytes())?;
    }
    let compiling = Instant::now();
    let mut renderer = renderer(&backend, args, job)?;
    let compile = match backend.kind() {
        BackendKind::Gpu => compiling.elapsed(),
        BackendKind::Cpu => Duration::ZERO,
    };
    let setup = begin.elapsed().saturating_sub(compile);
    let (name, interface, driver) = renderer.device();
    if args.verbose {
        progress.message(&format!(
            "device: {name} ({interface}, {driver}), open in {opened:.2?}"
        ));
        progress.message(&format!(
            "effects: {}",
            job.effects().names().collect::<Vec<_>>().join(", ")
        ));
    }
    let device = Device {
        name,
        backend: interface,
        driver,
    };
    // Once the renderer has its memory, in whose account the film is.
    let begun = request.before.as_ref().map(|before| before.begun(job));
    let begun = begun.transpose()?;
    let finished = begun.as_ref().is_some_and(|b| b.finished.is_some());
    let mut checkpoint = match &args.checkpoint {
        Some(path) if finished => {
            progress.message(&format!("{} is complete: nothing is added", path.display()));
            None
        }
        Some(path) => {
            let kind = backend.kind();
            let about = checkpoint::about(args, &request, kind, &device, &mut warnings)?;
            Some(Checkpoint::new(path, about, &progress))
        }
        None => None,
    };
    for warning in &warnings {
        progress.warning(warning);
    }
    let said = warnings.len();
    let mut watch = Display::new(&progress, &signals, job.settings());
    let keep = checkpoint.as_mut().map(|c| c as &mut dyn Keep);
    let outcome = go_on(renderer.as_mut(), job, &mut watch, begun, keep);
    progress.finish();
    let kept = checkpoint.map_or(Ok(()), |checkpoint| checkpoint.end(&outcome, &mut warnings));
    // Its memory is needed again.
    drop(renderer);
    let auditing = Instant::now();
    let ledger = audit(&backend, job, &outcome, &signals, &mut warnings);
    let auditing = auditing.elapsed();

    warnings.extend(observations(&outcome, job.settings()));
    warnings.extend(no_stderr(args, &outcome));
    if args.allow_non_finite {
        warnings.extend(not_finite(&outcome));
    }
    for warning in &warnings[said..] {
        progress.warning(warning);
    }
    let stats = statistics(&request.loaded, job, &outcome, backend.kind(), device);
    let stats = Stats {
        seconds: Seconds {
            total: begin.elapsed().as_secs_f64(),
            setup: setup.as_secs_f64(),
            compile: compile.as_secs_f64(),
            render: outcome.elapsed.as_secs_f64(),
            ledger: auditing.as_secs_f64(),
        },
        ledger,
        warnings,
        ..stats
    };
    let written = finish(args, &request, &outcome, &stats);
    let is_cut = matches!(
        outcome.stopped_by,
        StoppedBy::Failure | StoppedBy::Interrupt
    );
    let film = args.checkpoint.as_ref();
    if let Some(path) = film.filter(|path| is_cut && path.exists()) {
        progress.message(&format!("gpu-trace resume {} goes on", path.display()));
    }
    if outcome.failure.is_some() || written.is_err() {
        // What is said last is another error.
        if let Err(error) = &kept {
            progress.warning(&error.to_string());
        }
    }
    if let Some(failure) = &outcome.failure {
        return Err(failed(failure, &outcome, &request.files(args), written));
    }
    written?;
    kept?;
    check_finite(&outcome, args.allow_non_finite)?;
    signals
        .code()
        .map_or(Ok(()), |code| Err(Error::Interrupted(code)))
}

/// Makes samples that are not finite a failure, unless that is allowed.
fn check_finite(outcome: &Outcome, allowed: bool) -> Result<()> {
    match not_finite(outcome).filter(|_| !allowed) {
        None => Ok(()),
        Some(text) => Err(Error::NonFinite(format!(
            "{text} (--allow-non-finite makes this a warning)"
        ))),
    }
}

/// A failure in the middle of a render, with what became of the samples before it.
fn failed(failure: &Error, outcome: &Outcome, files: &str, written: Result<()>) -> Error {
    let saved = match (outcome.film.samples(), written) {
        (0, _) => "no samples were done, and no file was changed".to_owned(),
        (spp, Ok(())) => format!("the {spp} samples a pixel done before are in {files}"),
        (_, Err(error)) => error.to_string(),
    };
    Error::Gpu(format!("{failure}; {saved}"))
}

/// Loads and decides everything; checks the outputs. Touches no device and no file.
fn request(args: &RenderArgs) -> Result<Request> {
    let loaded = args.load()?;
    let settings = args.settings(&loaded.scene)?;
    let targets = if args.output.is_empty() {
        vec![Target::parse(format!("{}.png", loaded.name))?]
    } else {
        args.output
            .iter()
            .map(Target::parse)
            .collect::<Result<_>>()?
    };
    if !args.aov.is_empty() && !targets.iter().any(|t| t.format == Format::Exr) {
        return Err(Error::Usage(
            "--aov: only EXR files have room for layers: add an output such as -o image.exr".into(),
        ));
    }
    let mut outputs: Vec<&Path> = targets.iter().map(|t| t.path.as_path()).collect();
    outputs.extend(args.stats.as_deref());
    outputs.extend(args.dump_wgsl.as_deref());
    outputs.extend(args.checkpoint.as_deref());
    if let Some(path) = &args.checkpoint {
        checkpoint::check_new(path)?;
    }
    check_all(&outputs, &loaded.inputs())?;
    let job = prepare(&loaded.scene, &settings)?;
    // What is needed beside is known with the device.
    check_memory(&settings.crop, LEAST_PIXEL_BYTES)?;
    Ok(Request {
        loaded,
        job,
        targets,
        before: None,
    })
}

/// A renderer for the job, which fails as `--inject-fault` says.
fn renderer(backend: &Backend, args: &RenderArgs, job: &Job) -> Result<Box<dyn Renderer>> {
    let renderer = backend.renderer(job)?;
    let Some(fault) = args.inject_fault else {
        return Ok(renderer);
    };
    let device = match backend {
        Backend::Gpu(gpu) => Some(Gpu::clone(gpu)),
        Backend::Cpu { .. } => None,
    };
    Ok(Box::new(Faulty::new(renderer, device, fault)?))
}

/// What inexact settings took from the light, unless the render failed or was interrupted. That it cannot
/// be known is no failure of the render.
fn audit(
    backend: &Backend,
    job: &Job,
    outcome: &Outcome,
    signals: &Signals,
    warnings: &mut Vec<String>,
) -> Option<Vec<Entry>> {
    if matches!(
        outcome.stopped_by,
        StoppedBy::Failure | StoppedBy::Interrupt
    ) {
        return None;
    }
    let go_on = || signals.code().is_none();
    let entries = ledger::audit(backend, job, &outcome.film, &go_on).unwrap_or_else(|error| {
        warnings.push(format!("what inexact settings took is unknown: {error}"));
        None
    });
    warnings.extend(entries.iter().flatten().filter_map(Entry::warning));
    entries
}

/// Writes what there is and prints the summary.
fn finish(args: &RenderArgs, request: &Request, outcome: &Outcome, stats: &Stats) -> Result<()> {
    if outcome.film.samples() == 0 {
        // An empty image would replace an older, better one.
        return match &outcome.failure {
            Some(_) => Ok(()),
            None => print("stopped before the first samples were done; nothing was written\n"),
        };
    }
    let crop = request.job.settings().crop;
    let picture = Picture::new(crop.width, crop.height, outcome.film.pixels());
    let planes: Vec<Plane> = args
        .layers()
        .iter()
        .map(|aov| Plane::of(*aov, &outcome.film, &outcome.estimate))
        .collect();
    let layers: Vec<Layer<'_>> = planes.iter().map(Plane::layer).collect();
    let contents = Contents {
        picture: &picture,
        layers: &layers,
        metadata: &stats.metadata(),
        exposure: args.exposure,
    };
    // The statistics are worth having even if an image cannot be written.
    let written = write_all(&request.targets, &contents);
    if let Some(path) = &args.stats {
        stats.write(path)?;
    }
    written?;
    if args.quiet {
        Ok(())
    } else {
        print(&summary(&request.files(args), stats))
    }
}

fn write_file(path: &Path, bytes: &[u8]) -> Result<()> {
    atomic::write(path, bytes).map_err(|error| match error {
        Error::File { action, source, .. } => Error::File {
            action,
            path: PathBuf::from(path),
            source,
        },
        other => other,
    })
}

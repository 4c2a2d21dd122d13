//! `gpu-trace render`: from a scene file to images.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::args::RenderArgs;
use super::device::open;
use super::fault::Faulty;
use super::format::{percent, significant};
use super::signals::Signals;
use super::{derive, print};
use crate::backend::{Backend, LEAST_PIXEL_BYTES, check_memory};
use crate::effects::Effects;
use crate::error::{Error, Result};
use crate::film::NonFinite;
use crate::gpu::device::Gpu;
use crate::image::{Format, Picture};
use crate::ledger::{self, Entry};
use crate::output::stats::{BounceLimit, Device, Seconds};
use crate::output::{
    Aov, Contents, Layer, Plane, Progress, Snapshot, Stats, Target, atomic, check_all, write_all,
};
use crate::placement::Placement;
use crate::render::{Outcome, Renderer, Status, StoppedBy, Watch, render};
use crate::scene::builtin;
use crate::scene::load::Loaded;
use crate::settings::{MAXIMUM_SPP, Settings};
use crate::shader::{Stage, link};
use crate::variance::{VarianceClass, VarianceReport, energy_cut_at_most, variance_class};

/// Everything about a render that is decided before a device is touched.
struct Job {
    loaded: Loaded,
    settings: Settings,
    placement: Placement,
    effects: Effects,
    variance: VarianceReport,
    targets: Vec<Target>,
}

/// Runs `render`.
pub(super) fn run(args: &RenderArgs) -> Result<()> {
    let begin = Instant::now();
    let job = prepare(args)?;
    let signals = Signals::listen()?;
    let progress = Progress::new(args.progress_mode(), args.quiet);
    let bare = |warning: &String| warning.trim_start_matches("warning: ").to_owned();
    let mut warnings: Vec<String> = job.loaded.warnings.iter().map(bare).collect();
    warnings.extend(job.variance.warning.clone());
    warnings.extend(left_out(&job.placement));
    let opening = Instant::now();
    let backend = open(&args.device_choice(), &mut warnings)?;
    let opened = opening.elapsed();
    if let Some(path) = &args.dump_wgsl {
        let kernel = link(Stage::Path, &job.loaded.scene, &job.placement, &job.effects)?;
        write_file(path, kernel.wgsl.as_bytes())?;
    }
    let compiling = Instant::now();
    let mut renderer = renderer(&backend, args, &job)?;
    let compile = match backend {
        Backend::Gpu(_) => compiling.elapsed(),
        Backend::Cpu { .. } => Duration::ZERO,
    };
    let setup = begin.elapsed().saturating_sub(compile);
    let (name, interface, driver) = renderer.device();
    if args.verbose {
        progress.message(&format!(
            "device: {name} ({interface}, {driver}), open in {opened:.2?}"
        ));
        progress.message(&format!(
            "effects: {}",
            job.effects.names().collect::<Vec<_>>().join(", ")
        ));
    }
    for warning in &warnings {
        progress.warning(warning);
    }
    let said = warnings.len();

    let mut watch = Display::new(&progress, &signals, &job);
    let outcome = render_job(renderer.as_mut(), &job, &mut watch);
    progress.finish();
    // Its memory is needed again.
    drop(renderer);
    let auditing = Instant::now();
    let ledger = audit(&backend, &job, &outcome, &signals, &mut warnings);
    let auditing = auditing.elapsed();

    warnings.extend(observations(&outcome, &job.settings));
    warnings.extend(no_stderr(args, &outcome));
    if args.allow_non_finite {
        warnings.extend(not_finite(&outcome));
    }
    for warning in &warnings[said..] {
        progress.warning(warning);
    }
    let stats = statistics(
        &job,
        &outcome,
        backend.name(),
        Device {
            name,
            backend: interface,
            driver,
        },
    );
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
    let written = finish(args, &job, &outcome, &stats);
    if let Some(failure) = &outcome.failure {
        return Err(failed(failure, &outcome, &job, written));
    }
    written?;
    if let Some(text) = not_finite(&outcome).filter(|_| !args.allow_non_finite) {
        return Err(Error::NonFinite(format!(
            "{text} (--allow-non-finite makes this a warning)"
        )));
    }
    signals
        .code()
        .map_or(Ok(()), |code| Err(Error::Interrupted(code)))
}

/// A failure in the middle of a render, with what became of the samples before it.
fn failed(failure: &Error, outcome: &Outcome, job: &Job, written: Result<()>) -> Error {
    let saved = match (outcome.film.samples(), written) {
        (0, _) => "no samples were done, and no file was changed".to_owned(),
        (spp, Ok(())) => format!(
            "the {spp} samples a pixel done before are in {}",
            job.files()
        ),
        (_, Err(error)) => error.to_string(),
    };
    Error::Gpu(format!("{failure}; {saved}"))
}

/// What to say of samples that were not finite; `None` without any.
fn not_finite(outcome: &Outcome) -> Option<String> {
    let tally = outcome.film.tally();
    (tally.non_finite > 0).then(|| {
        let first = tally.first_non_finite.map_or_else(String::new, place);
        format!(
            "{} samples were not finite and are in no sum; {first}",
            tally.non_finite
        )
    })
}

fn place(first: NonFinite) -> String {
    let [x, y] = first.pixel;
    format!(
        "the first: pixel ({x}, {y}), sample {}, after bounce {}",
        first.sample, first.bounce
    )
}

impl Job {
    /// The images, as they were typed.
    fn files(&self) -> String {
        let files: Vec<String> = self.targets.iter().map(ToString::to_string).collect();
        files.join(", ")
    }
}

/// Loads and decides everything; checks the outputs. Touches no device and no file.
fn prepare(args: &RenderArgs) -> Result<Job> {
    let loaded = builtin::resolve(args.scene.as_deref())?;
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
    check_all(&outputs, args.scene_file().as_slice())?;
    check_memory(&settings.crop, LEAST_PIXEL_BYTES)?;
    let (placement, effects) = derive(&loaded.scene, &settings)?;
    let variance = variance_class(&loaded.scene, &placement, &settings);
    Ok(Job {
        loaded,
        settings,
        placement,
        effects,
        variance,
        targets,
    })
}

/// Renders. Where the variance is infinite no estimate of the error counts, for the stop rule neither.
fn render_job(renderer: &mut dyn Renderer, job: &Job, watch: &mut dyn Watch) -> Outcome {
    if job.variance.class != VarianceClass::Infinite {
        return render(renderer, &job.settings, watch);
    }
    let settings = Settings {
        error: None,
        ..job.settings.clone()
    };
    let mut outcome = render(renderer, &settings, watch);
    outcome.estimate.error = None;
    outcome.estimate.error_at_most = None;
    outcome
}

/// A renderer for the job, which fails as `--inject-fault` says.
fn renderer(backend: &Backend, args: &RenderArgs, job: &Job) -> Result<Box<dyn Renderer>> {
    let scene = &job.loaded.scene;
    let renderer = backend.renderer(scene, &job.placement, &job.effects, &job.settings)?;
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
    let (scene, settings) = (&job.loaded.scene, &job.settings);
    let go_on = || signals.code().is_none();
    ledger::audit(backend, scene, settings, &outcome.film, &go_on).unwrap_or_else(|error| {
        warnings.push(format!("what inexact settings took is unknown: {error}"));
        None
    })
}

/// Spheres of the scene that are not rendered, though nothing is wrong with them.
fn left_out(placement: &Placement) -> Option<String> {
    let [gone, other] = placement.coincident.first()?.map(|i| i + 1);
    Some(match placement.coincident.len() {
        1 => format!("sphere {gone} coincides with sphere {other}, and is left out"),
        count => format!(
            "{count} spheres coincide with others and are left out; the first: sphere {gone}, \
             which is where sphere {other} is"
        ),
    })
}

/// What the user should know about the outcome.
fn observations(outcome: &Outcome, settings: &Settings) -> Vec<String> {
    let mut said = Vec::new();
    if outcome.film.samples() > 0 && outcome.estimate.is_black() {
        said.push("the image is black: no path has found any light".to_owned());
    }
    let pixels = outcome.film.pixels();
    let beyond = pixels.iter().flatten().filter(|x| x.is_infinite()).count();
    if beyond > 0 {
        said.push(format!(
            "{beyond} values are beyond {:.1e}, the largest of f32: they are infinite in the files",
            f32::MAX
        ));
    }
    if let Some(limit) = settings.error
        && outcome.stopped_by == StoppedBy::Spp
    {
        let spp = settings.samples.end - settings.samples.start;
        let unknown = match outcome.estimate.error {
            Some(_) => "",
            None => "; it is unknown",
        };
        said.push(format!(
            "the error of {} was not reached within {spp} samples a pixel{unknown}",
            percent(limit)
        ));
    }
    said
}

/// What to say where standard errors were asked for and are unknown.
fn no_stderr(args: &RenderArgs, outcome: &Outcome) -> Option<String> {
    let asked = args.aov.contains(&Aov::Stderr) && outcome.film.samples() > 0;
    let unknown = asked && Plane::stderr_unknown(&outcome.film, &outcome.estimate);
    unknown.then(|| "the standard errors are unknown: the layer stderr holds no numbers".to_owned())
}

fn statistics(job: &Job, outcome: &Outcome, backend: &str, device: Device) -> Stats {
    let Job {
        loaded,
        settings,
        effects,
        ..
    } = job;
    let film = &outcome.film;
    let samples = film.paths();
    let tally = film.tally();
    let start = settings.samples.start;
    Stats {
        version: env!("CARGO_PKG_VERSION").into(),
        scene: loaded.name.clone(),
        scene_hash: loaded.hash.clone(),
        seed: settings.seed,
        sample_range: [start, start + film.most_samples()],
        spp: film.mean_samples().round() as u64,
        spp_range: [film.samples(), film.most_samples()],
        pilot_spp: outcome.pilot,
        width: settings.crop.width,
        height: settings.crop.height,
        backend: backend.into(),
        device,
        effects: effects.names().map(String::from).collect(),
        geometry: effects.geometry().into(),
        integrator: settings.integrator.name().into(),
        sampler: settings.sampler.name().into(),
        max_bounces: settings.max_bounces,
        roulette: settings.roulette,
        seconds: Seconds::default(),
        samples,
        paths_per_second: samples as f64 / outcome.elapsed.as_secs_f64(),
        rays: tally.rays,
        estimated_error: outcome.estimate.error,
        degrees_of_freedom: outcome.estimate.error.and_then(|_| film.freedom()),
        variance: job.variance.class,
        black: outcome.estimate.is_black(),
        non_finite: tally.non_finite,
        first_non_finite: tally.first_non_finite,
        bounce_limit: BounceLimit {
            paths: tally.cut_paths,
            throughput: tally.cut_throughput,
            energy_at_most: energy_cut_at_most(&loaded.scene, film),
        },
        ledger: None,
        stopped_by: outcome.stopped_by,
        warnings: Vec::new(),
    }
}

/// Writes what there is and prints the summary.
fn finish(args: &RenderArgs, job: &Job, outcome: &Outcome, stats: &Stats) -> Result<()> {
    if outcome.film.samples() == 0 {
        // An empty image would replace an older, better one.
        return match &outcome.failure {
            Some(_) => Ok(()),
            None => print("stopped before the first samples were done; nothing was written\n"),
        };
    }
    let crop = job.settings.crop;
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
    let written = write_all(&job.targets, &contents);
    if let Some(path) = &args.stats {
        stats.write(path)?;
    }
    written?;
    if args.quiet {
        Ok(())
    } else {
        print(&summary(job, stats))
    }
}

/// One line.
fn summary(job: &Job, stats: &Stats) -> String {
    let error = match stats.estimated_error {
        Some(error) => format!("error {}", percent(error)),
        None if stats.black => "black".into(),
        None if stats.variance == VarianceClass::Infinite => {
            "error unknown (infinite variance)".into()
        }
        None if stats.spp < 64 => "error unknown below 64 spp".into(),
        None => "error unknown".into(),
    };
    let stopped = match stats.stopped_by {
        StoppedBy::Spp => "",
        StoppedBy::Error => ", error reached",
        StoppedBy::Time => ", time is up",
        StoppedBy::Interrupt => ", interrupted",
        StoppedBy::Failure => ", failed",
    };
    let [least, most] = stats.spp_range;
    let range = if least < most {
        format!(" ({least} to {most})")
    } else {
        String::new()
    };
    let entries = || stats.ledger.iter().flatten();
    let cut = match stats.bounce_limit.paths {
        0 => String::new(),
        _ if entries().any(|e| e.setting == "max-bounces") => String::new(),
        paths => format!(", max-bounces cut {paths} paths"),
    };
    let taken: String = entries().map(taken).collect();
    let lost = stats.first_non_finite.map_or_else(String::new, |first| {
        format!(
            ", {} samples not finite ({})",
            stats.non_finite,
            place(first)
        )
    });
    format!(
        "{}: {}x{}, {} spp{range}{stopped}, {error}{cut}{taken}{lost}, {:.2} s, {} Mpaths/s on {}\n",
        job.files(),
        stats.width,
        stats.height,
        stats.spp,
        stats.seconds.total,
        significant(stats.paths_per_second * 1.0e-6),
        stats.device.name,
    )
}

/// What the summary says of a setting that is not exact.
fn taken(entry: &Entry) -> String {
    let Entry { setting, value, .. } = entry;
    let (removed, error) = (entry.removed, entry.standard_error);
    if !removed.is_finite() {
        return format!(", what {setting} {value} took is unknown");
    }
    if removed == 0.0 {
        return format!(", {setting} {value} took no light that shows");
    }
    if removed.abs() <= 2.0 * error {
        let most = percent(removed.abs() + 2.0 * error);
        return format!(", {setting} {value} took less than {most} of the light");
    }
    let verb = if removed > 0.0 { "took" } else { "added" };
    let spread = match error < 0.01 * removed.abs() {
        true => String::new(),
        false if error.is_nan() => " (by few pixels)".into(),
        false => format!(" ± {}", percent(error)),
    };
    format!(
        ", {setting} {value} {verb} {}{spread} of the light",
        percent(removed.abs())
    )
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

/// Shows the render loop's status, and asks for signals.
struct Display<'a> {
    progress: &'a Progress,
    signals: &'a Signals,
    pixels: u64,
    spp: Option<u64>,
    time: Option<Duration>,
    error: Option<f64>,
    /// Whether an error can be estimated at all.
    estimable: bool,
    /// Where the current stretch of speed measurement began.
    mark: (Duration, u64),
    rate: f64,
}

impl<'a> Display<'a> {
    fn new(progress: &'a Progress, signals: &'a Signals, job: &Job) -> Self {
        let settings = &job.settings;
        Self {
            progress,
            signals,
            pixels: settings.crop.pixels() as u64,
            // A cap that nobody asked for says nothing about how far the render is.
            spp: Some(settings.samples.end - settings.samples.start).filter(|n| *n != MAXIMUM_SPP),
            time: settings.time,
            error: settings.error,
            estimable: job.variance.class != VarianceClass::Infinite,
            mark: (Duration::ZERO, 0),
            rate: 0.0,
        }
    }
}

impl Watch for Display<'_> {
    fn update(&mut self, status: &Status) {
        let (since, before) = self.mark;
        let stretch = (status.elapsed - since).as_secs_f64();
        if stretch >= 0.5 || self.rate == 0.0 {
            self.rate = (status.paths - before) as f64 / stretch.max(1.0e-9);
            self.mark = (status.elapsed, status.paths);
        }
        let elapsed = status.elapsed.as_secs_f64();
        let error = status.error.filter(|_| self.estimable);
        // The nearest of the stop rules; an error falls with the root of the samples.
        let by_spp = status.paths as f64 / status.total as f64;
        let by_time = self.time.map_or(0.0, |time| elapsed / time.as_secs_f64());
        let by_error = self
            .error
            .zip(error)
            .map_or(0.0, |(want, have)| (want / have).powi(2));
        let fraction = by_spp.max(by_time).max(by_error).min(1.0);
        let remaining = (fraction > 0.0).then(|| elapsed * (1.0 / fraction - 1.0));
        self.progress.update(&Snapshot {
            samples: status.paths,
            spp: status.paths / self.pixels,
            spp_total: self.spp,
            fraction,
            elapsed: status.elapsed,
            remaining: remaining.and_then(|s| Duration::try_from_secs_f64(s).ok()),
            paths_per_second: self.rate,
            error,
        });
    }

    fn interrupted(&self) -> bool {
        self.signals.code().is_some()
    }
}

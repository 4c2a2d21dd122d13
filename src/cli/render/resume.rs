//! `gpu-trace resume`: a render goes on from its film file.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::{Args, ValueEnum as _};

use super::Request;
use super::display::Series;
use super::session::Session;
use crate::backend::{BackendChoice, BackendKind};
use crate::cli::args::RenderArgs;
use crate::cli::choices::{self, Wanted};
use crate::cli::fault::Fault;
use crate::cli::values;
use crate::error::{Error, Result};
use crate::film::{Estimate, Film, LEAST_SAMPLES};
use crate::film_file::{self, About, Command, FilmFile};
use crate::job::{Job, prepare};
use crate::memory::{LEAST_PIXEL_BYTES, check_memory};
use crate::output::{Aov, ProgressMode, Target, check_all};
use crate::render::{Begun, StoppedBy, estimate, has_all};
use crate::settings::{MAXIMUM_SPP, Settings};

/// The options of `resume`.
#[derive(Clone, Debug, Args)]
pub(crate) struct ResumeArgs {
    /// The film file: it is kept up to date.
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Image to write, may be repeated [default: those of the first render]
    #[arg(short, long, value_name = "FILE")]
    output: Vec<PathBuf>,
    /// Write statistics as JSON [default: where the first render did]
    #[arg(long, value_name = "FILE.json")]
    stats: Option<PathBuf>,
    /// Samples a pixel, those in the file among them
    #[arg(long, value_name = "N", value_parser = values::count, allow_negative_numbers = true)]
    spp: Option<u64>,
    /// Stop at this estimated error: 1% or 0.01
    #[arg(long, value_name = "P", value_parser = values::error, allow_hyphen_values = true)]
    error: Option<f64>,
    /// Stop after this time from now; with any of --spp, --error and --time the first render's do not count
    #[arg(long, value_name = "TIME", value_parser = values::time, allow_hyphen_values = true)]
    time: Option<Duration>,
    /// How often to write the film file [default: as the first render]
    #[arg(long, value_name = "TIME", value_parser = values::time, allow_hyphen_values = true)]
    checkpoint_every: Option<Duration>,
    /// What renders: auto, gpu, or cpu [default: what did before]
    #[arg(long, value_name = "NAME", value_parser = choices::backend(), hide_possible_values = true)]
    backend: Option<Wanted>,
    /// Which adapter, as `gpu-trace devices` lists them
    #[arg(long, value_name = "INDEX|NAME")]
    device: Option<String>,
    /// Only warn of samples that are not finite
    #[arg(long)]
    allow_non_finite: bool,
    /// Progress on stderr: auto, plain, json, none
    #[arg(
        long,
        value_name = "MODE",
        value_enum,
        default_value = "auto",
        hide_possible_values = true,
        hide_default_value = true
    )]
    progress: ProgressMode,
    /// Say nothing but warnings and errors
    #[arg(short, long, conflicts_with = "verbose")]
    quiet: bool,
    /// Say more: device, effects, times
    #[arg(short, long)]
    verbose: bool,
    #[arg(long, value_name = "KIND@WINDOW", hide = true)]
    inject_fault: Option<Fault>,
}

/// The film file of a render that goes on.
pub(super) struct Before {
    path: PathBuf,
    /// What it says.
    pub(super) about: About,
    /// Whether something else ends the render now.
    new_goal: bool,
}

/// Runs `resume`.
pub(crate) fn run(args: &ResumeArgs) -> Result<()> {
    let begin = Instant::now();
    let about = film_file::read_about(&args.file)?;
    let shown = args.file.display();
    if about.ranges.len() > 1 {
        return Err(Error::Usage(format!(
            "{shown} has gaps between its samples: render them with --sample-range, and merge"
        )));
    }
    let settings = settings(args, &about).map_err(Error::Usage)?;
    let loaded = about.scene.load(folder_of(&args.file))?;
    let job = prepare(&loaded.scene, &settings)?;
    check_memory(&settings.crop, LEAST_PIXEL_BYTES)?;
    let render = render_args(args, &about)?;
    let targets = render.output.iter().map(Target::parse);
    let targets: Vec<Target> = targets.collect::<Result<_>>()?;
    let mut outputs: Vec<&Path> = targets.iter().map(|t| t.path.as_path()).collect();
    outputs.extend(render.stats.as_deref());
    outputs.push(&args.file);
    check_all(&outputs, &loaded.inputs())?;
    let request = Request {
        loaded,
        job,
        targets,
        before: Some(Before {
            path: args.file.clone(),
            about,
            new_goal: has_new_goal(args),
        }),
    };
    Session::open(&render)?.perform(&render, &request, Series::alone(begin))
}

impl Before {
    /// Reads the sums.
    ///
    /// # Errors
    /// Those of [`film_file::read`].
    pub(super) fn begun(&self, job: &Job) -> Result<Begun> {
        let FilmFile { about, film } = film_file::read(&self.path)?;
        Ok(Begun {
            finished: self.finished(&film, job),
            film,
            pilot: about.pilot,
            look: about.look,
            elapsed: about.elapsed(),
        })
    }

    /// What has ended the render already, if nothing is to be added.
    fn finished(&self, film: &Film, job: &Job) -> Option<StoppedBy> {
        let settings = job.settings();
        if has_all(film, settings) {
            return Some(StoppedBy::Spp);
        }
        if settings
            .time
            .is_some_and(|time| self.about.elapsed() >= time)
        {
            return Some(StoppedBy::Time);
        }
        if !self.new_goal {
            // At a look that the file is past.
            return self.about.stopped_by.filter(|by| *by == StoppedBy::Error);
        }
        let Estimate { error_at_most, .. } = estimate(film, job.claims().has_error_bars());
        let reached = |limit: f64| error_at_most.is_some_and(|error| error <= limit);
        let enough = film.samples() >= LEAST_SAMPLES;
        (enough && settings.error.is_some_and(reached)).then_some(StoppedBy::Error)
    }
}

/// The folder of a film file.
pub(super) fn folder_of(path: &Path) -> &Path {
    path.parent().unwrap_or(Path::new(""))
}

fn has_new_goal(args: &ResumeArgs) -> bool {
    args.spp.is_some() || args.error.is_some() || args.time.is_some()
}

/// The settings in the file, and what ends the render now.
fn settings(args: &ResumeArgs, about: &About) -> Result<Settings, String> {
    let mut settings = about.settings.settings(&about.goal)?;
    if has_new_goal(args) {
        let start = settings.samples.start;
        let spp = args.spp.unwrap_or(MAXIMUM_SPP);
        settings.samples.end = start.saturating_add(spp);
        settings.error = args.error;
        settings.time = args.time.map(|time| about.elapsed().saturating_add(time));
    }
    Ok(settings)
}

/// The options of the render that goes on.
fn render_args(args: &ResumeArgs, about: &About) -> Result<RenderArgs> {
    let Command {
        outputs,
        stats,
        exposure,
        device,
        threads,
        allow_non_finite,
        checkpoint_every,
        ..
    } = about.command.clone();
    let before = about.makers.last().map(|maker| Wanted::Only(maker.backend));
    let backend = args.backend.or(before).unwrap_or(Wanted::Auto);
    let on_gpu = backend != Wanted::Only(BackendKind::Cpu);
    let choice = BackendChoice {
        kind: backend.kind(),
        device: args.device.as_deref(),
        threads: 0,
    };
    choice.check()?;
    Ok(RenderArgs {
        output: match args.output.is_empty() {
            true => outputs.into_iter().map(PathBuf::from).collect(),
            false => args.output.clone(),
        },
        stats: args.stats.clone().or(stats.map(PathBuf::from)),
        aov: layers(&about.command),
        exposure,
        checkpoint: Some(args.file.clone()),
        checkpoint_every: args
            .checkpoint_every
            .or(Duration::try_from_secs_f64(checkpoint_every).ok()),
        allow_non_finite: allow_non_finite || args.allow_non_finite,
        progress: args.progress,
        quiet: args.quiet,
        verbose: args.verbose,
        backend,
        device: args.device.clone().or(device.filter(|_| on_gpu)),
        threads,
        inject_fault: args.inject_fault,
        ..RenderArgs::none()?
    })
}

/// The layers that were asked for, as far as they are known here.
pub(super) fn layers(command: &Command) -> Vec<Aov> {
    let named = command.layers.iter();
    named
        .filter_map(|name| Aov::from_str(name, false).ok())
        .collect()
}

//! `--checkpoint`: the film file of a render, from time to time and at its end.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::Request;
use crate::backend::BackendKind;
use crate::cli::args::RenderArgs;
use crate::error::{Error, Result};
use crate::film::Film;
use crate::film_file::scene::absolute;
use crate::film_file::{self, About, Choices, Command, FORMAT, Goal, Maker, SceneRecord};
use crate::output::Progress;
use crate::output::stats::Device;
use crate::render::{Keep, Outcome, State};
use crate::study::identity::kernel_hash;

/// How often it is written if nobody says.
const EVERY: Duration = Duration::from_secs(60);

/// Refuses a film file that is there: the command that wrote it would begin again, and replace what `resume`
/// goes on from.
pub(super) fn check_new(path: &Path) -> Result<()> {
    let shown = path.display();
    if path.is_file() {
        return Err(Error::Usage(format!(
            "--checkpoint {shown}: the file is there already; gpu-trace resume {shown} goes on from it, \
             or remove it first"
        )));
    }
    if path.exists() {
        let text = format!("--checkpoint {shown}: a film file is a regular file");
        return Err(Error::Usage(text));
    }
    Ok(())
}

/// What the film file says until the render adds to it. Warns of another version, kernel or device than that of a
/// render that goes on.
pub(super) fn about(
    args: &RenderArgs,
    request: &Request,
    backend: BackendKind,
    device: &Device,
    warnings: &mut Vec<String>,
) -> Result<About> {
    let settings = request.job.settings();
    let maker = Maker {
        version: env!("CARGO_PKG_VERSION").into(),
        kernel: kernel_hash(&request.job)?,
        backend,
        device: device.clone(),
    };
    let command = command(args, request)?;
    let goal = Goal::of(settings);
    if let Some(before) = &request.before {
        let mut about = before.about.clone();
        for new in maker.differs(&about.makers) {
            warnings.push(format!("the render goes on with another {new}"));
        }
        if !about.makers.contains(&maker) {
            about.makers.push(maker);
        }
        return Ok(About {
            goal,
            command,
            ..about
        });
    }
    Ok(About {
        format: FORMAT,
        makers: vec![maker],
        scene: SceneRecord::of(&request.loaded)?,
        settings: Choices::of(settings)?,
        goal,
        ranges: Vec::new(),
        samples: Vec::new(),
        counts: Film::new(settings.crop).counts(),
        pilot: 0,
        look: 0,
        seconds: 0.0,
        stopped_by: None,
        command,
    })
}

/// What `resume` takes over of the options.
pub(super) fn command(args: &RenderArgs, request: &Request) -> Result<Command> {
    let targets = request.targets.iter().map(|target| absolute(&target.path));
    Ok(Command {
        outputs: targets.collect::<Result<_>>()?,
        stats: args.stats.as_deref().map(absolute).transpose()?,
        layers: args.layers().iter().map(|l| l.name().into()).collect(),
        exposure: args.exposure,
        device: args.device.clone(),
        threads: args.threads,
        allow_non_finite: args.allow_non_finite,
        checkpoint_every: args.checkpoint_every.unwrap_or(EVERY).as_secs_f64(),
    })
}

/// Keeps the film of a render.
pub(super) struct Checkpoint<'a> {
    path: PathBuf,
    every: Duration,
    last: Instant,
    about: About,
    progress: &'a Progress,
    /// What became of the file at the end; `None` before it, and where the render ended in its pilot.
    end: Option<Result<()>>,
}

impl<'a> Checkpoint<'a> {
    pub(super) fn new(path: &Path, about: About, progress: &'a Progress) -> Self {
        let every = Duration::try_from_secs_f64(about.command.checkpoint_every);
        Self {
            path: path.to_owned(),
            every: every.unwrap_or(EVERY),
            last: Instant::now(),
            about,
            progress,
            end: None,
        }
    }

    fn write(&mut self, state: &State<'_>) -> Result<()> {
        let about = &mut self.about;
        let (film, start) = (state.film, about.goal.samples[0]);
        about.ranges = vec![[start, start + film.samples()]];
        about.counts = film.counts();
        about.samples = about.counts.samples();
        about.pilot = state.pilot;
        about.look = state.look;
        about.seconds = state.elapsed.as_secs_f64();
        about.stopped_by = state.stopped_by;
        film_file::write(&self.path, about, film)
    }

    /// What became of the file at the end of the render.
    pub(super) fn end(self, outcome: &Outcome, warnings: &mut Vec<String>) -> Result<()> {
        if self.end.is_none() && outcome.film.samples() > 0 {
            warnings.push(format!(
                "{} was not written: the samples that decide where the others go are not done",
                self.path.display()
            ));
        }
        self.end.unwrap_or(Ok(()))
    }
}

impl Keep for Checkpoint<'_> {
    fn keep(&mut self, state: &State<'_>) {
        let ends = state.stopped_by.is_some();
        if state.film.samples() == 0 {
            // An older file, or none, says as much.
            self.end = ends.then_some(Ok(()));
            return;
        }
        if !ends && self.last.elapsed() < self.every {
            return;
        }
        let written = self.write(state);
        self.last = Instant::now();
        match written {
            written if ends => self.end = Some(written),
            Ok(()) => {}
            // The next one may succeed.
            Err(error) => self.progress.warning(&error.to_string()),
        }
    }
}

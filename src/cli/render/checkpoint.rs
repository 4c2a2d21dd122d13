//! `--checkpoint`: the film file of a render, from time to time and at its end.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::Request;
use crate::backend::BackendKind;
use crate::cli::args::RenderArgs;
use crate::error::{Error, Result};
use crate::film_file::{self, About, Choices, Command, FORMAT, Goal, SceneText};
use crate::output::Progress;
use crate::output::stats::Device;
use crate::render::{Keep, Outcome, State};
use crate::study::identity::kernel_hash;

/// How often it is written if nobody says.
const EVERY: Duration = Duration::from_secs(60);

/// Refuses a film file that is there: the command that wrote it would begin again, and replace what `resume`
/// goes on from.
pub(super) fn check_new(path: &Path) -> Result<()> {
    if path.is_file() {
        let shown = path.display();
        return Err(Error::Usage(format!(
            "--checkpoint {shown}: the file is there already; gpu-trace resume {shown} goes on from it, \
             or remove it first"
        )));
    }
    if path.exists() {
        return Err(Error::Usage(format!(
            "--checkpoint {}: a film file is a regular file",
            path.display()
        )));
    }
    Ok(())
}

/// What the film file says while nothing is done; `before` is what it said, if the render goes on. Warns of
/// another kernel than before.
pub(super) fn about(
    args: &RenderArgs,
    request: &Request,
    before: Option<About>,
    kind: BackendKind,
    device: &Device,
    warnings: &mut Vec<String>,
) -> Result<About> {
    let (loaded, settings) = (&request.loaded, request.job.settings());
    let device = film_file::Device {
        kind: kind.name().into(),
        name: device.name.clone(),
        backend: device.backend.clone(),
        driver: device.driver.clone(),
    };
    let kernel = kernel_hash(&request.job)?;
    let targets = request.targets.iter().map(|target| absolute(&target.path));
    let command = Command {
        outputs: targets.collect::<Result<_>>()?,
        stats: args.stats.as_deref().map(absolute).transpose()?,
        layers: args.layers().iter().map(|l| l.name().into()).collect(),
        exposure: args.exposure,
        device: args.device.clone(),
        threads: args.threads,
        allow_non_finite: args.allow_non_finite,
    };
    if let Some(mut about) = before {
        if !about.kernels.contains(&kernel) {
            warnings.push(format!(
                "the kernel is another one than that of the samples so far: {kernel}, not {}",
                about.kernels.join(", ")
            ));
            about.kernels.push(kernel);
        }
        if !about.devices.contains(&device) {
            about.devices.push(device);
        }
        about.goal = Goal::of(settings);
        return Ok(About { command, ..about });
    }
    let folder = loaded.folder.as_deref().map(absolute).transpose()?;
    Ok(About {
        format: FORMAT,
        version: env!("CARGO_PKG_VERSION").into(),
        kernels: vec![kernel],
        devices: vec![device],
        scene: SceneText {
            name: loaded.name.clone(),
            text: loaded.text.clone(),
            folder,
            hash: loaded.hash.clone(),
        },
        settings: Choices::of(settings),
        goal: Goal::of(settings),
        ranges: Vec::new(),
        samples: Vec::new(),
        counts: crate::film::Film::new(settings.crop).counts(),
        pilot: 0,
        look: 0,
        seconds: 0.0,
        stopped_by: None,
        command,
    })
}

/// A path that means the same from any folder, as text.
fn absolute(path: &Path) -> Result<String> {
    // Of the file of a scene in this folder, the folder is no path at all.
    let path = if path == Path::new("") {
        Path::new(".")
    } else {
        path
    };
    let absolute = std::path::absolute(path).ok();
    let text = absolute.as_deref().and_then(Path::to_str);
    text.map(String::from).ok_or_else(|| {
        Error::Usage(format!(
            "--checkpoint: the path {} cannot be kept in a film file, which holds Unicode text",
            path.display()
        ))
    })
}

/// Keeps the film of a render.
pub(super) struct Checkpoint<'a> {
    path: PathBuf,
    every: Duration,
    last: Instant,
    about: About,
    progress: &'a super::Progress,
    /// Whether the render has come to its end, and what went wrong there.
    end: Option<Result<()>>,
}

impl<'a> Checkpoint<'a> {
    pub(super) fn new(
        path: &Path,
        every: Option<Duration>,
        about: About,
        progress: &'a Progress,
    ) -> Self {
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
        match self.end {
            Some(written) => written,
            None => {
                if outcome.film.samples() > 0 {
                    let text =
                        "was not written: the samples that decide where the others go are not done";
                    warnings.push(format!("{} {text}", self.path.display()));
                }
                Ok(())
            }
        }
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

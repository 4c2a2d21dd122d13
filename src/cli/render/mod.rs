//! `gpu-trace render`: from a scene file to images.

mod checkpoint;
mod display;
mod frames;
mod merge;
mod resume;
mod session;
mod statistics;
mod summary;
mod view;

use std::path::{Path, PathBuf};
use std::time::Instant;

use self::display::Series;
pub(super) use self::merge::{MergeArgs, run as merge};
use self::resume::Before;
pub(super) use self::resume::{ResumeArgs, run as resume};
use self::session::Session;
use self::summary::{not_finite, summary};
use super::args::RenderArgs;
use super::print;
use crate::error::{Error, Result};
use crate::film_file;
use crate::image::Picture;
use crate::job::{Job, prepare};
use crate::memory::{LEAST_PIXEL_BYTES, check_memory};
use crate::output::{
    Contents, Layer, Plane, Stats, Target, atomic, check_all, check_layers, write_all,
};
use crate::render::Outcome;
use crate::scene::load::Loaded;

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
    if let Some(frames) = args.frames {
        return frames::run(args, frames);
    }
    let begin = Instant::now();
    let request = request(args, args.load()?)?;
    Session::open(args)?.perform(args, &request, Series::alone(begin))
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

/// Decides everything about the render of what was loaded; checks the outputs. Touches no device and no file.
fn request(args: &RenderArgs, loaded: Loaded) -> Result<Request> {
    let settings = args.settings(&loaded.scene)?;
    let targets = if args.output.is_empty() {
        vec![Target::parse(format!("{}.png", loaded.name))?]
    } else {
        args.output
            .iter()
            .map(Target::parse)
            .collect::<Result<_>>()?
    };
    check_layers(&args.aov, &targets)?;
    let mut outputs: Vec<&Path> = targets.iter().map(|t| t.path.as_path()).collect();
    outputs.extend(args.stats.as_deref());
    outputs.extend(args.dump_wgsl.as_deref());
    outputs.extend(args.checkpoint.as_deref());
    if let Some(path) = &args.checkpoint {
        film_file::check(&settings)?;
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
    let written = match args.view {
        None => write_all(&request.targets, &contents),
        Some(view) => view::write(view, &request.targets, &contents),
    };
    if let Some(path) = &args.stats {
        stats.write(path)?;
    }
    written?;
    if args.quiet {
        Ok(())
    } else {
        let shown = args.view.map(|view| view::summary(view, &picture));
        print(&summary(&request.files(args), stats, shown.as_deref()))
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

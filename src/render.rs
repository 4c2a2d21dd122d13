//! The render loop: windows of samples from a renderer into the film until a stop rule holds.

use std::ops::Range;
use std::time::{Duration, Instant};

use crate::error::Result;
use crate::estimate::Estimate;
use crate::film::{Film, Window, window_end};
use crate::settings::{Rect, Settings};

/// Renders windows of samples: the GPU or the CPU reference. What comes after does not know which.
pub trait Renderer {
    /// Name, interface and driver of what renders.
    fn device(&self) -> (String, String, String);

    /// Renders the sample indices `samples` of every pixel of the crop, or fewer if `control` says
    /// so; the window tells how many. The range lies in one window (`film::window_end`).
    ///
    /// # Errors
    /// If the device fails. The film keeps what it has.
    fn render(&mut self, samples: Range<u64>, control: &mut dyn Control) -> Result<Window>;

    /// From now on renders only `crop`, which lies in what the renderer was made for.
    fn show(&mut self, crop: Rect);

    /// Bytes of the device's memory that are allocated for the image and the scene.
    fn device_bytes(&self) -> u64;
}

/// Told of progress by a renderer, and asked whether to go on.
pub trait Control {
    /// Takes note that `paths` more paths are done; says whether to go on.
    fn proceed(&mut self, paths: u64) -> bool;
}

/// What ended a render: whichever came first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum StoppedBy {
    /// All samples were taken.
    Spp,
    /// The error fell to what was asked for.
    Error,
    /// The time was up.
    Time,
    /// The user or the system said so.
    Interrupt,
    /// The renderer failed.
    Failure,
}

/// Where a render is, for a progress display.
#[derive(Clone, Copy, Debug)]
pub struct Status {
    /// Samples of all pixels so far.
    pub paths: u64,
    /// Samples of all pixels if nothing stops it early.
    pub total: u64,
    /// Time since the render began.
    pub elapsed: Duration,
    /// The estimated error so far, if known.
    pub error: Option<f64>,
}

/// What a render loop reports to and asks.
pub trait Watch {
    /// Shows where the render is.
    fn update(&mut self, status: &Status);
    /// Whether a signal asked to stop.
    fn interrupted(&self) -> bool;
}

/// What a render loop leaves.
#[derive(Debug)]
pub struct Outcome {
    /// The sums.
    pub film: Film,
    /// Mean and error.
    pub estimate: Estimate,
    /// Why it ended.
    pub stopped_by: StoppedBy,
    /// Time in the loop.
    pub elapsed: Duration,
    /// What went wrong in the middle, if anything did; the film holds what was done before.
    pub failure: Option<crate::error::Error>,
}

struct Loop<'a> {
    watch: &'a mut dyn Watch,
    begin: Instant,
    deadline: Option<Duration>,
    status: Status,
}

impl Control for Loop<'_> {
    fn proceed(&mut self, paths: u64) -> bool {
        self.status.paths += paths;
        self.status.elapsed = self.begin.elapsed();
        self.watch.update(&self.status);
        !self.watch.interrupted() && self.deadline.is_none_or(|d| self.status.elapsed < d)
    }
}

/// Renders until all samples are done or a stop rule of `settings` holds.
pub fn render(renderer: &mut dyn Renderer, settings: &Settings, watch: &mut dyn Watch) -> Outcome {
    let mut film = Film::new(settings.crop);
    let mut estimate = Estimate::of(&film);
    let pixels = settings.crop.pixels() as u64;
    let total = (settings.samples.end - settings.samples.start).saturating_mul(pixels);
    let begin = Instant::now();
    let status = Status {
        paths: 0,
        total,
        elapsed: Duration::ZERO,
        error: None,
    };
    let mut control = Loop {
        watch,
        begin,
        deadline: settings.time,
        status,
    };
    let mut start = settings.samples.start;
    let mut failure = None;
    let stopped_by = loop {
        if start >= settings.samples.end {
            break StoppedBy::Spp;
        }
        if control.watch.interrupted() {
            break StoppedBy::Interrupt;
        }
        if settings.time.is_some_and(|time| begin.elapsed() >= time) {
            break StoppedBy::Time;
        }
        let window = start..window_end(start, settings.samples.end);
        match renderer.render(window, &mut control) {
            Ok(window) => {
                start = window.samples.end;
                film.add(&window);
            }
            Err(error) => {
                failure = Some(error);
                break StoppedBy::Failure;
            }
        }
        estimate = Estimate::of(&film);
        control.status.error = estimate.error;
        if settings
            .error
            .is_some_and(|limit| estimate.error.is_some_and(|e| e <= limit))
        {
            break StoppedBy::Error;
        }
    };
    Outcome {
        film,
        estimate,
        stopped_by,
        elapsed: begin.elapsed(),
        failure,
    }
}

/// Runs a render loop without display, signals or stop rules: for benchmarks and tests.
///
/// # Errors
/// If the renderer fails.
pub fn render_quietly(renderer: &mut dyn Renderer, settings: &Settings) -> Result<Outcome> {
    struct Quiet;
    impl Watch for Quiet {
        fn update(&mut self, _: &Status) {}
        fn interrupted(&self) -> bool {
            false
        }
    }
    let mut outcome = render(renderer, settings, &mut Quiet);
    match outcome.failure.take() {
        Some(error) => Err(error),
        None => Ok(outcome),
    }
}

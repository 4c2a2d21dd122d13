//! The render loop: windows of samples from a renderer into the film until a stop rule holds.

use std::ops::Range;
use std::time::{Duration, Instant};

use crate::error::Result;
use crate::film::{
    Allocation, BLOCK, Estimate, Film, LEAST_SAMPLES, PILOT_SAMPLES, Tiles, Window, next_look,
    window_end,
};
use crate::job::Job;
use crate::sampler::PILOT;
use crate::settings::{Rect, Settings};

/// Renders windows of samples: the GPU or the CPU reference. What comes after does not know which.
pub trait Renderer {
    /// Name, interface and driver of what renders.
    fn device(&self) -> (String, String, String);

    /// Renders the sample indices `samples` of every pixel of the crop, or fewer if `control` says
    /// so, none if it may be given up; the window tells how many. The range lies in one window (`film::window_end`).
    ///
    /// # Errors
    /// If the device fails. The film keeps what it has.
    fn render(&mut self, samples: Range<u64>, control: &mut dyn Control) -> Result<Window> {
        self.render_tiles(samples, None, control)
    }

    /// The same for some tiles only; `None`: for all. Needs the effect `adaptive`.
    ///
    /// # Errors
    /// If the device fails. The film keeps what it has.
    fn render_tiles(
        &mut self,
        samples: Range<u64>,
        tiles: Option<&Tiles>,
        control: &mut dyn Control,
    ) -> Result<Window>;

    /// From now on renders only `crop`, which lies in the image and is no larger, in both directions, than
    /// what the renderer was made for.
    fn show(&mut self, crop: Rect);

    /// Bytes of the device's memory that are allocated for the image and the scene.
    fn device_bytes(&self) -> u64;
}

/// Told of progress by a renderer, and asked whether to go on.
pub trait Control {
    /// Takes note that `paths` more paths are done; says whether to go on.
    fn proceed(&mut self, paths: u64) -> bool;

    /// Whether there is time for `rest`: of a large image, rendered part by part, the others have to follow
    /// where one went.
    fn has_time(&self, _rest: Duration) -> bool {
        true
    }

    /// Whether a window that has been stopped, but would take the rest of the image to be whole, may be
    /// given up instead.
    fn gives_up(&self) -> bool {
        false
    }
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
    /// Samples a pixel of the pilot, which are not in the film.
    pub pilot: u64,
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
    /// Whether there is an image without the window in progress.
    kept: bool,
}

impl Control for Loop<'_> {
    fn proceed(&mut self, paths: u64) -> bool {
        self.status.paths += paths;
        self.status.elapsed = self.begin.elapsed();
        self.watch.update(&self.status);
        !self.watch.interrupted() && self.has_time(Duration::ZERO)
    }

    fn has_time(&self, rest: Duration) -> bool {
        self.deadline.is_none_or(|d| self.status.elapsed + rest < d)
    }

    fn gives_up(&self) -> bool {
        self.kept && self.watch.interrupted()
    }
}

/// Renders until all samples are done or a stop rule of the job's settings holds. Where its estimator
/// claims no error bars no error is estimated, for the stop rule neither.
pub fn render(renderer: &mut dyn Renderer, job: &Job, watch: &mut dyn Watch) -> Outcome {
    run(
        renderer,
        job.settings(),
        job.claims().has_error_bars(),
        watch,
    )
}

fn run(
    renderer: &mut dyn Renderer,
    settings: &Settings,
    error_bars: bool,
    watch: &mut dyn Watch,
) -> Outcome {
    let pixels = settings.crop.pixels() as u64;
    let spp = settings.samples.end - settings.samples.start;
    let status = Status {
        paths: 0,
        total: spp.saturating_mul(pixels),
        elapsed: Duration::ZERO,
        error: None,
    };
    let mut run = Run {
        renderer,
        settings,
        error_bars,
        control: Loop {
            watch,
            begin: Instant::now(),
            deadline: settings.time,
            status,
            kept: false,
        },
        failure: None,
    };
    let mut film = Film::new(settings.crop);
    let mut pilot = 0;
    let stopped_by = if !settings.adaptive {
        run.fill(&mut film, settings.samples.clone())
    } else if let Err(stopped_by) = run.windows(&mut film, 0, 0..PILOT_SAMPLES.min(spp), PILOT) {
        stopped_by
    } else {
        // The pilot is in no image. Else a tile that it finds dark by chance would get few samples, and
        // stay too dark.
        let left = spp.saturating_sub(PILOT_SAMPLES);
        let allocation = Allocation::of(&film, left as f64 / LEAST_SAMPLES as f64);
        let end = (left as f64 / allocation.mean_weight()) as u64 / BLOCK * BLOCK;
        let mut image = Film::of(allocation);
        let stopped_by = run.fill(&mut image, 0..end);
        // As long as it has fewer samples, the pilot is the better image. What stopped it so early was not
        // what it shows.
        if image.samples() > 0 && image.mean_samples() >= film.mean_samples() {
            pilot = film.samples();
            image.count(film.tally(), film.paths());
            film = image;
        }
        stopped_by
    };
    Outcome {
        estimate: run.estimate(&film),
        film,
        pilot,
        stopped_by,
        elapsed: run.control.begin.elapsed(),
        failure: run.failure,
    }
}

/// A render under way.
struct Run<'a> {
    renderer: &'a mut dyn Renderer,
    settings: &'a Settings,
    /// Whether the spread of samples tells the error.
    error_bars: bool,
    control: Loop<'a>,
    failure: Option<crate::error::Error>,
}

impl Run<'_> {
    fn estimate(&self, film: &Film) -> Estimate {
        let estimate = Estimate::of(film);
        match self.error_bars {
            true => estimate,
            false => Estimate {
                error: None,
                error_at_most: None,
                ..estimate
            },
        }
    }

    /// Fills the film until the pixels of step 0 have the samples of `range`, or a stop rule holds:
    /// those of step s are always 2^s times as far.
    fn fill(&mut self, film: &mut Film, range: Range<u64>) -> StoppedBy {
        let mut start = range.start;
        let mut look = next_look(0);
        let counts = film.allocation().counts();
        while start < range.end {
            let end = window_end(start, range.end);
            for step in (0..film.steps()).filter(|s| counts[usize::from(*s)] > 0) {
                let part = start << step..end << step;
                if let Err(stopped_by) = self.windows(film, step, part, 0) {
                    return stopped_by;
                }
            }
            start = end;
            let estimate = self.estimate(film);
            self.control.status.error = estimate.error;
            // At sample counts that nothing seen so far decides.
            if film.samples() >= look {
                look = next_look(film.samples());
                let reached = |limit| estimate.error_at_most.is_some_and(|e| e <= limit);
                if self.settings.error.is_some_and(reached) {
                    return StoppedBy::Error;
                }
            }
        }
        StoppedBy::Spp
    }

    /// Adds the windows of a range to the pixels of one step; `Err` if something stops that. `origin` is
    /// the index of sample 0.
    fn windows(
        &mut self,
        film: &mut Film,
        step: u8,
        range: Range<u64>,
        origin: u64,
    ) -> std::result::Result<(), StoppedBy> {
        let tiles = film.allocation().tiles(step);
        let mut start = range.start;
        while start < range.end {
            if self.control.watch.interrupted() {
                return Err(StoppedBy::Interrupt);
            }
            let begin = self.control.begin;
            if self.settings.time.is_some_and(|t| begin.elapsed() >= t) {
                return Err(StoppedBy::Time);
            }
            let samples = origin + start..origin + window_end(start, range.end);
            let wanted = samples.end;
            let window = self
                .renderer
                .render_tiles(samples, tiles.as_ref(), &mut self.control);
            match window {
                Ok(window) => {
                    start = window.samples.end - origin;
                    let short = window.samples.end < wanted;
                    film.add_to(step, &window);
                    self.control.kept |= film.samples() > 0;
                    // For want of time, be there some left: windows begin where they always do.
                    if short && !self.control.watch.interrupted() {
                        return Err(StoppedBy::Time);
                    }
                }
                Err(error) => {
                    self.failure = Some(error);
                    return Err(StoppedBy::Failure);
                }
            }
        }
        Ok(())
    }
}

/// Runs a render loop of any renderer without display or signals, and estimates the error as if it could be
/// known: for benchmarks and tests.
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
    let mut outcome = run(renderer, settings, true, &mut Quiet);
    match outcome.failure.take() {
        Some(error) => Err(error),
        None => Ok(outcome),
    }
}

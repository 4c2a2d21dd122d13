//! The render loop: windows of samples from a renderer into the film until a stop rule holds.

mod goal;
mod keep;

use std::ops::Range;
use std::time::{Duration, Instant};

use crate::error::Result;
use crate::film::{
    Allocation, Estimate, Film, LEAST_SAMPLES, PILOT_SAMPLES, Tiles, Window, next_look, window_end,
};
use crate::job::Job;
use crate::sampler::PILOT;
use crate::settings::{Rect, Settings};

use goal::end_of;
pub(crate) use goal::{estimate, has_all};
pub use keep::{Begun, Keep, State, StoppedBy};

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
    /// Time that the render has taken before.
    before: Duration,
    deadline: Option<Duration>,
    status: Status,
    /// Whether there is an image without the window in progress.
    kept: bool,
}

impl Loop<'_> {
    fn elapsed(&self) -> Duration {
        self.before + self.begin.elapsed()
    }
}

impl Control for Loop<'_> {
    fn proceed(&mut self, paths: u64) -> bool {
        self.status.paths += paths;
        self.status.elapsed = self.elapsed();
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
    go_on(renderer, job, watch, None, None)
}

/// The same from where a render is, if it has begun; it is kept from time to time.
pub fn go_on<'a>(
    renderer: &'a mut dyn Renderer,
    job: &'a Job,
    watch: &'a mut dyn Watch,
    begun: Option<Begun>,
    keep: Option<&'a mut dyn Keep>,
) -> Outcome {
    let error_bars = job.claims().has_error_bars();
    run(renderer, job.settings(), error_bars, watch, begun, keep)
}

fn run<'a>(
    renderer: &'a mut dyn Renderer,
    settings: &'a Settings,
    error_bars: bool,
    watch: &'a mut dyn Watch,
    begun: Option<Begun>,
    keep: Option<&'a mut dyn Keep>,
) -> Outcome {
    let pixels = settings.crop.pixels() as u64;
    let spp = settings.samples.end - settings.samples.start;
    let has = |of: fn(&Film) -> u64| begun.as_ref().map_or(0, |begun| of(&begun.film));
    let status = Status {
        paths: has(Film::paths),
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
            before: begun.as_ref().map_or(Duration::ZERO, |b| b.elapsed),
            deadline: settings.time,
            status,
            kept: has(Film::samples) > 0,
        },
        keep,
        pilot: begun.as_ref().map_or(0, |begun| begun.pilot),
        look: begun.as_ref().map_or(next_look(0), |begun| begun.look),
        failure: None,
    };
    let (film, stopped_by) = run.all(begun);
    Outcome {
        estimate: run.estimate(&film),
        pilot: run.pilot,
        film,
        stopped_by,
        elapsed: run.control.elapsed(),
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
    keep: Option<&'a mut dyn Keep>,
    /// Samples a pixel of the pilot whose image the film is.
    pilot: u64,
    /// The number of samples at which the error is looked at next.
    look: u64,
    failure: Option<crate::error::Error>,
}

impl Run<'_> {
    fn estimate(&self, film: &Film) -> Estimate {
        estimate(film, self.error_bars)
    }

    /// The image, from where it is if it has begun.
    fn all(&mut self, begun: Option<Begun>) -> (Film, StoppedBy) {
        let samples = self.settings.samples.clone();
        let spp = samples.end - samples.start;
        let finished = begun.as_ref().and_then(|begun| begun.finished);
        if !self.settings.adaptive {
            let mut film = begun.map_or_else(|| Film::new(self.settings.crop), |begun| begun.film);
            let stopped_by = finished.unwrap_or_else(|| self.fill(&mut film, samples));
            return (film, stopped_by);
        }
        if let Some(begun) = begun {
            let mut film = begun.film;
            let end = end_of(&film, spp);
            let stopped_by = finished.unwrap_or_else(|| self.fill(&mut film, 0..end));
            return (film, stopped_by);
        }
        let mut pilot = Film::new(self.settings.crop);
        if let Err(stopped_by) = self.windows(&mut pilot, 0, 0..PILOT_SAMPLES.min(spp), PILOT) {
            return (pilot, stopped_by);
        }
        // The pilot is in no image. Else a tile that it finds dark by chance would get few samples, and
        // stay too dark.
        let left = spp.saturating_sub(PILOT_SAMPLES);
        let allocation = Allocation::of(&pilot, left as f64 / LEAST_SAMPLES as f64);
        let mut image = Film::of(allocation);
        image.count(pilot.tally(), pilot.paths());
        self.pilot = pilot.samples();
        let end = end_of(&image, spp);
        let stopped_by = self.fill(&mut image, 0..end);
        // As long as it has fewer samples, the pilot is the better image. What stopped it so early was not
        // what it shows.
        if image.samples() > 0 && image.mean_samples() >= pilot.mean_samples() {
            return (image, stopped_by);
        }
        self.pilot = 0;
        (pilot, stopped_by)
    }

    /// Fills the film until the pixels of step 0 have the samples of `range`, or a stop rule holds:
    /// those of step s are always 2^s times as far. Begins after the samples that are in.
    fn fill(&mut self, film: &mut Film, range: Range<u64>) -> StoppedBy {
        let stopped_by = self.fill_windows(film, range);
        self.offer(film, Some(stopped_by));
        stopped_by
    }

    fn fill_windows(&mut self, film: &mut Film, range: Range<u64>) -> StoppedBy {
        let counts = film.allocation().counts();
        let steps: Vec<u8> = (0..film.steps())
            .filter(|s| counts[usize::from(*s)] > 0)
            .collect();
        // A render that was stopped within a window goes on there, each step where it is.
        let done = |film: &Film, step: u8| (range.start << step) + film.samples_of_step(step);
        let least = steps.iter().map(|s| done(film, *s) >> s).min();
        let mut start = least.unwrap_or(range.start);
        while start < range.end {
            let end = window_end(start, range.end);
            for &step in &steps {
                let part = done(film, step)..end << step;
                if let Err(stopped_by) = self.windows(film, step, part, 0) {
                    return stopped_by;
                }
            }
            start = end;
            let estimate = self.estimate(film);
            self.control.status.error = estimate.error;
            // At sample counts that nothing seen so far decides.
            if film.samples() >= self.look {
                self.look = next_look(film.samples());
                let reached = |limit| estimate.error_at_most.is_some_and(|e| e <= limit);
                if self.settings.error.is_some_and(reached) {
                    return StoppedBy::Error;
                }
            }
            if start < range.end {
                self.offer(film, None);
            }
        }
        StoppedBy::Spp
    }

    /// Lets the film be kept.
    fn offer(&mut self, film: &Film, stopped_by: Option<StoppedBy>) {
        if let Some(keep) = &mut self.keep {
            keep.keep(&State {
                film,
                pilot: self.pilot,
                look: self.look,
                elapsed: self.control.elapsed(),
                stopped_by,
            });
        }
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
            if self
                .settings
                .time
                .is_some_and(|t| self.control.elapsed() >= t)
            {
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
    let mut outcome = run(renderer, settings, true, &mut Quiet, None, None);
    match outcome.failure.take() {
        Some(error) => Err(error),
        None => Ok(outcome),
    }
}

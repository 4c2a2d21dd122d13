//! The pilot: few samples of the whole image, for time and coarse variance; then the batches of a long
//! render, on as much of the image as the budget allows.

use std::ops::Range;
use std::time::{Duration, Instant};

use super::survey::{Part, Survey, floor, margin, pool};
use super::{Measured, Pilot, check, spread, squares};
use crate::error::Result;
use crate::film::{BLOCK, Estimate, Film, WINDOW, Window};
use crate::job::Job;
use crate::render::{Control, Renderer};
use crate::settings::Rect;
use crate::statistics::mean_and_error;

/// Pieces of the survey, each timed by itself.
const PIECES: u64 = 4;
/// Samples of a piece: some batches, and all pieces within one window.
const PIECE: u64 = 12;
/// Index of the survey's first sample: all of them are in short batches, and in one window.
const FIRST: u64 = 16;
/// Pixels of an image that is always surveyed as a whole.
const SMALL: usize = 1 << 16;
/// The side of the squares that are timed, and how many there are.
const TIMED_SIDE: u32 = 64;
const TIMED: Range<f64> = 4.0..16.0;
/// Timed windows, at least and at most, where windows of the whole image are short.
const WINDOWS: Range<usize> = 3..8;
/// The least relative spread of the time a path takes: between minutes, clocks and other processes
/// change by more than between the pieces of a pilot.
const DRIFT: f64 = 0.03;

/// Runs a pilot of about `budget`, or of what it needs at least, for `job`, of which `renderer` is; none if
/// `go_on` says to stop in the middle.
///
/// # Errors
/// If the renderer fails, or [`check`] refuses the job.
pub fn run(
    renderer: &mut dyn Renderer,
    job: &Job,
    budget: Duration,
    go_on: &dyn Fn() -> bool,
) -> Result<Option<Pilot>> {
    check(job)?;
    let settings = job.settings();
    let begin = Instant::now();
    let mut meter = Meter {
        renderer,
        go_on,
        stopped: false,
        times: Vec::new(),
    };
    let crop = settings.crop;

    // The first settles the driver and the size of dispatches, and does not count. It tells how much
    // can be had.
    let Some(first) = meter.render(0..BLOCK)? else {
        return Ok(None);
    };
    let floor = floor(&first);
    // Of the first alone, which is slow: on the safe side.
    let path_seconds = meter.seconds_per_path();
    let left = |path_seconds: f64| {
        let seconds = budget.as_secs_f64() - begin.elapsed().as_secs_f64();
        seconds / (path_seconds * crop.pixels() as f64)
    };
    let levels = settings.sampler.levels();
    let surveyed = (PIECES * PIECE) as f64;
    let affordable = 0.5 * left(path_seconds) >= surveyed || crop.pixels() <= SMALL;
    meter.times.clear();
    let mut whole = Vec::new();
    let rounds = if affordable { PIECES } else { 2 };
    for piece in 0..rounds {
        let start = FIRST + piece * PIECE;
        let length = if affordable { PIECE } else { BLOCK };
        let Some(window) = meter.render(start..start + length)? else {
            return Ok(None);
        };
        whole.push(window);
    }
    let survey = affordable.then(|| Survey::new(&whole, floor));
    let path_seconds = meter.seconds_per_path();
    let window_seconds = meter.window_seconds();

    // The batches of a long render.
    let fast = affordable && left(path_seconds) >= (WINDOWS.start as u64 * WINDOW) as f64;
    let ranges = ranges(levels, fast);
    let samples: u64 = ranges.iter().map(|r| r.end - r.start).sum();
    let apart = if affordable { 0.0 } else { surveyed };
    // A quarter is for the time.
    let share =
        left(path_seconds) - 0.25 * budget.as_secs_f64() / path_seconds / crop.pixels() as f64;
    let squares = squares(crop, share / (samples as f64 + apart));
    let mut parts: Vec<Part> = Vec::new();
    for square in &squares {
        meter.renderer.show(*square);
        let mut own = Vec::new();
        for piece in (0..PIECES).filter(|_| !affordable) {
            let start = FIRST + piece * PIECE;
            own.extend(meter.render(start..start + PIECE)?);
        }
        let mut windows = Vec::new();
        for range in &ranges {
            windows.extend(meter.render(range.clone())?);
        }
        if meter.stopped {
            return Ok(None);
        }
        parts.push(match &survey {
            Some(survey) => survey.part(&windows),
            None => Survey::new(&own, floor).part(&windows),
        });
    }
    meter.renderer.show(crop);
    let rays_per_path = whole.iter().map(|w| w.tally.rays as f64).sum::<f64>()
        / whole
            .iter()
            .map(|w| (w.samples.end - w.samples.start) as f64)
            .sum::<f64>()
        / crop.pixels() as f64;
    meter.times.clear();
    if !fast {
        // Short ranges take longer by the path: lanes wait for the last. So time is that of long ones, on
        // squares; paths have not the same length everywhere, hence by the ray.
        let paths = 0.25 * budget.as_secs_f64() / path_seconds;
        let wanted = paths / f64::from(TIMED_SIDE * TIMED_SIDE) / WINDOW as f64;
        let squares = spread(crop, TIMED_SIDE, wanted.clamp(TIMED.start, TIMED.end));
        // Once more for the first: it may have to find the size of dispatches anew.
        for square in squares.iter().take(1).chain(&squares) {
            meter.renderer.show(*square);
            if meter.render(WINDOW..2 * WINDOW)?.is_none() {
                return Ok(None);
            }
        }
        meter.times.remove(0);
        meter.renderer.show(crop);
    } else {
        while meter.times.len() < WINDOWS.start
            || (meter.times.len() < WINDOWS.end && left(path_seconds) > 0.0)
        {
            if meter.render(WINDOW..2 * WINDOW)?.is_none() {
                return Ok(None);
            }
        }
    }
    let pixels = crop.pixels();
    Ok(Some(Pilot {
        pixels: pixels as u64,
        start: settings.samples.start,
        sampler: settings.sampler,
        variance: pool(&parts, survey.as_ref(), pixels, levels.len()),
        margin: margin(&parts, survey.as_ref(), pixels),
        path_seconds: meter.path_seconds(rays_per_path),
        window_seconds: window_seconds + judging(crop, &whole),
        seconds: begin.elapsed().as_secs_f64(),
    }))
}

/// Ranges of samples that show each level but the first; the last, which decides, has most.
fn ranges(levels: &[u64], fast: bool) -> Vec<Range<u64>> {
    let long = if fast { WINDOW } else { WINDOW / 2 };
    let last = levels.len() - 1;
    let between = levels[..last].iter().skip(1);
    between
        .map(|level| *level..level + 32)
        .chain(std::iter::once(WINDOW..WINDOW + long))
        .collect()
}

/// Seconds that the film and the estimate of the error take after a window.
fn judging(crop: Rect, windows: &[Window]) -> f64 {
    let mut film = Film::new(crop);
    let begin = Instant::now();
    for window in windows {
        film.add(window);
        std::hint::black_box(Estimate::of(&film));
    }
    begin.elapsed().as_secs_f64() / windows.len() as f64
}

/// Renders, and keeps the time.
struct Meter<'a> {
    renderer: &'a mut dyn Renderer,
    go_on: &'a dyn Fn() -> bool,
    stopped: bool,
    times: Vec<Time>,
}

/// What a window took.
struct Time {
    paths: f64,
    rays: f64,
    /// Seconds until the last path was done.
    tracing: f64,
    /// Seconds from there to the end.
    reading: f64,
}

impl Meter<'_> {
    /// A window; none once it is time to stop.
    fn render(&mut self, samples: Range<u64>) -> Result<Option<Window>> {
        if self.stopped {
            return Ok(None);
        }
        struct Clock<'a> {
            last: Instant,
            go_on: &'a dyn Fn() -> bool,
        }
        impl Control for Clock<'_> {
            fn proceed(&mut self, _: u64) -> bool {
                self.last = Instant::now();
                (self.go_on)()
            }
        }
        let begin = Instant::now();
        let mut clock = Clock {
            last: begin,
            go_on: self.go_on,
        };
        let window = self.renderer.render(samples, &mut clock)?;
        let samples = window.samples.end - window.samples.start;
        self.times.push(Time {
            paths: samples as f64 * window.pixels.len() as f64,
            rays: window.tally.rays as f64,
            tracing: (clock.last - begin).as_secs_f64(),
            reading: clock.last.elapsed().as_secs_f64(),
        });
        self.stopped |= !(self.go_on)();
        Ok((!self.stopped).then_some(window))
    }

    fn seconds_per_path(&self) -> f64 {
        let sum = |of: &dyn Fn(&Time) -> f64| self.times.iter().map(of).sum::<f64>();
        sum(&|t| t.tracing) / sum(&|t| t.paths)
    }

    /// Seconds of a path of so many rays.
    fn path_seconds(&self, rays: f64) -> Measured {
        let each = self.times.iter().map(|t| rays * t.tracing / t.rays);
        let each: Vec<f64> = each.collect();
        let (value, error) = mean_and_error(&each);
        Measured {
            value,
            // Of one piece rather than of their mean: what disturbs lasts longer than a piece. One piece
            // alone tells nothing of it.
            spread: match each.len() {
                1 => DRIFT,
                n => (error / value * (n as f64).sqrt()).max(DRIFT),
            },
        }
    }

    fn window_seconds(&self) -> f64 {
        self.times.iter().map(|t| t.reading).sum::<f64>() / self.times.len() as f64
    }
}

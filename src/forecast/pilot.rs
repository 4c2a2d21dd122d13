//! The pilot: few samples of the whole image, for time and coarse variance; then the batches of a long
//! render, on as much of the image as the budget allows.

use std::ops::Range;
use std::time::{Duration, Instant};

use super::survey::{Part, Survey};
use super::{Measured, Pilot};
use crate::error::Result;
use crate::estimate::Estimate;
use crate::film::{Film, WINDOW, Window};
use crate::render::{Control, Renderer};
use crate::settings::{Rect, Settings};
use crate::statistics::mean_and_error;

/// Pieces of the survey, each timed by itself.
const PIECES: u64 = 4;
/// Samples of a piece: some batches, and all pieces within one window.
const PIECE: u64 = 12;
/// The side of the squares that stand for the image.
const SIDE: u32 = 32;
/// The fewest squares: fewer do not tell by themselves how much they differ.
const FEWEST: f64 = 24.0;
/// Timed windows, at least and at most, where windows of the whole image are short.
const WINDOWS: Range<usize> = 3..8;
/// The least relative spread of the time a path takes: between minutes, clocks and other processes
/// change by more than between the pieces of a pilot.
const DRIFT: f64 = 0.03;

/// Runs a pilot of about `budget`, or of what it needs at least, for a render with `settings`; none if
/// `go_on` says to stop in the middle.
///
/// # Errors
/// If the renderer fails.
pub fn run(
    renderer: &mut dyn Renderer,
    settings: &Settings,
    budget: Duration,
    go_on: &dyn Fn() -> bool,
) -> Result<Option<Pilot>> {
    let begin = Instant::now();
    let mut meter = Meter {
        renderer,
        go_on,
        stopped: false,
        times: Vec::new(),
    };
    let crop = settings.crop;

    // The first settles the driver and the size of dispatches, and does not count.
    let first = 64 - PIECES * PIECE;
    meter.render(0..first)?;
    meter.times.clear();
    let mut windows = Vec::new();
    for piece in 0..PIECES {
        let start = first + piece * PIECE;
        windows.push(meter.render(start..start + PIECE)?);
    }
    let survey = Survey::new(crop, &windows);
    let left = |meter: &Meter<'_>| {
        let seconds = budget.as_secs_f64() - begin.elapsed().as_secs_f64();
        seconds / (meter.path_seconds().value * crop.pixels() as f64)
    };

    // The batches of a long render.
    let levels = settings.sampler.levels();
    let fast = left(&meter) >= (WINDOWS.start as u64 * WINDOW) as f64;
    let ranges = ranges(levels, fast);
    let samples: u64 = ranges.iter().map(|r| r.end - r.start).sum();
    let squares = squares(crop, left(&meter) / samples as f64);
    let timed = meter.times.len();
    let mut parts: Vec<Part> = Vec::new();
    for square in &squares {
        meter.renderer.show(*square);
        let windows: Vec<Window> = ranges
            .iter()
            .map(|range| meter.render(range.clone()))
            .collect::<Result<_>>()?;
        if meter.stopped {
            break;
        }
        parts.push(survey.part(&windows));
    }
    meter.renderer.show(crop);
    meter.times.truncate(timed);
    if fast {
        meter.times.clear();
        while meter.times.len() < WINDOWS.start
            || (meter.times.len() < WINDOWS.end && left(&meter) > 0.0)
        {
            meter.render(WINDOW..2 * WINDOW)?;
        }
    }
    if meter.stopped {
        return Ok(None);
    }
    Ok(Some(Pilot {
        pixels: crop.pixels() as u64,
        start: settings.samples.start,
        sampler: settings.sampler,
        variance: survey.pool(&parts, levels.len()),
        margin: survey.margin(),
        path_seconds: meter.path_seconds(),
        window_seconds: meter.window_seconds() + judging(crop, &windows),
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

/// Squares, one in each cell of a grid, that make up about so large a share of the image; or all of it.
fn squares(crop: Rect, share: f64) -> Vec<Rect> {
    let area = f64::from(SIDE * SIDE);
    let wanted = (share * crop.pixels() as f64 / area).max(FEWEST);
    if wanted * area >= 0.8 * crop.pixels() as f64 {
        return vec![crop];
    }
    let aspect = f64::from(crop.width) / f64::from(crop.height);
    let side = |cells: f64, size: u32| (cells.round() as u32).clamp(1, size.div_ceil(SIDE));
    let columns = side((wanted * aspect).sqrt(), crop.width);
    let rows = side(wanted / f64::from(columns), crop.height);
    // A place in each cell: the R2 sequence (Roberts 2018), which is even in both directions.
    let offset = |i: u32, ratio: f64| (0.5 + f64::from(i + 1) * ratio).fract();
    let start = |cell: u32, cells: u32, size: u32, offset: f64| {
        let center = (f64::from(cell) + offset) * f64::from(size) / f64::from(cells);
        ((center - 0.5 * f64::from(SIDE)).max(0.0) as u32).min(size.saturating_sub(SIDE))
    };
    (0..rows * columns)
        .map(|i| Rect {
            x: crop.x + start(i % columns, columns, crop.width, offset(i, 0.754_877_666)),
            y: crop.y + start(i / columns, rows, crop.height, offset(i, 0.569_840_291)),
            width: SIDE.min(crop.width),
            height: SIDE.min(crop.height),
        })
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
    /// Seconds until the last path was done.
    tracing: f64,
    /// Seconds from there to the end.
    reading: f64,
}

impl Meter<'_> {
    fn render(&mut self, samples: Range<u64>) -> Result<Window> {
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
            tracing: (clock.last - begin).as_secs_f64(),
            reading: clock.last.elapsed().as_secs_f64(),
        });
        self.stopped |= !(self.go_on)();
        Ok(window)
    }

    fn path_seconds(&self) -> Measured {
        let each: Vec<f64> = self.times.iter().map(|t| t.tracing / t.paths).collect();
        let (value, error) = mean_and_error(&each);
        Measured {
            value,
            // Of one piece rather than of their mean: what disturbs lasts longer than a piece.
            spread: (error / value * (each.len() as f64).sqrt()).max(DRIFT),
        }
    }

    fn window_seconds(&self) -> f64 {
        self.times.iter().map(|t| t.reading).sum::<f64>() / self.times.len() as f64
    }
}

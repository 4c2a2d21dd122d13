//! A run: one series with one seed, measured at growing numbers of samples.

use std::ops::Range;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use super::measure::Reference;
use super::series::Key;
use crate::error::Result;
use crate::film::{Estimate, Film, window_end};
use crate::render::{Control, Renderer};
use crate::settings::Rect;

/// What is known after some number of samples a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Samples a pixel.
    pub spp: u64,
    /// Seconds of rendering so far, without setup, compilation, and what the study itself does.
    pub seconds: f64,
    /// Mean square error against the reference, whose noise is still in it.
    pub mse: f64,
    /// Mean square relative error, likewise.
    pub relmse: f64,
    /// Relative error of the image's mean.
    pub bias: f64,
    /// The relative error that the render itself estimates, which knows no reference.
    pub estimated: Option<f64>,
}

/// A series with a seed. One line of `runs.jsonl`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// The series.
    pub series: Key,
    /// The seed.
    pub seed: u64,
    /// Whether it came to its end: what was cut short is run again.
    pub complete: bool,
    /// Name of what rendered.
    pub device: String,
    /// Seconds before compilation: opening the device, placing the scene.
    pub setup: f64,
    /// Seconds of linking and compiling.
    pub compile: f64,
    /// Samples that were no finite number.
    pub non_finite: u64,
    /// At 1, 2, 4, ... samples a pixel.
    pub points: Vec<Point>,
}

/// How far a run goes.
#[derive(Clone, Copy, Debug)]
pub struct Length {
    /// Samples a pixel.
    pub spp: u64,
    /// Seconds, setup and compilation included: no point is begun that would end later.
    pub seconds: Option<f64>,
}

/// Told of every point, with the film; asked whether to go on.
pub trait Observer {
    /// Samples of all pixels that are done, from renderers.
    fn proceed(&mut self, paths: u64) -> bool;
    /// A point is reached.
    ///
    /// # Errors
    /// If what is kept of it cannot be written.
    fn point(&mut self, spp: u64, film: &Film) -> Result<()>;
}

/// The numbers of samples at which errors are measured: 1, 2, 4, ... and the last.
pub fn marks(spp: u64) -> impl Iterator<Item = u64> {
    (0..63)
        .map(|k| 1 << k)
        .take_while(move |n| *n < spp)
        .chain([spp])
}

struct Stops<'a> {
    observer: &'a mut dyn Observer,
    stopped: bool,
}

impl Control for Stops<'_> {
    fn proceed(&mut self, paths: u64) -> bool {
        self.stopped |= !self.observer.proceed(paths);
        !self.stopped
    }
}

/// Renders the sample indices `range` of every pixel into `film`; returns whether all were done, and
/// the time that took.
///
/// # Errors
/// If the renderer fails.
pub fn advance(
    renderer: &mut dyn Renderer,
    film: &mut Film,
    range: Range<u64>,
    observer: &mut dyn Observer,
) -> Result<(bool, Duration)> {
    let mut control = Stops {
        observer,
        stopped: false,
    };
    let mut start = range.start;
    let mut elapsed = Duration::ZERO;
    while start < range.end {
        if !control.proceed(0) {
            return Ok((false, elapsed));
        }
        let begin = Instant::now();
        let window = renderer.render(start..window_end(start, range.end), &mut control)?;
        start = window.samples.end;
        film.add(&window);
        elapsed += begin.elapsed();
    }
    Ok((true, elapsed))
}

/// Renders until `length`, and measures at every mark; returns the points, whether they are all,
/// and the film.
///
/// # Errors
/// If the renderer fails, or the image is not finite.
pub fn execute(
    renderer: &mut dyn Renderer,
    crop: Rect,
    started: f64,
    length: Length,
    reference: &Reference,
    observer: &mut dyn Observer,
) -> Result<(Vec<Point>, bool, Film)> {
    let mut film = Film::new(crop);
    let mut points = Vec::new();
    let (mut spp, mut seconds) = (0, 0.0);
    for mark in marks(length.spp) {
        // Twice as many samples take twice as long.
        let expected = seconds * mark as f64 / spp.max(1) as f64;
        if spp > 0
            && length
                .seconds
                .is_some_and(|limit| started + expected > limit)
        {
            break;
        }
        let (done, elapsed) = advance(renderer, &mut film, spp..mark, observer)?;
        if !done {
            return Ok((points, false, film));
        }
        seconds += elapsed.as_secs_f64();
        spp = mark;
        let measured = reference.measure(&film)?;
        points.push(Point {
            spp,
            seconds,
            mse: measured.mse,
            relmse: measured.relmse,
            bias: measured.bias,
            estimated: Estimate::of(&film).error,
        });
        observer.point(spp, &film)?;
    }
    Ok((points, true, film))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_double_and_end_where_asked() {
        assert_eq!(marks(1).collect::<Vec<_>>(), [1]);
        assert_eq!(marks(8).collect::<Vec<_>>(), [1, 2, 4, 8]);
        assert_eq!(marks(11).collect::<Vec<_>>(), [1, 2, 4, 8, 11]);
    }
}

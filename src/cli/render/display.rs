//! How far a render is, while it runs.

use std::time::{Duration, Instant};

use crate::cli::signals::Signals;
use crate::output::{Progress, Snapshot};
use crate::render::{Status, Watch};
use crate::settings::{MAXIMUM_SPP, Settings};

/// Shows the render loop's status, and asks for signals.
pub(super) struct Display<'a> {
    progress: &'a Progress,
    signals: &'a Signals,
    pixels: u64,
    spp: Option<u64>,
    time: Option<Duration>,
    error: Option<f64>,
    series: Series,
    /// Where the current stretch of speed measurement began.
    mark: (Duration, u64),
    rate: f64,
}

/// The place of a render among those of one command.
#[derive(Clone, Copy)]
pub(super) struct Series {
    /// How many are done.
    pub(super) done: usize,
    /// How many there are.
    pub(super) all: usize,
    /// When the first began, with all that came before its samples.
    pub(super) first_begin: Instant,
    /// When this one began.
    pub(super) begin: Instant,
}

impl Series {
    /// Of the only render of a command.
    pub(super) fn alone(begin: Instant) -> Self {
        Self {
            done: 0,
            all: 1,
            first_begin: begin,
            begin,
        }
    }
}

impl<'a> Display<'a> {
    pub(super) fn new(
        progress: &'a Progress,
        signals: &'a Signals,
        settings: &Settings,
        series: Series,
    ) -> Self {
        Self {
            progress,
            signals,
            pixels: settings.crop.pixels() as u64,
            // A cap that nobody asked for says nothing about how far the render is.
            spp: Some(settings.samples.end - settings.samples.start).filter(|n| *n != MAXIMUM_SPP),
            time: settings.time,
            error: settings.error,
            series,
            mark: (Duration::ZERO, 0),
            rate: 0.0,
        }
    }
}

impl Watch for Display<'_> {
    fn update(&mut self, status: &Status) {
        let (since, before) = self.mark;
        let stretch = (status.elapsed - since).as_secs_f64();
        if stretch >= 0.5 || self.rate == 0.0 {
            self.rate = (status.paths - before) as f64 / stretch.max(1.0e-9);
            self.mark = (status.elapsed, status.paths);
        }
        let elapsed = status.elapsed.as_secs_f64();
        // The nearest of the stop rules; an error falls with the root of the samples.
        let by_spp = status.paths as f64 / status.total as f64;
        let by_time = self.time.map_or(0.0, |time| elapsed / time.as_secs_f64());
        let by_error = self
            .error
            .zip(status.error)
            .map_or(0.0, |(want, have)| (want / have).powi(2));
        let own = by_spp.max(by_time).max(by_error).min(1.0);
        let Series {
            done,
            all,
            first_begin,
            ..
        } = self.series;
        let fraction = (done as f64 + own) / all as f64;
        let since_begin = match all {
            1 => status.elapsed,
            _ => first_begin.elapsed(),
        };
        let elapsed = since_begin.as_secs_f64();
        let remaining = (fraction > 0.0).then(|| elapsed * (1.0 / fraction - 1.0));
        self.progress.update(&Snapshot {
            samples: status.paths,
            spp: status.paths / self.pixels,
            spp_total: self.spp,
            fraction,
            elapsed: since_begin,
            remaining: remaining.and_then(|s| Duration::try_from_secs_f64(s).ok()),
            paths_per_second: self.rate,
            error: status.error,
        });
    }

    fn interrupted(&self) -> bool {
        self.signals.code().is_some()
    }
}

//! Where a study is, and how long the rest will take.

use std::time::{Duration, Instant};

use super::host::Host;
use super::plan::Study;
use crate::output::Snapshot;

/// A part of the work that is still to do.
#[derive(Clone, Copy)]
pub(super) struct Part {
    /// Index of the series; one past the last for the reference.
    pub(super) series: usize,
    /// Samples a pixel.
    pub(super) samples: u64,
}

/// Where the study is, and how long the rest will take.
pub(super) struct Timetable<'a> {
    pub(super) host: &'a mut dyn Host,
    pixels: u64,
    limit: Option<f64>,
    begin: Instant,
    /// Seconds a path, by series, once known.
    rates: Vec<Option<f64>>,
    pub(super) pending: Vec<Part>,
    current: Part,
    since: Instant,
    /// Paths of the current part, and of all.
    done: u64,
    total: u64,
}

impl<'a> Timetable<'a> {
    pub(super) fn new(host: &'a mut dyn Host, study: &Study) -> Self {
        let now = Instant::now();
        let none = Part {
            series: study.subjects.len(),
            samples: 0,
        };
        Self {
            host,
            pixels: study.base.crop.pixels() as u64,
            limit: study.length.seconds,
            begin: now,
            rates: vec![None; study.subjects.len() + 1],
            pending: Vec::new(),
            current: none,
            since: now,
            done: 0,
            total: 0,
        }
    }

    /// Begins a part, the first of the pending ones.
    pub(super) fn start(&mut self, name: &str, part: Part) {
        if !self.pending.is_empty() {
            self.pending.remove(0);
        }
        self.host.begin(name);
        self.current = part;
        self.since = Instant::now();
        self.done = 0;
    }

    fn rate(&self, series: usize) -> f64 {
        let known = || self.rates.iter().flatten();
        let mean = known().sum::<f64>() / known().count().max(1) as f64;
        self.rates[series].unwrap_or(mean)
    }

    /// So many more paths of the current part are done.
    pub(super) fn report(&mut self, paths: u64) {
        self.done += paths;
        self.total += paths;
        if self.done == 0 {
            return;
        }
        let elapsed = self.since.elapsed().as_secs_f64();
        self.rates[self.current.series] = Some(elapsed / self.done as f64);
        let left = |part: &Part, done: u64| {
            let whole = (part.samples * self.pixels).saturating_sub(done) as f64;
            let seconds = whole * self.rate(part.series);
            match self.limit {
                // The reference takes what it takes.
                Some(limit) if part.series + 1 < self.rates.len() => seconds.min(limit),
                _ => seconds,
            }
        };
        let remaining = left(&self.current, self.done)
            + self.pending.iter().map(|part| left(part, 0)).sum::<f64>();
        let spent = self.begin.elapsed();
        let snapshot = Snapshot {
            samples: self.total,
            spp: self.done / self.pixels,
            spp_total: Some(self.current.samples),
            fraction: spent.as_secs_f64() / (spent.as_secs_f64() + remaining),
            elapsed: spent,
            remaining: Duration::try_from_secs_f64(remaining).ok(),
            paths_per_second: self.done as f64 / elapsed.max(1.0e-9),
            error: None,
        };
        self.host.progress(&snapshot);
    }
}

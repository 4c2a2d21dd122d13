//! Two kernels in turns.

use std::time::Instant;

use super::{Difference, Measured, Watch};
use crate::backend::Backend;
use crate::error::Result;
use crate::film::{Estimate, Film, window_end};
use crate::job::Job;
use crate::render::{Control, Renderer};
use crate::settings::Rect;
use crate::shader::{Stage, link};
use crate::statistics::{mean_and_error, student_quantile};

/// How much is measured.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Turns of each of two kernels, at least 2.
    pub rounds: u64,
    /// Seconds of a turn, at least, as far as so many samples a pixel can be taken.
    pub turn: f64,
}

impl Default for Effort {
    fn default() -> Self {
        Self {
            rounds: 8,
            turn: 0.15,
        }
    }
}

/// Samples a pixel of a turn, at least.
const LEAST: u64 = 16;
/// Samples a pixel of a turn, at most.
const MOST: u64 = 1 << 16;
/// Confidence of the interval.
const CONFIDENCE: f64 = 0.95;

/// A kernel, compiled.
pub(super) struct Bench {
    renderer: Box<dyn Renderer>,
    crop: Rect,
    /// The samples of all turns.
    film: Film,
    /// Whether their spread tells an error.
    error_bars: bool,
    lines: usize,
    compile_seconds: f64,
}

impl Bench {
    pub(super) fn new(backend: &Backend, job: &Job) -> Result<Self> {
        let begin = Instant::now();
        let renderer = backend.renderer(job)?;
        let compile_seconds = begin.elapsed().as_secs_f64();
        let kernel = link(Stage::Path, job.scene(), job.placement(), job.effects())?;
        Ok(Self {
            renderer,
            crop: job.settings().crop,
            film: Film::new(job.settings().crop),
            error_bars: job.claims().has_error_bars(),
            lines: kernel.wgsl.lines().count(),
            compile_seconds,
        })
    }

    /// Name, interface and driver.
    pub(super) fn device(&self) -> (String, String, String) {
        self.renderer.device()
    }

    /// Seconds of so many further samples of each pixel.
    fn turn(&mut self, spp: u64) -> Result<f64> {
        struct All;
        impl Control for All {
            fn proceed(&mut self, _: u64) -> bool {
                true
            }
        }
        let end = self.film.samples() + spp;
        let begin = Instant::now();
        while self.film.samples() < end {
            let start = self.film.samples();
            let window = self
                .renderer
                .render(start..window_end(start, end), &mut All)?;
            self.film.add(&window);
        }
        Ok(begin.elapsed().as_secs_f64())
    }

    /// Forgets all samples.
    fn begin_anew(&mut self) {
        self.film = Film::new(self.crop);
    }

    /// The relative variance of a sample, where it can be told.
    fn variance(&self) -> Option<f64> {
        let error = Estimate::of(&self.film).error.filter(|_| self.error_bars)?;
        Some(error * error * self.film.samples() as f64)
    }

    /// Seconds of a million samples if `spp` samples of each pixel take `seconds`.
    fn per_megasample(&self, seconds: f64, spp: u64) -> f64 {
        1.0e6 * seconds / (self.crop.pixels() as f64 * spp as f64)
    }
}

/// What a sample with an effect takes and what one with its alternative does.
#[derive(Clone, Copy, Debug)]
pub struct Cost {
    /// Seconds of a million samples with it.
    pub with: f64,
    /// The same with the alternative.
    pub against: f64,
    /// The difference: what the effect costs.
    pub price: f64,
    /// Ends of the price's 95 % interval, from the spread of the turns.
    pub interval: [f64; 2],
    /// The relative variance of a sample with the effect over that of one with the alternative, where both can be
    /// told.
    pub variance_ratio: Option<f64>,
}

/// How long turns are.
#[derive(Clone, Copy, Debug)]
pub(super) struct Meter {
    rounds: u64,
    spp: u64,
    seconds_per_megasample: f64,
}

impl Meter {
    /// Finds out how many samples are long enough; the first of them warm up the device.
    pub(super) fn new(own: &mut Bench, effort: Effort) -> Result<Self> {
        let mut spp = LEAST;
        own.turn(spp)?;
        loop {
            let seconds = own.turn(spp)?;
            if seconds >= effort.turn || spp >= MOST {
                return Ok(Self {
                    rounds: effort.rounds,
                    spp,
                    seconds_per_megasample: own.per_megasample(seconds, spp),
                });
            }
            spp *= 2;
        }
    }

    /// What is known of the kernel whose turns are so long.
    pub(super) fn kernel(&self, own: &Bench) -> Measured {
        Measured {
            size: [own.crop.width, own.crop.height],
            spp: self.spp,
            seconds_per_megasample: self.seconds_per_megasample,
            lines: own.lines,
            compile_seconds: own.compile_seconds,
        }
    }

    /// Runs both in turns, the one or the other first, on the same samples; `None` if `watch` says to stop.
    pub(super) fn difference(
        self,
        with: &mut Bench,
        against: &mut Bench,
        watch: &dyn Watch,
    ) -> Result<Option<Difference>> {
        let mut times = [Vec::new(), Vec::new()];
        with.begin_anew();
        against.begin_anew();
        for round in 0..self.rounds {
            let order = if round % 2 == 0 { [0, 1] } else { [1, 0] };
            for which in order {
                if !watch.goes_on() {
                    return Ok(None);
                }
                let bench: &mut Bench = if which == 0 { with } else { against };
                let seconds = bench.turn(self.spp)?;
                times[which].push(bench.per_megasample(seconds, self.spp));
            }
        }
        let differences: Vec<f64> = times[0].iter().zip(&times[1]).map(|(a, b)| a - b).collect();
        let (price, error) = mean_and_error(&differences);
        let t = student_quantile((self.rounds - 1) as f64, CONFIDENCE);
        let variances = with.variance().zip(against.variance());
        let ratio = variances.map(|(a, b)| a / b);
        Ok(Some(Difference {
            cost: Cost {
                with: mean_and_error(&times[0]).0,
                against: mean_and_error(&times[1]).0,
                price,
                interval: [price - t * error, price + t * error],
                variance_ratio: ratio.filter(|ratio| ratio.is_finite() && *ratio > 0.0),
            },
            kernel_lines: with.lines as i64 - against.lines as i64,
            compile_seconds: with.compile_seconds - against.compile_seconds,
        }))
    }
}

//! How often intervals hold the truth: renders of many seeds against what all others agree on.

use gpu_trace::film::{Estimate, Film, Trust, half_widths, next_look, window_end};
use gpu_trace::gpu::device::Gpu;
use gpu_trace::gpu::renderer::GpuRenderer;
use gpu_trace::job::prepare;
use gpu_trace::render::{Control, Renderer as _};
use gpu_trace::scene::Scene;
use gpu_trace::settings::Settings;
use gpu_trace::statistics::student_quantile;

/// What one render says at some number of samples: by pixel and channel.
pub(crate) struct Said {
    pub(crate) samples: u64,
    /// The error that it estimates.
    pub(crate) error: f64,
    trust: Trust,
    freedom: f64,
    means: Vec<f64>,
    variances: Vec<f64>,
    half_widths: Vec<f64>,
}

impl Said {
    fn by(film: &Film) -> Self {
        let all = |of: &dyn Fn(usize) -> [f64; 3]| (0..film.rect().pixels()).flat_map(of).collect();
        let half_widths = half_widths(film).expect("16 batches");
        let estimate = Estimate::of(film);
        Self {
            samples: film.samples(),
            error: estimate.error.expect("16 batches"),
            trust: estimate.trust.expect("16 batches"),
            freedom: film.freedom().expect("16 batches"),
            means: all(&|i| film.mean(i)),
            variances: all(&|i| film.variance_of_mean(i).expect("16 batches")),
            half_widths: all(&|i| half_widths[i]),
        }
    }
}

/// Renders of one scene with one sampler.
pub(crate) struct Runs {
    /// For each number of samples what every seed says; last where it stopped by its error.
    pub(crate) said: Vec<Vec<Said>>,
    /// The error to stop at.
    pub(crate) limit: f64,
}

struct On;

impl Control for On {
    fn proceed(&mut self, _: u64) -> bool {
        true
    }
}

/// Renders `seeds` seeds up to the last of `samples`, and takes note at each of these; and where the
/// error falls to what another seed has at `stop` samples.
pub(crate) fn runs(
    gpu: &Gpu,
    scene: &Scene,
    settings: &Settings,
    seeds: u64,
    samples: &[u64],
    stop: u64,
) -> Runs {
    let job = prepare(scene, settings).unwrap_or_else(|e| panic!("{e}"));
    let mut renderer = GpuRenderer::new(gpu.clone(), &job).unwrap_or_else(|e| panic!("{e}"));
    let end = *samples.last().expect("a number of samples");
    let mut said: Vec<Vec<Said>> = (0..=samples.len()).map(|_| Vec::new()).collect();
    let mut limit = f64::NAN;
    // Seed 0 only sets the error to stop at.
    for seed in 0..=seeds {
        renderer = renderer.with_seed(seed);
        let mut film = Film::new(settings.crop);
        let (mut start, mut look, mut running) = (0, next_look(0), true);
        while start < end {
            let range = start..window_end(start, end);
            start = range.end;
            let window = renderer.render(range, &mut On);
            film.add(&window.unwrap_or_else(|e| panic!("{e}")));
            if seed == 0 {
                if start == stop {
                    limit = Said::by(&film).error;
                }
                continue;
            }
            if let Some(at) = samples.iter().position(|s| *s == start) {
                said[at].push(Said::by(&film));
            }
            // As the render loop does it.
            if running && start >= look {
                look = next_look(start);
                let error = Estimate::of(&film).error_at_most;
                let reached = error.is_some_and(|e| e <= limit);
                if reached || start == end {
                    running = false;
                    said[samples.len()].push(Said::by(&film));
                }
            }
        }
    }
    Runs { said, limit }
}

/// The mean of many renders, of which each can be taken out.
pub(crate) struct Truth {
    sum: Vec<f64>,
    variance: Vec<f64>,
    renders: f64,
}

impl Truth {
    /// What all of `renders` agree on.
    pub(crate) fn of<'a>(renders: impl Iterator<Item = &'a Said> + Clone) -> Self {
        let add = |sum: &mut Vec<f64>, values: &[f64]| {
            sum.resize(values.len(), 0.0);
            sum.iter_mut().zip(values).for_each(|(s, v)| *s += v);
        };
        let (mut sum, mut variance) = (Vec::new(), Vec::new());
        for said in renders.clone() {
            add(&mut sum, &said.means);
            add(&mut variance, &said.variances);
        }
        let count = renders.count() as f64;
        Self {
            variance: variance.iter().map(|v| v / (count * count)).collect(),
            sum,
            renders: count,
        }
    }

    /// The same without one of the renders.
    fn without(&self, said: &Said) -> Vec<f64> {
        let rest = self.renders - 1.0;
        let without = |(sum, mean): (&f64, &f64)| (sum - mean) / rest;
        self.sum.iter().zip(&said.means).map(without).collect()
    }
}

/// Verdicts on the errors that renders state.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Verdicts {
    /// Renders whose stated error is off by a quarter of the actual one or more, and those of them whose verdict is
    /// `doubtful`.
    pub(crate) off: usize,
    pub(crate) doubted: usize,
    /// Renders whose stated error is within a tenth of it, and those of them whose verdict is `good`.
    pub(crate) close: usize,
    pub(crate) trusted: usize,
}

/// What the verdicts are worth. `own` gives each render's part in the truth, which is taken out; `heavy_tailed`: that
/// samples are is known of the scene.
pub(crate) fn verdicts(said: &[Said], own: &[Said], truth: &Truth, heavy_tailed: bool) -> Verdicts {
    let mut all = Verdicts::default();
    for (said, own) in said.iter().zip(own) {
        let ratio = said.error / actual(said, &truth.without(own)).sqrt();
        let good = said.trust.verdict(heavy_tailed).verdict == "good";
        if (ratio - 1.0).abs() >= 0.25 {
            all.off += 1;
            all.doubted += usize::from(!good);
        } else if (ratio - 1.0).abs() <= 0.1 {
            all.close += 1;
            all.trusted += usize::from(good);
        }
    }
    all
}

/// The square of a render's actual error, as [`Estimate::error`] has it.
fn actual(said: &Said, truth: &[f64]) -> f64 {
    let values = truth.len() as f64;
    let mean = truth.iter().sum::<f64>() / values;
    let floor = (0.1 * mean).powi(2);
    let square = |(m, t): (&f64, &f64)| (m - t).powi(2) / (t * t + floor);
    said.means.iter().zip(truth).map(square).sum::<f64>() / values
}

/// Shares of values whose interval holds the truth.
pub(crate) struct Coverage {
    /// The mean and 1.96 standard errors.
    pub(crate) normal: f64,
    /// Student's quantile instead.
    pub(crate) student: f64,
    /// [`half_widths`].
    pub(crate) ours: f64,
    /// The shares of values of which over all seeds fewer than 90 % do, with Student's and with ours.
    pub(crate) poor: [f64; 2],
    /// Estimated error over actual error, both by mean squares.
    pub(crate) honesty: f64,
    /// The actual error.
    pub(crate) error: f64,
    /// Of a share: the intervals that it is of. The channels of a pixel go together.
    pub(crate) count: f64,
}

/// How often what is said holds. `own` gives each render's part in the truth, which is taken out.
pub(crate) fn coverage(said: &[Said], own: &[Said], truth: &Truth, scale: f64) -> Coverage {
    let values = truth.sum.len();
    // Constant values have no interval.
    let noisy: Vec<usize> = (0..values).filter(|i| truth.variance[*i] > 0.0).collect();
    let mut held = vec![[0u32; 3]; values];
    let (mut all, mut estimated) = (0.0, 0.0);
    for (said, own) in said.iter().zip(own) {
        let t = [
            student_quantile(f64::INFINITY, 0.95),
            student_quantile(said.freedom, 0.95),
        ];
        let truth_here = truth.without(own);
        all += actual(said, &truth_here) * values as f64;
        for i in 0..values {
            let square = (said.means[i] - truth_here[i]).powi(2);
            let widths = [
                t[0] * t[0] * said.variances[i],
                t[1] * t[1] * said.variances[i],
                said.half_widths[i].powi(2),
            ];
            for (held, width) in held[i].iter_mut().zip(widths) {
                // The truth has an error of its own.
                let width = scale * scale * width + t[0] * t[0] * truth.variance[i];
                *held += u32::from(square <= width);
            }
        }
        estimated += said.error.powi(2) * values as f64;
    }
    let seeds = said.len() as f64;
    let share = |k: usize| {
        let all: f64 = noisy.iter().map(|i| f64::from(held[*i][k])).sum();
        all / (seeds * noisy.len() as f64)
    };
    let poor = |k: usize| {
        let poor = noisy
            .iter()
            .filter(|i| f64::from(held[**i][k]) < 0.9 * seeds);
        poor.count() as f64 / noisy.len() as f64
    };
    Coverage {
        normal: share(0),
        student: share(1),
        ours: share(2),
        poor: [poor(1), poor(2)],
        honesty: (estimated / all).sqrt(),
        error: (all / (seeds * values as f64)).sqrt(),
        count: seeds * noisy.len() as f64 / 3.0,
    }
}

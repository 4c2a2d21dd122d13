//! The figures of a finished render.

use crate::backend::BackendKind;
use crate::effects::Effect;
use crate::job::Job;
use crate::output::Stats;
use crate::output::stats::{BounceLimit, Device, Seconds};
use crate::render::Outcome;
use crate::scene::load::Loaded;
use crate::variance::{VarianceClass, energy_cut_at_most};

/// All but what is known at the end: times, warnings, and the ledger.
pub(super) fn statistics(
    loaded: &Loaded,
    job: &Job,
    outcome: &Outcome,
    backend: BackendKind,
    device: Device,
) -> Stats {
    let (settings, effects) = (job.settings(), job.effects());
    let film = &outcome.film;
    let samples = film.paths();
    let tally = film.tally();
    let start = settings.samples.start;
    let heavy_tailed = job.variance().class == VarianceClass::HeavyTailed;
    Stats {
        version: env!("CARGO_PKG_VERSION").into(),
        scene: loaded.name.clone(),
        scene_hash: loaded.hash.clone(),
        seed: settings.seed,
        sample_range: [start, start + film.most_samples()],
        spp: film.mean_samples().round() as u64,
        spp_range: [film.samples(), film.most_samples()],
        pilot_spp: outcome.pilot,
        width: settings.crop.width,
        height: settings.crop.height,
        backend: backend.name().into(),
        device,
        effects: effects.names().map(String::from).collect(),
        geometry: effects.geometry().into(),
        integrator: settings.integrator.name().into(),
        sampler: settings.sampler.name().into(),
        max_bounces: settings.max_bounces,
        radiance_cache: job.cells().is_some(),
        lamp_images: job.effects().has(Effect::LampImages),
        roulette: settings.has_roulette(),
        seconds: Seconds::default(),
        samples,
        paths_per_second: samples as f64 / outcome.elapsed.as_secs_f64(),
        rays: tally.rays,
        estimated_error: outcome.estimate.error,
        trust: outcome
            .estimate
            .trust
            .map(|trust| trust.verdict(heavy_tailed)),
        degrees_of_freedom: outcome.estimate.error.and_then(|_| film.freedom()),
        mean_stderr: outcome
            .estimate
            .error
            .and_then(|_| film.variance_of_image_mean())
            .map(|variance| variance.map(f64::sqrt)),
        variance: job.variance().class,
        black: outcome.estimate.is_black(),
        non_finite: tally.non_finite,
        first_non_finite: tally.first_non_finite,
        bounce_limit: BounceLimit {
            paths: tally.cut_paths,
            throughput: tally.cut_throughput,
            energy_at_most: energy_cut_at_most(job.scene(), film),
        },
        ledger: None,
        stopped_by: outcome.stopped_by,
        warnings: Vec::new(),
    }
}

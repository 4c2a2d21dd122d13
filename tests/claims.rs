//! Estimators hold what they claim: every integrator, sampler and light sampling, evenly and adaptively.
//! Each claim has a judge here, and a companion: where the claim would be wrong, its judge finds it.

use crate::common::images::channels_by_batches;
use crate::common::{gpu_renderer, job, scene, scene_file};
use gpu_trace::effects::Effect;
use gpu_trace::error::Result;
use gpu_trace::film::{Film, window_end};
use gpu_trace::gpu::renderer::{DispatchLimits, GpuRenderer};
use gpu_trace::render::{Control, Renderer as _, Status, Watch, render, render_quietly};
use gpu_trace::sampler::Sampler;
use gpu_trace::scene::Scene;
use gpu_trace::settings::{Integrator, LightSampling, Offset, Rect, Settings};
use gpu_trace::statistics::{mean_and_error, normal_limit};
use gpu_trace::variance::VarianceClass;
use gpu_trace::verify::{image_bits, settings};

/// Samples a pixel: with batches of all lengths.
const SPP: u64 = 512;
/// Two pairs.
const SEEDS: u64 = 4;
/// z-tests of the whole family, to be well over: two for each of 26 estimators.
const TESTS: usize = 52;

/// Gray, so that a channel tells all; dark enough for the lecture's estimator to have a finite fourth moment; with a mirror
/// in which both lamps have images.
fn gray() -> Scene {
    scene(
        "[camera]\nposition = [0, 1.5, 5]\nlook_at = [0, 0.6, 0]\nfov = 40.0\n[image]\nwidth = 32\n\
         height = 24\n[environment]\nradiance = [0.2, 0.2, 0.2]\n\
         [material.floor]\ntype = \"diffuse\"\nalbedo = [0.4, 0.4, 0.4]\n\
         [material.ball]\ntype = \"diffuse\"\nalbedo = [0.5, 0.5, 0.5]\n\
         [material.mirror]\ntype = \"mirror\"\nreflectance = [0.6, 0.6, 0.6]\n\
         [material.lamp]\ntype = \"diffuse\"\nalbedo = [0, 0, 0]\nemission = [3, 3, 3]\n\
         [[sphere]]\ncenter = [0, -100, 0]\nradius = 100\nmaterial = \"floor\"\n\
         [[sphere]]\ncenter = [-0.8, 0.6, 0]\nradius = 0.6\nmaterial = \"ball\"\n\
         [[sphere]]\ncenter = [0.8, 0.5, 0.2]\nradius = 0.5\nmaterial = \"mirror\"\n\
         [[sphere]]\ncenter = [1.5, 3, 1]\nradius = 0.9\nmaterial = \"lamp\"\n\
         [[sphere]]\ncenter = [-2, 1.2, 1.5]\nradius = 0.6\nmaterial = \"lamp\"\n",
    )
}

/// All ways to estimate, of which none is another under another name.
fn estimators(scene: &Scene) -> Vec<Settings> {
    let mut all = Vec::new();
    for integrator in Integrator::ALL {
        let asks = integrator.samples_lights();
        let kinds = &LightSampling::ALL[..if asks { 2 } else { 1 }];
        for light_sampling in kinds {
            for sampler in Sampler::ALL {
                for adaptive in [false, true] {
                    all.push(Settings {
                        integrator: *integrator,
                        light_sampling: asks.then_some(*light_sampling),
                        sampler: *sampler,
                        adaptive,
                        ..settings(scene, 32, 24, SPP)
                    });
                }
            }
        }
    }
    all.push(Settings {
        radiance_cache: true,
        ..settings(scene, 32, 24, SPP)
    });
    all.push(Settings {
        lamp_images: true,
        ..settings(scene, 32, 24, SPP)
    });
    assert!(2 * all.len() <= TESTS, "{} estimators", all.len());
    all
}

fn name(s: &Settings) -> String {
    format!(
        "{} {} {}{}{}{}",
        s.integrator.name(),
        s.light_sampling().name(),
        s.sampler.name(),
        if s.adaptive { " adaptive" } else { "" },
        if s.radiance_cache { " cache" } else { "" },
        if s.lamp_images { " images" } else { "" },
    )
}

fn film(renderer: &mut GpuRenderer, settings: &Settings) -> Film {
    render_quietly(renderer, settings)
        .unwrap_or_else(|e| panic!("{e}"))
        .film
}

/// A film for each seed.
fn films(mut renderer: GpuRenderer, settings: &Settings) -> Vec<Film> {
    let mut films = Vec::new();
    for seed in 0..SEEDS {
        renderer = renderer.with_seed(seed);
        films.push(film(&mut renderer, settings));
    }
    films
}

/// The first channel of all pixels, and its variance.
fn values(film: &Film) -> Vec<[f64; 2]> {
    let variance = |i| film.variance_of_mean(i).expect("16 batches")[0];
    (0..film.rect().pixels())
        .map(|i| [film.mean(i)[0], variance(i)])
        .collect()
}

/// By how much the squared differences of the films of a pair exceed what their error bars say, the bars'
/// squares being `share` of what they are, in standard errors: pixels are independent. The other pair says
/// what a pixel's difference weighs, so that a few noisy ones do not decide; the expectation is 0 whatever
/// the weights.
fn excess(films: &[Film], share: f64) -> f64 {
    let all: Vec<Vec<[f64; 2]>> = films.iter().map(values).collect();
    let mut excess = Vec::new();
    for [a, b, c, d] in [[0, 1, 2, 3], [2, 3, 0, 1]] {
        let other: Vec<f64> = all[c]
            .iter()
            .zip(&all[d])
            .map(|(x, y)| x[1] + y[1])
            .collect();
        let mean = other.iter().sum::<f64>() / other.len() as f64;
        for (([x, vx], [y, vy]), other) in all[a].iter().zip(&all[b]).zip(&other) {
            excess.push(((x - y).powi(2) - share * (vx + vy)) / (other + 0.1 * mean));
        }
    }
    let (mean, error) = mean_and_error(&excess);
    mean / error
}

/// The difference of two images' means in standard errors, each of several films.
fn mean_apart(a: &[Film], b: &[Film]) -> f64 {
    let total = |films: &[Film]| {
        let n = films.len() as f64;
        let all = films.iter().map(|film| channels_by_batches(film)[0]);
        let [sum, variance] = all.fold([0.0; 2], |s, [mean, error]| {
            [s[0] + mean, s[1] + error * error]
        });
        [sum / n, variance / (n * n)]
    };
    let ([a, va], [b, vb]) = (total(a), total(b));
    (a - b) / (va + vb).sqrt()
}

struct On;

impl Control for On {
    fn proceed(&mut self, _: u64) -> bool {
        true
    }
}

/// Adds the windows of the job's samples to a film, each `times` times.
fn add(film: &mut Film, settings: &Settings, seed: u64, times: usize) -> Result<()> {
    let mut renderer = gpu_renderer(&gray(), settings).with_seed(seed);
    let (mut start, end) = (settings.samples.start, settings.samples.end);
    while start < end {
        let window = renderer.render(start..window_end(start, end), &mut On)?;
        start = window.samples.end;
        (0..times).for_each(|_| film.add(&window));
    }
    Ok(())
}

/// Whether small dispatches, a crop, and parts of the samples have the bits of the whole.
fn splits_agree(scene: &Scene, settings: &Settings) -> bool {
    let whole = film(&mut gpu_renderer(scene, settings), settings);
    let limits = DispatchLimits {
        tiles: 3,
        samples: 12,
    };
    let mut renderer = gpu_renderer(scene, settings).with_limits(limits);
    let dispatches = image_bits(&film(&mut renderer, settings)) == image_bits(&whole);

    let crop = Rect {
        x: 5,
        y: 3,
        width: 18,
        height: 17,
    };
    renderer.show(crop);
    let cropped = Settings {
        crop,
        ..settings.clone()
    };
    let part = film(&mut renderer, &cropped);
    let same = |i: usize| {
        let (x, y) = (i as u32 % crop.width, i as u32 / crop.width);
        let at = (crop.y + y) * settings.width + crop.x + x;
        part.mean(i).map(f64::to_bits) == whole.mean(at as usize).map(f64::to_bits)
    };
    let crops = (0..crop.pixels()).all(same);

    let mut parts = Film::new(settings.crop);
    for samples in [0..64, 64..settings.samples.end] {
        let part = Settings {
            samples,
            adaptive: false,
            ..settings.clone()
        };
        add(&mut parts, &part, settings.seed, 1).unwrap_or_else(|e| panic!("{e}"));
    }
    dispatches && crops && image_bits(&parts) == image_bits(&whole)
}

#[test]
fn every_estimator_holds_what_it_claims() {
    let scene = gray();
    let limit = normal_limit(TESTS);
    // Of another kind, with other seeds, and without roulette.
    let plain = Settings {
        integrator: Integrator::Bsdf,
        sampler: Sampler::Independent,
        roulette: Some(false),
        seed: 99,
        ..settings(&scene, 32, 24, 8 * SPP)
    };
    let truth = [film(&mut gpu_renderer(&scene, &plain), &plain)];
    for settings in estimators(&scene) {
        let name = name(&settings);
        let job = job(&scene, &settings);
        let claims = job.claims();
        assert_eq!(job.variance().class, VarianceClass::Finite, "{name}");
        assert_eq!(job.cells().is_some(), settings.radiance_cache, "{name}");
        let has_images = job.effects().has(Effect::LampImages);
        assert_eq!(has_images, settings.lamp_images, "{name}");
        let films = films(gpu_renderer(&scene, &settings), &settings);
        // A companion: error bars of half the length.
        let (bars, halved) = (excess(&films, 1.0), excess(&films, 0.25));
        let apart = mean_apart(&films, &truth);
        let agree = splits_agree(&scene, &settings);
        eprintln!(
            "{name}: bars off by {bars:.2}, half of them {halved:.2}, mean by {apart:.2}, splits agree: {agree}"
        );
        assert!(claims.has_error_bars() && claims.unbiased, "{name}");
        assert!(bars.abs() < limit, "{name}: error bars off by {bars}");
        let dependent = films.iter().all(Film::pixels_are_dependent);
        assert_eq!(dependent, !claims.independent_pixels, "{name}");
        assert!(halved > limit, "{name}: halved error bars by {halved}");
        assert!(apart.abs() < limit, "{name}: biased by {apart}");
        // Another: what is not claimed does not hold.
        assert_eq!(agree, claims.any_split_same_bits, "{name}");
    }
}

#[test]
fn companion_batches_that_depend_on_each_other_are_found() {
    // An estimator that takes each sample twice, and counts it as two.
    let settings = settings(&gray(), 32, 24, SPP);
    let films: Vec<Film> = (0..SEEDS)
        .map(|seed| {
            let mut film = Film::new(settings.crop);
            add(&mut film, &settings, seed, 2).unwrap_or_else(|e| panic!("{e}"));
            film
        })
        .collect();
    let excess = excess(&films, 1.0);
    assert!(excess > normal_limit(TESTS), "{excess}");
}

#[test]
fn companion_a_bias_is_found() {
    let scene = gray();
    let exact = settings(&scene, 32, 24, SPP);
    let nudged = Settings {
        offset: Offset::Out(0.4),
        ..exact.clone()
    };
    assert!(job(&scene, &exact).claims().unbiased);
    assert!(!job(&scene, &nudged).claims().unbiased);
    let [exact, nudged] = [exact, nudged].map(|s| films(gpu_renderer(&scene, &s), &s));
    let apart = mean_apart(&exact, &nudged);
    assert!(apart.abs() > normal_limit(TESTS), "{apart}");
}

#[test]
fn stop_rules_and_infinite_variance_take_claims_away() {
    let scene = scene_file("scenes/lecture.toml");
    let base = settings(&scene, 16, 16, 128);
    let claims = |change: &dyn Fn(&mut Settings)| {
        let mut settings = base.clone();
        change(&mut settings);
        job(&scene, &settings).claims()
    };
    let all = claims(&|_| {});
    assert!(all.unbiased && all.any_split_same_bits && all.has_error_bars());
    let stops: [&dyn Fn(&mut Settings); 2] = [&|s| s.error = Some(0.1), &|s| {
        s.time = Some(std::time::Duration::from_secs(1))
    }];
    for stop in stops {
        let claims = claims(stop);
        assert!(!claims.unbiased && !claims.any_split_same_bits && claims.has_error_bars());
    }

    struct Quiet;
    impl Watch for Quiet {
        fn update(&mut self, status: &Status) {
            assert!(status.paths <= status.total);
        }
        fn interrupted(&self) -> bool {
            false
        }
    }
    for (integrator, known) in [
        (Integrator::Bsdf, true),
        (Integrator::Lecture { termination: 0.2 }, false),
    ] {
        // An error that any image has is no reason to stop where none is known.
        let settings = Settings {
            integrator,
            error: Some(0.9),
            ..base.clone()
        };
        let job = job(&scene, &settings);
        assert_eq!(job.claims().has_error_bars(), known);
        let outcome = render(&mut gpu_renderer(&scene, &settings), &job, &mut Quiet);
        assert_eq!(outcome.estimate.error.is_some(), known);
        assert_eq!(outcome.film.samples(), if known { 64 } else { 128 });
    }
}

//! Both samplers: the same image, true error bars, the same paths on device and host, and samples that
//! are a function of seed, pixel and index alone.

use std::iter::zip;

use crate::common::images::{Left, assert_alike, assert_same, cut, with_values};
use crate::common::{gpu_renderer, render_cpu, render_gpu, scene_file};
use glam::DVec3;
use gpu_trace::film::{Film, window_end};
use gpu_trace::gpu::renderer::DispatchLimits;
use gpu_trace::image::Picture;
use gpu_trace::placement::Placement;
use gpu_trace::reference::path::PathTracer;
use gpu_trace::render::render_quietly;
use gpu_trace::sampler::Sampler;
use gpu_trace::scene::Scene;
use gpu_trace::settings::{Rect, Settings};
use gpu_trace::statistics::mean_and_error;
use gpu_trace::verify::{means, settings};

const SAMPLERS: [Sampler; 2] = [Sampler::Independent, Sampler::Sobol];

#[test]
fn batches_fit_into_windows_and_there_are_enough() {
    for sampler in SAMPLERS {
        let (mut start, mut batches) = (0, 0);
        while start < 5000 {
            let end = window_end(start, u64::MAX);
            let length = sampler.batch(start);
            assert!(length.is_power_of_two() && start.is_multiple_of(length));
            assert!((start..end).all(|i| sampler.batch(i) == length));
            assert!(end - start >= 2 * length, "one batch tells nothing");
            batches += (end - start) / length;
            start = end;
            assert!(start < 64 || batches >= 16, "{batches} batches at {start}");
        }
        // Blocks, of which the kernel's sums are made, divide every batch.
        assert!(sampler.batch(0).is_multiple_of(gpu_trace::film::BLOCK));
        assert_eq!(sampler.batch(u64::MAX), sampler.batch(1 << 20));
    }
}

/// Sum over the channels.
fn gray(v: [f64; 3]) -> f64 {
    v.iter().sum()
}

/// Renders of the same that are compared.
const SEEDS: u64 = 24;

/// Of every pixel's mean: its variance as was estimated, and as it is over `runs`, which have every pixel's mean and
/// estimate for each seed.
fn variances(runs: &[Vec<(DVec3, f64)>]) -> [Vec<f64>; 2] {
    let (n, pixels) = (runs.len() as f64, runs[0].len());
    let estimated = |i: usize| runs.iter().map(|run| run[i].1).sum::<f64>() / n;
    let actual = |i: usize| {
        let mean = runs.iter().map(|run| run[i].0).sum::<DVec3>() / n;
        let squares: f64 = runs
            .iter()
            .map(|run| (run[i].0 - mean).length_squared())
            .sum();
        squares / (n - 1.0)
    };
    [
        (0..pixels).map(estimated).collect(),
        (0..pixels).map(actual).collect(),
    ]
}

/// What estimates are beyond actual variances, relative, in standard errors, and the ratio of both.
fn bars([estimated, actual]: &[Vec<f64>; 2]) -> (f64, f64) {
    let excess: Vec<f64> = zip(estimated, actual).map(|(a, b)| a - b).collect();
    // Pixels are independent.
    let (mean, error) = mean_and_error(&excess);
    let ratio = estimated.iter().sum::<f64>() / actual.iter().sum::<f64>();
    (mean / error, ratio)
}

fn small(scene: &Scene, sampler: Sampler, spp: u64, seed: u64) -> Settings {
    Settings {
        sampler,
        seed,
        ..settings(scene, 20, 20, spp)
    }
}

#[test]
fn error_bars_are_true() {
    let scene = scene_file("scenes/lecture.toml");
    for sampler in SAMPLERS {
        // Scrambles of 4, of 4 and 16, and in the long form of all lengths.
        let all: &[u64] = &[64, 256, 512];
        for &spp in &all[..if crate::thorough::thorough() { 3 } else { 2 }] {
            let mut renderer = gpu_renderer(&scene, &small(&scene, sampler, spp, 0));
            let mut runs = Vec::new();
            for seed in 0..SEEDS {
                renderer = renderer.with_seed(seed);
                let outcome = render_quietly(&mut renderer, &small(&scene, sampler, spp, seed));
                let film = outcome.unwrap_or_else(|e| panic!("{e}")).film;
                let of = |i| {
                    let variance = film.variance_of_mean(i).expect("16 batches");
                    (DVec3::from(film.mean(i)), gray(variance))
                };
                runs.push((0..400).map(of).collect());
            }
            let both = variances(&runs);
            let [found, wanted] = both.each_ref().map(|values| {
                let pixels = values.iter().map(|x| [*x as f32; 3]);
                Picture::new(20, 20, pixels.collect())
            });
            let _left = Left::of(
                format!("variances, {sampler:?}, {spp} spp"),
                &found,
                &wanted,
            );
            let (z, ratio) = bars(&both);
            eprintln!("{sampler:?}, {spp} spp: ratio {ratio:.3}, z = {z:.2}");
            assert!(z.abs() < 3.9, "{sampler:?}, {spp} spp: {z}");
        }
    }
}

#[test]
fn companion_samples_of_a_scramble_are_not_independent() {
    // The spread of single samples as the error estimate: true for independent ones alone.
    let scene = scene_file("scenes/lecture.toml");
    let placement = Placement::new(&scene, 20, 20);
    let z = |sampler| {
        // Of every other pixel, and of every other line.
        let run = |seed| {
            let settings = small(&scene, sampler, 256, seed);
            let tracer = PathTracer::new(&scene, &placement, &settings);
            (0..100)
                .map(|i| single_samples(&tracer, [i % 10 * 2, i / 10 * 2]))
                .collect()
        };
        let runs: Vec<_> = (0..SEEDS).map(run).collect();
        let (z, ratio) = bars(&variances(&runs));
        eprintln!("{sampler:?}: ratio {ratio:.3}, z = {z:.2}");
        z
    };
    assert!(z(Sampler::Independent).abs() < 3.9);
    assert!(z(Sampler::Sobol) > 5.0);
}

/// The mean of a pixel, and its variance if the samples were independent.
fn single_samples(tracer: &PathTracer<'_>, pixel: [u32; 2]) -> (DVec3, f64) {
    let samples = tracer.settings.samples.clone();
    let all: Vec<DVec3> = samples.map(|s| tracer.trace(pixel, s).radiance).collect();
    let n = all.len() as f64;
    let mean = all.iter().sum::<DVec3>() / n;
    let squares: f64 = all.iter().map(|x| (x - mean).length_squared()).sum();
    (mean, squares / (n - 1.0) / n)
}

/// z of the difference of two films' means.
fn difference(a: &Film, b: &Film) -> f64 {
    let differences: Vec<f64> = (0..a.rect().pixels())
        .map(|i| gray(a.mean(i)) - gray(b.mean(i)))
        .collect();
    let (mean, error) = mean_and_error(&differences);
    mean / error
}

#[test]
fn samplers_give_the_same_image() {
    for name in ["lecture", "glass", "lecture-reflective", "tests/lens"] {
        let scene = scene_file(format!("scenes/{name}.toml"));
        let film = |scene: &Scene, sampler, seed| {
            let settings = Settings {
                sampler,
                seed,
                ..settings(scene, 48, 48, 300)
            };
            render_gpu(scene, &settings)
        };
        let independent = film(&scene, Sampler::Independent, 1);
        let sobol = film(&scene, Sampler::Sobol, 2);
        let z = difference(&independent, &sobol);
        eprintln!("{name}: z = {z:.2}");
        assert_alike(name, &sobol, &independent, z.abs() < 3.9, z);
        if name == "lecture" {
            let mut brighter = scene.clone();
            for material in &mut brighter.materials {
                material.emission *= 1.01;
            }
            let z = difference(&film(&brighter, Sampler::Sobol, 2), &independent);
            assert!(z > 3.9, "companion: {z}");
        }
    }
}

#[test]
fn the_same_paths_and_error_bars_on_device_and_host() {
    for sampler in SAMPLERS {
        for (name, spp) in [
            ("lecture", 300),
            ("tests/glass-ball", 128),
            ("tests/lens", 64),
        ] {
            let scene = scene_file(format!("scenes/{name}.toml"));
            let settings = Settings {
                sampler,
                ..settings(&scene, 24, 24, spp)
            };
            let (film, reference) = (render_gpu(&scene, &settings), render_cpu(&scene, &settings));
            let near = |a: f64, b: f64, off: f64| (a - b).abs() <= off * b.abs() + 1.0e-12;
            let all: Vec<bool> = (0..film.rect().pixels())
                .map(|i| {
                    let [a, b] = [&film, &reference].map(|f| gray(f.mean(i)));
                    let [v, w] = [&film, &reference]
                        .map(|f| gray(f.variance_of_mean(i).expect("16 batches")));
                    near(a, b, 1.0e-4) && near(v, w, 1.0e-2)
                })
                .collect();
            let share = all.iter().filter(|near| **near).count() as f64 / all.len() as f64;
            let (name, what) = (
                format!("{sampler:?}, {name}"),
                format!("{share:.3} of the pixels agree"),
            );
            eprintln!("{name}: {what}");
            assert_alike(&name, &film, &reference, share > 0.9, what);
            // Companion: another seed has other paths.
            let other = Settings {
                seed: 1,
                ..settings
            };
            let other = means(&render_gpu(&scene, &other));
            let reference = means(&reference);
            let same = other
                .iter()
                .zip(&reference)
                .filter(|(a, b)| near(**a, **b, 1.0e-4));
            assert!(10 * same.count() < 9 * reference.len());
        }
    }
}

fn film_of(scene: &Scene, settings: &Settings, limits: DispatchLimits) -> Film {
    let mut renderer = gpu_renderer(scene, settings).with_limits(limits);
    render_quietly(&mut renderer, settings)
        .unwrap_or_else(|e| panic!("{e}"))
        .film
}

#[test]
fn samples_are_a_function_of_seed_pixel_and_index() {
    let scene = scene_file("scenes/tests/glass-ball.toml");
    for sampler in SAMPLERS {
        for samples in [0..330, 5..83, 250..700] {
            let whole = Settings {
                sampler,
                samples,
                ..settings(&scene, 21, 17, 1)
            };
            let film = film_of(&scene, &whole, DispatchLimits::default());
            // Dispatches end within batches.
            for (tiles, samples) in [(1, 4), (u32::MAX, 12), (2, 28)] {
                let split = film_of(&scene, &whole, DispatchLimits { tiles, samples });
                assert_same(format!("{sampler:?}, split"), &split, &film);
                for i in 0..film.rect().pixels() {
                    assert_eq!(film.variance_of_mean(i), split.variance_of_mean(i));
                }
            }
            let crop = Rect {
                x: 5,
                y: 3,
                width: 9,
                height: 11,
            };
            let part = film_of(
                &scene,
                &Settings {
                    crop,
                    ..whole.clone()
                },
                DispatchLimits::default(),
            );
            let _left = Left::of(format!("{sampler:?}, crop"), &part, &cut(&film, crop));
            for y in 0..11 {
                for x in 0..9 {
                    let here = film.mean(((y + 3) * 21 + x + 5) as usize);
                    assert_eq!(part.mean((y * 9 + x) as usize), here, "{sampler:?}");
                }
            }
            // Parts that end anywhere average to the whole within an ulp of f32.
            let middle = whole.samples.start + 71;
            let of = |samples| {
                let settings = Settings {
                    samples,
                    ..whole.clone()
                };
                film_of(&scene, &settings, DispatchLimits::default())
            };
            let parts = [
                of(whole.samples.start..middle),
                of(middle..whole.samples.end),
            ];
            let weight = |part: &Film| part.samples() as f64 / film.samples() as f64;
            let mean_of = |i: usize| {
                let sum = |c: usize| parts.iter().map(|f| f.mean(i)[c] * weight(f)).sum();
                [0, 1, 2].map(sum)
            };
            let means: Vec<[f64; 3]> = (0..film.rect().pixels()).map(mean_of).collect();
            let joined = with_values(&film, means.iter().copied());
            let _left = Left::of(format!("{sampler:?}, parts"), &joined, &film);
            for (i, mean) in means.iter().enumerate() {
                for (c, mean) in mean.iter().enumerate() {
                    let off = (film.mean(i)[c] - mean).abs();
                    assert!(
                        off <= 2.0 * gpu_trace::verify::U * mean,
                        "{sampler:?}, pixel {i}"
                    );
                }
            }
        }
    }
}

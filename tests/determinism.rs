//! The same bits whenever the same samples are rendered: whatever the crop, the dispatches and the
//! parts. Other seeds give other bits.

use std::iter::zip;

use crate::common::images::{Left, assert_same, cut, with_values};
use crate::common::{gpu_renderer, render_cpu, render_gpu, scene_file};
use gpu_trace::film::Film;
use gpu_trace::gpu::renderer::DispatchLimits;
use gpu_trace::image::Picture;
use gpu_trace::render::render_quietly;
use gpu_trace::sampler::Sampler;
use gpu_trace::scene::MAX_SPP;
use gpu_trace::scene::Scene;
use gpu_trace::settings::{GeometryChoice, Rect, Settings};
use gpu_trace::statistics::mean_and_error;
use gpu_trace::verify::{U, image_bits, means, settings, share_beyond, share_off};

/// A scene with all materials, a pole sphere, light and an environment.
fn glass_ball() -> Scene {
    scene_file("scenes/tests/glass-ball.toml")
}

fn bits(scene: &Scene, settings: &Settings) -> Vec<u32> {
    image_bits(&render_gpu(scene, settings))
}

#[test]
fn the_same_seed_gives_the_same_bits_and_another_gives_others() {
    let scene = glass_ball();
    let one = settings(&scene, 48, 40, 64);
    let first = render_gpu(&scene, &one);
    assert_same("the same seed", &render_gpu(&scene, &one), &first);
    // The background is the same for all seeds: what has a variance counts.
    let noisy: Vec<usize> = (0..one.crop.pixels())
        .flat_map(|i| {
            let variance = first.variance_of_mean(i).expect("16 batches");
            (0..3)
                .filter(move |c| variance[*c] > 0.0)
                .map(move |c| 3 * i + c)
        })
        .collect();
    assert!(noisy.len() > 1000, "only {} values are noisy", noisy.len());
    let first = image_bits(&first);
    for seed in [1, 1 << 32, u64::MAX] {
        let other = bits(
            &scene,
            &Settings {
                seed,
                ..one.clone()
            },
        );
        let same = noisy.iter().filter(|i| first[**i] == other[**i]).count();
        eprintln!("seed {seed}: {same} of {} values agree", noisy.len());
        // Sums of few distinct values may agree by chance.
        assert!(
            5 * same < noisy.len(),
            "seed {seed}: {same} of {} values agree",
            noisy.len()
        );
    }
}

#[test]
fn a_crop_has_the_whole_images_bits() {
    let scene = glass_ball();
    let whole = settings(&scene, 61, 47, 12);
    let image = render_gpu(&scene, &whole);
    for crop in [
        Rect {
            x: 0,
            y: 0,
            width: 61,
            height: 1,
        },
        Rect {
            x: 13,
            y: 7,
            width: 20,
            height: 31,
        },
        Rect {
            x: 60,
            y: 46,
            width: 1,
            height: 1,
        },
        Rect {
            x: 3,
            y: 9,
            width: 8,
            height: 8,
        },
    ] {
        let settings = Settings {
            crop,
            ..whole.clone()
        };
        let part = render_gpu(&scene, &settings);
        assert_same(format!("{crop:?}"), &part, &cut(&image, crop));
    }
}

fn limited(scene: &Scene, settings: &Settings, limits: DispatchLimits) -> Film {
    let mut renderer = gpu_renderer(scene, settings).with_limits(limits);
    render_quietly(&mut renderer, settings)
        .unwrap_or_else(|e| panic!("{e}"))
        .film
}

#[test]
fn any_split_into_dispatches_gives_the_same_bits() {
    let scene = glass_ball();
    for samples in [0..64, 0..30, 5..23] {
        let settings = Settings {
            samples,
            ..settings(&scene, 41, 33, 1)
        };
        let whole = limited(&scene, &settings, DispatchLimits::default());
        for (tiles, samples) in [(1, u64::MAX), (7, 1), (u32::MAX, 4), (3, 12), (30, 8)] {
            let split = limited(&scene, &settings, DispatchLimits { tiles, samples });
            let place = format!(
                "samples {:?}, {tiles} tiles, {samples} samples",
                settings.samples
            );
            assert_same(&place, &split, &whole);
            assert_eq!(whole.tally().rays, split.tally().rays, "{place}");
            for i in 0..settings.crop.pixels() {
                assert_eq!(
                    whole.variance_of_mean(i),
                    split.variance_of_mean(i),
                    "{place}, pixel {i}"
                );
            }
        }
    }
}

/// Parts, each rendered by itself, averaged.
fn of_parts(scene: &Scene, base: &Settings, ends: &[u64]) -> Vec<f64> {
    let mut sums = vec![0.0; 3 * base.crop.pixels()];
    let mut start = base.samples.start;
    for &end in ends.iter().filter(|end| **end > base.samples.start) {
        let film = render_gpu(
            scene,
            &Settings {
                samples: start..end,
                ..base.clone()
            },
        );
        for (sum, mean) in sums.iter_mut().zip(means(&film)) {
            *sum += mean * (end - start) as f64;
        }
        start = end;
    }
    sums.iter()
        .map(|s| s / (start - base.samples.start) as f64)
        .collect()
}

fn values(film: &Film, values: &[f64]) -> Picture {
    with_values(film, values.as_chunks().0.iter().copied())
}

#[test]
fn parts_average_to_the_whole() {
    let scene = glass_ball();
    for ends in [
        &[100, 256][..],
        &[7, 64],
        &[1, 2, 3, 64],
        &[255, 256, 257, 300],
    ] {
        let whole = settings(&scene, 24, 20, ends[ends.len() - 1]);
        let film = render_gpu(&scene, &whole);
        let image = film.pixels();
        let parts = of_parts(&scene, &whole, ends);
        let _left = Left::of(format!("parts {ends:?}"), &film, &values(&film, &parts));
        for (x, part) in image.as_flattened().iter().zip(parts) {
            let off = (f64::from(*x) - part).abs();
            // One ulp of f32.
            assert!(off <= 2.0 * U * part, "{ends:?}: {x} and {part}");
        }
        // Companion: parts with a gap are something else.
        let gap = of_parts(
            &scene,
            &Settings {
                samples: 1..2,
                ..whole.clone()
            },
            ends,
        );
        let differ = gap
            .iter()
            .zip(image.as_flattened())
            .filter(|(a, b)| (**a - f64::from(**b)).abs() > 2.0 * U * **a);
        assert!(
            differ.count() > image.len(),
            "{ends:?}: a missing sample is not found"
        );
    }
}

#[test]
fn sums_round_only_within_blocks() {
    // A single sample is not rounded. The sum of a block of 4 is, three times, each by at most u of
    // itself; over the blocks, high and low part of a sum are exact together.
    let scene = glass_ball();
    let whole = settings(&scene, 24, 20, 8);
    let film = render_gpu(&scene, &whole);
    let singles = of_parts(&scene, &whole, &[1, 2, 3, 4, 5, 6, 7, 8]);
    let _left = Left::of("single samples", &film, &values(&film, &singles));
    for (mean, single) in means(&film).iter().zip(singles) {
        let off = (mean - single).abs();
        assert!(off <= 3.0 * U * single, "{mean} and {single}");
    }
}

/// z of the mean of the differences.
fn difference(a: &Film, b: &Film) -> f64 {
    let differences: Vec<f64> = zip(means(a), means(b)).map(|(x, y)| x - y).collect();
    let (mean, error) = mean_and_error(&differences);
    if mean == 0.0 { 0.0 } else { mean / error }
}

#[test]
fn baked_and_list_agree() {
    for name in [
        "lecture",
        "glass",
        "tests/glass-ball",
        "tests/reflective",
        "tests/lens",
    ] {
        let scene = scene_file(format!("scenes/{name}.toml"));
        let base = settings(&scene, 48, 48, 16);
        let film = |geometry| {
            render_gpu(
                &scene,
                &Settings {
                    geometry,
                    ..base.clone()
                },
            )
        };
        let (baked, list) = (film(GeometryChoice::Baked), film(GeometryChoice::List));
        // A driver may contract the two kernels differently, and a path that bounces often between
        // curved mirrors and glass multiplies such a difference: nearly all values, not all.
        let share = share_beyond(&list, &baked, 1.0e-4);
        let z = difference(&baked, &list);
        let _left = Left::of(format!("{name}, list"), &list, &baked);
        eprintln!(
            "{name}: {:.3} % of the values differ, z = {z:.2}",
            100.0 * share
        );
        assert!(share < 0.1, "{name}: {share} of the values differ");
        assert!(z.abs() < 3.9, "{name}: {z} deviations");
        // Companion: other samples differ nearly everywhere.
        let other = render_gpu(
            &scene,
            &Settings {
                seed: 1,
                ..base.clone()
            },
        );
        if name != "tests/lens" {
            let share = share_beyond(&other, &baked, 1.0e-4);
            assert!(share > 0.3, "{name}: only {share} differ with another seed");
        }
    }
}

#[test]
fn odd_sizes_render() {
    let scene = glass_ball();
    for (width, height, spp) in [
        (1, 1, 300),
        (7, 5, 33),
        (1, 600, 2),
        (3000, 1, 4),
        (1025, 9, 1),
    ] {
        let settings = settings(&scene, width, height, spp);
        let film = render_gpu(&scene, &settings);
        assert_eq!(film.samples(), spp);
        assert_eq!(film.tally().non_finite, 0);
        assert!(film.tally().rays >= u64::from(width * height) * spp);
        // Every pixel is there: the same as the reference's, but for paths that part.
        let reference = render_cpu(&scene, &settings);
        let share = share_off(&film, &reference);
        let _left = Left::of(format!("{width} x {height}"), &film, &reference);
        assert!(
            share < 0.05,
            "{width} x {height}: {share} of the values differ"
        );
        let total: f64 = means(&film).iter().sum();
        assert!(total > 0.0);
    }
}

#[test]
fn seams_between_regions_do_not_show() {
    // Regions are at most 1024 pixels wide: the columns around the seam by themselves.
    let scene = glass_ball();
    let whole = settings(&scene, 2100, 2, 4);
    let image = render_gpu(&scene, &whole);
    let crop = Rect {
        x: 1000,
        y: 0,
        width: 60,
        height: 2,
    };
    let part = render_gpu(&scene, &Settings { crop, ..whole });
    assert_same("seam", &part, &cut(&image, crop));
}

#[test]
fn sample_indices_go_on_past_32_bits() {
    let scene = glass_ball();
    let edge = 1u64 << 32;
    for samples in [
        edge - 70..edge + 70,
        edge - 1..edge + 1,
        (1 << 16) - 10..(1 << 16) + 10,
        MAX_SPP - 40..MAX_SPP,
    ] {
        let settings = Settings {
            samples: samples.clone(),
            // Its batches are short: enough of them for an estimate.
            sampler: Sampler::Independent,
            ..settings(&scene, 12, 10, 1)
        };
        let film = render_gpu(&scene, &settings);
        assert_eq!(film.samples(), samples.end - samples.start);
        let reference = render_cpu(&scene, &settings);
        let share = share_off(&film, &reference);
        let _left = Left::of(format!("samples {samples:?}"), &film, &reference);
        assert!(
            share < 0.05,
            "{samples:?}: {share} of the values differ from the reference's"
        );
        if samples.end - samples.start >= 100 {
            // The batch that ends at the multiple of 2^32 counts.
            for i in 0..settings.crop.pixels() {
                let (a, b) = (film.variance_of_mean(i), reference.variance_of_mean(i));
                let (a, b) = (a.expect("enough blocks"), b.expect("enough blocks"));
                let close = (0..3).all(|c| (a[c] - b[c]).abs() <= 0.02 * b[c] + 1.0e-12);
                assert!(close, "pixel {i}: variance {a:?}, reference {b:?}");
            }
        }
        // Companion: 2^32 samples away is something else.
        let moved = Settings {
            samples: samples.start ^ edge..samples.start ^ edge | 1,
            ..settings
        };
        if moved.samples.end > moved.samples.start && samples.start.is_multiple_of(2) {
            let one = Settings {
                samples: samples.start..samples.start + 1,
                ..moved.clone()
            };
            assert_ne!(bits(&scene, &one), bits(&scene, &moved), "{samples:?}");
        }
    }
}

//! Scenes whose image is one number, known exactly.

use crate::common::images::{Left, assert_uniform, uniform};
use crate::common::{render_gpu, scene, scene_file};
use gpu_trace::film::Film;
use gpu_trace::scene::Scene;
use gpu_trace::settings::{GeometryChoice, Settings};
use gpu_trace::verify::{U, image_bits, means, settings};

/// Largest relative deviation of any pixel and channel from `expected`.
fn deviation(film: &Film, expected: f64) -> f64 {
    assert_eq!(film.tally().non_finite, 0, "{:?}", film.tally());
    means(film)
        .iter()
        .map(|m| (m / expected - 1.0).abs())
        .fold(0.0, f64::max)
}

/// The camera inside a closed sphere that emits 1.
fn closed(albedo: f64, radius: f64) -> Scene {
    let [x, y, z] = [0.3, -0.2, 0.1].map(|x| x * radius);
    scene(&format!(
        "[camera]\nposition = [{x:e}, {y:e}, {z:e}]\nlook_at = [{z:e}, {radius:e}, {x:e}]\nfov = 60.0\n\
         [image]\nwidth = 16\nheight = 16\n[material.wall]\ntype = \"diffuse\"\n\
         albedo = [{albedo}, {albedo}, {albedo}]\nemission = [1, 1, 1]\n\
         [[sphere]]\ncenter = [0, 0, 0]\nradius = {radius:e}\nmaterial = \"wall\"\n"
    ))
}

/// Radiance in a closed furnace after at most `bounces` scattering events, and the error of an f32
/// sum of it: a rounding an event for the throughput, one for the sum.
fn furnace(albedo: f64, bounces: u32) -> (f64, f64) {
    // What the kernel is told.
    let albedo = f64::from(albedo as f32);
    let radiance = (0..=bounces).map(|n| albedo.powi(n as i32)).sum();
    (radiance, 2.0 * f64::from(bounces.max(1)) * U)
}

const RADII: [f64; 7] = [1.0e-6, 1.0e-3, 0.1, 1.0, 7.0, 1.0e3, 1.0e6];

fn check_closed(albedo: f64, radius: f64, bounces: u32) {
    let scene = closed(albedo, radius);
    let settings = Settings {
        roulette: Some(false),
        max_bounces: bounces,
        ..settings(&scene, 16, 16, 16)
    };
    let film = render_gpu(&scene, &settings);
    let (expected, tolerance) = furnace(albedo, bounces);
    let off = deviation(&film, expected);
    let name = format!("albedo {albedo}, radius {radius}, {bounces} bounces");
    let what = format!("off by {off:e}, {tolerance:e} allowed");
    assert_uniform(&name, &film, expected, off <= tolerance, what);
    // 16 samples of 1 + bounces rays each: no path misses.
    let rays = 256 * 16 * u64::from(bounces + 1);
    assert_eq!(film.tally().rays, rays, "radius {radius}");
}

#[test]
fn a_closed_furnace_has_no_variance() {
    for radius in RADII {
        check_closed(0.9, radius, 64);
    }
    for albedo in [0.5, 0.999] {
        for radius in [1.0e-6, 1.0, 1.0e6] {
            check_closed(albedo, radius, 64);
        }
    }
}

#[test]
fn a_closed_furnace_cut_early_is_the_partial_sum() {
    for bounces in [0, 1, 2, 7, 100] {
        check_closed(0.5, 1.0, bounces);
        check_closed(0.999, 1.0, bounces);
    }
}

#[test]
fn a_lossless_closed_furnace_stops_at_the_limit() {
    let scene = closed(1.0, 1.0);
    for geometry in [
        GeometryChoice::Baked,
        GeometryChoice::List,
        GeometryChoice::Bvh,
    ] {
        let settings = Settings {
            geometry,
            ..settings(&scene, 16, 16, 16)
        };
        let film = render_gpu(&scene, &settings);
        let _left = Left::of(
            format!("lossless, {geometry:?}"),
            &film,
            &uniform(&film, [65.0; 3]),
        );
        // Every sum is a small whole number.
        assert_eq!(deviation(&film, 65.0), 0.0);
        assert_eq!(film.tally().cut_paths, 256 * 16);
        assert_eq!(film.tally().cut_throughput, 256.0 * 16.0);
    }
}

#[test]
fn paths_of_any_length_are_whole() {
    // 16 samples of 10001 rays are beyond what some drivers let a loop do: dispatches are resumed.
    let scene = closed(1.0, 1.0);
    for geometry in [
        GeometryChoice::Baked,
        GeometryChoice::List,
        GeometryChoice::Bvh,
    ] {
        let settings = Settings {
            geometry,
            max_bounces: 10_000,
            ..settings(&scene, 8, 8, 16)
        };
        let film = render_gpu(&scene, &settings);
        let wanted = uniform(&film, [10_001.0; 3]);
        let _left = Left::of(format!("long, {geometry:?}"), &film, &wanted);
        assert_eq!(deviation(&film, 10_001.0), 0.0, "{geometry:?}");
        assert_eq!(film.tally().rays, 64 * 16 * 10_001, "{geometry:?}");
    }
}

#[test]
fn roulette_does_not_change_the_mean() {
    // Per pixel the estimate has a variance now: a z-test over all of them.
    let scene = closed(0.5, 1.0);
    let film = render_gpu(&scene, &settings(&scene, 32, 32, 256));
    let (expected, _) = furnace(0.5, 64);
    let _left = Left::of("roulette", &film, &uniform(&film, [expected; 3]));
    let z = |expected: f64| {
        let (mean, error) = gpu_trace::statistics::mean_and_error(&red(&film));
        (mean - expected) / error
    };
    assert!(z(expected).abs() < 3.9, "{} deviations", z(expected));
    assert!(
        z(1.01 * expected).abs() > 3.9,
        "companion: 1 % is not found"
    );
}

/// The channels have the same paths: one of them counts.
fn red(film: &Film) -> Vec<f64> {
    (0..film.rect().pixels()).map(|i| film.mean(i)[0]).collect()
}

#[test]
fn the_lectures_estimator_has_the_same_mean() {
    let scene = closed(0.5, 1.0);
    let settings = Settings {
        integrator: gpu_trace::settings::Integrator::Lecture { termination: 0.2 },
        // The variance below is one of independent samples.
        sampler: gpu_trace::sampler::Sampler::Independent,
        ..settings(&scene, 32, 32, 1024)
    };
    let film = render_gpu(&scene, &settings);
    let _left = Left::of("the lecture's furnace", &film, &uniform(&film, [2.0; 3]));
    let (mean, error) = gpu_trace::statistics::mean_and_error(&red(&film));
    let z = (mean - 2.0) / error;
    assert!(z.abs() < 3.9, "{mean} +- {error}");
    // numerics.md, case 39: Var = (1 + 2 rho m)/(1 - q2) - m^2, m = 2, q2 = 4 rho^2/(3 (1 - p)).
    let q2 = 4.0 * 0.25 / (3.0 * 0.8);
    let variance: f64 = (1.0 + 2.0 * 0.5 * 2.0) / (1.0 - q2) - 4.0;
    let expected = (variance / (1024.0 * 1024.0)).sqrt();
    assert!(
        (error / expected - 1.0).abs() < 0.1,
        "error {error}, {expected} expected"
    );
}

#[test]
fn companion_a_wrong_furnace_is_found() {
    let (expected, tolerance) = furnace(0.9, 64);
    let run = |albedo: f64, bounces: u32| {
        let scene = closed(albedo, 1.0);
        let settings = Settings {
            roulette: Some(false),
            max_bounces: bounces,
            ..settings(&scene, 16, 16, 16)
        };
        deviation(&render_gpu(&scene, &settings), expected)
    };
    assert!(run(0.9, 64) <= tolerance);
    assert!(run(0.90001, 64) > tolerance);
    // One bounce less is 1e-4 less.
    assert!(run(0.9, 63) > tolerance);
}

/// A ball in a constant environment of 1, the camera at four radii.
fn white(material: &str, radius: f64) -> Scene {
    let distance = 4.0 * radius;
    scene(&format!(
        "[camera]\nposition = [0, 0, {distance:e}]\nlook_at = [0, 0, 0]\nfov = 36.0\n\
         [image]\nwidth = 32\nheight = 32\n[environment]\nradiance = [1, 1, 1]\n\
         [material.m]\n{material}\n[[sphere]]\ncenter = [0, 0, 0]\nradius = {radius:e}\nmaterial = \"m\"\n"
    ))
}

const LOSSLESS: [(&str, &str); 3] = [
    ("diffuse", "type = \"diffuse\"\nalbedo = [1, 1, 1]"),
    ("mirror", "type = \"mirror\"\nreflectance = [1, 1, 1]"),
    ("dielectric", "type = \"dielectric\"\nior = 1.5"),
];

#[test]
fn a_white_furnace_is_white() {
    for (name, material) in LOSSLESS {
        for radius in [1.0e-5, 1.0e-3, 0.1, 1.0, 50.0, 1.0e3, 1.0e6] {
            let scene = white(material, radius);
            let film = render_gpu(&scene, &settings(&scene, 32, 32, 64));
            let off = deviation(&film, 1.0);
            // numerics.md, case 26, asks for 1e-3. A path takes a few events, each with the
            // roundings of two divisions by the index squared: 16 u an event, 64 at most.
            let name = format!("{name}, radius {radius}");
            let what = format!("off by {off:e}");
            assert_uniform(&name, &film, 1.0, off <= 64.0 * 16.0 * U, what);
        }
    }
}

#[test]
fn companion_a_gray_furnace_is_found() {
    for material in [
        "type = \"diffuse\"\nalbedo = [0.99, 0.99, 0.99]",
        "type = \"mirror\"\nreflectance = [0.99, 0.99, 0.99]",
    ] {
        let scene = white(material, 1.0);
        let film = render_gpu(&scene, &settings(&scene, 32, 32, 64));
        assert!(deviation(&film, 1.0) > 1.0e-3, "{material}");
    }
    // A ball that absorbs a thousandth in glass: the glass is not what is white by itself.
    let scene = scene(
        "[camera]\nposition = [0, 0, 4]\nlook_at = [0, 0, 0]\nfov = 36.0\n[image]\nwidth = 32\n\
         height = 32\n[environment]\nradiance = [1, 1, 1]\n[material.g]\ntype = \"dielectric\"\n\
         ior = 1.5\n[material.d]\ntype = \"diffuse\"\nalbedo = [0.9, 0.9, 0.9]\n[[sphere]]\n\
         center = [0, 0, 0]\nradius = 1.0\nmaterial = \"g\"\n[[sphere]]\ncenter = [0, 0, 0]\n\
         radius = 0.5\nmaterial = \"d\"\n",
    );
    let film = render_gpu(&scene, &settings(&scene, 32, 32, 64));
    assert!(deviation(&film, 1.0) > 1.0e-3);
}

/// A glass ball in an environment of 1, the camera on the axis.
fn glass(camera: f64, emission: f64) -> Scene {
    scene(&format!(
        "[camera]\nposition = [0, 0, {camera}]\nlook_at = [0, 0, -9]\nfov = 36.0\n[image]\nwidth = 32\n\
         height = 32\n[environment]\nradiance = [1, 1, 1]\n[material.g]\ntype = \"dielectric\"\n\
         ior = 1.5\n[material.lamp]\ntype = \"diffuse\"\nalbedo = [0, 0, 0]\n\
         emission = [{emission}, {emission}, {emission}]\n[[sphere]]\ncenter = [0, 0, 0]\n\
         radius = 1.0\nmaterial = \"g\"\n[[sphere]]\ncenter = [0, 0, -0.5]\nradius = 0.2\n\
         material = \"lamp\"\n"
    ))
}

#[test]
fn radiance_in_glass_is_larger_by_the_index_squared() {
    // numerics.md: an emitter of n^2 times the environment's radiance vanishes in glass, and the
    // environment seen from inside has that radiance. Few events a path, with 16 roundings each.
    let image = |camera: f64, emission: f64| {
        let scene = glass(camera, emission);
        render_gpu(&scene, &settings(&scene, 32, 32, 64))
    };
    let tolerance = 64.0 * 16.0 * U;
    // From within too near to the centre for total reflection.
    for (name, camera, expected) in [("from outside", 4.0, 1.0), ("from inside", 0.3, 2.25)] {
        let film = image(camera, 2.25);
        let off = deviation(&film, expected);
        assert_uniform(name, &film, expected, off <= tolerance, off);
    }
    // Companions: without the square it shows.
    assert!(deviation(&image(4.0, 1.0), 1.0) > 0.1);
    assert!(deviation(&image(0.3, 1.0), 2.25) > 0.1);
}

#[test]
fn the_reflective_furnace_is_its_albedo() {
    // 0.37 + 0.62518 cos(theta), the angle at the camera's side; see the scene's file. A pixel of
    // the middle of the disc: all angles below 3 degrees, where 1 - cos < 1.4e-3.
    let scene = scene_file("scenes/tests/white-furnace-reflective.toml");
    let settings = settings(&scene, 65, 65, 4096);
    let film = render_gpu(&scene, &settings);
    let _left = Left::alone("the reflective furnace", &film);
    let expected = 0.37 + 0.62518;
    let middle: Vec<f64> = (31..34)
        .flat_map(|y| (31..34).map(move |x| y * 65 + x))
        .map(|i| film.mean(i)[0])
        .collect();
    let variance: f64 = (31..34)
        .flat_map(|y| (31..34).map(move |x| y * 65 + x))
        .map(|i| film.variance_of_mean(i).expect("blocks")[0])
        .sum();
    let (mean, error) = (middle.iter().sum::<f64>() / 9.0, variance.sqrt() / 9.0);
    let (low, high) = (expected - 1.4e-3 - 3.9 * error, expected + 3.9 * error);
    assert!(
        (low..high).contains(&mean),
        "{mean} +- {error} for {expected}"
    );
    assert!(
        !(low..high).contains(&(1.02 * mean)),
        "companion: 2 % is not found"
    );
}

#[test]
fn a_constant_stays_what_it_is_over_many_samples() {
    // numerics.md, case 32: a plain f32 sum of 0.1 drifts, the same way every time.
    let scene = scene(
        "[camera]\nposition = [0, 0, 0]\nlook_at = [0, 0, 1]\nfov = 90.0\n[image]\nwidth = 8\n\
         height = 8\n[environment]\nradiance = [0.1, 0.7, 0.3]\n",
    );
    for spp in [1, 3, 16, 100, 256, 4096] {
        let film = render_gpu(&scene, &settings(&scene, 8, 8, spp));
        let wanted = uniform(&film, [0.1f32, 0.7, 0.3].map(f64::from));
        let _left = Left::of(format!("a constant, {spp} samples"), &film, &wanted);
        for i in 0..64 {
            for (mean, value) in film.mean(i).iter().zip([0.1f32, 0.7, 0.3]) {
                let off = (mean / f64::from(value) - 1.0).abs();
                // A block of 4 rounds its third and fourth sum by at most u of itself (a plain sum
                // of 256 is off by some 60 u). Over the blocks, high part and correction are exact
                // together but for the roundings of the correction.
                let tolerance = if spp == 1 {
                    0.0
                } else {
                    2.0 * U + 65536.0 * U * U
                };
                assert!(
                    off <= tolerance,
                    "{spp} samples: {mean} for {value}, off by {off:e}"
                );
            }
        }
        // All pixels the same.
        let bits = image_bits(&film);
        assert!(bits.chunks(3).all(|pixel| pixel == &bits[..3]));
    }
}

#[test]
fn an_empty_scene_is_its_environment() {
    let scene = scene_file("scenes/tests/empty.toml");
    let film = render_gpu(&scene, &settings(&scene, 16, 16, 256));
    let _left = Left::of("empty", &film, &uniform(&film, [0.25, 0.5, 1.0]));
    // Powers of two: nothing is rounded.
    assert!((0..256).all(|i| film.mean(i) == [0.25, 0.5, 1.0]));
    assert_eq!(film.tally().rays, 256 * 256);
}

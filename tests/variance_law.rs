//! The variance of the estimators in a closed furnace, where it is known, for independent samples; and
//! what is said where it cannot be known.
//!
//! In a closed diffuse sphere that emits 1 a sample is a sum of weights, L = W_0 + W_1 + ... with
//! W_0 = 1 and W_n = w_1 ... w_n, the factors being independent: the direction at a vertex is
//! uniform about the normal there, wherever that is. Of the lecture's estimator w is 0 with
//! probability p and else 2 rho c/(1 - p) with a uniform cosine c, so that E w = rho and
//! E w^2 = 4 rho^2/(3 (1 - p)) = q. Then E (W_n W_(n + k)) = q^n rho^k, and E L^2 is the sum over all
//! pairs: 1/(1 - q) (1 + 2 rho/(1 - rho)). The other way is that L = 1 + w L', which gives
//! E L^2 = 1 + 2 rho m + q E L^2 with m = E L = 1/(1 - rho): the same.

use crate::common::images::{Left, uniform, with_values};
use crate::common::{job, render_cpu, render_gpu, scene};
use crate::thorough::thorough;
use gpu_trace::film::Film;
use gpu_trace::sampler::Sampler;
use gpu_trace::scene::{Scene, Sphere};
use gpu_trace::settings::{Integrator, Settings};
use gpu_trace::statistics::{mean_and_error, normal_limit};
use gpu_trace::variance::VarianceClass;
use gpu_trace::verify::settings;

/// The camera inside a closed sphere that emits 1.
fn closed(material: &str) -> Scene {
    scene(&format!(
        "[camera]\nposition = [0.3, -0.2, 0.1]\nlook_at = [0.1, 1, 0.3]\nfov = 60.0\n\
         [image]\nwidth = 16\nheight = 16\n[material.wall]\n{material}\nemission = [1, 1, 1]\n\
         [[sphere]]\ncenter = [0, 0, 0]\nradius = 1.0\nmaterial = \"wall\"\n"
    ))
}

fn diffuse(rho: f64) -> String {
    format!("type = \"diffuse\"\nalbedo = [{rho}, {rho}, {rho}]")
}

/// Variance by the sum over pairs of weights, of paths of at most `bounces` events.
fn by_pairs(rho: f64, p: f64, bounces: i32) -> f64 {
    let q = 4.0 * rho * rho / (3.0 * (1.0 - p));
    let mean: f64 = (0..=bounces).map(|n| rho.powi(n)).sum();
    let square: f64 = (0..=bounces)
        .map(|n| {
            let later: f64 = (1..=bounces - n).map(|k| rho.powi(k)).sum();
            q.powi(n) * (1.0 + 2.0 * later)
        })
        .sum();
    square - mean * mean
}

/// Variance by the recursion.
fn by_recursion(rho: f64, p: f64) -> f64 {
    let m = 1.0 / (1.0 - rho);
    let q = 4.0 * rho * rho / (3.0 * (1.0 - p));
    (1.0 + 2.0 * rho * m) / (1.0 - q) - m * m
}

/// Pairs for which the sixth moment is finite too, (2 rho)^6/(7 (1 - p)^5) < 1, so that the measured
/// variance is normal.
const PAIRS: [(f64, f64); 6] = [
    (0.2, 0.2),
    (0.4, 0.2),
    (0.55, 0.2),
    (0.5, 0.1),
    (0.6, 0.0),
    (0.35, 0.4),
];

#[test]
fn the_law_has_two_derivations() {
    for (rho, p) in PAIRS {
        let (pairs, recursion) = (by_pairs(rho, p, 64), by_recursion(rho, p));
        // What the 64 bounces of a render leave out is far below what samples show.
        let off = (pairs / recursion - 1.0).abs();
        assert!(off < 1.0e-9, "rho {rho}, p {p}: {pairs} and {recursion}");
    }
}

/// The variance of a sample, as each pixel has it by itself.
fn variances(film: &Film) -> Vec<[f64; 3]> {
    let samples = film.samples() as f64;
    let of = |i| {
        film.variance_of_mean(i)
            .expect("16 blocks")
            .map(|v| samples * v)
    };
    (0..film.rect().pixels()).map(of).collect()
}

/// The same averaged over pixels, and the standard error of that.
fn measured(film: &Film) -> (f64, f64) {
    let red = variances(film).into_iter().map(|[red, ..]| red);
    mean_and_error(&red.collect::<Vec<_>>())
}

/// To be left where a variance is not the law's.
fn left(name: String, film: &Film, law: f64) -> Left {
    let found = with_values(film, variances(film));
    Left::of(
        format!("variance, {name}"),
        &found,
        &uniform(film, [law; 3]),
    )
}

fn lecture(p: f64) -> Integrator {
    Integrator::Lecture { termination: p }
}

/// Of images of `side` pixels, where a variance that is wrong by the share `wrong` is found.
fn check(render: impl Fn(&Scene, &Settings) -> Film, side: u32, wrong: f64) {
    let limit = normal_limit(PAIRS.len());
    for (rho, p) in PAIRS {
        let scene = closed(&diffuse(rho));
        let settings = Settings {
            integrator: lecture(p),
            sampler: Sampler::Independent,
            ..settings(&scene, side, side, 256)
        };
        let (film, law) = (render(&scene, &settings), by_recursion(rho, p));
        let _left = left(format!("rho {rho}, p {p}, side {side}"), &film, law);
        let (variance, error) = measured(&film);
        let deviations = |law: f64| (variance - law) / error;
        let z = deviations(law);
        eprintln!("rho {rho}, p {p}: {variance:.5} +- {error:.5} for {law:.5}, z = {z:.2}");
        assert!(z.abs() < limit, "rho {rho}, p {p}: {z} deviations");
        for wrong in [1.0 - wrong, 1.0 + wrong] {
            let z = deviations(wrong * law);
            assert!(
                z.abs() > limit,
                "companion: {wrong} times the variance is not found for rho {rho}, p {p}: {z}"
            );
        }
    }
}

#[test]
fn the_lectures_estimator_has_its_variance() {
    check(render_gpu, 64, 0.05);
}

#[test]
fn the_reference_has_the_lectures_variance() {
    // The long form is as large as the device's.
    let (side, wrong) = if thorough() { (64, 0.05) } else { (32, 0.1) };
    check(render_cpu, side, wrong);
}

/// Variance with cosine sampling and roulette, which is exact in f32 too: a path's weight falls as
/// rho^n to 1/4, with rho^n from there on brought to 1/4 with probability s, and then stays 1/4 as
/// long as it survives, each time with probability rho.
fn with_roulette(rho: f64) -> f64 {
    let mut weight = rho;
    while weight >= 0.25 {
        weight *= rho;
    }
    let s = 4.0 * weight;
    let (mean, variance) = (0.25 / (1.0 - rho), 0.0625 * rho / (1.0 - rho).powi(2));
    s * (variance + mean * mean) - (s * mean).powi(2)
}

#[test]
fn roulette_has_its_variance() {
    let all = [0.3, 0.5, 0.55, 0.7];
    let limit = normal_limit(all.len());
    for rho in all {
        let scene = closed(&diffuse(rho));
        let settings = Settings {
            sampler: Sampler::Independent,
            ..settings(&scene, 64, 64, 256)
        };
        let (film, law) = (render_gpu(&scene, &settings), with_roulette(rho));
        let _left = left(format!("rho {rho}, roulette"), &film, law);
        let (variance, error) = measured(&film);
        let z = (variance - law) / error;
        eprintln!("rho {rho}: {variance:.5} +- {error:.5} for {law:.5}, z = {z:.2}");
        assert!(z.abs() < limit, "rho {rho}: {z} deviations");
        let z = (variance - 1.05 * law) / error;
        assert!(z.abs() > limit, "companion: rho {rho}: {z} deviations");
    }
}

#[test]
fn no_render_shows_an_infinite_variance() {
    // With q = 1.35 the limit of 64 bounces keeps the variance finite, on paper: what a million
    // samples show is a small part of it, and the error bar would be far too small.
    let scene = closed(&diffuse(0.9));
    let settings = Settings {
        integrator: lecture(0.2),
        sampler: Sampler::Independent,
        ..settings(&scene, 64, 64, 256)
    };
    let (variance, error) = measured(&render_gpu(&scene, &settings));
    let truth = by_pairs(0.9, 0.2, 64);
    eprintln!("{variance:.3e} +- {error:.1e} is seen of {truth:.3e}");
    assert!(variance + 10.0 * error < 0.01 * truth);
    assert_eq!(class(&scene, &settings), VarianceClass::Infinite);
}

fn class(scene: &Scene, settings: &Settings) -> VarianceClass {
    let job = job(scene, settings);
    let report = job.variance();
    let quiet = report.class == VarianceClass::Finite;
    assert_eq!(report.warning.is_none(), quiet, "{report:?}");
    report.class
}

fn class_with(scene: &Scene, integrator: Integrator, bounces: u32) -> VarianceClass {
    let settings = Settings {
        integrator,
        max_bounces: bounces,
        ..settings(scene, 16, 16, 64)
    };
    class(scene, &settings)
}

#[test]
fn the_class_changes_where_the_moments_do() {
    use VarianceClass::{Finite, HeavyTailed, Infinite};
    for p in [0.0, 0.1, 0.2, 0.5] {
        let kept: f64 = 1.0 - p;
        // The k-th moment of w, (2 rho)^k/((k + 1) (1 - p)^(k - 1)), is 1 here.
        let infinite = (3.0 * kept).sqrt() / 2.0;
        let heavy = (5.0 * kept.powi(3)).powf(0.25) / 2.0;
        for (rho, wanted) in [
            (heavy - 1.0e-3, Finite),
            (heavy + 1.0e-3, HeavyTailed),
            (infinite - 1.0e-3, HeavyTailed),
            (infinite + 1.0e-3, Infinite),
        ] {
            let scene = closed(&diffuse(rho));
            assert_eq!(class_with(&scene, lecture(p), 64), wanted, "{rho}, {p}");
            assert_eq!(class_with(&scene, Integrator::Bsdf, 64), Finite);
            // So few events are seen by every render.
            assert_eq!(class_with(&scene, lecture(p), 2), Finite);
        }
    }
    // What samples see of paths of n events: 64 of them are enough for exp(n D) <= 64, with D = 0.655
    // for the second moment and 1.033 for the fourth.
    let scene = closed(&diffuse(0.9));
    for (bounces, wanted) in [
        (4, Finite),
        (5, HeavyTailed),
        (6, HeavyTailed),
        (7, Infinite),
    ] {
        assert_eq!(class_with(&scene, lecture(0.2), bounces), wanted);
    }
    // The largest channel counts.
    let scene = closed("type = \"diffuse\"\nalbedo = [0.1, 0.1, 0.8]");
    assert_eq!(class_with(&scene, lecture(0.2), 64), Infinite);
}

#[test]
fn every_material_has_its_class() {
    use VarianceClass::{Finite, HeavyTailed, Infinite};
    for (material, p, wanted) in [
        // r^2/(1 - p), r^4/(1 - p)^3
        (
            "type = \"mirror\"\nreflectance = [0.9, 0.9, 0.9]",
            0.2,
            Infinite,
        ),
        (
            "type = \"mirror\"\nreflectance = [0.88, 0, 0]",
            0.2,
            HeavyTailed,
        ),
        ("type = \"mirror\"\nreflectance = [0.84, 0, 0]", 0.2, Finite),
        ("type = \"mirror\"\nreflectance = [1, 1, 1]", 0.0, Finite),
        // The lecture's lobe, 31 times as bright as a white wall, over 1 % of the hemisphere.
        (
            "type = \"reflective\"\nalbedo = [0, 0, 0]\nspecular = [1, 1, 1]\nepsilon = 0.01\nmu = 10.0",
            0.2,
            Infinite,
        ),
        (
            "type = \"reflective\"\nalbedo = [0.5, 0.5, 0.5]\nspecular = [1, 1, 1]\nepsilon = 0.01\nmu = 0.0",
            0.2,
            Finite,
        ),
        // A lobe as wide as the hemisphere is a diffuse surface of albedo pi mu: 0.7, 0.9.
        (
            "type = \"reflective\"\nalbedo = [0, 0, 0]\nspecular = [1, 1, 1]\nepsilon = 1.0\nmu = 0.2228",
            0.2,
            HeavyTailed,
        ),
        (
            "type = \"reflective\"\nalbedo = [0, 0, 0]\nspecular = [1, 1, 1]\nepsilon = 1.0\nmu = 0.2865",
            0.2,
            Infinite,
        ),
    ] {
        let scene = closed(material);
        assert_eq!(class_with(&scene, lecture(p), 64), wanted, "{material}");
    }
}

/// Balls side by side, seen from outside.
fn balls(materials: &[&str]) -> Scene {
    let mut text = "[camera]\nposition = [0, 0, 9]\nlook_at = [0, 0, 0]\nfov = 36.0\n[image]\n\
                    width = 16\nheight = 16\n[environment]\nradiance = [1, 1, 1]\n"
        .to_owned();
    for (i, material) in materials.iter().enumerate() {
        text += &format!(
            "[material.m{i}]\n{material}\n[[sphere]]\ncenter = [{}, 0, 0]\nradius = 1.0\n\
             material = \"m{i}\"\n",
            3 * i
        );
    }
    scene(&text)
}

#[test]
fn weights_without_a_bound_count() {
    use VarianceClass::{Finite, Infinite};
    let shiny =
        "type = \"ashikhmin\"\ndiffuse = [0, 0, 0]\nspecular = [0.1, 0, 0]\nnu = 10\nnv = 10";
    let black = diffuse(0.0);
    let of = |scene: &Scene| class_with(scene, lecture(0.2), 64);
    assert_eq!(of(&balls(&[shiny, shiny])), Infinite);
    assert_eq!(of(&balls(&[shiny, &black])), Finite);
    // Within a shiny room a black ball ends some paths, not all.
    let mut room = closed(shiny);
    assert_eq!(of(&room), Infinite);
    let ball = balls(&[black.as_str()]);
    room.materials.extend(ball.materials.iter().cloned());
    let material = room.materials.len() - 1;
    let inner = ball.spheres.iter().cloned().map(|sphere| Sphere {
        radius: 0.1,
        material,
        ..sphere
    });
    room.spheres.extend(inner);
    assert_eq!(of(&room), Infinite);
}

#[test]
fn a_ball_that_light_leaves_is_harmless() {
    use VarianceClass::{Finite, Infinite};
    let (white, dark) = (diffuse(1.0), diffuse(0.2));
    // No path meets the same ball twice in a row: the geometric mean of two factors counts.
    for (materials, wanted) in [
        (&[white.as_str()][..], Finite),
        (&[&white, &white], Infinite),
        (&[&white, &dark], Finite),
        (&[&white, &dark, &dark], Finite),
        (&[&white, &dark, &white], Infinite),
        // Within glass light can go round and round, and each time the survivors weigh more.
        (&["type = \"dielectric\"\nior = 1.5"], Infinite),
    ] {
        let scene = balls(materials);
        assert_eq!(
            class_with(&scene, lecture(0.2), 64),
            wanted,
            "{materials:?}"
        );
    }
    let glass = balls(&["type = \"dielectric\"\nior = 1.5"]);
    assert_eq!(class_with(&glass, lecture(0.0), 64), Finite);
}

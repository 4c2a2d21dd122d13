//! The lecture's reflective material alone: its albedo by formula, what is below the horizon, and a reference by
//! someone else's arithmetic (`references/reflective.py`). What every material has to pass is in
//! `materials.rs` and `distribution.rs`.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::common::gpu;
use glam::DVec3;
use gpu_trace::gpu::bsdf_probe::{BsdfInput, BsdfProbe, Sampled};
use gpu_trace::materials::reflective::Reflective;
use gpu_trace::materials::{MaterialKind, Surface};
use gpu_trace::settings::Integrator;
use gpu_trace::statistics::{mean_and_error, normal_limit, normal_p, sidak};
use gpu_trace::verify::{Random, ULP};

const SAMPLES: usize = 200_000;

fn gray(albedo: f64, specular: f64, epsilon: f64, mu: f64) -> Reflective {
    Reflective {
        albedo: DVec3::splat(albedo),
        specular: DVec3::splat(specular),
        epsilon,
        mu,
    }
}

/// Towards where a path came from at this angle, the normal being z; its mirror direction is along +x.
fn arrival(degrees: f64) -> DVec3 {
    let (sin, cos) = f64::to_radians(degrees).sin_cos();
    DVec3::new(-sin, 0.0, cos)
}

/// What the device draws from a material at an angle.
fn drawn(m: &Reflective, integrator: Integrator, degrees: f64) -> Vec<Sampled> {
    let probe = BsdfProbe::new(&gpu(), &[MaterialKind::from(m.clone())], integrator);
    let surface = Surface {
        normal: DVec3::Z,
        eta: 1.0,
        offset: DVec3::ZERO,
    };
    let mut random = Random::new(&format!("{m:?} {degrees}"));
    let inputs: Vec<BsdfInput> = (0..SAMPLES)
        .map(|_| BsdfInput::new(0, &surface, arrival(degrees), random.unit4()))
        .collect();
    probe.sample(&inputs).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn energy_is_what_the_formula_says() {
    // transport.md: 0.625 cos(theta) for S = 1, epsilon = 0.01, mu = 10, until the horizon clips
    // the lobe at 82 degrees. The device's mean weight is the albedo, for both integrators.
    let m = gray(0.25, 1.0, 0.01, 10.0);
    let angles = [0.0, 20.0, 45.0, 60.0, 80.0];
    let level = sidak(2 * angles.len());
    for degrees in angles {
        let theta = f64::to_radians(degrees);
        assert!(theta + (1.0 - m.epsilon).acos() < FRAC_PI_2);
        let lobe = m.mu * PI * m.epsilon * (2.0 - m.epsilon) * theta.cos();
        assert!((lobe - 0.625 * theta.cos()).abs() < 5.0e-4);
        let expected = 0.25 + lobe;
        for integrator in [Integrator::Bsdf, Integrator::Lecture { termination: 0.2 }] {
            let weights = drawn(&m, integrator, degrees);
            let weights: Vec<f64> = weights.iter().map(|s| s.weight().x).collect();
            let (mean, error) = mean_and_error(&weights);
            let p = normal_p((mean - expected) / error);
            let place = format!("{integrator:?} at {degrees} degrees: {mean} +- {error}");
            assert!(p > level, "{place} for {expected}, p = {p:e}");
            // The uniform hemisphere is a hundred times less likely to find the lobe.
            let factor = if integrator == Integrator::Bsdf {
                1.02
            } else {
                1.2
            };
            let p = normal_p((mean - factor * expected) / error);
            assert!(p < level, "companion: {place} is not found, p = {p:e}");
        }
    }
}

#[test]
fn samples_below_the_horizon_end() {
    let samples = drawn(&gray(0.3, 0.4, 0.2, 0.5), Integrator::Bsdf, 80.0);
    let below = samples.iter().filter(|s| s.wi().z < -4.0 * ULP);
    let below: Vec<&Sampled> = below.collect();
    assert!(below.iter().all(|s| s.weight == [0.0; 3]));
    assert!(
        below.len() > SAMPLES / 1000,
        "only {} were below",
        below.len()
    );
}

/// A line of the reference's table.
struct Line {
    case: String,
    degrees: f64,
    quantity: String,
    mean: f64,
    error: f64,
}

fn table() -> Vec<Line> {
    let text = include_str!("references/reflective.csv");
    let lines = text.lines().skip(1).map(|line| {
        let cells: Vec<&str> = line.split(',').collect();
        let number = |i: usize| cells[i].parse::<f64>().expect("a number");
        Line {
            case: cells[0].to_owned(),
            degrees: number(1),
            quantity: cells[2].to_owned(),
            mean: number(3),
            error: number(4),
        }
    });
    lines.collect()
}

/// A sample's share of a quantity of the table.
fn share(quantity: &str, s: &Sampled, m: &Reflective, degrees: f64) -> f64 {
    let mirrored = arrival(degrees) * DVec3::new(-1.0, 1.0, 1.0);
    let of = match quantity {
        "albedo" => 1.0,
        "lobe" => f64::from(u8::from(s.wi().dot(mirrored) > 1.0 - m.epsilon)),
        "height" => s.wi().z,
        "along" => s.wi().x,
        other => panic!("no quantity is called {other}"),
    };
    s.weight().x * of
}

#[test]
fn it_is_what_numpy_says() {
    let table = table();
    assert!(table.len() >= 40, "{} lines", table.len());
    let limit = normal_limit(table.len());
    let mut wrong = 0;
    for line in &table {
        let m = match line.case.as_str() {
            "lecture" => gray(0.37, 1.0, 0.01, 10.0),
            "wide" => gray(0.3, 0.4, 0.2, 0.5),
            other => panic!("no case is called {other}"),
        };
        let samples = drawn(&m, Integrator::Bsdf, line.degrees);
        let of = |s| share(&line.quantity, s, &m, line.degrees);
        let (mean, error) = mean_and_error(&samples.iter().map(of).collect::<Vec<f64>>());
        let z = |truth: f64| (mean - truth) / error.hypot(line.error);
        let place = format!("{}, {}, {}", line.case, line.degrees, line.quantity);
        let (found, truth) = (z(line.mean), line.mean);
        assert!(
            found.abs() < limit,
            "{place}: {mean} for {truth}, {found} deviations"
        );
        wrong += usize::from(z(1.05 * truth).abs() > limit);
    }
    // Companion: 5 % too much. What is along the surface is small where light comes from above.
    let lines = table.len();
    assert!(5 * wrong >= 4 * lines, "found {wrong} of {lines} times");
}

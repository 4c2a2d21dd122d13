//! Diffuse, mirror and dielectric on the device against their f64 twins, fed with the same f32
//! numbers. Tolerances count roundings, in ULP = 2^-23 (see `common::ULP`).

mod common;

use bytemuck::{Pod, Zeroable};
use common::{Agreement, Row, ULP, probe, to_row, vector};
use glam::DVec3;
use gpu_trace::check::Random;
use gpu_trace::reference::bsdf::dielectric::{fresnel, sample_dielectric};
use gpu_trace::reference::bsdf::diffuse::{sample_diffuse, sample_diffuse_uniform};
use gpu_trace::reference::bsdf::mirror::sample_mirror;
use gpu_trace::reference::core::sampling::sphere_direction;

const CASES: usize = 100_000;

fn double(row: Row) -> [f64; 4] {
    row.map(f64::from)
}

/// Direction, crossed; weight, compression.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Sample {
    direction: [f32; 3],
    crossed: f32,
    weight: [f32; 3],
    compression: f32,
}

impl Sample {
    fn direction(&self) -> DVec3 {
        DVec3::from(self.direction.map(f64::from))
    }

    fn weight(&self) -> DVec3 {
        DVec3::from(self.weight.map(f64::from))
    }
}

/// A normal, and a direction that arrives on its side; grazing ones among them.
fn arrival(random: &mut Random, i: usize) -> (Row, Row) {
    let n = random.direction();
    let d = random.direction();
    let d = if d.dot(n) > 0.0 { -d } else { d };
    let d = if i.is_multiple_of(8) {
        (d - (d.dot(n) + 1.0e-3) * n).normalize()
    } else {
        d
    };
    (to_row(n, 0.0), to_row(d, 0.0))
}

/// Bounds of what a driver may make of the Fresnel terms: the least and the largest share that is
/// reflected, and cos_t, for cos_t^2 off by its roundings.
fn fresnel_bounds(cos_i: f64, eta: f64) -> ([f64; 2], [f64; 2]) {
    let square = ((eta - 1.0) * (eta + 1.0) + cos_i * cos_i) / (eta * eta);
    // eta -+ 1 and their product 3; cos^2 1; the sum 1; eta^2 1 and the ratio 2.5.
    let sizes = ((eta - 1.0) * (eta + 1.0)).abs() + cos_i * cos_i;
    let error = (4.0 * sizes / (eta * eta) + 3.5 * square.abs()) * ULP;
    let cosines = [square - error, square + error].map(|s| s.max(0.0).sqrt());
    let reflected = cosines.map(|cos_t| {
        if cos_t == 0.0 {
            return 1.0;
        }
        let s = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
        let p = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
        0.5 * (s * s + p * p)
    });
    let sorted = |[a, b]: [f64; 2]| [a.min(b), a.max(b)];
    // s and p: products 1 each, in a difference and a sum of the same size; 2.5 for the ratio. At
    // most 1 in size, so twice that in their squares; 2 more. The root 4.5.
    let r = sorted(reflected);
    let c = sorted(cosines);
    (
        [r[0] - 14.0 * ULP, r[1] + 14.0 * ULP],
        [c[0] * (1.0 - 5.0 * ULP), c[1] * (1.0 + 5.0 * ULP)],
    )
}

/// How far `x` is out of a range, on top of a rounding.
fn outside(x: f64, [low, high]: [f64; 2]) -> f64 {
    (low - x).max(x - high).max(0.0)
}

fn fresnel_inputs() -> Vec<Row> {
    let mut random = Random::new("fresnel");
    let inputs = (0..CASES).map(|i| {
        let eta = [
            1.0 / 1.5,
            1.5,
            random.range(0.4, 2.5),
            1.0 + 1.0e-4 * random.unit(),
        ][i % 4];
        let critical = (1.0 - eta * eta).max(0.0).sqrt();
        let cos_i = match i % 3 {
            0 => random.unit(),
            1 => 10f64.powf(random.range(-6.0, 0.0)),
            _ => (critical * (1.0 + 1.0e-4 * (random.unit() - 0.5))).clamp(1.0e-6, 1.0),
        };
        [cos_i as f32, eta as f32, 0.0, 0.0]
    });
    inputs.collect()
}

const GLASS: [&str; 2] = ["dielectric", "interior"];

#[test]
fn fresnel_agrees() {
    let inputs = fresnel_inputs();
    let outputs: Vec<Row> = probe(&GLASS)
        .call("fresnel", &inputs)
        .expect("the probe runs");
    let run = |factor: f64| {
        let (mut share, mut cosine) = (Agreement::default(), Agreement::default());
        for (input, output) in inputs.iter().zip(&outputs) {
            let [cos_i, eta, ..] = double(*input);
            let [reflected, cos_t, ..] = double(*output);
            let twin = fresnel(cos_i, factor * eta);
            let (r, c) = fresnel_bounds(cos_i, factor * eta);
            assert!(outside(twin.reflected, r) == 0.0 && outside(twin.cos_t, c) == 0.0);
            let place = || format!("cos_i = {cos_i}, eta = {eta}: {output:?} for {twin:?}");
            share.add(outside(reflected, r), 1.0e-30, place);
            cosine.add(outside(cos_t, c), 1.0e-30, place);
            assert!((0.0..=1.0).contains(&output[0]), "share {}", output[0]);
        }
        (share, cosine)
    };
    let (share, cosine) = run(1.0);
    share.assert_holds(CASES);
    cosine.assert_holds(CASES);
    let (share, cosine) = run(1.001);
    share.assert_fails();
    cosine.assert_fails();
}

#[test]
fn fresnel_is_reciprocal() {
    // numerics.md, case 23, where the refraction is not total.
    let forward: Vec<Row> = fresnel_inputs();
    let probe = probe(&GLASS);
    let outputs: Vec<Row> = probe.call("fresnel", &forward).expect("the probe runs");
    let pairs = || forward.iter().zip(&outputs).filter(|(_, o)| o[1] > 0.0);
    for (factor, holds) in [(1.0, true), (1.01, false)] {
        let back: Vec<Row> = pairs()
            .map(|(i, o)| [o[1], factor / i[1], 0.0, 0.0])
            .collect();
        let returned: Vec<Row> = probe.call("fresnel", &back).expect("the probe runs");
        let mut agreement = Agreement::default();
        for ((input, output), back) in pairs().zip(&returned) {
            let error = f64::from((output[0] - back[0]).abs());
            let place = || format!("cos_i, eta = {input:?}: {output:?}, back {back:?}");
            agreement.add(error, 1.0e-5 / f64::from(input[0]), place);
        }
        if holds {
            agreement.assert_holds(CASES / 2);
        } else {
            assert!(agreement.any_fails(), "a wrong index is not found");
        }
    }
}

/// Largest error, in any component, of what `sphere_direction` gives (`functions.rs`).
const DIRECTION: f64 = 6.0e-7 + 6.5 * ULP;

#[test]
fn diffuse_samples_agree() {
    let mut random = Random::new("diffuse");
    let inputs: Vec<[Row; 3]> = (0..CASES)
        .map(|_| {
            [
                random.unit4(),
                to_row(random.direction(), 0.0),
                random.unit4(),
            ]
        })
        .collect();
    for lecture in [false, true] {
        let effects: &[&str] = if lecture {
            &["diffuse", "lecture"]
        } else {
            &["diffuse"]
        };
        let outputs: Vec<Sample> = probe(effects)
            .call("sample_diffuse", &inputs)
            .expect("the probe runs");
        let run = |shift: f64| {
            let mut agreement = Agreement::default();
            for ([albedo, n, u], s) in inputs.iter().zip(&outputs) {
                let (albedo, n, mut u) = (vector(*albedo), vector(*n), double(*u));
                u[0] += shift;
                let place = || format!("albedo {albedo}, n = {n}, u = {u:?}: {s:?}");
                let on_sphere = sphere_direction(glam::DVec2::new(u[0], u[1]));
                if lecture {
                    let twin = sample_diffuse_uniform(albedo, n, u);
                    // Of two opposite directions on the horizon either will do.
                    let apart = (s.direction() - twin.direction).length();
                    let either = on_sphere.dot(n).abs() < 2.0 * DIRECTION;
                    let apart = if either {
                        apart.min((s.direction() + twin.direction).length())
                    } else {
                        apart
                    };
                    agreement.add(apart, 1.8 * DIRECTION, place);
                    // The cosine: the direction, and 3 for the product with n.
                    let cosine = 1.8 * DIRECTION + 3.0 * ULP;
                    agreement.add(
                        (s.weight() - twin.weight).abs().max_element(),
                        2.0 * cosine + 2.0 * ULP,
                        place,
                    );
                } else {
                    let twin = sample_diffuse(albedo, n, u);
                    let length = (n + on_sphere).length();
                    let bound = (1.8 * DIRECTION + 2.0 * ULP) / length + 4.0 * ULP;
                    agreement.add((s.direction() - twin.direction).length(), bound, place);
                    assert_eq!(s.weight(), albedo, "the weight is the albedo, exactly");
                }
            }
            agreement
        };
        run(0.0).assert_holds(CASES);
        run(1.0e-4).assert_fails();
    }
}

/// A reflected direction: the cosine 3, the products 3 and the sum 1 of at most twice the size; 3.5
/// to normalise, and n may be longer than 1 by a rounding.
const REFLECTED: f64 = 16.0 * ULP;

#[test]
fn mirror_samples_agree() {
    let mut random = Random::new("mirror");
    let inputs: Vec<[Row; 3]> = (0..CASES)
        .map(|i| {
            let (n, d) = arrival(&mut random, i);
            [random.unit4(), n, d]
        })
        .collect();
    let outputs: Vec<Sample> = probe(&["mirror"])
        .call("sample_mirror", &inputs)
        .expect("the probe runs");
    let run = |shift: f64| {
        let mut agreement = Agreement::default();
        for ([r, n, d], s) in inputs.iter().zip(&outputs) {
            let (r, n, d) = (vector(*r), vector(*n), vector(*d));
            let twin = sample_mirror(r, (n + shift * DVec3::X).normalize(), d);
            let place = || format!("n = {n}, d = {d}: {s:?}");
            agreement.add((s.direction() - twin.direction).length(), REFLECTED, place);
            assert_eq!(s.weight(), r, "the weight is the reflectance, exactly");
        }
        agreement
    };
    run(0.0).assert_holds(CASES);
    run(1.0e-4).assert_fails();
}

#[test]
fn dielectric_samples_agree() {
    let mut random = Random::new("dielectric");
    let inputs: Vec<[Row; 3]> = (0..CASES)
        .map(|i| {
            let (n, d) = arrival(&mut random, i);
            let eta = [1.5, 1.0 / 1.5, 1.0, random.range(0.4, 2.5)][i % 4];
            [to_row(vector(n), eta), d, random.unit4()]
        })
        .collect();
    let outputs: Vec<Sample> = probe(&GLASS)
        .call("sample_dielectric", &inputs)
        .expect("the probe runs");
    let run = |factor: f64| {
        let mut agreement = Agreement::default();
        let mut crossed = 0;
        for ([n, d, u], s) in inputs.iter().zip(&outputs) {
            let eta = factor * f64::from(n[3]);
            let (n, d, u) = (vector(*n), vector(*d), double(*u));
            let cos_i = -n.dot(d);
            // The cosine's own roundings move the terms: bounds at both ends.
            let ends = [cos_i - 3.0 * ULP, cos_i + 3.0 * ULP]
                .map(|c| fresnel_bounds(c.clamp(0.0, 1.0), eta));
            let least = ends[0].0[0].min(ends[1].0[0]);
            let most = ends[0].0[1].max(ends[1].0[1]);
            if (least..=most).contains(&u[2]) {
                continue;
            }
            let twin = sample_dielectric(eta, n, d, u);
            let place = || format!("n = {n}, d = {d}, eta = {eta}, u = {u:?}: {s:?} for {twin:?}");
            let lobe = if (s.crossed != 0.0) == twin.crossed {
                0.0
            } else {
                1.0
            };
            agreement.add(lobe, 0.5, place);
            let c = fresnel(cos_i.min(1.0), eta).cos_t;
            let cos_t = outside(c, [ends[1].1[1]; 2]).max(outside(c, [ends[0].1[0]; 2]));
            // d/eta and the cosines over eta: 3.5, 3 for the cosine, cos_t's, 2 for sum and product.
            let bound = REFLECTED
                + if twin.crossed {
                    cos_t + 10.0 * ULP / eta
                } else {
                    0.0
                };
            agreement.add((s.direction() - twin.direction).length(), bound, place);
            let weight = (s.weight() - twin.weight).abs().max_element();
            agreement.add(weight, 5.0 * ULP * twin.weight.x, place);
            let compression = (f64::from(s.compression) - twin.compression).abs();
            agreement.add(compression, 2.0 * ULP * twin.compression, place);
            crossed += usize::from(twin.crossed);
        }
        (agreement, crossed)
    };
    let (agreement, crossed) = run(1.0);
    agreement.assert_holds(3 * CASES);
    assert!(
        (CASES / 4..CASES).contains(&crossed),
        "{crossed} of {CASES} refracted"
    );
    assert!(run(1.001).0.any_fails(), "a wrong index is not found");
}

//! The lecture's reflective material on the device against its f64 twin; reciprocity and energy.

mod common;

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use bytemuck::{Pod, Zeroable};
use common::{Agreement, Row, ULP, probe, to_row, vector};
use glam::{DVec2, DVec3};
use gpu_trace::check::Random;
use gpu_trace::reference::bsdf::reflective::{
    Reflective, eval_reflective, in_lobe, lobe_probability, sample_reflective,
    sample_reflective_uniform,
};
use gpu_trace::reference::core::sampling::sphere_direction;
use gpu_trace::statistics::{mean_and_error, normal_p, sidak};

const CASES: usize = 100_000;

/// Largest error, in any component, of what `sphere_direction` gives (`functions.rs`).
const DIRECTION: f64 = 6.0e-7 + 6.5 * ULP;

/// The rows of `sample_reflective`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Input {
    color: [f32; 3],
    epsilon: f32,
    specular: [f32; 3],
    mu: f32,
    normal: [f32; 3],
    lobe_weight: f32,
    arrival: [f32; 3],
    color_weight: f32,
    u: Row,
}

#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Sample {
    direction: [f32; 3],
    crossed: f32,
    weight: [f32; 3],
    compression: f32,
}

fn wide(v: [f32; 3]) -> DVec3 {
    DVec3::from(v.map(f64::from))
}

fn luminance(v: [f32; 3]) -> f64 {
    wide(v).dot(DVec3::new(0.2126, 0.7152, 0.0722))
}

impl Input {
    /// Weights as the host forms them.
    fn weighed(mut self) -> Self {
        let epsilon = f64::from(self.epsilon);
        let lobe = f64::from(self.mu) * PI * epsilon * (2.0 - epsilon);
        self.lobe_weight = (lobe * luminance(self.specular)) as f32;
        self.color_weight = luminance(self.color) as f32;
        self
    }

    fn material(&self) -> Reflective {
        Reflective {
            color: wide(self.color),
            specular: wide(self.specular),
            epsilon: f64::from(self.epsilon),
            mu: f64::from(self.mu),
        }
    }

    fn u(&self) -> [f64; 4] {
        self.u.map(f64::from)
    }
}

fn inputs(name: &str) -> Vec<Input> {
    let mut random = Random::new(name);
    (0..CASES)
        .map(|i| {
            let n = random.direction();
            let d = random.direction();
            let d = if d.dot(n) > 0.0 { -d } else { d };
            let [r, g, b, s] = random.unit4();
            // Pure lobes and pure diffuse parts among them.
            let (color, specular) = match i % 8 {
                0 => ([0.0; 3], [s; 3]),
                1 => ([r, g, b], [0.0; 3]),
                _ => ([r, g, b], [s, r, g]),
            };
            let three = |v: DVec3| v.as_vec3().to_array();
            let input = Input {
                color,
                epsilon: 10f64.powf(random.range(-4.0, 0.0)) as f32,
                specular,
                mu: 10f64.powf(random.range(-1.0, 2.0)) as f32,
                normal: three(n),
                lobe_weight: 0.0,
                arrival: three(d),
                color_weight: 0.0,
                u: random.unit4(),
            };
            input.weighed()
        })
        .collect()
}

/// A direction d_r: as in `materials.rs`.
const REFLECTED: f64 = 16.0 * ULP;

#[test]
fn samples_agree() {
    let inputs = inputs("reflective");
    let outputs: Vec<Sample> = probe(&["reflective"])
        .call("sample_reflective", &inputs)
        .expect("the probe runs");
    let run = |shift: f64| {
        let mut agreement = Agreement::default();
        for (input, s) in inputs.iter().zip(&outputs) {
            let (n, d, mut u) = (wide(input.normal), wide(input.arrival), input.u());
            u[1] += shift;
            let m = input.material();
            let d_r = d.reflect(n).normalize();
            let cos_o = n.dot(d_r);
            let q = lobe_probability(&m, cos_o.max(0.0));
            // The cosine of d_r, the products and the ratio: 4.
            let q_error =
                (REFLECTED + 3.0 * ULP) / cos_o.max(1.0e-9) * q * (1.0 - q) + 8.0 * ULP * q;
            if (u[2] - q).abs() <= q_error {
                continue;
            }
            let twin = sample_reflective(&m, n, d, u);
            let chosen = u[2] < q;
            let place = || format!("{input:?}: {s:?} for {twin:?}, q = {q}");
            // `functions.rs`: cap_direction and cosine_direction.
            let x = m.epsilon * u[0];
            let direction = if chosen {
                REFLECTED + (1.5e-6 + 10.0 * ULP) * (x * (2.0 - x)).sqrt() + 7.0 * ULP
            } else {
                let length = (n + sphere_direction(DVec2::new(u[0], u[1]))).length();
                (1.8 * DIRECTION + 2.0 * ULP) / length + 4.0 * ULP
            };
            agreement.add(
                (wide(s.direction) - twin.direction).length(),
                direction,
                place,
            );

            // On the edges of horizon and lobe either answer will do.
            let cosine = n.dot(twin.direction);
            let off = (twin.direction - d_r).length();
            let edge = (2.0 * m.epsilon).sqrt();
            let unsure = (off - edge).abs() < direction + REFLECTED + 4.0 * ULP * edge;
            if cosine.abs() < 2.0 * direction || unsure && !chosen {
                continue;
            }
            // weight = f cos/pdf. pdf: q's error, that of 1 - q, of the cosine, and 4 products.
            let lobe = chosen || in_lobe(&m, twin.direction, d_r);
            let cap = if lobe { 1.0 / (TAU * m.epsilon) } else { 0.0 };
            let pdf = q * cap + (1.0 - q) * cosine / PI;
            let cosine_error = direction + 3.0 * ULP;
            let pdf_error = (q_error + ULP) * (cap + cosine / PI)
                + cosine_error * (1.0 - q) / PI
                + 8.0 * ULP * pdf;
            // Where the pdf is only the diffuse part, the errors of the cosine in it and in the
            // numerator are one and the same; to count both is on the safe side.
            let relative = 2.0 * (cosine_error / cosine + pdf_error / pdf + 6.0 * ULP);
            let error = (wide(s.weight) - twin.weight).abs().max_element();
            agreement.add(error, relative * twin.weight.max_element() + 1.0e-37, place);
        }
        agreement
    };
    run(0.0).assert_holds(CASES);
    assert!(run(1.0e-3).any_fails(), "wrong samples are not found");
}

#[test]
fn samples_below_the_horizon_end() {
    let inputs = inputs("horizon");
    let outputs: Vec<Sample> = probe(&["reflective"])
        .call("sample_reflective", &inputs)
        .expect("the probe runs");
    let mut below = 0;
    for (input, s) in inputs.iter().zip(&outputs) {
        let cosine = wide(input.normal).dot(wide(s.direction));
        if cosine < -4.0 * ULP {
            assert_eq!(s.weight, [0.0; 3], "{input:?}: {s:?}");
            below += 1;
        }
    }
    assert!(below > CASES / 1000, "only {below} were below the horizon");
}

#[test]
fn uniform_samples_agree() {
    let inputs = inputs("uniform reflective");
    let probe = probe(&["reflective", "lecture"]);
    let outputs: Vec<Sample> = probe
        .call("sample_reflective", &inputs)
        .expect("the probe runs");
    let run = |shift: f64| {
        let mut agreement = Agreement::default();
        for (input, s) in inputs.iter().zip(&outputs) {
            let (n, d, mut u) = (wide(input.normal), wide(input.arrival), input.u());
            u[1] += shift;
            let m = input.material();
            let twin = sample_reflective_uniform(&m, n, d, u);
            let cosine = n.dot(twin.direction);
            let d_r = d.reflect(n).normalize();
            let bound = 1.8 * DIRECTION;
            let unsure = ((twin.direction - d_r).length() - (2.0 * m.epsilon).sqrt()).abs();
            if cosine < 2.0 * bound || unsure < 2.0 * bound + REFLECTED {
                continue;
            }
            let place = || format!("{input:?}: {s:?} for {twin:?}");
            agreement.add((wide(s.direction) - twin.direction).length(), bound, place);
            let relative = (bound + 3.0 * ULP) / cosine + 8.0 * ULP;
            let error = (wide(s.weight) - twin.weight).abs().max_element();
            agreement.add(error, relative * twin.weight.max_element() + 1.0e-37, place);
        }
        agreement
    };
    run(0.0).assert_holds(CASES);
    run(1.0e-3).assert_fails();
}

#[test]
fn the_brdf_is_reciprocal() {
    // f(arrival -> w) = f(-w -> -arrival): w.d_r is symmetric. On the edge of the lobe either
    // answer will do.
    let mut random = Random::new("reciprocity");
    let mut inputs = Vec::new();
    for input in self::inputs("reciprocity") {
        let (n, d) = (wide(input.normal), wide(input.arrival));
        let d_r = d.reflect(n).normalize();
        // Half of them near the lobe.
        let spread = (2.0 * f64::from(input.epsilon)).sqrt();
        let w = if random.unit() < 0.5 {
            d_r + spread * random.direction()
        } else {
            random.direction()
        };
        let w = w.normalize();
        let edge = ((w - d_r).length() - spread).abs();
        if w.dot(n) > 0.0 && edge > 2.0 * REFLECTED {
            let first = [input.color, input.specular];
            let rows = |d: DVec3, w: DVec3| -> [Row; 5] {
                let [c, s] = first;
                [
                    [c[0], c[1], c[2], input.epsilon],
                    [s[0], s[1], s[2], input.mu],
                    to_row(n, 0.0),
                    to_row(d, 0.0),
                    to_row(w, 0.0),
                ]
            };
            inputs.push((input, rows(d, w), rows(-w, -d), rows(-w, d)));
        }
    }
    let probe = probe(&["reflective"]);
    let call = |rows: Vec<[Row; 5]>| -> Vec<Row> {
        probe
            .call("eval_reflective", &rows)
            .expect("the probe runs")
    };
    let there = call(inputs.iter().map(|i| i.1).collect());
    let back = call(inputs.iter().map(|i| i.2).collect());
    let wrong = call(inputs.iter().map(|i| i.3).collect());
    let (mut agreement, mut twins, mut companion) = (
        Agreement::default(),
        Agreement::default(),
        Agreement::default(),
    );
    let mut lobes = 0;
    for (i, (input, rows, ..)) in inputs.iter().enumerate() {
        let place = || format!("{rows:?}: {:?} and {:?}", there[i], back[i]);
        let apart = |a: Row, b: Row| (vector(a) - vector(b)).abs().max_element();
        let size = vector(there[i]).max_element();
        agreement.add(apart(there[i], back[i]), 1.0e-5 * size + 1.0e-37, place);
        if there[i][3] == 1.0 {
            lobes += 1;
            companion.add(
                apart(there[i], wrong[i]),
                1.0e-5 * size + 1.0e-37,
                String::new,
            );
        }
        let m = input.material();
        let d_r = vector(rows[3]).reflect(vector(rows[2])).normalize();
        let twin = eval_reflective(&m, in_lobe(&m, vector(rows[4]), d_r));
        let error = (vector(there[i]) - twin).abs().max_element();
        twins.add(error, 5.0 * ULP * twin.max_element() + 1.0e-37, place);
    }
    assert!(lobes > 1000, "only {lobes} in the lobe");
    agreement.assert_holds(CASES / 4);
    twins.assert_holds(CASES / 4);
    companion.assert_fails();
}

/// Albedo of the material for light that leaves at the angle `theta`, by quadrature.
fn albedo(m: &Reflective, theta: f64) -> f64 {
    const RINGS: u32 = 4000;
    const STEPS: u32 = 400;
    let n = DVec3::Z;
    let d_r = DVec3::new(theta.sin(), 0.0, theta.cos());
    // About d_r, so that the edge of the lobe lies between two rings; midpoints.
    let mut lobe = 0.0;
    for i in 0..RINGS {
        let x = m.epsilon * (f64::from(i) + 0.5) / f64::from(RINGS);
        let sine = (x * (2.0 - x)).sqrt();
        for j in 0..STEPS {
            let (s, c) = (TAU * (f64::from(j) + 0.5) / f64::from(STEPS)).sin_cos();
            let across = DVec3::new(theta.cos(), 0.0, -theta.sin());
            let w = (1.0 - x) * d_r + sine * (c * across + s * DVec3::Y);
            assert!(in_lobe(m, w, d_r));
            lobe += w.dot(n).max(0.0);
        }
    }
    let solid_angle = TAU * m.epsilon / f64::from(RINGS * STEPS);
    let base = eval_reflective(m, false).x;
    base * PI + (eval_reflective(m, true).x - base) * lobe * solid_angle
}

#[test]
fn energy_is_what_the_formula_says() {
    // transport.md: 0.625 cos(theta) for S = 1, epsilon = 0.01, mu = 10, until the horizon clips
    // the lobe at 82 degrees. The device's mean weight is the albedo, for both integrators.
    let color = 0.25f32;
    let m = Reflective {
        color: DVec3::splat(f64::from(color)),
        specular: DVec3::ONE,
        epsilon: f64::from(0.01f32),
        mu: 10.0,
    };
    let angles = [0.0, 20.0, 45.0, 60.0, 80.0, 85.0, 89.0];
    let mut random = Random::new("energy");
    let level = sidak(2 * angles.len());
    for degrees in angles {
        let theta = f64::to_radians(degrees);
        let expected = albedo(&m, theta);
        let formula = m.mu * PI * m.epsilon * (2.0 - m.epsilon) * theta.cos();
        let lobe = expected - f64::from(color);
        if theta + (1.0 - m.epsilon).acos() < FRAC_PI_2 {
            assert!(
                (lobe - formula).abs() < 1.0e-6,
                "{degrees}: {lobe} for {formula}"
            );
        } else {
            assert!(
                lobe < 1.2 * formula + 0.02,
                "{degrees}: {lobe} beyond the horizon"
            );
        }
        assert!((formula - 0.625 * theta.cos()).abs() < 5.0e-4);
        let input = |u| {
            Input {
                color: [color; 3],
                epsilon: 0.01,
                specular: [1.0; 3],
                mu: 10.0,
                normal: [0.0, 0.0, 1.0],
                lobe_weight: 0.0,
                arrival: [theta.sin() as f32, 0.0, -theta.cos() as f32],
                color_weight: 0.0,
                u,
            }
            .weighed()
        };
        let inputs: Vec<Input> = (0..200_000).map(|_| input(random.unit4())).collect();
        for effects in [&["reflective"][..], &["reflective", "lecture"]] {
            let outputs: Vec<Sample> = probe(effects)
                .call("sample_reflective", &inputs)
                .expect("the probe runs");
            let weights: Vec<f64> = outputs.iter().map(|s| f64::from(s.weight[0])).collect();
            let (mean, error) = mean_and_error(&weights);
            let p = normal_p((mean - expected) / error);
            assert!(
                p > level,
                "{effects:?} at {degrees} degrees: {mean} +- {error} for {expected}, p = {p:e}"
            );
            // The uniform hemisphere is a hundred times less likely to find the lobe.
            let factor = if effects.contains(&"lecture") {
                1.2
            } else {
                1.02
            };
            let p = normal_p((mean - factor * expected) / error);
            assert!(
                p < level,
                "companion: {effects:?} at {degrees} degrees is not found, p = {p:e}"
            );
        }
    }
}

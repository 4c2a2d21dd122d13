//! Cases 1, 3, 6 and 9: a ray against one sphere, by the kernel's own solvers.
//!
//! The truth is the same formula in f64, with the f32 numbers that the kernel got.

use glam::DVec3;

use super::Case;
use super::context::Context;
use crate::effects::Effect;
use crate::error::Result;
use crate::reference::scene::sphere::{
    Quadratic, pole_quadratic, root_interior, root_outside, sphere_quadratic,
};
use crate::verify::{Measure, Random, Row, ULP, to_row, vector};

pub(super) const CASES: &[Case] = &[
    Case {
        id: 1,
        name: "a far sphere",
        setup: "radius 1 at distances 1e3 to 1e5, impact below 0.99: distance in units of \
                8 ulp(D) (1 + b/sqrt(R^2 - b^2)); no wrong hit or miss",
        run: far,
    },
    Case {
        id: 3,
        name: "a huge sphere from nearby",
        setup: "radius 1e3 to 1e8, from 0.01 to 10 above or below the surface: distance in units \
                of its bound, 1e-6 (1 + (|B| + |d|)/S) and the rounding of C",
        run: huge,
    },
    Case {
        id: 6,
        name: "grazing rays",
        setup: "impact R (1 +- e), e = 1e-7 to 1e-3, from distances to 1e3: hit or miss is wrong \
                only within 4 ulp(D) of the silhouette",
        run: grazing,
    },
    Case {
        id: 9,
        name: "directions of any length",
        setup: "|d| = 1e-15 to 1e15, powers of two: t |d| is that of the unit direction to 4 ulp; \
                other lengths: t within 4 ulp(D) (1 + b/sqrt(R^2 - b^2))",
        run: lengths,
    },
];

pub(super) const NO_HIT: f64 = 3.0e38f32 as f64;

/// The distance of f32 numbers of the size of x.
pub(super) fn ulp(x: f64) -> f64 {
    (x.abs().log2().floor() - 23.0).exp2()
}

/// A ray from distance `distance` whose line passes the centre at `impact`: origin and direction.
pub(super) fn ray(random: &mut Random, distance: f64, impact: f64) -> (DVec3, DVec3) {
    let d = random.direction();
    let across = d.cross(random.direction()).normalize();
    let along = (distance * distance - impact * impact).max(0.0).sqrt();
    (impact * across - along * d, d)
}

/// Rays against spheres about their centres: [f, radius], [direction, 0].
fn solve(context: &Context, inputs: &[[Row; 2]]) -> Result<Vec<[Row; 2]>> {
    context.probe(&[])?.call("sphere_quadratic", inputs)
}

/// The twin on the same numbers, with the radius times `factor`; and the impact parameter.
fn twin([f, d]: [Row; 2], factor: f64) -> (Quadratic, f64) {
    let (radius, f, d) = (factor * f64::from(f[3]), vector(f), vector(d));
    let impact = f.cross(d).length() / d.length();
    (sphere_quadratic(f, d, radius), impact)
}

/// Whether the line of a ray passes so near to the silhouette that f32 may say either.
fn undecided(impact: f64, radius: f64, distance: f64) -> bool {
    (impact - radius).abs() <= 4.0 * ulp(distance)
}

fn far(context: &Context) -> Result<Measure> {
    let mut random = Random::new("far");
    let inputs: Vec<[Row; 2]> = (0..context.size(50_000, 500_000))
        .map(|_| {
            let distance = random.magnitude(3.0, 5.0);
            let impact = random.range(0.0, 0.99);
            let (f, d) = ray(&mut random, distance, impact);
            [to_row(f, 1.0), to_row(d, 0.0)]
        })
        .collect();
    let outputs = solve(context, &inputs)?;
    let mut measure = Measure::new(1.0, "of the bound");
    for (input, [_, t]) in inputs.iter().zip(&outputs) {
        let (q, impact) = twin(*input, context.disturbed(1.0e-2));
        let distance = vector(input[0]).length();
        // Rounded to f32, some impacts are beyond the radius.
        if undecided(impact, 1.0, distance) {
            continue;
        }
        let t = f64::from(t[0]);
        let error = match root_outside(&q, false) {
            Some(truth) => {
                let slope = impact / (1.0 - impact * impact).max(0.0).sqrt();
                (t - truth).abs() / (8.0 * ulp(distance) * (1.0 + slope))
            }
            None if t == NO_HIT => 0.0,
            None => f64::INFINITY,
        };
        measure.add(error, || {
            format!("from {distance:.6e}, impact {impact:.6}: t = {t}")
        });
    }
    Ok(measure)
}

fn grazing(context: &Context) -> Result<Measure> {
    let mut random = Random::new("grazing");
    let inputs: Vec<[Row; 2]> = (0..context.size(50_000, 500_000))
        .map(|_| {
            let radius = random.magnitude(-3.0, 3.0);
            let e = random.magnitude(-7.0, -3.0) * (random.unit() - 0.5).signum();
            let distance = radius * random.magnitude(0.1, 3.0);
            let (f, d) = ray(&mut random, distance, radius * (1.0 + e));
            [to_row(f, radius), to_row(d, 0.0)]
        })
        .collect();
    let outputs = solve(context, &inputs)?;
    let mut measure = Measure::new(0.0, "wrong hits or misses");
    for (input, [_, t]) in inputs.iter().zip(&outputs) {
        let radius = f64::from(input[0][3]);
        let (q, impact) = twin(*input, context.disturbed(1.0e-3));
        let distance = vector(input[0]).length();
        if undecided(impact, radius, distance) {
            continue;
        }
        let hits = f64::from(t[0]) != NO_HIT;
        let wrong = hits != root_outside(&q, false).is_some();
        measure.count(1, u64::from(wrong), || {
            format!("radius {radius:e} from {distance:e}, impact {impact:e}: hit {hits}")
        });
    }
    Ok(measure)
}

fn lengths(context: &Context) -> Result<Measure> {
    let mut random = Random::new("lengths");
    let mut inputs: Vec<[Row; 2]> = Vec::new();
    let mut add = |power: bool| {
        let distance = random.range(1.5, 20.0);
        let impact = random.range(0.0, 0.9);
        let (f, d) = ray(&mut random, distance, impact);
        let exponent = random.range(-50.0, 50.0);
        // A power of two leaves the direction as it is.
        let scale = if power { exponent.round() } else { exponent }.exp2();
        let unit = to_row(d, 0.0);
        let other = unit.map(|x| (f64::from(x) * scale) as f32);
        inputs.extend([[to_row(f, 1.0), unit], [to_row(f, 1.0), other]]);
    };
    for i in 0..context.size(20_000, 200_000) {
        add(i % 2 == 0);
    }
    let outputs = solve(context, &inputs)?;
    let factor = context.disturbed(1.0e-5);
    let mut measure = Measure::new(4.0, "ulp, or of the bound's");
    for (i, (pair, out)) in inputs
        .chunks_exact(2)
        .zip(outputs.chunks_exact(2))
        .enumerate()
    {
        let (unit, other) = (f64::from(out[0][1][0]), f64::from(out[1][1][0]));
        let length = vector(pair[1][1]).length();
        if i % 2 == 0 {
            let scale = length / vector(pair[0][1]).length();
            let error = (other * scale - unit * factor).abs() / ulp(unit);
            measure.add(error, || format!("length {length:e}: t = {other:e}"));
            continue;
        }
        let (q, impact) = twin(pair[1], 1.0);
        let truth = factor * root_outside(&q, false).unwrap_or(NO_HIT);
        let slope = 1.0 + impact / (1.0 - impact * impact).sqrt();
        let bound = ulp(vector(pair[1][0]).length()) * slope;
        measure.add((other - truth).abs() * length / bound, || {
            format!("length {length:e}: t = {other:e} for {truth:e}")
        });
    }
    Ok(measure)
}

fn huge(context: &Context) -> Result<Measure> {
    let mut random = Random::new("huge");
    let inputs: Vec<[Row; 3]> = (0..context.size(50_000, 500_000))
        .map(|_| {
            let radius = random.magnitude(3.0, 8.0);
            let n = random.direction();
            let side = if random.unit() < 0.5 { -1.0 } else { 1.0 };
            let height = side * random.magnitude(-2.0, 1.0);
            let across = random.range(-30.0, 30.0) * n.any_orthonormal_vector();
            let d = random.direction();
            let d = if d.dot(n) * height > 0.0 { -d } else { d };
            [
                to_row(height * n + across, 1.0 / radius),
                to_row(d, 0.0),
                to_row(n, 0.0),
            ]
        })
        .collect();
    let probe = context.probe(&[Effect::Interior, Effect::Pole])?;
    let outputs: Vec<[Row; 3]> = probe.call("pole_quadratic", &inputs)?;
    let mut measure = Measure::new(1.0, "of the bound");
    for ([x, d, n], [_, outside, inside]) in inputs.iter().zip(&outputs) {
        let k = context.disturbed(1.0e-2) * f64::from(x[3]);
        let (x, d, n) = (vector(*x), vector(*d), vector(*n));
        // What the disturbance moves is the surface, by about its height.
        let lift = (context.disturbed(1.0e-3) - 1.0) * n;
        let q = pole_quadratic(x + lift, d, n, k);
        let c_error = ULP * (5.0 * k * x.length_squared() + 6.0 * x.length() + q.c.abs());
        let root = if q.c < 0.0 {
            Some((f64::from(inside[0]), root_interior(&q, false)))
        } else {
            root_outside(&q, false).map(|truth| (f64::from(outside[0]), truth))
        };
        // Near the horizon f32 may say either, and so may it on the surface.
        let b_error = 1.0e-6 * (k * x.length() + 1.0) * d.length();
        let square_error =
            2.0 * q.b.abs() * b_error + q.a * c_error + 4.0 * ULP * (q.b * q.b + q.a * q.c.abs());
        let Some((t, truth)) = root else { continue };
        if q.square < 4.0 * square_error || q.c.abs() < 16.0 * c_error {
            continue;
        }
        let s = q.square.sqrt();
        let bound = 1.0e-6 * (1.0 + (q.b.abs() + d.length()) / s) + c_error / q.c.abs();
        measure.add((t / truth - 1.0).abs() / bound, || {
            format!("R = {:e}, x = {x}, d = {d}: t = {t} for {truth}", 1.0 / k)
        });
    }
    Ok(measure)
}

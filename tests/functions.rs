//! The functions of `core/` and the ray-sphere solver on the device against its f64 twin, fed with the same
//! f32 numbers. Tolerances count roundings, in ULP = 2^-23 (see `gpu_trace::verify::ULP`). The companions feed
//! the twin with slightly wrong numbers: at least half of the cases must then be off.

use crate::common::probe;
use glam::{DVec2, DVec3};
use gpu_trace::reference::scene::sphere::{Quadratic, root_outside, sphere_quadratic};
use gpu_trace::sampling::directions::{
    basis_around, cap_direction, circle_point, cosine_direction, sphere_direction,
};
use gpu_trace::verify::{Agreement, Random, Row, ULP, to_row, vector};

const CASES: usize = 100_000;
const NO_HIT: f32 = 3.0e38;

fn double(row: Row) -> [f64; 4] {
    row.map(f64::from)
}

/// A unit vector as f32 has it; axes and near axes among them.
fn unit_row(random: &mut Random, i: usize, w: f64) -> Row {
    let axes = [
        DVec3::X,
        DVec3::Y,
        DVec3::Z,
        -DVec3::X,
        -DVec3::Y,
        -DVec3::Z,
    ];
    let d = match i % 8 {
        0 => axes[i / 8 % 6],
        1 => (axes[i / 8 % 6] + 1.0e-4 * random.direction()).normalize(),
        _ => random.direction(),
    };
    to_row(d, w)
}

/// What `circle_point` promises, per component.
const CIRCLE: f64 = 6.0e-7;

#[test]
fn circle_point_agrees() {
    let run = |shift: f64| {
        let inputs: Vec<Row> = (0..1 << 20)
            .map(|i| [(f64::from(i) / f64::from(1 << 20)) as f32, 0.0, 0.0, 0.0])
            .collect();
        let outputs: Vec<Row> = probe(&[])
            .call("circle_point", &inputs)
            .expect("the probe runs");
        let mut agreement = Agreement::default();
        for (u, p) in inputs.iter().zip(&outputs) {
            let twin = circle_point(f64::from(u[0]) + shift);
            let error = (DVec2::new(f64::from(p[0]), f64::from(p[1])) - twin)
                .abs()
                .max_element();
            agreement.add(error, CIRCLE, || format!("u = {}", u[0]));
        }
        agreement
    };
    run(0.0).assert_holds(1 << 20);
    run(1.0e-6).assert_fails();
}

/// Roundings of `sphere_direction`: u (1 - u) 1, square root 4.5 and half of that 1, the circle
/// CIRCLE, the product 1.
const DIRECTION: f64 = CIRCLE + 6.5 * ULP;

#[test]
fn sphere_direction_agrees() {
    let run = |shift: f64| {
        let mut random = Random::new("sphere");
        let inputs: Vec<Row> = (0..CASES).map(|_| random.unit4()).collect();
        let outputs: Vec<Row> = probe(&[])
            .call("sphere_direction", &inputs)
            .expect("the probe runs");
        let mut agreement = Agreement::default();
        for (u, w) in inputs.iter().zip(&outputs) {
            let u = double(*u);
            let twin = sphere_direction(DVec2::new((u[0] + shift).min(1.0), u[1]));
            let error = (vector(*w) - twin).abs().max_element();
            agreement.add(error, DIRECTION, || format!("u = {u:?}"));
        }
        agreement
    };
    run(0.0).assert_holds(CASES);
    run(1.0e-5).assert_fails();
}

#[test]
fn cosine_direction_agrees() {
    let run = |shift: f64| {
        let mut random = Random::new("cosine");
        let inputs: Vec<[Row; 2]> = (0..CASES)
            .map(|i| [unit_row(&mut random, i, 0.0), random.unit4()])
            .collect();
        let outputs: Vec<Row> = probe(&[])
            .call("cosine_direction", &inputs)
            .expect("the probe runs");
        let mut agreement = Agreement::default();
        for ([n, u], w) in inputs.iter().zip(&outputs) {
            let (n, u) = (
                vector(*n),
                DVec2::new(f64::from(u[0]) + shift, f64::from(u[1])),
            );
            let twin = cosine_direction(n, u);
            // n + direction: an error of the direction (its length: sqrt 3 times the largest), and
            // a rounding; near the antipode of n the sum is short. Then 2 to normalise, 1 to scale.
            let length = (n + sphere_direction(u)).length();
            let tolerance = (1.8 * DIRECTION + 2.0 * ULP) / length + 4.0 * ULP;
            let error = (vector(*w) - twin).length();
            agreement.add(error, tolerance, || format!("n = {n}, u = {u}"));
        }
        agreement
    };
    run(0.0).assert_holds(CASES);
    run(1.0e-4).assert_fails();
}

/// numerics.md, case 22.
const BASIS: f64 = 2.0e-7;

#[test]
fn basis_around_agrees_and_is_orthonormal() {
    let run = |shift: f64| {
        let mut random = Random::new("basis");
        let mut inputs: Vec<Row> = (0..CASES).map(|i| unit_row(&mut random, i, 0.0)).collect();
        // Both signs of zero and the last step before the pole of the formula.
        inputs.extend([
            [1.0, 0.0, 0.0, 0.0],
            [1.0, 0.0, -0.0, 0.0],
            [1.0e-7, 0.0, -1.0, 0.0],
        ]);
        let outputs: Vec<[Row; 2]> = probe(&[])
            .call("basis_around", &inputs)
            .expect("the probe runs");
        let mut agreement = Agreement::default();
        for (n, [t, b]) in inputs.iter().zip(&outputs) {
            let twin = basis_around(vector(*n) + DVec3::splat(shift));
            let (n, t, b) = (vector(*n), vector(*t), vector(*b));
            let apart = (t - twin.tangent)
                .abs()
                .max((b - twin.bitangent).abs())
                .max_element();
            agreement.add(apart, BASIS, || format!("n = {n}"));
            // n itself is a unit vector within half a rounding of each component: 0.87 u in length,
            // which the products inherit.
            for product in [
                n.dot(t),
                n.dot(b),
                t.dot(b),
                0.5 * (t.length() - 1.0),
                0.5 * (b.length() - 1.0),
            ] {
                agreement.add(product.abs(), 2.0 * BASIS, || {
                    format!("n = {n}, product {product}")
                });
            }
        }
        agreement
    };
    run(0.0).assert_holds(CASES);
    let broken = run(1.0e-3);
    assert!(broken.any_fails(), "a wrong basis is not found");
}

#[test]
fn cap_direction_agrees() {
    let run = |factor: f64| {
        let mut random = Random::new("cap");
        let inputs: Vec<[Row; 2]> = (0..CASES)
            .map(|i| {
                let height = 10f64.powf(random.range(-8.0, 0.0));
                [unit_row(&mut random, i, height), random.unit4()]
            })
            .collect();
        let outputs: Vec<Row> = probe(&[])
            .call("cap_direction", &inputs)
            .expect("the probe runs");
        let mut agreement = Agreement::default();
        for ([axis, u], w) in inputs.iter().zip(&outputs) {
            let (height, u) = (f64::from(axis[3]), double(*u));
            let twin = cap_direction(vector(*axis), factor * height, DVec2::new(u[0], u[1]));
            // Across: x, 2 - x, their product 3, the square root 4.5 and half of that, the circle,
            // the products with the basis 2, the basis BASIS, the sums 2: all times the sine.
            // Along: x, 1 - x, the product, the sum; 3 to normalise.
            let sine = (height * u[0] * (2.0 - height * u[0])).sqrt();
            let across = 1.5 * CIRCLE + 1.8 * BASIS + 10.0 * ULP;
            let tolerance = across * sine + 7.0 * ULP;
            let error = (vector(*w) - twin).length();
            agreement.add(error, tolerance, || format!("axis = {axis:?}, u = {u:?}"));
        }
        agreement
    };
    run(1.0).assert_holds(CASES);
    assert!(run(1.01).any_fails(), "a wrong cap is not found");
}

#[test]
fn sums_lose_less_than_a_plain_sum() {
    let mut random = Random::new("sum");
    let mut value = || 10f64.powf(random.range(-6.0, 6.0)) as f32;
    let inputs: Vec<[Row; 3]> = (0..CASES)
        .map(|_| {
            let high = [value(), value(), value(), 0.0];
            [
                high,
                high.map(|x| x * 2.0f32.powi(-25)),
                [value(), value(), -value(), 0.0],
            ]
        })
        .collect();
    let outputs: Vec<[Row; 2]> = probe(&[]).call("sum_add", &inputs).expect("the probe runs");
    let (mut plain, mut compensated) = (Agreement::default(), Agreement::default());
    for ([high, low, x], [new_high, new_low]) in inputs.iter().zip(&outputs) {
        let exact = vector(*high) + vector(*low) + vector(*x);
        let sum = vector(*new_high) + vector(*new_low);
        for c in 0..3 {
            let largest = f64::from(high[c].abs().max(x[c].abs()));
            let error = (sum[c] - exact[c]).abs();
            let place = || format!("{} + {} + {}", high[c], low[c], x[c]);
            // What any driver must keep: one rounding of the sum, one of low.
            plain.add(error, 2.0 * ULP * largest, place);
            // TwoSum: high + error is exact, so what is left is a rounding of low.
            compensated.add(error, 2.0 * ULP * ULP * largest, place);
        }
    }
    plain.assert_holds(3 * CASES);
    // A driver may reassociate; the software one that the tests run on where there is no GPU does
    // not, and its images' sums are tested on that.
    if crate::common::gpu().summary.kind == "software" {
        compensated.assert_holds(3 * CASES);
    }
}

#[test]
fn broken_numbers_are_found() {
    let (nan, inf) = (f32::NAN, f32::INFINITY);
    let good = [
        0.0,
        -0.0,
        1.0,
        f32::MAX,
        f32::MIN,
        f32::MIN_POSITIVE,
        1.0e-45,
        3.0e38,
    ];
    let mut inputs: Vec<Row> = good.iter().map(|x| [*x, 0.0, *x, 0.0]).collect();
    let negative_nan = f32::from_bits(0xff80_0001);
    for bad in [nan, -nan, inf, -inf, negative_nan] {
        inputs.extend([
            [bad, 0.0, 0.0, 0.0],
            [0.0, bad, 0.0, 0.0],
            [1.0, 0.0, bad, 0.0],
        ]);
    }
    let outputs: Vec<[u32; 4]> = probe(&[])
        .call("is_broken", &inputs)
        .expect("the probe runs");
    for (v, found) in inputs.iter().zip(&outputs) {
        assert_eq!(found[0] == 1, v.iter().any(|x| !x.is_finite()), "{v:?}");
    }
}

/// Rays towards a sphere, from near and far: f and radius, direction.
fn rays(name: &str) -> Vec<[Row; 2]> {
    let mut random = Random::new(name);
    (0..CASES)
        .map(|i| {
            let radius = 10f64.powf(random.range(-3.0, 3.0));
            // Outside up to 1e5 radii away, and inside.
            let distance = if i % 4 == 0 {
                random.unit()
            } else {
                10f64.powf(random.range(0.0, 5.0))
            };
            let f = radius * distance * random.direction();
            // Aimed at a point of the ball around it, so that hits, misses and grazes are common.
            let aim = 1.5 * radius * random.unit() * random.direction();
            let d = (aim - f).normalize() * 10f64.powf(random.range(-1.0, 1.0));
            [to_row(f, radius), to_row(d, 0.0)]
        })
        .collect()
}

/// Error bounds of `sphere_quadratic`'s members; see the function for the operations.
fn quadratic_bounds(f: DVec3, d: DVec3, q: &Quadratic, radius: f64) -> [f64; 4] {
    let (distance, rr) = (f.length(), radius * radius);
    let l = (f + (q.b / q.a) * d).length();
    // b 3 and d.d 3 roundings, their ratio 2.5, the product 1: times |f|; the sum 1 times |l|.
    let l_error = 10.0 * ULP * distance + ULP * l;
    // l.l: twice l's error, 3; r^2 1; the difference 1; times d.d, 4.
    let ll_error = 2.0 * l * l_error + l_error * l_error + 3.0 * ULP * l * l;
    let square = q.a * (ll_error + ULP * rr + 5.0 * ULP * (rr - l * l).abs());
    [
        3.0 * ULP * q.a,
        3.0 * ULP * distance * d.length(),
        square,
        // f.f 3, r^2 1, the difference 1.
        ULP * (3.0 * distance * distance + rr + q.c.abs()),
    ]
}

#[test]
fn sphere_quadratic_agrees() {
    let run = |factor: f64| {
        let inputs = rays("sphere quadratic");
        let outputs: Vec<[Row; 2]> = probe(&[])
            .call("sphere_quadratic", &inputs)
            .expect("the probe runs");
        let mut agreement = Agreement::default();
        for ([f, d], [q, _]) in inputs.iter().zip(&outputs) {
            let (radius, q) = (f64::from(f[3]), double(*q));
            let (f, d) = (vector(*f), vector(*d));
            let twin = sphere_quadratic(f * factor, d, radius * factor);
            let bounds = quadratic_bounds(f, d, &twin, radius);
            let twins = [twin.a, twin.b, twin.square, twin.c];
            for i in 1..4 {
                let place = || format!("member {i}, f = {f}, d = {d}, r = {radius}");
                agreement.add((q[i] - twins[i]).abs(), bounds[i], place);
            }
            agreement.add((q[0] - twins[0]).abs(), bounds[0], || format!("d = {d}"));
        }
        agreement
    };
    run(1.0).assert_holds(CASES);
    assert!(run(1.001).any_fails(), "a wrong scale is not found");
}

#[test]
fn distances_to_far_spheres_hold_the_catalogues_bound() {
    // numerics.md, case 1.
    let inputs = rays("far spheres");
    let outputs: Vec<[Row; 2]> = probe(&[])
        .call("sphere_quadratic", &inputs)
        .expect("the probe runs");
    let (mut agreement, mut companion) = (Agreement::default(), Agreement::default());
    let mut wrong = 0;
    for ([f, d], [_, root]) in inputs.iter().zip(&outputs) {
        let (radius, f, d) = (f64::from(f[3]), vector(*f), vector(*d));
        let distance = f.length();
        let q = sphere_quadratic(f, d, radius);
        if distance < 1.001 * radius {
            continue;
        }
        let ulp = ULP * distance;
        let impact = (f + (q.b / q.a) * d).length();
        let twin = root_outside(&q, false);
        let hit = root[0] < NO_HIT;
        if twin.is_some() != hit {
            wrong += usize::from((impact - radius).abs() > 4.0 * ulp);
        } else if let Some(t) = twin
            && impact <= 0.99 * radius
        {
            let bound = 8.0 * ulp * (1.0 + impact / (radius * radius - impact * impact).sqrt());
            let length = d.length();
            let place = || format!("f = {f}, d = {d}, r = {radius}");
            agreement.add((f64::from(root[0]) - t).abs() * length, bound, place);
            // The textbook formula in f32.
            let naive = naive_root(f, d, radius);
            companion.add((naive - t).abs() * length, bound, String::new);
        }
    }
    assert_eq!(wrong, 0, "wrong hits or misses");
    agreement.assert_holds(CASES / 4);
    assert!(companion.any_fails(), "the naive solver is as good");
}

/// t = (b - sqrt(b^2 - a c))/a in f32, c = f.f - r^2.
fn naive_root(f: DVec3, d: DVec3, radius: f64) -> f64 {
    let (f, d, r) = (f.as_vec3(), d.as_vec3(), radius as f32);
    let (a, b, c) = (d.dot(d), -f.dot(d), f.dot(f) - r * r);
    f64::from((b - (b * b - a * c).max(0.0).sqrt()) / a)
}

//! Exponentials and logarithms on the device against those of f64. Tolerances count roundings, in ULP = 2^-23;
//! the companions' arguments are off by 1e-5.

use crate::common::probe;
use gpu_trace::materials::powers::{expm1_over, log_of, log1p_over};
use gpu_trace::verify::{Agreement, Random, Row, ULP};

const CASES: usize = 200_000;

/// Arguments of the four functions: of all sizes, about the ends of the reductions, and special ones.
fn arguments() -> Vec<Row> {
    let mut random = Random::new("powers");
    let mut rows = vec![
        [1.0, 0.0, 0.0, 0.0],
        [f32::MIN_POSITIVE, -1.0 + f32::EPSILON / 2.0, -87.0, -87.0],
        [1.0e37, 1.0e37, 87.0, 87.0],
        [1.0 - f32::EPSILON / 2.0, -f32::EPSILON, 1.0e-30, 1.0e-30],
    ];
    let root = std::f64::consts::FRAC_1_SQRT_2;
    let half = 0.5 * std::f64::consts::LN_2;
    for i in 0..CASES {
        let near = 1.0 + 1.0e-5 * random.range(-1.0, 1.0);
        let sign = if random.unit() < 0.5 { -1.0 } else { 1.0 };
        let row = match i % 4 {
            0 => [root * near, root * near - 1.0, half * near, -half * near],
            1 => {
                let small = sign * random.magnitude(-12.0, 0.0);
                [1.0 + 0.9 * small, 0.9 * small, small, small]
            }
            2 => {
                let unit = random.unit();
                [unit, -unit, -20.0 * unit, -20.0 * unit]
            }
            _ => [
                random.magnitude(-37.0, 37.0),
                random.magnitude(-3.0, 37.0),
                random.range(-86.0, 86.0),
                random.range(-86.0, 86.0),
            ],
        };
        rows.push(row.map(|x| x as f32));
    }
    rows
}

#[test]
fn powers_agree() {
    // The quotient f/(2 + f) has 3, its series 1, the product and the sum 2 more; the reduced argument is
    // exact. Over x: 2.5 and a rounding of f. exp: the product 1, the sum 1, the scale none, the reduction 1.
    // exp(x) - 1 beyond the reduction: the difference is 0.29 at least, of terms of at most 0.5; 2.5 more.
    const BOUNDS: [f64; 4] = [6.0 * ULP, 10.0 * ULP, 3.0 * ULP, 9.0 * ULP];
    let inputs = arguments();
    let outputs: Vec<Row> = probe(&[]).call("powers", &inputs).expect("the probe runs");
    let run = |factor: f64| {
        let mut found: [Agreement; 4] = Default::default();
        for (input, output) in inputs.iter().zip(&outputs) {
            let [x, y, z, w] = input.map(f64::from);
            let truth = [
                log_of(factor * x),
                log1p_over(factor * y),
                (factor * z).exp(),
                expm1_over(factor * w),
            ];
            for (i, truth) in truth.into_iter().enumerate() {
                let error = (f64::from(output[i]) - truth).abs();
                // Of ln 1 nothing is left.
                let least = f64::from(f32::MIN_POSITIVE);
                found[i].add(error, BOUNDS[i] * truth.abs() + least, || {
                    format!("{input:?}: {output:?}")
                });
            }
        }
        found
    };
    for found in run(1.0) {
        found.assert_holds(CASES);
    }
    for found in run(1.0 - 1.0e-5) {
        assert!(found.any_fails());
    }
    // 0 is taken for the smallest normal number, and what is below all numbers for 0.
    let far: Row = [0.0, 0.0, -88.0, -1000.0];
    let ends: Vec<Row> = probe(&[]).call("powers", &[far]).expect("the probe runs");
    let [log, one, nothing, over] = ends[0];
    assert_eq!((one, nothing), (1.0, 0.0));
    assert!((f64::from(log) - log_of(0.0)).abs() < 1.0e-5, "{log}");
    assert!((over - 1.0e-3).abs() < 1.0e-9, "{over}");
}

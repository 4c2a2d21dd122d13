//! What a driver makes of f32 arithmetic: WGSL leaves much of it open.

use super::context::Context;
use crate::error::Result;
use crate::gpu::probe::Probe;
use crate::verify::Random;

/// What was seen of a driver's f32 arithmetic.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct DriverReport {
    /// Whether (a + b) - a is replaced by b, which ends compensated sums unless they are hidden.
    pub reassociates: bool,
    /// Whether a compensated sum keeps its digits as the kernel hides it.
    pub sums_hold: bool,
    /// Whether a b + c is rounded once.
    pub contracts: bool,
    /// Whether `fma` is rounded once.
    pub fma_is_fused: bool,
    /// Whether results below 1.2e-38 become 0.
    pub flushes_subnormals: bool,
    /// Largest error of a division, in ulp; WGSL allows 2.5.
    pub division_ulp: f64,
    /// Largest error of a square root, in ulp.
    pub sqrt_ulp: f64,
    /// Largest error of `inverseSqrt`, in ulp; WGSL allows 2.
    pub inverse_sqrt_ulp: f64,
    /// Largest error of `sin` on [-pi, pi]; WGSL allows 4.9e-4.
    pub sin_error: f64,
    /// Largest error of `cos` on [-pi, pi].
    pub cos_error: f64,
}

/// Rows of `probe_arithmetic`: a, b, c, an angle.
type Row = [f32; 4];

/// Distance of `value` from `truth` in ulp of the truth.
fn ulps(value: f32, truth: f64) -> f64 {
    let exponent = truth.abs().log2().floor();
    (f64::from(value) - truth).abs() / (exponent - 23.0).exp2()
}

/// Sees what the driver of the context's device does.
///
/// # Errors
/// If the device fails.
pub fn probe_driver(context: &Context) -> Result<DriverReport> {
    let probe = context.probe(&[])?;
    let mut random = Random::new("driver");
    let inputs: Vec<Row> = (0..context.size(20_000, 200_000))
        .map(|_| {
            let (a, b) = (random.range(1.0, 2.0), random.range(1.0, 2.0));
            // The angle over its range.
            let angle = random.range(-std::f64::consts::PI, std::f64::consts::PI);
            [
                a as f32,
                b as f32,
                random.range(0.5, 1.0) as f32,
                angle as f32,
            ]
        })
        .collect();
    let outputs: Vec<[Row; 2]> = probe.call("arithmetic", &inputs)?;
    let mut report = DriverReport {
        reassociates: reassociates(&probe)?,
        sums_hold: sums_hold(&probe)?,
        contracts: contracts(&probe, false)?,
        fma_is_fused: contracts(&probe, true)?,
        flushes_subnormals: flushes(&probe)?,
        division_ulp: 0.0,
        sqrt_ulp: 0.0,
        inverse_sqrt_ulp: 0.0,
        sin_error: 0.0,
        cos_error: 0.0,
    };
    for ([a, b, c, angle], [roots, turns]) in inputs.iter().zip(&outputs) {
        let [a, b, c, angle] = [*a, *b, *c, *angle].map(f64::from);
        let larger = |worst: &mut f64, x: f64| *worst = worst.max(x);
        larger(&mut report.division_ulp, ulps(roots[0], a / b));
        larger(&mut report.sqrt_ulp, ulps(roots[1], c.sqrt()));
        larger(&mut report.inverse_sqrt_ulp, ulps(roots[2], 1.0 / c.sqrt()));
        larger(
            &mut report.sin_error,
            (f64::from(turns[0]) - angle.sin()).abs(),
        );
        larger(
            &mut report.cos_error,
            (f64::from(turns[1]) - angle.cos()).abs(),
        );
    }
    Ok(report)
}

fn one(probe: &Probe, input: Row) -> Result<[Row; 2]> {
    let outputs: Vec<[Row; 2]> = probe.call("rounding", &[input])?;
    Ok(outputs[0])
}

/// (1 + u/2) - 1 is 0, unless the 1 is taken out.
fn reassociates(probe: &Probe) -> Result<bool> {
    Ok(one(probe, [1.0, 1.0e-9, 0.0, 0.0])?[0][0] != 0.0)
}

fn sums_hold(probe: &Probe) -> Result<bool> {
    let inputs = [[
        [1.0f32, 1.0, 1.0, 0.0],
        [0.0; 4],
        [1.0e-9, 1.0e-9, 1.0e-9, 0.0],
    ]];
    let outputs: Vec<[Row; 2]> = probe.call("sum_add", &inputs)?;
    Ok(outputs[0][1][0] == 1.0e-9)
}

/// (1 + e)^2 - (1 + 2 e) is e^2 if rounded once, else 0, for e = 2^-12.
fn contracts(probe: &Probe, explicit: bool) -> Result<bool> {
    let e = 2f32.powi(-12);
    let outputs = one(probe, [1.0 + e, 1.0 + e, -(1.0 + 2.0 * e), 0.0])?;
    Ok(outputs[0][if explicit { 2 } else { 1 }] != 0.0)
}

fn flushes(probe: &Probe) -> Result<bool> {
    // 2^-100 2^-40 is subnormal.
    let outputs = one(probe, [2f32.powi(-100), 2f32.powi(-40), 0.0, 0.0])?;
    Ok(outputs[1][0] == 0.0)
}

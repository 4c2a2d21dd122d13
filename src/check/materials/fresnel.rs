//! Case 23: the share of the light that a smooth surface reflects.

use crate::check::context::Context;
use crate::error::Result;
use crate::gpu::probe::Probe;
use crate::materials::fresnel::fresnel as exact_fresnel;
use crate::verify::{Measure, Random, Row, ULP};

/// Bounds of what a driver may make of the Fresnel term: the least and the largest share that is
/// reflected, for cos_t^2 off by its roundings.
fn reflected_bounds(cos_i: f64, eta: f64) -> [f64; 2] {
    let difference = (eta - 1.0) * (eta + 1.0);
    let square = (difference + cos_i * cos_i) / (eta * eta);
    // eta -+ 1 and their product 3; cos^2 1; the sum 1; eta^2 1 and the ratio 2.5.
    let sizes = difference.abs() + cos_i * cos_i;
    let error = (4.0 * sizes / (eta * eta) + 3.5 * square.abs()) * ULP;
    let shares = [square - error, square + error].map(|square| {
        if square <= 0.0 {
            return 1.0;
        }
        let cos_t = square.sqrt();
        let s = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
        let p = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
        0.5 * (s * s + p * p)
    });
    // s and p: products 1 each, in a difference and a sum of the same size; 2.5 for the ratio. At
    // most 1 in size, so twice that in their squares; 2 more.
    let rest = 14.0 * ULP;
    [
        shares[0].min(shares[1]) - rest,
        (shares[0].max(shares[1]) + rest).min(1.0),
    ]
}

/// cos_i and eta.
fn fresnel_input(random: &mut Random, i: usize) -> Row {
    let eta = [
        1.5,
        1.0 / 1.5,
        2.4f64.powf(random.range(-1.0, 1.0)),
        1.0 + random.magnitude(-6.0, -2.0),
    ];
    let eta = f64::from(eta[i / 4 % 4] as f32);
    let critical = (1.0 - eta * eta).max(0.0).sqrt();
    let cos_i = match i % 4 {
        0 => random.unit(),
        1 => random.magnitude(-6.0, 0.0),
        2 => critical,
        _ => critical * (1.0 + random.magnitude(-7.0, -3.0) * (random.unit() - 0.5).signum()),
    };
    [cos_i.clamp(1.0e-6, 1.0) as f32, eta as f32, 0.0, 0.0]
}

pub(super) fn fresnel(context: &Context) -> Result<Measure> {
    let mut random = Random::new("fresnel");
    let inputs: Vec<Row> = (0..context.size(50_000, 500_000))
        .map(|i| fresnel_input(&mut random, i))
        .collect();
    let probe = context.probe(&[])?;
    let outputs: Vec<Row> = probe.call("fresnel", &inputs)?;
    let mut measure = Measure::new(1.0, "of the bound");
    let mut beyond = 0;
    for (input, output) in inputs.iter().zip(&outputs) {
        let (cos_i, eta) = (f64::from(input[0]), f64::from(input[1]));
        let (eta, share) = (eta * context.disturbed(1.0e-2), f64::from(output[0]));
        let truth = exact_fresnel(cos_i, eta).reflected;
        let [low, high] = reflected_bounds(cos_i, eta);
        // In total reflection there is no error.
        let bound = if low == 1.0 {
            0.0
        } else if share < truth {
            truth - low
        } else {
            high - truth
        };
        let error = (share - truth).abs();
        let error = if error == 0.0 { 0.0 } else { error / bound };
        measure.add(error, || {
            format!("cos_i = {cos_i:e}, eta = {eta}: R = {share} for {truth}")
        });
        beyond += u64::from(!(0.0..=1.0).contains(&share));
    }
    measure.count(inputs.len() as u64, beyond, || "R beyond 1".into());
    returned(context, &probe, &inputs, &outputs, &mut measure)?;
    Ok(measure)
}

/// The same share from the other side, where the refraction is not total.
///
/// The square of the cosine that comes back: 4 roundings of two terms of at most 1, times the
/// larger index ratio's square, the same once more from the way there, and 1 of 1/eta, 17 together.
/// The cosine is off by that over twice the cosine, the share by 4 over the other cosine times that;
/// twice as much where the roundings are as large as the square. The terms themselves: 14 each way.
fn returned(
    context: &Context,
    probe: &Probe,
    inputs: &[Row],
    outputs: &[Row],
    measure: &mut Measure,
) -> Result<()> {
    let wrong = context.disturbed(1.0e-2) as f32;
    let pairs: Vec<(Row, Row)> = std::iter::zip(inputs, outputs)
        .filter(|(_, o)| o[1] > 0.0)
        .map(|(i, o)| (*i, *o))
        .collect();
    let back: Vec<Row> = pairs
        .iter()
        .map(|(i, o)| [o[1], wrong / i[1], 0.0, 0.0])
        .collect();
    let returned: Vec<Row> = probe.call("fresnel", &back)?;
    for ((input, output), back) in pairs.iter().zip(&returned) {
        let (there, back) = (f64::from(output[0]), f64::from(back[0]));
        let cosines = f64::from(input[0]) * f64::from(output[1]);
        let eta = f64::from(input[1].max(1.0 / input[1]));
        let bound = 28.0 * ULP + 4.0 * 17.0 * eta * eta * ULP / cosines;
        measure.add((there - back).abs() / bound, || {
            format!("cos_i, eta = {input:?}: R = {there}, {back} from the other side")
        });
    }
    Ok(())
}

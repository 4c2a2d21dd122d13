//! Case 24: the lobes of the reflective material.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use super::{BASIS, REFLECTED, normal};
use crate::check::context::Context;
use crate::error::Result;
use crate::gpu::bsdf_probe::BsdfInput;
use crate::materials::reflective::Reflective;
use crate::materials::{MaterialKind, Surface};
use crate::sampling::directions::cap_direction;
use crate::settings::Integrator;
use crate::verify::{Measure, Random, Row, ULP, vector};

/// A reflective material whose lobe reflects 0.6 of the light, as f32 has it.
fn glossy(epsilon: f64) -> Reflective {
    let epsilon = f64::from(epsilon as f32);
    let cap = PI * epsilon * (2.0 - epsilon);
    Reflective {
        albedo: DVec3::splat(0.3f32.into()),
        specular: DVec3::ONE,
        epsilon,
        mu: f64::from((0.6 / cap) as f32),
    }
}

/// Such materials from epsilon = 1e-8 to 1.
pub(super) fn lobes() -> Vec<Reflective> {
    const COUNT: u32 = 33;
    let exponent = |i: u32| -8.0 * f64::from(i) / f64::from(COUNT - 1);
    (0..COUNT)
        .map(|i| glossy(10f64.powf(exponent(i))))
        .collect()
}

pub(super) fn kinds(lobes: &[Reflective]) -> Vec<MaterialKind> {
    lobes.iter().cloned().map(MaterialKind::from).collect()
}

pub(super) fn narrow(context: &Context) -> Result<Measure> {
    let mut measure = Measure::new(1.0, "of the bound");
    caps(context, &mut measure)?;
    weights(context, &mut measure)?;
    Ok(measure)
}

fn caps(context: &Context, measure: &mut Measure) -> Result<()> {
    let mut random = Random::new("caps");
    let inputs: Vec<[Row; 2]> = (0..context.size(50_000, 500_000))
        .map(|i| {
            let height = if i % 16 == 0 {
                1.0
            } else {
                random.magnitude(-8.0, 0.0)
            };
            [normal(&mut random, i, height), random.unit4()]
        })
        .collect();
    let outputs: Vec<Row> = context.probe(&[])?.call("cap_direction", &inputs)?;
    for ([axis, u], w) in inputs.iter().zip(&outputs) {
        let height = f64::from(axis[3]) * context.disturbed(0.02);
        let u = DVec2::new(u[0].into(), u[1].into());
        let twin = cap_direction(vector(*axis), height, u);
        // Across, all times the sine: x, 2 - x, their product 3, the square root 4.5 and half of
        // that, the circle 6e-7, the products with the basis 2, the basis, the sums 2. Along: x,
        // 1 - x, the product, the sum; 3 to normalise.
        let x = height * u.x;
        let across = 1.5 * 6.0e-7 + 1.8 * BASIS + 10.0 * ULP;
        let bound = across * (x * (2.0 - x)).max(0.0).sqrt() + 7.0 * ULP;
        measure.add((vector(*w) - twin).length() / bound, || {
            format!("epsilon {height:e} about {axis:?}: {w:?} for {twin}")
        });
    }
    Ok(())
}

/// The weight f cos/pdf of the direction that came out.
fn weights(context: &Context, measure: &mut Measure) -> Result<()> {
    let mut random = Random::new("weights");
    let lobes = lobes();
    let inputs: Vec<BsdfInput> = (0..context.size(50_000, 500_000))
        .map(|i| {
            let normal = vector(normal(&mut random, i, 0.0));
            let wo = random.direction();
            let wo = if wo.dot(normal) < 0.0 { -wo } else { wo };
            // Grazing ones among them.
            let lift = if i % 4 == 0 {
                wo.dot(normal) - random.magnitude(-4.0, -1.0)
            } else {
                0.0
            };
            let wo = (wo - lift * normal).normalize();
            let surface = Surface {
                normal,
                eta: 1.0,
                offset: DVec3::ZERO,
            };
            BsdfInput::new(i % lobes.len(), &surface, wo, random.unit4())
        })
        .collect();
    let probe = context.materials(&kinds(&lobes), Integrator::Bsdf);
    for (input, s) in inputs.iter().zip(probe.sample(&inputs)?) {
        let material = &lobes[input.material as usize];
        let Some((truth, relative)) = weight_of(material, input, s.wi()) else {
            continue;
        };
        let truth = truth * context.disturbed(1.0e-2);
        measure.add((s.weight().x / truth - 1.0).abs() / relative, || {
            let epsilon = material.epsilon;
            format!("epsilon {epsilon:e}, {input:?}: {s:?} for {truth}")
        });
    }
    Ok(())
}

/// The weight of direction `w` and its relative error bound; `None` on edges of horizon and lobe
/// and where the choice between the parts is within rounding: either answer will do.
fn weight_of(m: &Reflective, input: &BsdfInput, w: DVec3) -> Option<(f64, f64)> {
    let (n, d, u) = (input.surface().normal, -input.wo(), f64::from(input.u[2]));
    let d_r = d.reflect(n).normalize();
    let (cosine, cos_o) = (n.dot(w), n.dot(d_r));
    let q = m.lobe_probability(cos_o.max(0.0));
    // The cosine of d_r, the products and the ratio.
    let q_error = (REFLECTED + 3.0 * ULP) / cos_o.max(1.0e-9) * q * (1.0 - q) + 8.0 * ULP * q;
    let chosen = u < q;
    let edge = (2.0 * m.epsilon).sqrt();
    let rim = ((w - d_r).length() - edge).abs() < 2.0 * REFLECTED + 4.0 * ULP * edge;
    if (u - q).abs() <= q_error || cosine < 1.0e-4 || rim && !chosen {
        return None;
    }
    let lobe = chosen || m.in_lobe(w, d_r);
    let value = m.value_of(q, cosine, lobe);
    let pdf = value.pdf;
    // w came out as it was used: the cosine has 3 roundings, the pdf those of q, 1 - q, the cosine
    // and 4 products; 6 for f and the ratio.
    let cap = if lobe { 1.0 / (TAU * m.epsilon) } else { 0.0 };
    let pdf_error =
        (q_error + ULP) * (cap + cosine / PI) + 3.0 * ULP * (1.0 - q) / PI + 8.0 * ULP * pdf;
    let relative = 2.0 * (3.0 * ULP / cosine + pdf_error / pdf + 6.0 * ULP);
    Some((value.f_cos.x / pdf, relative))
}

//! Case 27: light that goes there and back.

use super::REFLECTED;
use super::lobes::{kinds, lobes};
use crate::check::context::Context;
use crate::error::Result;
use crate::gpu::bsdf_probe::{BsdfInput, Evaluated, Sampled};
use crate::materials::dielectric::Dielectric;
use crate::materials::reflective::Reflective;
use crate::materials::{Event, MaterialKind, Surface};
use crate::settings::Integrator;
use crate::verify::{Measure, Random, ULP, to_row, vector};

pub(super) fn reciprocity(context: &Context) -> Result<Measure> {
    let mut measure = Measure::new(1.0, "of the bound");
    both_ways(context, &mut measure)?;
    through_glass(context, &mut measure)?;
    Ok(measure)
}

/// Two directions above the surface, half of them near each other's mirror direction.
fn both_ways(context: &Context, measure: &mut Measure) -> Result<()> {
    let mut random = Random::new("reciprocity");
    let lobes = lobes();
    let wrong: Vec<Reflective> = lobes
        .iter()
        .map(|m| Reflective {
            mu: m.mu * context.disturbed(1.0e-2),
            ..m.clone()
        })
        .collect();
    let (mut there, mut back) = (Vec::new(), Vec::new());
    for i in 0..context.size(50_000, 500_000) {
        let place = i % lobes.len();
        let n = random.direction();
        let wo = random.direction();
        let wo = if wo.dot(n) < 0.0 { -wo } else { wo };
        let mirrored = (-wo).reflect(n);
        let edge = (2.0 * lobes[place].epsilon).sqrt();
        let wi = match i % 2 {
            0 => (mirrored + edge * random.direction()).normalize(),
            _ => random.direction(),
        };
        // On the edge of the lobe either answer will do.
        let rim = ((wi - mirrored).length() - edge).abs() < 2.0 * REFLECTED + 4.0 * ULP * edge;
        if wi.dot(n) <= 0.0 || rim {
            continue;
        }
        let surface = Surface {
            normal: n,
            eta: 1.0,
            offset: glam::DVec3::ZERO,
        };
        there.push(BsdfInput::new(place, &surface, wo, to_row(wi, 0.0)));
        back.push(BsdfInput::new(place, &surface, wi, to_row(wo, 0.0)));
    }
    let probe = context.materials(&kinds(&lobes), Integrator::Bsdf);
    let forth: Vec<Evaluated> = probe.evaluate(&there)?;
    let probe = context.materials(&kinds(&wrong), Integrator::Bsdf);
    let returned: Vec<Evaluated> = probe.evaluate(&back)?;
    for (input, (a, b)) in there.iter().zip(forth.iter().zip(&returned)) {
        let [wo, wi] = [input.wo(), vector(input.u)];
        let n = input.surface().normal;
        // The cosines of both, as f32 has them, go out of f cos: 3 roundings each.
        let (a, b) = (
            f64::from(a.f_cos[0]) / n.dot(wi),
            f64::from(b.f_cos[0]) / n.dot(wo),
        );
        let bound = 1.0e-5 + 3.0 * ULP * (1.0 / n.dot(wi) + 1.0 / n.dot(wo));
        measure.add((a / b - 1.0).abs() / bound, || {
            format!("{input:?}: {a}, {b} the other way round")
        });
    }
    Ok(())
}

/// Light that goes through a surface, and back from where it came.
fn through_glass(context: &Context, measure: &mut Measure) -> Result<()> {
    let mut random = Random::new("glass");
    // Never reflected where there is a choice.
    let u = [0.0, 0.0, 1.0 - (0.5 * ULP) as f32, 0.0];
    let there: Vec<BsdfInput> = (0..context.size(50_000, 500_000))
        .map(|i| {
            let eta = [1.5, 1.0 / 1.5, 2.4f64.powf(random.range(-1.0, 1.0))][i % 3];
            let (normal, wo) = (random.direction(), random.direction());
            let wo = if wo.dot(normal) < 0.0 { -wo } else { wo };
            let lift = if i % 4 == 0 {
                wo.dot(normal) - random.magnitude(-5.0, -1.0)
            } else {
                0.0
            };
            let wo = (wo - lift * normal).normalize();
            let surface = Surface {
                normal,
                eta,
                offset: glam::DVec3::ZERO,
            };
            BsdfInput::new(0, &surface, wo, u)
        })
        .collect();
    let glass = [MaterialKind::from(Dielectric::smooth(1.5))];
    let probe = context.materials(&glass, Integrator::Bsdf);
    let crossed: Vec<(BsdfInput, Sampled)> = std::iter::zip(there.iter(), probe.sample(&there)?)
        .filter(|(_, s)| s.event & Event::TRANSMITTED.bits() != 0)
        .map(|(input, s)| (*input, s))
        .collect();
    let wrong = context.disturbed(1.0e-2) as f32;
    let back: Vec<BsdfInput> = crossed
        .iter()
        .map(|(input, s)| BsdfInput {
            wo: s.wi,
            normal: input.normal.map(|x| -x),
            eta: wrong / input.eta,
            ..*input
        })
        .collect();
    let returned = probe.sample(&back)?;
    for ((input, s), second) in crossed.iter().zip(&returned) {
        let cos_i = input.surface().normal.dot(input.wo());
        // The square of the cosine on the way back has some 30 roundings, times up to 2.4^2: within
        // these f32 may find total reflection.
        if cos_i * cos_i < 200.0 * ULP {
            continue;
        }
        // The component along the surface has some 30 roundings on both ways together, and the
        // direction 1/cos_i times its error.
        let apart = (second.wi() - input.wo()).length() * cos_i;
        let radiance = s.weight().x * second.weight().x - 1.0;
        measure.add(apart.max(radiance.abs()) / 1.0e-5, || {
            format!("{input:?}: {s:?}, back {second:?}")
        });
    }
    Ok(())
}

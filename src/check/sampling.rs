//! Case 28: what is drawn follows the pdf that the weights assume.

use std::f64::consts::TAU;

use glam::DVec3;

use super::Case;
use super::context::Context;
use super::materials::REFLECTED;
use crate::error::Result;
use crate::gpu::bsdf_probe::BsdfInput;
use crate::gpu::probe::Probe;
use crate::materials::mirror::Mirror;
use crate::materials::{MaterialKind, Surface};
use crate::settings::Integrator;
use crate::statistics::sidak;
use crate::verify::bsdf::Subjects;
use crate::verify::bsdf::draw::Draw;
use crate::verify::{Cells, Measure, Outcome, Random, Row, to_row, vector};

pub(super) const CASES: &[Case] = &[Case {
    id: 28,
    name: "samples against their pdf",
    setup: "caps, and every case of every material (in the quick form one of each form) at 0, 45, \
            85 and 89.9 degrees, from either side, and under the lecture's integrator, by \
            chi-square; of delta lobes by how often each is chosen; log p over the log of the \
            level that Sidak leaves of 1e-3. Mirrors are a delta: the direction in units of 16 ulp",
    run: samples,
}];

fn samples(context: &Context) -> Result<Measure> {
    let mut outcomes = materials(context, Integrator::Bsdf)?;
    outcomes.extend(materials(
        context,
        Integrator::Lecture { termination: 0.2 },
    )?);
    outcomes.extend(caps(context)?);
    let level = sidak(outcomes.len());
    let mut measure = Measure::new(1.0, "of the level");
    for (place, p) in outcomes {
        measure.add(p.ln() / level.ln(), || format!("{place}: p = {p:e}"));
    }
    mirror(context, &mut measure)?;
    Ok(measure)
}

/// Every case of every material, or of each form the first. Disturbed, the twin's normal is turned.
fn materials(context: &Context, integrator: Integrator) -> Result<Vec<Outcome>> {
    let count = context.size(100_000, 1_000_000);
    let mut outcomes = Vec::new();
    for subjects in Subjects::each(&context.gpu, integrator) {
        for subject in subjects.first_of_each_form(context.size(1, usize::MAX)) {
            // Delta lobes are the same whatever the integrator.
            if integrator == Integrator::Bsdf || subjects.is_uniform(subject) {
                let wrong = context.disturbed(0.2) - 1.0;
                let draws = Draw::all(&subjects, subject, count)?;
                outcomes.extend(draws.iter().map(|draw| draw.follows(wrong)));
            }
        }
    }
    Ok(outcomes)
}

/// A function's outputs for uniform numbers; `case` decides which.
fn draw<I: bytemuck::Pod, O: bytemuck::Pod>(
    context: &Context,
    probe: &Probe,
    function: &str,
    case: &str,
    input: impl Fn(Row) -> I,
) -> Result<Vec<O>> {
    let mut random = Random::new(&format!("{function} {case}"));
    let count = context.size(100_000, 1_000_000);
    let inputs: Vec<I> = (0..count).map(|_| input(random.unit4())).collect();
    probe.call(function, &inputs)
}

/// The pole of the basis's formula, and a direction that is not special.
fn normals() -> [DVec3; 2] {
    [-DVec3::Z, DVec3::new(2.0, -1.0, 2.0) / 3.0].map(|n| vector(to_row(n, 0.0)))
}

/// Uniform directions of a cap.
fn caps(context: &Context) -> Result<Vec<Outcome>> {
    let probe = context.probe(&[])?;
    let mut outcomes = Vec::new();
    for (height, axis) in [1.0e-6, 1.0e-4, 0.01, 1.0]
        .into_iter()
        .zip(normals().repeat(2))
    {
        let row = to_row(axis, height);
        let case = format!("cap of height {height} about {axis}");
        let drawn: Vec<Row> = draw(context, &probe, "cap_direction", &case, |u| [row, u])?;
        let height = f64::from(row[3]) * context.disturbed(0.05);
        let cells = Cells::new(axis, &[0.0, height], 8, 16);
        let p = cells.test(drawn.iter().map(|w| Some(vector(*w))), |_| {
            1.0 / (TAU * height)
        });
        outcomes.push((case, p));
    }
    Ok(outcomes)
}

/// The mirror has one direction, whatever the random numbers.
fn mirror(context: &Context, measure: &mut Measure) -> Result<()> {
    let mut random = Random::new("mirror");
    let shift = (context.disturbed(1.0e-3) - 1.0) * DVec3::X;
    let reflectance = [0.9f32, 0.5, 0.25];
    let inputs: Vec<BsdfInput> = (0..context.size(10_000, 100_000))
        .map(|_| {
            let (normal, wo) = (random.direction(), random.direction());
            let wo = if wo.dot(normal) < 0.0 { -wo } else { wo };
            let surface = Surface {
                normal,
                eta: 1.0,
                offset: DVec3::ZERO,
            };
            BsdfInput::new(0, &surface, wo, random.unit4())
        })
        .collect();
    let silver = MaterialKind::from(Mirror {
        reflectance: reflectance.map(f64::from).into(),
    });
    let probe = context.materials(&[silver], Integrator::Bsdf);
    for (input, s) in inputs.iter().zip(probe.sample(&inputs)?) {
        let normal = input.surface().normal + shift;
        let twin = (-input.wo()).reflect(normal).normalize();
        let error = if reflectance == s.weight {
            (s.wi() - twin).length() / REFLECTED
        } else {
            f64::INFINITY
        };
        measure.add(error, || format!("mirror, {input:?}: {s:?}"));
    }
    Ok(())
}

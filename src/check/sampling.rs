//! Case 28: what is drawn follows the pdf that the weights assume.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use rayon::prelude::*;

use super::context::Context;
use super::inputs::Random;
use super::intersection::{Row, to_row, vector};
use super::materials::{REFLECTED, glossy};
use super::{Case, Measure, Run};
use crate::error::Result;
use crate::gpu::bsdf_probe::{BsdfInput, BsdfProbe, Sampled};
use crate::gpu::probe::Probe;
use crate::materials::dielectric::{Dielectric, fresnel};
use crate::materials::diffuse::Diffuse;
use crate::materials::mirror::Mirror;
use crate::materials::{Event, MaterialKind, Surface};
use crate::reference::core::sampling::basis_around;
use crate::settings::Integrator;
use crate::statistics::{chi_square, normal_p, sidak};

pub(super) const CASES: &[Case] = &[Case {
    id: 28,
    name: "samples against their pdf",
    setup: "caps, diffuse and reflective (epsilon 1e-4 to 0.2, incidence 0, 45, 85 and 89.9 \
            degrees) by chi-square, glass by how often it reflects; log p over the log of the \
            level that Sidak leaves of 1e-3. Mirrors are a delta: the direction in units of 16 ulp",
    run: Run::On(samples),
}];

const ANGLES: [f64; 4] = [0.0, 45.0, 85.0, 89.9];

fn samples(context: &Context) -> Result<Measure> {
    let mut outcomes = diffuse(context, false)?;
    outcomes.extend(diffuse(context, true)?);
    outcomes.extend(caps(context)?);
    outcomes.extend(reflective(context)?);
    outcomes.extend(dielectric(context)?);
    let level = sidak(outcomes.len());
    let mut measure = Measure::new(1.0, "of the level");
    for (place, p) in outcomes {
        measure.add(p.ln() / level.ln(), || format!("{place}: p = {p:e}"));
    }
    mirror(context, &mut measure)?;
    Ok(measure)
}

/// What was drawn, and the p-value.
type Outcome = (String, f64);

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

/// What a material makes of uniform numbers.
fn drawn(
    context: &Context,
    probe: &BsdfProbe,
    case: &str,
    surface: &Surface,
    wo: DVec3,
) -> Result<Vec<Sampled>> {
    let mut random = Random::new(&format!("sample {case}"));
    let count = context.size(100_000, 1_000_000);
    let inputs: Vec<BsdfInput> = (0..count)
        .map(|_| BsdfInput::new(0, surface, wo, random.unit4()))
        .collect();
    probe.sample(&inputs)
}

/// Cells of the sphere about an axis: rings between heights 1 - cos, cut into sectors.
struct Cells {
    axes: [DVec3; 3],
    heights: Vec<f64>,
}

impl Cells {
    const RINGS: usize = 8;
    const SECTORS: usize = 16;
    /// Points of the quadrature along the sides of a cell.
    const STEPS: u32 = 24;

    /// Rings of equal solid angle from height to height of `edges`.
    fn new(axis: DVec3, edges: &[f64]) -> Self {
        let axis = axis.normalize();
        let basis = basis_around(axis);
        let between = |pair: &[f64]| {
            let (low, step) = (pair[0], (pair[1] - pair[0]) / Self::RINGS as f64);
            (1..=Self::RINGS).map(move |i| low + step * i as f64)
        };
        let inner = edges.windows(2).flat_map(between);
        Self {
            axes: [basis.tangent, basis.bitangent, axis],
            heights: edges[..1].iter().copied().chain(inner).collect(),
        }
    }

    fn count(&self) -> usize {
        (self.heights.len() - 1) * Self::SECTORS
    }

    fn of(&self, w: DVec3) -> usize {
        let [tangent, bitangent, axis] = self.axes;
        // 1 - cos without the cancellation.
        let height = 0.5 * (w.normalize() - axis).length_squared();
        let ring = self.heights[1..].partition_point(|h| *h <= height);
        let turn = w.dot(bitangent).atan2(w.dot(tangent)).rem_euclid(TAU) / TAU;
        let sector = (turn * Self::SECTORS as f64) as usize;
        ring.min(self.heights.len() - 2) * Self::SECTORS + sector.min(Self::SECTORS - 1)
    }

    /// The integral of a pdf over a cell, by midpoints.
    fn mass(&self, cell: usize, pdf: impl Fn(DVec3) -> f64) -> f64 {
        let [tangent, bitangent, axis] = self.axes;
        let (ring, sector) = (cell / Self::SECTORS, cell % Self::SECTORS);
        let (low, high) = (self.heights[ring], self.heights[ring + 1]);
        let middle = |i: u32| (f64::from(i) + 0.5) / f64::from(Self::STEPS);
        let mut sum = 0.0;
        for i in 0..Self::STEPS {
            let x = low + (high - low) * middle(i);
            let sine = (x * (2.0 - x)).max(0.0).sqrt();
            for j in 0..Self::STEPS {
                let turn = (sector as f64 + middle(j)) / Self::SECTORS as f64;
                let (s, c) = (TAU * turn).sin_cos();
                sum += pdf((1.0 - x) * axis + sine * (c * tangent + s * bitangent));
            }
        }
        let solid_angle = (high - low) * TAU / Self::SECTORS as f64;
        sum * solid_angle / f64::from(Self::STEPS * Self::STEPS)
    }

    /// p-value of directions against a pdf. What has none ended its path: a cell of its own, with
    /// what is left of the probability.
    fn test(
        &self,
        directions: impl Iterator<Item = Option<DVec3>>,
        pdf: impl Fn(DVec3) -> f64 + Sync,
    ) -> f64 {
        let mut counts = vec![0; self.count() + 1];
        for w in directions {
            counts[w.map_or(self.count(), |w| self.of(w))] += 1;
        }
        let cells = (0..self.count()).into_par_iter();
        let mut masses: Vec<f64> = cells.map(|cell| self.mass(cell, &pdf)).collect();
        let rest = 1.0 - masses.iter().sum::<f64>();
        let none_ended = counts[self.count()] == 0 && rest < 1.0e-4;
        // What quadrature leaves is no cell.
        masses.push(if none_ended { 0.0 } else { rest.max(0.0) });
        chi_square(&counts, &masses).p
    }
}

/// The pole of the basis's formula, and a direction that is not special.
fn normals() -> [DVec3; 2] {
    [-DVec3::Z, DVec3::new(2.0, -1.0, 2.0) / 3.0].map(|n| vector(to_row(n, 0.0)))
}

/// Diffuse: cosine about the normal, or the lecture's uniform hemisphere.
fn diffuse(context: &Context, lecture: bool) -> Result<Vec<Outcome>> {
    let gray = MaterialKind::from(Diffuse {
        albedo: DVec3::splat(0.5),
    });
    let integrator = match lecture {
        true => Integrator::Lecture { termination: 0.2 },
        false => Integrator::Bsdf,
    };
    let probe = context.materials(&[gray], integrator)?;
    let tilt = context.disturbed(0.2) - 1.0;
    let mut outcomes = Vec::new();
    for n in normals() {
        let case = format!("diffuse, lecture {lecture}, n = {n}");
        let drawn = drawn(
            context,
            &probe,
            &case,
            &Surface {
                normal: n,
                eta: 1.0,
            },
            n,
        )?;
        let pdf = |w: DVec3| match (w.dot(n), lecture) {
            (cosine, _) if cosine <= 0.0 => 0.0,
            // Disturbed, both move towards the pole; they still integrate to 1.
            (cosine, true) => (1.0 + tilt * (cosine - 0.5)) / TAU,
            (cosine, false) => cosine / PI * (1.0 + tilt * (cosine - 2.0 / 3.0)),
        };
        let cells = Cells::new(n, &[0.0, 1.0, 2.0]);
        let p = cells.test(drawn.iter().map(|s| Some(s.wi())), pdf);
        outcomes.push((case, p));
    }
    Ok(outcomes)
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
        let cells = Cells::new(axis, &[0.0, height]);
        let p = cells.test(drawn.iter().map(|w| Some(vector(*w))), |_| {
            1.0 / (TAU * height)
        });
        outcomes.push((case, p));
    }
    Ok(outcomes)
}

fn reflective(context: &Context) -> Result<Vec<Outcome>> {
    let normal = normals()[1];
    let surface = Surface { normal, eta: 1.0 };
    let tangent = basis_around(normal).tangent;
    let mut outcomes = Vec::new();
    for &epsilon in context.size(&[0.01][..], &[1.0e-4, 0.01, 0.2]) {
        let mut m = glossy(epsilon);
        let probe = context.materials(&[m.clone().into()], Integrator::Bsdf)?;
        let epsilon = m.epsilon;
        m.mu *= context.disturbed(0.2);
        let m = MaterialKind::from(m);
        for degrees in ANGLES {
            let (sin, cos) = f64::to_radians(degrees).sin_cos();
            let wo = vector(to_row(cos * normal - sin * tangent, 0.0));
            let case = format!("reflective, epsilon {epsilon:e}, {degrees} degrees");
            let drawn = drawn(context, &probe, &case, &surface, wo)?;
            let d_r = (-wo).reflect(normal).normalize();
            let cells = Cells::new(d_r, &[0.0, epsilon, 2.0 * epsilon, 1.0, 2.0]);
            let pdf = |w: DVec3| match w.dot(normal) {
                cosine if cosine > 0.0 => m.evaluate(&surface, wo, w).pdf,
                _ => 0.0,
            };
            let directions = drawn.iter().map(|s| (s.weight[0] > 0.0).then(|| s.wi()));
            outcomes.push((case, cells.test(directions, pdf)));
        }
    }
    Ok(outcomes)
}

/// How often glass reflects.
fn dielectric(context: &Context) -> Result<Vec<Outcome>> {
    let glass = MaterialKind::from(Dielectric { ior: 1.5 });
    let probe = context.materials(&[glass], Integrator::Bsdf)?;
    let mut outcomes = Vec::new();
    for eta in [1.5, 1.0 / 1.5].map(|eta| f64::from(eta as f32)) {
        for degrees in ANGLES {
            let (sin, cos) = f64::to_radians(degrees).sin_cos();
            let normal = DVec3::Z;
            let wo = vector(to_row(DVec3::new(-sin, 0.0, cos), 0.0));
            let case = format!("glass, eta {eta}, {degrees} degrees");
            let drawn = drawn(context, &probe, &case, &Surface { normal, eta }, wo)?;
            let total = drawn.len() as f64;
            let through = Event::TRANSMITTED.bits();
            let reflected = drawn.iter().filter(|s| s.event & through == 0).count() as f64;
            let share = fresnel(wo.z, eta).reflected;
            let p = if share == 1.0 {
                f64::from(u8::from(reflected == total))
            } else {
                let share = (share * context.disturbed(0.2)).min(0.999);
                normal_p((reflected - total * share) / (total * share * (1.0 - share)).sqrt())
            };
            outcomes.push((case, p));
        }
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
            BsdfInput::new(0, &Surface { normal, eta: 1.0 }, wo, random.unit4())
        })
        .collect();
    let silver = MaterialKind::from(Mirror {
        reflectance: reflectance.map(f64::from).into(),
    });
    let probe = context.materials(&[silver], Integrator::Bsdf)?;
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

//! Cases 22 to 25 and 27: functions of the materials.
//!
//! The truth is the f64 twin with the f32 numbers that the kernel got. Bounds count roundings, in
//! [`ULP`]; WGSL allows 2.5 for a division and 4.5 for a square root.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use super::context::Context;
use super::Case;
use crate::error::Result;
use crate::gpu::bsdf_probe::{BsdfInput, Evaluated, Sampled};
use crate::gpu::probe::Probe;
use crate::materials::conductor::{Conductor, Metal};
use crate::materials::dielectric::{Dielectric, fresnel as exact_fresnel};
use crate::materials::reflective::Reflective;
use crate::materials::{Event, MaterialKind, Surface};
use crate::reference::core::sampling::{basis_around, cap_direction};
use crate::settings::Integrator;
use crate::verify::{Measure, Random, Row, ULP, to_row, vector};

pub(super) const CASES: &[Case] = &[
    Case {
        id: 22,
        name: "a basis around any normal",
        setup: "random normals, the axes and near them, z = +-0 and to within 1e-8 of -z: tangent \
                and bitangent orthonormal, and those of f64, to 2e-7",
        run: basis,
    },
    Case {
        id: 23,
        name: "Fresnel at grazing and critical angles",
        setup: "index ratio 1/2.4 to 2.4, cosine 1e-6 to 1 and within 1e-7 of the critical one: \
                R in units of its bound, at most 1, and 1 in total reflection (T is what R leaves); \
                F(i, eta) = F(t, 1/eta) in units of its bound",
        run: fresnel,
    },
    Case {
        id: 24,
        name: "narrow lobes",
        setup: "the reflective material, epsilon 1e-8 to 1, up to grazing incidence: the direction in \
                the lobe and f cos/pdf in units of their bounds",
        run: narrow,
    },
    Case {
        id: 25,
        name: "microfacets at grazing angles",
        setup: "rough metals of roughness 0.2 to 1, both cosines 1e-6 to 1: value and pdf, with Smith's \
                shadowing and masking, those of f64 to 1e-5",
        run: grazing,
    },
    Case {
        id: 27,
        name: "there and back",
        setup: "f(i, o) = f(o, i) for the reflective material, to 1e-5; light through glass and \
                back has its old direction, to 1e-5/cos_i, and its old radiance, to 1e-5",
        run: reciprocity,
    },
];

/// A reflected direction: the cosine 3, the products 3 and the sum 1 of at most twice the size; 3.5
/// to normalise, and n may be longer than 1 by a rounding.
pub(super) const REFLECTED: f64 = 16.0 * ULP;

/// What the basis promises, per component.
const BASIS: f64 = 2.0e-7;

/// Axes and directions near them, those near the basis's seam z = 0 and its far pole -z more than
/// others; w as the row's fourth number.
fn normal(random: &mut Random, i: usize, w: f64) -> Row {
    let small = random.magnitude(-8.0, -1.0);
    let across = random.direction() * DVec3::new(1.0, 1.0, 0.0);
    // Along z there is none.
    let across = across.try_normalize().unwrap_or(DVec3::X);
    let d = match i % 8 {
        0 => [
            DVec3::X,
            -DVec3::X,
            DVec3::Y,
            -DVec3::Y,
            DVec3::Z,
            -DVec3::Z,
        ][i / 8 % 6],
        1 => across,
        2 => -across.with_z(0.0),
        3 => across.with_z(small * (random.unit() - 0.5)),
        4 => (small * across).with_z(-1.0),
        5 => (small * across).with_z(1.0),
        _ => random.direction(),
    };
    let mut row = to_row(d.normalize(), w);
    if i % 8 == 2 {
        row[2] = -0.0;
    }
    row
}

fn basis(context: &Context) -> Result<Measure> {
    let mut random = Random::new("basis");
    let inputs: Vec<Row> = (0..context.size(50_000, 500_000))
        .map(|i| normal(&mut random, i, 0.0))
        .collect();
    let outputs: Vec<[Row; 2]> = context.probe(&[])?.call("basis_around", &inputs)?;
    let mut measure = Measure::new(BASIS, "absolute");
    for (row, [t, b]) in inputs.iter().zip(&outputs) {
        let (n, t, b) = (vector(*row), vector(*t), vector(*b));
        let twin = basis_around(n + DVec3::splat(context.disturbed(1.0e-4) - 1.0));
        let apart = (t - twin.tangent).abs().max((b - twin.bitangent).abs());
        let products = [
            n.dot(t),
            n.dot(b),
            t.dot(b),
            t.length() - 1.0,
            b.length() - 1.0,
        ];
        let product = products.iter().fold(0.0f64, |worst, x| worst.max(x.abs()));
        // With n as f32 has it, exact arithmetic is off by up to | |n|^2 - 1 |.
        let skew = product - (n.length_squared() - 1.0).abs();
        measure.add(apart.max_element().max(skew), || {
            format!("n = {row:?}: {t}, {b}")
        });
    }
    Ok(measure)
}

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

fn fresnel(context: &Context) -> Result<Measure> {
    let mut random = Random::new("fresnel");
    let inputs: Vec<Row> = (0..context.size(50_000, 500_000))
        .map(|i| fresnel_input(&mut random, i))
        .collect();
    let probe = context.probe(&["dielectric", "interior"])?;
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

/// A reflective material whose lobe reflects 0.6 of the light, as f32 has it.
pub(super) fn glossy(epsilon: f64) -> Reflective {
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
fn lobes() -> Vec<Reflective> {
    const COUNT: u32 = 33;
    let exponent = |i: u32| -8.0 * f64::from(i) / f64::from(COUNT - 1);
    (0..COUNT)
        .map(|i| glossy(10f64.powf(exponent(i))))
        .collect()
}

fn kinds(lobes: &[Reflective]) -> Vec<MaterialKind> {
    lobes.iter().cloned().map(MaterialKind::from).collect()
}

fn narrow(context: &Context) -> Result<Measure> {
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
            let surface = Surface { normal, eta: 1.0 };
            BsdfInput::new(i % lobes.len(), &surface, wo, random.unit4())
        })
        .collect();
    let probe = context.materials(&kinds(&lobes), Integrator::Bsdf)?;
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

/// What the GGX functions make of small cosines, which the frame leaves as they are: about z, with the axis y,
/// it is that of the coordinates. Of directions that are nearly opposite the half vector is no matter of theirs.
fn grazing(context: &Context) -> Result<Measure> {
    let mut random = Random::new("grazing");
    let [eta, k] = Metal::Gold.index();
    let metals: Vec<Conductor> = [0.2, 0.5, 1.0]
        .map(|roughness| Conductor {
            preset: None,
            eta: Some(eta),
            k: Some(k),
            roughness,
            anisotropy: 0.5,
            axis: DVec3::Y,
        })
        .into();
    let surface = Surface {
        normal: DVec3::Z,
        eta: 1.0,
    };
    let mut inputs = Vec::new();
    while inputs.len() < context.size(50_000, 500_000) {
        let mut direction = || {
            let cosine = random.magnitude(-6.0, 0.0);
            let (sin, cos) = random.range(0.0, TAU).sin_cos();
            let sine = (1.0 - cosine * cosine).sqrt();
            vector(to_row(DVec3::new(sine * cos, sine * sin, cosine), 0.0))
        };
        let (wo, wi) = (direction(), direction());
        if (wo + wi).length_squared() > 0.5 {
            let place = inputs.len() % metals.len();
            inputs.push(BsdfInput::new(place, &surface, wo, to_row(wi, 0.0)));
        }
    }
    let kinds: Vec<MaterialKind> = metals.iter().cloned().map(MaterialKind::from).collect();
    let values = context
        .materials(&kinds, Integrator::Bsdf)?
        .evaluate(&inputs)?;
    let mut measure = Measure::new(1.0e-5, "relative");
    for (input, value) in inputs.iter().zip(&values) {
        let metal = &kinds[input.material as usize];
        let twin = metal.evaluate(&surface, input.wo(), vector(input.u));
        let truth = context.disturbed(1.0e-3);
        let off = |found: f32, twin: f64| (f64::from(found) / (truth * twin) - 1.0).abs();
        let error = off(value.pdf, twin.pdf).max(off(value.f_cos[0], twin.f_cos.x));
        measure.add(error, || format!("{input:?}: {value:?} for {twin:?}"));
    }
    Ok(measure)
}

fn reciprocity(context: &Context) -> Result<Measure> {
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
        };
        there.push(BsdfInput::new(place, &surface, wo, to_row(wi, 0.0)));
        back.push(BsdfInput::new(place, &surface, wi, to_row(wo, 0.0)));
    }
    let probe = context.materials(&kinds(&lobes), Integrator::Bsdf)?;
    let forth: Vec<Evaluated> = probe.evaluate(&there)?;
    let probe = context.materials(&kinds(&wrong), Integrator::Bsdf)?;
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
            BsdfInput::new(0, &Surface { normal, eta }, wo, u)
        })
        .collect();
    let glass = [MaterialKind::from(Dielectric { ior: 1.5 })];
    let probe = context.materials(&glass, Integrator::Bsdf)?;
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

//! Cases 22 to 25 and 27: functions of the materials.
//!
//! The truth is the f64 twin with the f32 numbers that the kernel got. Bounds count roundings, in
//! [`ULP`]; WGSL allows 2.5 for a division and 4.5 for a square root.

mod fresnel;
mod lobes;
mod microfacets;
mod reciprocity;

use glam::DVec3;

use super::Case;
use super::context::Context;
use crate::error::Result;
use crate::sampling::directions::basis_around;
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
        run: fresnel::fresnel,
    },
    Case {
        id: 24,
        name: "narrow lobes",
        setup: "the reflective material, epsilon 1e-8 to 1, up to grazing incidence: the direction in \
                the lobe and f cos/pdf in units of their bounds",
        run: lobes::narrow,
    },
    Case {
        id: 25,
        name: "microfacets at grazing angles",
        setup: "rough metals of roughness 0.2 to 1, and rough glass of 0.5 and 1 on both sides of its surface, both \
                cosines 1e-6 to 1: value and pdf, with Smith's shadowing and masking, those of f64 to 1e-5",
        run: microfacets::grazing,
    },
    Case {
        id: 27,
        name: "there and back",
        setup: "f(i, o) = f(o, i) for the reflective material, to 1e-5; light through glass and \
                back has its old direction, to 1e-5/cos_i, and its old radiance, to 1e-5",
        run: reciprocity::reciprocity,
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

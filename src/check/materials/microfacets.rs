//! Case 25: rough metals.

use std::f64::consts::TAU;

use glam::DVec3;

use crate::check::context::Context;
use crate::error::Result;
use crate::gpu::bsdf_probe::BsdfInput;
use crate::materials::conductor::{Conductor, Metal};
use crate::materials::{MaterialKind, Surface};
use crate::settings::Integrator;
use crate::verify::{Measure, Random, to_row, vector};

/// What the GGX functions make of small cosines, which the frame leaves as they are: about z, with the axis y,
/// it is that of the coordinates. Of directions that are nearly opposite the half vector is no matter of theirs.
pub(super) fn grazing(context: &Context) -> Result<Measure> {
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
        offset: DVec3::ZERO,
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

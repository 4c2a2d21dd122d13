//! Case 25: rough metals and rough glass.

use std::f64::consts::TAU;

use glam::DVec3;

use crate::check::context::Context;
use crate::error::Result;
use crate::gpu::bsdf_probe::BsdfInput;
use crate::materials::conductor::{Conductor, Metal};
use crate::materials::dielectric::Dielectric;
use crate::materials::fresnel::fresnel;
use crate::materials::{MaterialKind, Surface};
use crate::settings::Integrator;
use crate::verify::{Measure, Random, to_row, vector};

/// What the GGX functions make of small cosines, which the frame leaves as they are: about z, with the axis y,
/// it is that of the coordinates. Of directions that are nearly opposite the half vector is no matter of theirs, and
/// neither is Fresnel's term near the critical angle.
pub(super) fn grazing(context: &Context) -> Result<Measure> {
    let mut random = Random::new("grazing");
    let kinds = kinds();
    let mut inputs = Vec::new();
    while inputs.len() < context.size(50_000, 500_000) {
        let place = inputs.len() % kinds.len();
        let glass = kinds[place].is_translucent();
        let mut direction = |below: bool| {
            let cosine = random.magnitude(-6.0, 0.0);
            let (sin, cos) = random.range(0.0, TAU).sin_cos();
            let sine = (1.0 - cosine * cosine).sqrt();
            let z = if below { -cosine } else { cosine };
            vector(to_row(DVec3::new(sine * cos, sine * sin, z), 0.0))
        };
        let (crossed, inside) = (glass && inputs.len() % 4 < 2, inputs.len() % 8 < 4);
        let (wo, wi) = (direction(false), direction(crossed));
        let ior = kinds[place].ior();
        let eta = if inside { 1.0 / ior } else { ior };
        let sum = if crossed { wo + eta * wi } else { wo + wi };
        let cos_h = wo.dot(sum).abs() / sum.length();
        let facing = fresnel(cos_h, eta).cos_t > 0.1 || fresnel(1.05 * cos_h, eta).cos_t == 0.0;
        let far = sum.length_squared() > if crossed { 0.1 } else { 0.5 };
        if far && (!glass || facing && cos_h > 0.1) {
            let surface = Surface {
                normal: DVec3::Z,
                eta,
                offset: DVec3::ZERO,
            };
            inputs.push(BsdfInput::new(place, &surface, wo, to_row(wi, 0.0)));
        }
    }
    let values = context
        .materials(&kinds, Integrator::Bsdf)
        .evaluate(&inputs)?;
    let mut measure = Measure::new(1.0e-5, "relative");
    for (input, value) in inputs.iter().zip(&values) {
        let kind = &kinds[input.material as usize];
        let twin = kind.evaluate(&input.surface(), input.wo(), vector(input.u));
        let truth = context.disturbed(1.0e-3);
        // No microfacet may send light that way.
        let off = |found: f32, twin: f64| {
            if twin == 0.0 {
                f64::from(found)
            } else {
                (f64::from(found) / (truth * twin) - 1.0).abs()
            }
        };
        let error = off(value.pdf, twin.pdf).max(off(value.f_cos[0], twin.f_cos.x));
        measure.add(error, || format!("{input:?}: {value:?} for {twin:?}"));
    }
    Ok(measure)
}

fn kinds() -> Vec<MaterialKind> {
    let [eta, k] = Metal::Gold.index();
    let metals = [0.2, 0.5, 1.0].map(|roughness| {
        MaterialKind::from(Conductor {
            preset: None,
            eta: Some(eta),
            k: Some(k),
            roughness,
            anisotropy: 0.5,
            axis: DVec3::Y,
        })
    });
    let glass = [0.5, 1.0].map(|roughness| {
        MaterialKind::from(Dielectric {
            roughness,
            ..Dielectric::smooth(1.5)
        })
    });
    metals.into_iter().chain(glass).collect()
}

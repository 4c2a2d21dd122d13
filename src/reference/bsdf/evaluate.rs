//! Twin of `shaders/bsdf/evaluate.wesl`.

use std::f64::consts::PI;

use glam::DVec3;

use super::reflective::{Reflective, eval_reflective, in_lobe, lobe_probability, pdf_reflective};
use crate::scene::MaterialKind;

/// Whether light sampling can help: there is something besides delta lobes.
#[must_use]
pub fn has_density(material: &MaterialKind) -> bool {
    !matches!(
        material,
        MaterialKind::Mirror { .. } | MaterialKind::Dielectric { .. }
    )
}

/// f cos of the direction `w`, and the pdf in solid angle with which the material samples it; `None`
/// for a material of delta lobes.
#[must_use]
pub fn evaluate(
    material: &MaterialKind,
    normal: DVec3,
    arrival: DVec3,
    w: DVec3,
) -> Option<(DVec3, f64)> {
    let cosine = normal.dot(w).max(0.0);
    match *material {
        MaterialKind::Diffuse { albedo } => Some((cosine / PI * albedo, cosine / PI)),
        MaterialKind::Reflective {
            albedo,
            specular,
            epsilon,
            mu,
        } => {
            let material = Reflective {
                color: albedo,
                specular,
                epsilon,
                mu,
            };
            let d_r = arrival.reflect(normal).normalize();
            let q = lobe_probability(&material, normal.dot(d_r).max(0.0));
            let lobe = in_lobe(&material, w, d_r);
            let value = cosine * eval_reflective(&material, lobe);
            Some((value, pdf_reflective(&material, q, cosine, lobe)))
        }
        MaterialKind::Mirror { .. } | MaterialKind::Dielectric { .. } => None,
    }
}

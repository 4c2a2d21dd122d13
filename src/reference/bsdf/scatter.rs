//! Twin of `shaders/bsdf/scatter.wesl`.

use glam::DVec3;

use super::dielectric::sample_dielectric;
use super::diffuse::{sample_diffuse, sample_diffuse_uniform};
use super::mirror::sample_mirror;
use super::reflective::{Reflective, sample_reflective, sample_reflective_uniform};
use super::sample::BsdfSample;
use crate::scene::MaterialKind;

/// Samples the material; `normal` is on the side of arrival, `eta` the index beyond a
/// dielectric's surface over the one before, `uniform` asks for the lecture's
/// uniform hemisphere where the material has more than delta lobes.
#[must_use]
pub fn scatter(
    material: &MaterialKind,
    normal: DVec3,
    arrival: DVec3,
    eta: f64,
    u: [f64; 4],
    uniform: bool,
) -> BsdfSample {
    match *material {
        MaterialKind::Diffuse { albedo } if uniform => sample_diffuse_uniform(albedo, normal, u),
        MaterialKind::Diffuse { albedo } => sample_diffuse(albedo, normal, u),
        MaterialKind::Mirror { reflectance } => sample_mirror(reflectance, normal, arrival),
        MaterialKind::Dielectric { .. } => sample_dielectric(eta, normal, arrival, u),
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
            if uniform {
                sample_reflective_uniform(&material, normal, arrival, u)
            } else {
                sample_reflective(&material, normal, arrival, u)
            }
        }
    }
}

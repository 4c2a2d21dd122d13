//! Twin of `shaders/bsdf/dielectric.wesl`.

use glam::DVec3;

use super::sample::{BsdfSample, bsdf_sample};

/// Fresnel's answer for one direction.
#[derive(Clone, Copy, Debug)]
pub struct Fresnel {
    /// Share of the unpolarised light that is reflected.
    pub reflected: f64,
    /// Cosine beyond the surface; 0 if the reflection is total.
    pub cos_t: f64,
}

/// eta: index beyond the surface over the index on the side of arrival.
#[must_use]
pub fn fresnel(cos_i: f64, eta: f64) -> Fresnel {
    let square = ((eta - 1.0) * (eta + 1.0) + cos_i * cos_i) / (eta * eta);
    if square <= 0.0 {
        return Fresnel {
            reflected: 1.0,
            cos_t: 0.0,
        };
    }
    let cos_t = square.sqrt();
    let s = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    let p = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    Fresnel {
        reflected: 0.5 * (s * s + p * p),
        cos_t,
    }
}

/// Chooses a lobe with its share of the light.
#[must_use]
pub fn sample_dielectric(eta: f64, normal: DVec3, arrival: DVec3, u: [f64; 4]) -> BsdfSample {
    let cos_i = (-normal.dot(arrival)).clamp(0.0, 1.0);
    let f = fresnel(cos_i, eta);
    if u[2] < f.reflected {
        return bsdf_sample((arrival + 2.0 * cos_i * normal).normalize(), DVec3::ONE);
    }
    BsdfSample {
        direction: (arrival / eta + (cos_i / eta - f.cos_t) * normal).normalize(),
        weight: DVec3::splat(1.0 / (eta * eta)),
        density: 0.0,
        crossed: true,
        compression: eta * eta,
    }
}

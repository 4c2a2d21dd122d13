//! Rough glass, with the formulas and sources of the kernel's `dielectric.wesl`.

use glam::{DVec2, DVec3};

use crate::materials::fresnel::fresnel;
use crate::materials::ggx::{Frame, ggx_normal, ggx_pdf, ggx_weight};
use crate::materials::{BsdfSample, BsdfValue, Event, Surface};

/// How far a quotient of equal indices may be from 1: WGSL divides to 2.5 ulp.
const SAME_INDEX: f64 = 3.0e-7;

/// Whether there is no surface: the medium beyond is the one before.
fn is_absent(eta: f64) -> bool {
    (eta - 1.0).abs() <= SAME_INDEX
}

/// In the local frame, on the surface if rounding has put it below.
fn arrival(frame: &Frame, wo: DVec3) -> DVec3 {
    let o = frame.to_local(wo);
    o.truncate().extend(o.z.max(0.0))
}

/// A microfacet that wo sees; it reflects or refracts.
pub(super) fn sample(alpha: f64, surface: &Surface, wo: DVec3, u: [f64; 4]) -> BsdfSample {
    let eta = surface.eta;
    if is_absent(eta) {
        return BsdfSample {
            wi: -wo,
            weight: DVec3::ONE,
            pdf: 0.0,
            event: Event::DELTA | Event::TRANSMITTED,
            eta: 1.0,
        };
    }
    let (alpha, frame) = (DVec2::splat(alpha), Frame::around(surface.normal));
    let o = arrival(&frame, wo);
    let (h, cos_h) = ggx_normal(o, alpha, DVec2::new(u[0], u[1]));
    let cos_h = cos_h.min(1.0);
    let f = fresnel(cos_h, eta);
    let crossed = u[2] >= f.reflected;
    let half = (eta - 1.0) * (eta + 1.0) / (cos_h + eta * f.cos_t);
    let (i, share, event) = if crossed {
        let stretch = 4.0 * cos_h * f.cos_t * (eta / half).powi(2);
        (
            -(o + half * h) / eta,
            (1.0 - f.reflected) * stretch,
            Event::GLOSSY | Event::TRANSMITTED,
        )
    } else {
        (2.0 * cos_h * h - o, f.reflected, Event::GLOSSY)
    };
    let (mut weight, mut pdf) = (0.0, 0.0);
    // On the wrong side the path ends: it would meet another microfacet.
    if (crossed && i.z < 0.0) || (!crossed && i.z > 0.0) {
        weight = ggx_weight(o, i.with_z(i.z.abs()), alpha);
        pdf = share * ggx_pdf(o, h, alpha);
    }
    let eta = if crossed { eta } else { 1.0 };
    BsdfSample {
        wi: frame.to_world(i).normalize(),
        weight: DVec3::splat(weight / (eta * eta)),
        pdf,
        event,
        eta,
    }
}

/// What is not reflected.
fn refracted_share(cos_i: f64, cos_t: f64, eta: f64) -> f64 {
    let (s, p) = (cos_i + eta * cos_t, eta * cos_i + cos_t);
    2.0 * eta * cos_i * cos_t * (1.0 / (s * s) + 1.0 / (p * p))
}

/// The one microfacet that sends wi to wo.
pub(super) fn evaluate(alpha: f64, surface: &Surface, wo: DVec3, wi: DVec3) -> BsdfValue {
    let eta = surface.eta;
    let (alpha, frame) = (DVec2::splat(alpha), Frame::around(surface.normal));
    let (o, i) = (arrival(&frame, wo), frame.to_local(wi));
    let crossed = i.z < 0.0;
    let event = if crossed {
        Event::GLOSSY | Event::TRANSMITTED
    } else {
        Event::GLOSSY
    };
    let none = BsdfValue {
        f_cos: DVec3::ZERO,
        pdf: 0.0,
        event,
    };
    let sum = wo + wi;
    let half = if crossed { sum + (eta - 1.0) * wi } else { sum };
    let half = frame.to_local(half);
    let size = half.length();
    let denser = eta > 1.0;
    let h = if crossed && denser { -1.0 } else { 1.0 } / size * half;
    let change = ((eta - 1.0) * (eta + 1.0)).abs();
    let larger = 0.5 * (change + size * size) / size;
    let smaller = 0.5 * (change - size * size) / size;
    let faces = !crossed || (smaller > 0.0 && h.z > 0.0);
    if is_absent(eta) || i.z == 0.0 || size == 0.0 || !faces {
        return none;
    }
    let (cos_o, cos_t) = match (crossed, denser) {
        (false, _) => (0.5 * size, 0.0),
        (true, true) => (smaller, larger / eta),
        (true, false) => (larger, smaller / eta),
    };
    let (share, scale) = if crossed {
        let stretch = 4.0 * cos_o * cos_t * (eta / size).powi(2);
        let share = refracted_share(cos_o, cos_t, eta);
        (share * stretch, 1.0 / (eta * eta))
    } else {
        (fresnel(cos_o.min(1.0), eta).reflected, 1.0)
    };
    let pdf = share * ggx_pdf(o, h, alpha);
    let weight = scale * ggx_weight(o, i.with_z(i.z.abs()), alpha);
    BsdfValue {
        f_cos: DVec3::splat(pdf * weight),
        pdf,
        event,
    }
}

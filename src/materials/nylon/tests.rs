use std::f64::consts::PI;

use super::*;
use crate::materials::hemisphere::{albedo, direction, furthest};

#[test]
fn it_reflects_what_is_known() {
    // By quadrature in another language: 0.24 at 0 and 0.39 at 85 degrees.
    let nylon = Nylon::default();
    for (degrees, known) in [(0.0, 0.24), (85.0, 0.39)] {
        let found = albedo(&nylon, direction(degrees, 0.3));
        assert!((found - known).abs() < 0.005, "{degrees}: {found}");
        // Companion.
        let other = Nylon {
            a: 3.0 * nylon.a,
            ..nylon.clone()
        };
        let other = albedo(&other, direction(degrees, 0.3));
        assert!((other - known).abs() > 0.005, "{degrees}: {other}");
    }
}

/// As it is printed, with Fresnel's equations by angles.
fn published(p: &Nylon, l: DVec3, v: DVec3) -> DVec3 {
    let h = (l + v).normalize();
    let (n_l, n_v, n_h, h_v) = (l.z, v.z, h.z, h.dot(v));
    let d = p.a / (1.0 + p.b * (1.0 - n_h)).powf(p.c);
    let g = 1f64.min(2.0 * n_h * n_v / h_v).min(2.0 * n_h * n_l / h_v);
    let cos_t = (1.0 - (1.0 - h_v * h_v) / (p.ior * p.ior)).sqrt();
    let s = (h_v - p.ior * cos_t) / (h_v + p.ior * cos_t);
    let t = (cos_t - p.ior * h_v) / (cos_t + p.ior * h_v);
    let f = 0.5 * (s * s + t * t);
    p.diffuse / PI + f * g / (PI * n_l * n_v) * d
}

#[test]
fn it_is_the_published_formula() {
    for material in cases() {
        let found = furthest(&material, |wo, wi| published(&material, wo, wi));
        // 1 - n.h loses digits, and B magnifies that; so does Fresnel's 0 for an index of 1.
        assert!(found < 1.0e-8, "{material:?}: {found:e}");
        let wrong = Nylon {
            c: 1.01 * material.c,
            ior: 1.01 * material.ior,
            ..material.clone()
        };
        let found = furthest(&material, |wo, wi| published(&wrong, wo, wi));
        assert!(found > 1.0e-5, "{material:?}: {found:e}");
    }
}

#[test]
fn the_most_that_is_scattered_is_known() {
    let mut lower = 0.0f64;
    for material in cases() {
        let bound = material.albedo().x;
        for degrees in [0.0, 40.0, 70.0, 80.0, 85.0, 87.0, 89.0, 89.9] {
            let found = albedo(&material, direction(degrees, 0.3));
            assert!(
                found <= bound,
                "{material:?}, {degrees}: {found} of {bound}"
            );
            lower = lower.max(found / bound);
        }
    }
    // Companion: a bound 5 % lower is not kept.
    assert!(lower > 0.95, "{lower}");
}

#[test]
fn what_gains_energy_says_so() {
    let nylon = Nylon::default();
    assert_eq!(nylon.warning(), None);
    let bright = Nylon {
        a: 20.0 * nylon.a,
        ..nylon
    };
    let [what, _] = bright.warning().expect("it does");
    assert!(what.contains("gains energy"), "{what}");
}

use super::*;
use crate::materials::hemisphere::{SURFACE, albedo, direction, furthest, integral};

fn plain(diffuse: f64, specular: f64, nu: f64, nv: f64) -> Ashikhmin {
    Ashikhmin {
        diffuse: DVec3::splat(diffuse),
        specular: DVec3::splat(specular),
        nu,
        nv,
        axis: DVec3::Y,
    }
}

#[test]
fn it_reflects_what_is_known() {
    // By quadrature of the paper's formulas in another language: 0.97 at 0 and 0.40 at 88 degrees.
    let material = plain(1.0, 0.04, 100.0, 100.0);
    for (degrees, known) in [(0.0, 0.97), (88.0, 0.40)] {
        let found = albedo(&material, direction(degrees, 0.3));
        assert!((found - known).abs() < 0.005, "{degrees}: {found}");
        // Companion.
        let other = albedo(&plain(0.5, 0.04, 100.0, 100.0), direction(degrees, 0.3));
        assert!((other - known).abs() > 0.005, "{degrees}: {other}");
    }
}

/// The paper's eqs. 4 and 5, as they are printed.
fn paper(material: &Ashikhmin, k1: DVec3, k2: DVec3) -> DVec3 {
    let n = DVec3::Z;
    // u = axis x n, v = n x u, for the axis y.
    let (u, v) = (DVec3::X, DVec3::Y);
    let h = (k1 + k2).normalize();
    let (nu, nv, rs, rd) = (
        material.nu,
        material.nv,
        material.specular,
        material.diffuse,
    );
    let exponent = (nu * h.dot(u).powi(2) + nv * h.dot(v).powi(2)) / (1.0 - h.dot(n).powi(2));
    let fresnel = rs + (1.0 - rs) * (1.0 - k1.dot(h)).powi(5);
    let specular = ((nu + 1.0) * (nv + 1.0)).sqrt() / (8.0 * std::f64::consts::PI)
        * n.dot(h).powf(exponent)
        / (h.dot(k1) * n.dot(k1).max(n.dot(k2)))
        * fresnel;
    let edge = |k: DVec3| 1.0 - (1.0 - n.dot(k) / 2.0).powi(5);
    let diffuse = 28.0 * rd / (23.0 * std::f64::consts::PI) * (1.0 - rs) * edge(k1) * edge(k2);
    specular + diffuse
}

#[test]
fn it_is_the_papers_formula() {
    for material in cases() {
        let upright = Ashikhmin {
            axis: DVec3::Y,
            ..material
        };
        // 1 - (n.h)^2 of the printed exponent loses digits, and the largest exponents magnify them.
        let size = upright.nu.max(upright.nv).max(1.0);
        let found = furthest(&upright, |wo, wi| paper(&upright, wo, wi));
        // So does the printed k1.h of grazing directions, which are of unit length but for some 1e-16: over the square
        // of their sum's length, above 1e-4 for those drawn here.
        let allowed = f64::max(1.0e-10 * size, 1.0e-8);
        assert!(found < allowed, "{upright:?}: {found:e}");
        let wrong = Ashikhmin {
            nv: 1.01 * upright.nv + 0.01,
            ..upright.clone()
        };
        let found = furthest(&upright, |wo, wi| paper(&wrong, wo, wi));
        assert!(found > 1.0e-3, "{upright:?}: {found:e}");
    }
}

#[test]
fn at_the_normal_the_exponent_is_nothing() {
    // effects.md: 0 at h = n, where the formula has 0/0.
    let material = plain(0.0, 0.5, 1.0e6, 3.0);
    assert_eq!(
        material.half_vector_pdf(DVec3::Z),
        (1.0e6f64 + 1.0).sqrt() * 2.0 / TAU
    );
    let near = material.half_vector_pdf(DVec3::new(1.0e-9, 1.0e-9, 1.0));
    assert!((near / material.half_vector_pdf(DVec3::Z) - 1.0).abs() < 1.0e-10);
}

#[test]
fn what_the_lobe_adds_the_diffuse_term_has_left() {
    // B of `albedo`: the lobe of nothing but Schlick's fifth power.
    let mut least = 1.0f64;
    for (nu, nv) in [
        (0.0, 0.0),
        (0.0, 30.0),
        (3.0, 3.0),
        (20.0, 1.0e3),
        (1.0e4, 1.0e4),
    ] {
        let lobe = plain(0.0, 0.0, nu, nv);
        for degrees in [0.0, 30.0, 60.0, 75.0, 85.0, 89.0] {
            for turn in [0.0, 0.8, 1.57] {
                let wo = direction(degrees, turn);
                let left = (1.0 - 0.5 * wo.z).powi(5);
                let added = albedo(&lobe, wo);
                assert!(added <= left, "{nu}, {nv}, {degrees}: {added} of {left}");
                least = least.min(1.0 - added / left);
            }
        }
    }
    // Companion: it is not far from that.
    assert!(least < 0.5, "{least}");
}

#[test]
fn the_second_moment_has_no_bound() {
    // By each factor of 10 in the cosine it grows by about the same.
    let lobe = plain(0.0, 0.5, 1.0, 1.0);
    let moments = [1.0e-1f64, 1.0e-2, 1.0e-3].map(|cosine| {
        let wo = direction(cosine.acos().to_degrees(), 0.0);
        integral(wo, |wi| {
            TAU * lobe.evaluate(&SURFACE, wo, wi).f_cos.x.powi(2)
        })
    });
    let steps = [moments[1] - moments[0], moments[2] - moments[1]];
    assert!(steps[1] > 0.5 * steps[0] && steps[0] > 0.0, "{moments:?}");
}

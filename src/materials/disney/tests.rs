use std::f64::consts::PI;

use super::*;
use crate::materials::hemisphere::{albedo, direction, furthest};

#[test]
fn it_reflects_what_is_known() {
    // By quadrature in another language: 1.04 at 0 and 1.51 at 88 degrees.
    let rough = Disney {
        roughness: 1.0,
        specular: 0.0,
        ..Disney::of(DVec3::ONE)
    };
    for (degrees, known) in [(0.0, 1.04), (88.0, 1.51)] {
        let found = albedo(&rough, direction(degrees, 0.3));
        assert!((found - known).abs() < 0.005, "{degrees}: {found}");
        // Companion.
        let smoother = Disney {
            roughness: 0.9,
            ..rough.clone()
        };
        let other = albedo(&smoother, direction(degrees, 0.3));
        assert!((other - known).abs() > 0.005, "{degrees}: {other}");
    }
}

/// disney.brdf, line by line, but for its colours, which are linear here.
fn published(p: &Disney, l: DVec3, v: DVec3) -> DVec3 {
    let sqr = |x: f64| x * x;
    let schlick_fresnel = |u: f64| {
        let m = (1.0 - u).clamp(0.0, 1.0);
        let m2 = m * m;
        m2 * m2 * m
    };
    let gtr1 = |n_dot_h: f64, a: f64| {
        let a2 = a * a;
        let t = 1.0 + (a2 - 1.0) * n_dot_h * n_dot_h;
        (a2 - 1.0) / (PI * a2.ln() * t)
    };
    let gtr2_aniso = |n_dot_h: f64, h_dot_x: f64, h_dot_y: f64, ax: f64, ay: f64| {
        1.0 / (PI * ax * ay * sqr(sqr(h_dot_x / ax) + sqr(h_dot_y / ay) + n_dot_h * n_dot_h))
    };
    let smith_g = |n_dot_v: f64, alpha_g: f64| {
        let (a, b) = (alpha_g * alpha_g, n_dot_v * n_dot_v);
        1.0 / (n_dot_v + (a + b - a * b).sqrt())
    };
    let smith_g_aniso = |n_dot_v: f64, v_dot_x: f64, v_dot_y: f64, ax: f64, ay: f64| {
        1.0 / (n_dot_v + (sqr(v_dot_x * ax) + sqr(v_dot_y * ay) + sqr(n_dot_v)).sqrt())
    };
    // X = u = axis x n, Y = v, for the axis y.
    let (n, x, y) = (DVec3::Z, DVec3::X, DVec3::Y);
    let (n_dot_l, n_dot_v) = (n.dot(l), n.dot(v));
    let h = (l + v).normalize();
    let (n_dot_h, l_dot_h) = (n.dot(h), l.dot(h));
    let base = p.base_color;
    let lum = 0.3 * base.x + 0.6 * base.y + 0.1 * base.z;
    let tint = if lum > 0.0 { base / lum } else { DVec3::ONE };
    let spec0 = (p.specular * 0.08 * DVec3::ONE.lerp(tint, p.specular_tint)).lerp(base, p.metallic);
    let c_sheen = DVec3::ONE.lerp(tint, p.sheen_tint);
    let (fl, fv) = (schlick_fresnel(n_dot_l), schlick_fresnel(n_dot_v));
    let fd90 = 0.5 + 2.0 * l_dot_h * l_dot_h * p.roughness;
    let fd = mix(1.0, fd90, fl) * mix(1.0, fd90, fv);
    let fss90 = l_dot_h * l_dot_h * p.roughness;
    let fss = mix(1.0, fss90, fl) * mix(1.0, fss90, fv);
    let ss = 1.25 * (fss * (1.0 / (n_dot_l + n_dot_v) - 0.5) + 0.5);
    let aspect = (1.0 - p.anisotropic * 0.9).sqrt();
    let ax = (sqr(p.roughness) / aspect).max(0.001);
    let ay = (sqr(p.roughness) * aspect).max(0.001);
    let ds = gtr2_aniso(n_dot_h, h.dot(x), h.dot(y), ax, ay);
    let fh = schlick_fresnel(l_dot_h);
    let fs = spec0.lerp(DVec3::ONE, fh);
    let gs = smith_g_aniso(n_dot_l, l.dot(x), l.dot(y), ax, ay)
        * smith_g_aniso(n_dot_v, v.dot(x), v.dot(y), ax, ay);
    let f_sheen = fh * p.sheen * c_sheen;
    let dr = gtr1(n_dot_h, mix(0.1, 0.001, p.clearcoat_gloss));
    let fr = mix(0.04, 1.0, fh);
    let gr = smith_g(n_dot_l, 0.25) * smith_g(n_dot_v, 0.25);
    ((1.0 / PI) * mix(fd, ss, p.subsurface) * base + f_sheen) * (1.0 - p.metallic)
        + gs * fs * ds
        + DVec3::splat(0.25 * p.clearcoat * gr * fr * dr)
}

#[test]
fn it_is_the_published_code() {
    for material in cases() {
        let upright = Disney {
            axis: DVec3::Y,
            ..material
        };
        let found = furthest(&upright, |wo, wi| published(&upright, wi, wo));
        // GTR1's 1 - (1 - a^2) cos^2 loses digits where the gloss is 1.
        assert!(found < 1.0e-8, "{upright:?}: {found:e}");
        let wrong = Disney {
            roughness: 0.9 * upright.roughness + 0.02,
            ..upright.clone()
        };
        let found = furthest(&upright, |wo, wi| published(&wrong, wi, wo));
        assert!(found > 1.0e-4, "{upright:?}: {found:e}");
    }
}

#[test]
fn the_most_that_is_scattered_is_known() {
    let mut lower = 0.0f64;
    for material in cases() {
        let upright = Disney {
            axis: DVec3::Y,
            ..material
        };
        let bound = upright.albedo().x;
        for degrees in [0.0, 40.0, 70.0, 80.0, 85.0, 87.0, 89.0, 89.9] {
            for turn in [0.0, 1.57] {
                let found = albedo(&upright, direction(degrees, turn));
                assert!(found <= bound, "{upright:?}, {degrees}: {found} of {bound}");
                lower = lower.max(found / bound);
            }
        }
    }
    // Companion: a bound 5 % lower is not kept.
    assert!(lower > 0.95, "{lower}");
}

#[test]
fn what_gains_energy_says_so() {
    let [what, _] = Disney {
        roughness: 1.0,
        ..Disney::of(DVec3::ONE)
    }
    .warning()
    .expect("it does");
    assert!(what.contains("gains energy"), "{what}");
    assert_eq!(Disney::of(DVec3::splat(0.5)).warning(), None);
}

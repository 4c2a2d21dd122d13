use super::*;
use crate::materials::hemisphere::{albedo, direction, furthest};

fn white(roughness: f64) -> Sheen {
    Sheen {
        color: DVec3::ONE,
        roughness,
    }
}

/// As it is printed.
fn published(material: &Sheen, l: DVec3, v: DVec3) -> DVec3 {
    let h = (l + v).normalize();
    let (r, sin_h) = (material.roughness, h.z.acos().sin());
    let d = (2.0 + 1.0 / r) * sin_h.powf(1.0 / r) / (2.0 * PI);
    let visibility = 1.0 / (4.0 * (l.z + v.z - l.z * v.z));
    d * visibility * material.color
}

#[test]
fn it_is_the_published_formula() {
    for material in cases() {
        let found = furthest(&material, |wo, wi| published(&material, wo, wi));
        // sin(acos) loses digits near the normal, and the power magnifies that.
        assert!(found < 1.0e-6, "{material:?}: {found:e}");
        let wrong = Sheen {
            roughness: 1.01 * material.roughness,
            ..material.clone()
        };
        let found = furthest(&material, |wo, wi| published(&wrong, wo, wi));
        assert!(found > 1.0e-3, "{material:?}: {found:e}");
    }
}

#[test]
fn along_the_surface_it_scatters_most() {
    // For r = 1 and 1/2 the integrals of sin^3 and sin^4 are 2/3 and 3 pi/16.
    assert!((white(1.0).most() - 2.0 / PI).abs() < 1.0e-6);
    assert!((white(0.5).most() - 0.75).abs() < 1.0e-6);
    for roughness in [MIN_ROUGHNESS, 0.1, 0.2, 0.5, 1.0] {
        let material = white(roughness);
        let mut before = 0.0;
        for degrees in [0.0, 20.0, 45.0, 70.0, 80.0, 85.0, 88.0, 89.0, 89.9, 89.999] {
            let found = albedo(&material, direction(degrees, 0.3));
            assert!(found > before, "{roughness}, {degrees}: {found}");
            assert!(
                found <= material.albedo().x,
                "{roughness}, {degrees}: {found}"
            );
            before = found;
        }
        // Companion: it comes that far.
        assert!(before > 0.995 * material.most(), "{roughness}: {before}");
    }
}

#[test]
fn what_gains_energy_says_so() {
    let [what, _] = white(0.2).warning().expect("it does");
    assert!(what.contains("scatters 1.02 times"), "{what}");
    assert_eq!(white(0.22).warning(), None);
    let dark = Sheen {
        color: DVec3::splat(0.5),
        roughness: MIN_ROUGHNESS,
    };
    assert_eq!(dark.warning(), None);
}

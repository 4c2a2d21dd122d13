//! Tables of few entries with which measured materials are tested: no file of the database can be.

use std::f64::consts::FRAC_1_PI;
use std::sync::{Arc, LazyLock};

use glam::DVec3;

use super::{BrdfTable, Measured};
use crate::materials::lobes::{Pair, schlick};

/// A table by angles' functions: the squared sine of theta_h, the cosine of theta_d, and cos 2 phi_d where it has
/// a meaning.
fn table(sizes: [usize; 3], f: impl Fn(f64, f64, f64) -> DVec3) -> Arc<BrdfTable> {
    Arc::new(BrdfTable::sampled(sizes, |o, i| {
        let Pair { h, cos_h, .. } = Pair::between(o, i);
        let across = h.truncate();
        let difference = 0.5 * (i - o);
        let sides = across.perp_dot(difference.truncate()).powi(2);
        let turned = across.length_squared() * difference.length_squared() - 2.0 * sides;
        f(across.length_squared(), cos_h, turned).max(DVec3::ZERO)
    }))
}

/// A glossy lobe over a dull colour, with phi_d, and 0 at wide angles; a metal; a colour that is brighter towards
/// where light comes from, of few entries.
static TABLES: LazyLock<[Arc<BrdfTable>; 3]> = LazyLock::new(|| {
    let plastic = table([24, 10, 12], |sin2, cos_d, turned| {
        let dull = FRAC_1_PI * (0.3 + 0.1 * cos_d + 0.2 * turned - 0.25 * sin2);
        let glossy = (0.05 + 0.95 * schlick(cos_d)) * 3.0 * (-40.0 * sin2).exp();
        dull * DVec3::new(1.0, 0.6, 0.3) + glossy * DVec3::new(1.0, 1.1, 0.9)
    });
    let metal = table([40, 8, 6], |sin2, cos_d, turned| {
        let lobe = 6.0 * (1.0 + 0.3 * turned) / (1.0 + 120.0 * sin2).powi(2);
        (lobe + 0.02) * DVec3::new(0.9, 0.7, 0.4).lerp(DVec3::ONE, schlick(cos_d))
    });
    let dusty = table([4, 5, 3], |sin2, cos_d, turned| {
        (0.05 + 0.1 * cos_d + 0.04 * turned) * DVec3::new(0.8, 1.0, 1.2 + 0.2 * sin2)
    });
    [plastic, metal, dusty]
});

pub(in crate::materials) fn cases() -> Vec<Measured> {
    let [plastic, metal, dusty] = LazyLock::force(&TABLES);
    let case = |name: &str, table: &Arc<BrdfTable>, scale: DVec3| {
        Measured::of(&format!("{name}.binary"), Arc::clone(table), scale)
    };
    vec![
        case("plastic", plastic, DVec3::ONE),
        case("metal", metal, DVec3::new(1.1, 1.0, 0.9)),
        case("dusty", dusty, DVec3::splat(1.5)),
        case("tinted", plastic, DVec3::new(0.7, 0.0, 0.8)),
    ]
}

//! Car paints that tests ask for, every form among them.

use glam::DVec3;

use super::{CarPaint, LEAST_M, POLARIS_SILBER};
use crate::materials::coat::Clearcoat;
use crate::materials::flakes::Flakes;

pub(in crate::materials) fn cases() -> Vec<CarPaint> {
    let case = |diffuse: [f64; 3], specular: [[f64; 3]; 3], f0: [f64; 3], m: [f64; 3]| CarPaint {
        preset: None,
        diffuse: Some(diffuse.into()),
        specular: Some(specular.map(DVec3::from)),
        f0: Some(f0.into()),
        m: Some(m.into()),
        ..CarPaint::default()
    };
    let silver = CarPaint {
        preset: None,
        diffuse: Some(POLARIS_SILBER.diffuse),
        specular: Some(POLARIS_SILBER.specular),
        f0: Some(POLARIS_SILBER.f0),
        m: Some(POLARIS_SILBER.m),
        ..CarPaint::default()
    };
    let none = [0.0; 3];
    let coated = |paint: &CarPaint, ior| CarPaint {
        clearcoat: Some(Clearcoat { ior }),
        ..paint.clone()
    };
    let silver_of = |m: [f64; 3]| CarPaint {
        m: Some(m.into()),
        ..silver.clone()
    };
    let red = case(
        [0.4, 0.02, 0.01],
        [none, [0.03, 0.02, 0.02], [0.1; 3]],
        [0.2; 3],
        [0.5, 0.2, 0.1],
    );
    let flaked =
        |paint: CarPaint, [density, scale, spread, jitter]: [f64; 4], color: [f64; 3]| CarPaint {
            flakes: Some(Flakes {
                density,
                scale,
                spread,
                jitter,
                color: color.into(),
            }),
            ..paint
        };
    vec![
        // Flakes that need the search of at most two cells along each axis, of one and of three.
        flaked(red.clone(), [0.6, 8.0, 0.3, 0.5], [0.2, 0.15, 0.1]),
        flaked(silver_of([0.4, 0.2, 0.05]), [0.4, 20.0, 0.0, 0.0], [0.2; 3]),
        flaked(
            coated(&silver_of([0.3, 0.2, 0.1]), 2.0),
            [0.5, 50.0, 0.2, 0.25],
            [0.1; 3],
        ),
        flaked(coated(&red, 1.5), [1.0, 3.0, 0.15, 1.0], [0.15, 0.15, 0.2]),
        // One that reflects nothing by itself, a usual coat, one of diamond over paint without lobes.
        coated(&red, 1.0),
        coated(&silver, 1.5),
        coated(&case([0.3, 0.4, 0.5], [none; 3], [0.5; 3], [0.1; 3]), 2.4),
        silver.clone(),
        // Colours of all parts, the widest lobe, and one that reflects little but at grazing incidence.
        case(
            [0.3, 0.05, 0.02],
            [[0.02, 0.04, 0.05], [0.05, 0.02, 0.1], [0.06, 0.06, 0.05]],
            [0.3, 1.0, 0.04],
            [1.0, 0.3, 0.1],
        ),
        // Parts alone.
        case([0.5, 0.4, 0.3], [none; 3], [0.5; 3], [0.1; 3]),
        case(
            none,
            [none, [0.2, 0.1, 0.05], none],
            [0.6; 3],
            [0.5, 0.05, 0.5],
        ),
        // The narrowest.
        case(
            [0.2, 0.2, 0.3],
            [none, none, [0.15, 0.1, 0.05]],
            [0.9; 3],
            [0.5, 0.5, LEAST_M],
        ),
    ]
}

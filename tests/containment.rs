//! What lies in what: spheres that are left out, and spheres just within another one.

use std::fmt::Write as _;

use crate::common::images::{Left, uniform};
use crate::common::{render_cpu, render_gpu, scene};
use gpu_trace::effects::{Effect, Effects};
use gpu_trace::placement::{Placement, Side};
use gpu_trace::sampler::Sampler;
use gpu_trace::scene::{Environment, Scene};
use gpu_trace::settings::{GeometryChoice, Settings};
use gpu_trace::verify::{Random, means, settings};

const MATERIALS: &str = "
    [material.lamp]
    type = 'diffuse'
    albedo = [0.5, 0.5, 0.5]
    emission = [1, 1, 1]
    [material.two]
    type = 'dielectric'
    ior = 2.0
    [material.some]
    type = 'dielectric'
    ior = 1.5
";

/// A camera at `position`, spheres as (center, radius, material), an environment of 1.
fn spheres(position: [f64; 3], all: &[([f64; 3], f64, &str)]) -> Scene {
    let mut text = format!(
        "[camera]\nposition = {position:?}\nlook_at = [0.01, 0.02, -9.0]\nfov = 40.0\n[image]\n\
         width = 16\nheight = 16\n[environment]\nradiance = [1, 1, 1]\n{MATERIALS}"
    );
    for (center, radius, material) in all {
        let _ = writeln!(
            text,
            "[[sphere]]\ncenter = {center:?}\nradius = {radius:?}\nmaterial = \"{material}\""
        );
    }
    scene(&text)
}

fn left(scene: &Scene) -> Vec<usize> {
    let placement = Placement::new(scene, 16, 16);
    placement.spheres.iter().map(|s| s.source).collect()
}

#[test]
fn of_spheres_that_differ_by_a_rounding_one_is_left() {
    let ulp = f64::EPSILON;
    let place = [0.3, 0.0, 0.0];
    let moved = [0.1 + 0.2, 0.0, 0.0];
    assert_ne!(place, moved);
    for (a, b) in [
        ((place, 1.0), (place, 1.0)),
        ((place, 1.0), (place, 1.0 + ulp)),
        ((place, 1.0 + ulp), (place, 1.0)),
        ((place, 1.0), (moved, 1.0)),
        ((place, 1.0 - ulp), (moved, 1.0)),
    ] {
        for camera in [[0.0, 0.0, 4.0], [0.3, 0.0, 0.5]] {
            let scene = spheres(camera, &[(a.0, a.1, "lamp"), (b.0, b.1, "lamp")]);
            assert_eq!(left(&scene).len(), 1, "{a:?} {b:?} from {camera:?}");
            let film = render_gpu(&scene, &settings(&scene, 16, 16, 16));
            assert!(means(&film).iter().any(|m| *m > 1.4), "{a:?} {b:?}");
        }
    }
    // Companion: what is not hidden stays.
    let apart = spheres(
        [0.0, 0.0, 4.0],
        &[(place, 1.0, "lamp"), (moved, 1.0 + 1.0e-9, "lamp")],
    );
    assert_eq!(left(&apart), [1]);
    let beside = spheres(
        [0.0, 0.0, 4.0],
        &[(place, 1.0, "lamp"), ([0.31, 0.0, 0.0], 1.0, "lamp")],
    );
    assert_eq!(left(&beside).len(), 2);
}

#[test]
fn chains_of_hidden_spheres_leave_the_outermost() {
    let all: Vec<([f64; 3], f64, &str)> = (0..5)
        .map(|i| ([0.0; 3], 1.0 - 0.1 * f64::from(i), "lamp"))
        .collect();
    assert_eq!(left(&spheres([0.0, 0.0, 4.0], &all)), [0]);
    // In a room the tightest is left.
    assert_eq!(left(&spheres([0.0, 0.0, 0.1], &all)), [4]);
    // Between the third and the fourth, these two.
    assert_eq!(left(&spheres([0.0, 0.0, 0.75], &all)), [2, 3]);
}

#[test]
fn glass_is_not_hidden_by_glass_and_fills_rooms() {
    let nested = spheres(
        [0.0, 0.0, 4.0],
        &[([0.0; 3], 1.0, "two"), ([0.0; 3], 0.5, "lamp")],
    );
    assert_eq!(left(&nested).len(), 2);
    let room = [([0.0; 3], 1.0, "lamp"), ([0.0; 3], 2.0, "two")];
    assert_eq!(left(&spheres([0.0, 0.0, 0.5], &room)).len(), 2);
}

/// A furnace is white, whatever glass is in it, on both backends and in both geometry forms.
fn is_white(name: &str, scene: &Scene) {
    for geometry in [
        GeometryChoice::Baked,
        GeometryChoice::List,
        GeometryChoice::Bvh,
    ] {
        let settings = Settings {
            geometry,
            max_bounces: 4000,
            // Some paths in glass go round for longer than that: not these.
            sampler: Sampler::Independent,
            ..settings(scene, 16, 16, 64)
        };
        let film = render_gpu(scene, &settings);
        let white = uniform(&film, [1.0; 3]);
        let _left = Left::of(format!("{name}, {geometry:?}"), &film, &white);
        assert_eq!(film.tally().cut_paths, 0, "{name}");
        for mean in means(&film) {
            assert!((mean - 1.0).abs() < 1.0e-3, "{name}, {geometry:?}: {mean}");
        }
    }
    let film = render_cpu(scene, &settings(scene, 16, 16, 16));
    let _left = Left::alone(format!("{name}, CPU"), &film);
    assert!(means(&film).iter().all(|m| *m < 1.0 + 1.0e-9), "{name}");
}

#[test]
fn crowded_shells_are_white() {
    let camera = [0.0, 0.0, 4.0];
    let o = [0.0; 3];
    let shifted = [0.0004, 0.0, 0.0];
    for (name, all) in [
        (
            "two cores",
            vec![
                (o, 1.0, "two"),
                (o, 1.0 - 1.0e-8, "two"),
                (shifted, 0.9996, "two"),
            ],
        ),
        (
            "the same, other order",
            vec![
                (o, 1.0, "two"),
                (shifted, 0.9996, "two"),
                (o, 1.0 - 1.0e-8, "two"),
            ],
        ),
        (
            "a chain",
            vec![
                (o, 1.0, "two"),
                (o, 1.0 - 1.0e-8, "some"),
                (o, 1.0 - 2.0e-8, "two"),
                (o, 0.999, "some"),
            ],
        ),
        (
            "a bubble that touches",
            vec![(o, 1.0, "two"), ([0.7, 0.0, 0.0], 0.3, "some")],
        ),
        (
            "a bubble that touches above",
            vec![(o, 1.0, "two"), ([0.0, 0.7, 0.0], 0.3, "some")],
        ),
        (
            "paint",
            vec![
                (o, 1.0, "two"),
                (o, 0.3, "two"),
                ([0.0, 0.69, 0.0], 0.3, "some"),
            ],
        ),
    ] {
        is_white(name, &spheres(camera, &all));
    }
    // More than the kernel keeps account of: none is.
    let crowd: Vec<([f64; 3], f64, &str)> = (0..7)
        .map(|i| {
            (
                [1.0e-5 * f64::from(i), 0.0, 0.0],
                0.9998 + 1.0e-6 * f64::from(i % 2),
                "some",
            )
        })
        .chain([(o, 1.0, "two")])
        .collect();
    is_white("a crowd", &spheres(camera, &crowd));
}

#[test]
fn a_tangent_bubble_in_a_wall_of_glass_is_white() {
    // The bubble touches the wall from inside, and another sphere lies just within the wall.
    let wall = 1000.0;
    let center = [0.0, -1000.5, 0.0];
    let all = [
        (center, wall, "two"),
        (center, 999.999_926_989_055_7, "two"),
        (
            [0.0, -1000.5, 3.027_689_969_781_818],
            996.972_310_030_218_2,
            "two",
        ),
    ];
    is_white("wall", &spheres([0.3, 0.8, 5.0], &all));
    let [a, b, c] = all;
    is_white("wall, other order", &spheres([0.3, 0.8, 5.0], &[b, c, a]));
}

#[test]
fn a_camera_on_a_surface_is_outside() {
    let mut random = Random::new("surface");
    for _ in 0..2000 {
        let place = random.direction().normalize();
        for material in ["lamp", "two"] {
            let scene = spheres(place.to_array(), &[([0.0; 3], 1.0, material)]);
            let placement = Placement::new(&scene, 16, 16);
            let side = placement.spheres[0].side;
            assert!(matches!(side, Side::Outside | Side::Tracked), "{place}");
            assert!(placement.within.is_empty(), "{place}");
        }
    }
}

#[test]
fn a_closed_room_has_no_sky() {
    let effects = |camera| {
        let scene = spheres(camera, &[([0.0; 3], 1.0, "lamp")]);
        let placement = Placement::new(&scene, 16, 16);
        let effects = Effects::derive(&scene, &placement, &Settings::for_scene(&scene));
        (effects.has(Effect::Environment), placement.radiance_scale)
    };
    assert!(!effects([0.0, 0.0, 0.5]).0);
    assert!(effects([0.0, 0.0, 4.0]).0);
    // Nor does it count for the unit of light.
    let mut scene = spheres([0.0, 0.0, 0.5], &[([0.0; 3], 1.0, "lamp")]);
    scene.environment = Some(Environment::Constant(glam::DVec3::splat(1.0e20)));
    assert_eq!(
        Placement::new(&scene, 16, 16).radiance_scale,
        effects([0.0, 0.0, 0.5]).1
    );
}

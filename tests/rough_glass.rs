//! Rough glass in scenes: all estimators have the same mean, lamps on any side of it and in it, clear or tinted, and
//! where there is no surface there is none to be seen. (Its BSDF is tested as that of every material is.)

use crate::common::images::{assert_uniform, channels, fault};
use crate::common::{render_gpu, scene};
use crate::thorough::thorough;
use gpu_trace::film::Film;
use gpu_trace::scene::Scene;
use gpu_trace::settings::{Integrator, LightSampling, Settings};
use gpu_trace::statistics::normal_limit;
use gpu_trace::verify::{U, means, settings};

/// Frosted glass, lamps, and a floor; the camera at `eye`.
fn scene_with(eye: [f64; 3], spheres: &[(&str, [f64; 3], f64)]) -> Scene {
    let mut text = format!(
        "[camera]\nposition = {eye:?}\nlook_at = [0, 0, -0.1]\nfov = 40.0\n[image]\nwidth = 16\nheight = 16\n\
         [environment]\nradiance = [0.1, 0.1, 0.1]\n\
         [material.frosted]\ntype = \"dielectric\"\nior = 1.5\nroughness = 0.6\n\
         [material.dense]\ntype = \"dielectric\"\nior = 1.8\nroughness = 0.5\n\
         [material.tinted]\ntype = \"dielectric\"\nior = 1.5\nroughness = 0.6\nabsorption = [0.7, 0, 0]\n\
         [material.clear]\ntype = \"dielectric\"\nior = 1.3\n\
         [material.floor]\ntype = \"diffuse\"\nalbedo = [0.5, 0.5, 0.5]\n\
         [material.lamp]\ntype = \"diffuse\"\nalbedo = [0, 0, 0]\nemission = [4, 4, 4]\n\
         [[sphere]]\ncenter = [0, -101.2, 0]\nradius = 100\nmaterial = \"floor\"\n"
    );
    for (material, center, radius) in spheres {
        text += &format!(
            "[[sphere]]\ncenter = {center:?}\nradius = {radius}\nmaterial = \"{material}\"\n"
        );
    }
    scene(&text)
}

const OUTSIDE: [f64; 3] = [0.0, 0.2, 4.0];

fn situations() -> Vec<(&'static str, Scene)> {
    let ball = ("frosted", [0.0, 0.0, 0.0], 1.0);
    let mut many = vec![ball];
    for i in 0..10 {
        let angle = 0.63 * f64::from(i);
        let place = [
            2.0 * angle.cos(),
            0.4 + 0.1 * f64::from(i),
            2.0 * angle.sin(),
        ];
        many.push(("lamp", place, 0.3));
    }
    let behind = ("lamp", [0.6, 0.4, -2.5], 0.6);
    vec![
        ("behind", scene_with(OUTSIDE, &[ball, behind])),
        (
            "before",
            scene_with(OUTSIDE, &[ball, ("lamp", [1.5, 2.0, 3.0], 0.6)]),
        ),
        (
            "within",
            scene_with(OUTSIDE, &[ball, ("lamp", [0.3, 0.1, 0.1], 0.3)]),
        ),
        (
            "seen from within",
            scene_with([0.0, 0.0, 0.6], &[ball, behind]),
        ),
        (
            "across",
            scene_with(OUTSIDE, &[ball, ("lamp", [0.8, 0.4, 0.2], 0.5)]),
        ),
        (
            "nested",
            scene_with(
                OUTSIDE,
                &[
                    ("clear", [0.0, 0.0, 0.0], 1.1),
                    ("dense", [0.1, 0.0, 0.0], 0.8),
                    ("frosted", [0.6, 0.3, 0.2], 0.5),
                    ("lamp", [0.0, 0.1, 0.1], 0.3),
                ],
            ),
        ),
        ("many lamps", scene_with(OUTSIDE, &many)),
        (
            "tinted",
            scene_with(
                OUTSIDE,
                &[
                    ("tinted", [0.0, 0.0, 0.0], 1.0),
                    ("clear", [0.6, 0.3, 0.2], 0.5),
                    ("lamp", [-0.2, 0.1, 0.1], 0.3),
                    ("floor", [0.2, -0.5, 0.1], 0.3),
                ],
            ),
        ),
    ]
}

#[test]
fn lamps_are_found_on_both_sides() {
    // The long form finds half of what the short one does.
    let (spp, least) = if thorough() {
        (2048, 0.015)
    } else {
        (512, 0.03)
    };
    let situations = situations();
    let ways = 4 * situations.len();
    let limit = normal_limit(ways);
    let (mut apart, mut failed) = (Vec::new(), Vec::new());
    for (name, scene) in situations {
        let base = settings(&scene, 16, 16, spp);
        let with = |integrator, light_sampling, factor| {
            let settings = Settings {
                integrator,
                light_sampling,
                samples: 0..spp * factor,
                seed: factor,
                ..base.clone()
            };
            render_gpu(&scene, &settings)
        };
        // Without light sampling: what it must not change.
        let reference = with(Integrator::Bsdf, None, 16);
        let [truth, error] = channels(&reference)[0];
        for (integrator, light_sampling) in [
            (Integrator::Path, None),
            (Integrator::Path, Some(LightSampling::Cone)),
            (Integrator::Nee, None),
            (Integrator::Lecture { termination: 0.2 }, None),
        ] {
            let film = with(integrator, light_sampling, 4);
            let [found, own] = channels(&film)[0];
            let both = error.hypot(own);
            let z = (found - truth) / both;
            let sampling: LightSampling = light_sampling.unwrap_or_default();
            let name = format!("{name}, {} {}", integrator.name(), sampling.name());
            eprintln!(
                "{name}: {found:.5}, z = {z:.2}, error {:.3} %",
                100.0 * both / truth
            );
            failed.extend(fault(&name, &film, &reference, z.abs() < limit, z));
            apart.push((name, z, least * truth / both));
        }
    }
    assert_eq!(apart.len(), ways);
    assert!(failed.is_empty(), "beyond {limit}: {failed:?}");
    // Power: so much of the light is found missing in most of them.
    let found = apart.iter().filter(|(.., shift)| *shift > 2.0 * limit);
    assert!(4 * found.count() >= 3 * apart.len(), "{apart:?}");
}

/// A glass ball with a rough one of this index in it, in an environment of 1, and its largest deviation from that.
fn off_white(ior: f64, priority: i32) -> (Film, f64) {
    let scene = scene(&format!(
        "[camera]\nposition = [0, 0, 4]\nlook_at = [0, 0, 0]\nfov = 36.0\n[image]\nwidth = 32\nheight = 32\n\
         [environment]\nradiance = [1, 1, 1]\n[material.outer]\ntype = \"dielectric\"\nior = 1.5\n\
         [material.inner]\ntype = \"dielectric\"\nroughness = 0.7\nior = {ior}\n\
         [[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = \"outer\"\npriority = 1\n\
         [[sphere]]\ncenter = [0.2, 0, 0]\nradius = 0.5\nmaterial = \"inner\"\npriority = {priority}\n"
    ));
    let film = render_gpu(&scene, &settings(&scene, 32, 32, 64));
    assert_eq!(film.tally().non_finite, 0);
    let off = means(&film).into_iter().map(|m| (m - 1.0).abs());
    let off = off.fold(0.0, f64::max);
    (film, off)
}

#[test]
fn where_there_is_no_surface_none_is_seen() {
    // Smooth glass loses nothing, rough glass what its microfacets shadow: so it shows if it is there. Within glass of
    // the same index, and where glass of higher precedence hides it, it is not. Tolerance as in furnace.rs.
    let tolerance = 64.0 * 16.0 * U;
    for (ior, priority) in [(1.5, 2), (1.4, 0)] {
        let (film, off) = off_white(ior, priority);
        assert_uniform(&format!("index {ior}"), &film, 1.0, off <= tolerance, off);
    }
    // Companion: one that is there.
    assert!(off_white(1.4, 2).1 > 1.0e-2);
}

//! What the ledger says that settings took, against analytic truth and against renders.

use crate::common::images::Left;
use crate::common::{gpu, job, render_gpu, scene, scene_file};
use gpu_trace::backend::Backend;
use gpu_trace::film::{Estimate, Film};
use gpu_trace::job::prepare;
use gpu_trace::ledger::{Entry, audit};
use gpu_trace::scene::Scene;
use gpu_trace::settings::{Integrator, Offset, Settings};
use gpu_trace::verify::settings;

fn entries(backend: &Backend, scene: &Scene, settings: &Settings) -> Vec<Entry> {
    let film = render_gpu(scene, settings);
    let entries = audit(backend, &job(scene, settings), &film, &|| true);
    entries
        .unwrap_or_else(|e| panic!("{e}"))
        .expect("nothing stops it")
}

/// A room that emits, seen from its centre.
fn furnace(albedo: f64) -> Scene {
    scene(&format!(
        "[camera]\nposition = [0, 0, 0]\nlook_at = [0, 0, 1]\nfov = 90.0\n[image]\nwidth = 32\n\
         height = 32\n[material.wall]\ntype = \"diffuse\"\nalbedo = [{albedo}, {albedo}, {albedo}]\n\
         emission = [1, 1, 1]\n[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = \"wall\"\n"
    ))
}

#[test]
fn a_bounce_limit_takes_the_rest_of_the_series() {
    // E (1 - rho^(N + 1))/(1 - rho) of E/(1 - rho); without roulette every path is alike.
    for backend in [Backend::Gpu(Box::new(gpu())), Backend::Cpu { threads: 0 }] {
        for (albedo, bounces) in [(0.5, 1), (0.5, 4), (0.9, 16)] {
            let scene = furnace(albedo);
            let settings = Settings {
                max_bounces: bounces,
                roulette: Some(false),
                integrator: Integrator::Bsdf,
                ..settings(&scene, 32, 32, 16)
            };
            let entries = entries(&backend, &scene, &settings);
            assert_eq!(entries.len(), 1);
            let entry = &entries[0];
            assert_eq!(
                (entry.setting, &*entry.value),
                ("max-bounces", &*bounces.to_string())
            );
            let more = f64::from(4 * bounces + 65);
            let truth =
                1.0 - (1.0 - albedo.powf(f64::from(bounces) + 1.0)) / (1.0 - albedo.powf(more));
            assert!(
                (entry.removed / truth - 1.0).abs() < 1.0e-4,
                "{entry:?} for {truth}"
            );
            // Companion: one bounce more is another share.
            assert!((entry.removed / (truth * albedo) - 1.0).abs() > 0.05);
        }
    }
}

#[test]
fn an_offset_takes_what_renders_lack() {
    let scene = scene_file("scenes/glass.toml");
    let with = |offset, seed| Settings {
        offset,
        seed,
        // Which has few outliers here: rays that start in the glass make light samples worse.
        integrator: Integrator::Bsdf,
        ..settings(&scene, 64, 48, 512)
    };
    let backend = Backend::Gpu(Box::new(gpu()));
    let found = entries(&backend, &scene, &with(Offset::None, 0));
    let entry = found
        .iter()
        .find(|e| e.setting == "offset")
        .expect("an entry");
    // Other seeds: nothing is shared with the audit.
    let [exact, nudged] = [(Offset::Exact, 1), (Offset::None, 2)]
        .map(|(offset, seed)| render_gpu(&scene, &with(offset, seed)));
    let _left = Left::of("without an offset", &nudged, &exact);
    let light = |film: &Film| {
        let count = film.rect().pixels();
        let variance = (0..count)
            .filter_map(|i| film.variance_of_mean(i))
            .flatten()
            .sum::<f64>();
        (
            Estimate::of(film).mean,
            variance.sqrt() / (3 * count) as f64,
        )
    };
    let (exact, exact_error) = light(&exact);
    let (nudged, nudged_error) = light(&nudged);
    let removed = 1.0 - nudged / exact;
    // Channels of a pixel share their paths: at most three times the variance.
    let error = (3.0f64).sqrt() * exact_error.hypot(nudged_error) / exact;
    let z = (entry.removed - removed) / error.hypot(entry.standard_error);
    assert!(
        z.abs() < 4.0,
        "{entry:?}, renders say {removed} within {error}"
    );
    // Companion: it is not nothing, by far.
    assert!(
        entry.removed > 10.0 * entry.standard_error && removed > 10.0 * error,
        "{entry:?}"
    );
}

#[test]
fn what_takes_nothing_is_not_in_it() {
    let backend = Backend::Gpu(Box::new(gpu()));
    let scene = scene_file("scenes/lecture.toml");
    assert_eq!(entries(&backend, &scene, &settings(&scene, 32, 32, 16)), []);
    // Stopped before it is measured, it is left out.
    let settings = Settings {
        max_bounces: 1,
        ..settings(&scene, 32, 32, 16)
    };
    let film = render_gpu(&scene, &settings);
    let stopped = audit(&backend, &job(&scene, &settings), &film, &|| false);
    assert_eq!(stopped.unwrap_or_else(|e| panic!("{e}")), None);
}

/// A lens across one of two glass balls; `apart` moves the other off it.
fn across(apart: f64) -> Scene {
    scene(&format!(
        "[camera]\nposition = [0, 0, 0.99]\nlook_at = [7, 0, -5]\nfov = 5.0\n\
         aperture_radius = 0.3\nfocus_distance = 10.0\n[image]\nwidth = 16\nheight = 16\n\
         [environment]\nradiance = [1, 1, 1]\n[material.glass]\ntype = \"dielectric\"\nior = 1.5\n\
         [[sphere]]\ncenter = [0, 0, 0]\nradius = 1.0\nmaterial = \"glass\"\n\
         [[sphere]]\ncenter = [{}, 0, 1]\nradius = 0.4\nmaterial = \"glass\"\n",
        0.75 + apart
    ))
}

#[test]
fn what_only_an_offset_lets_be_rendered_has_no_figure() {
    // By sign the lens may be on both sides; exactly, its points would be in different media.
    let with = |scene: &Scene, offset| Settings {
        offset,
        ..settings(scene, 16, 16, 16)
    };
    let offset = Offset::Out(1.0e-2);
    for backend in [Backend::Gpu(Box::new(gpu())), Backend::Cpu { threads: 0 }] {
        let scene = across(0.0);
        let refused = prepare(&scene, &with(&scene, Offset::Exact)).map(|_| ());
        let found = entries(&backend, &scene, &with(&scene, offset));
        let entry = |name| found.iter().find(|e| e.setting == name);
        let entry = entry("offset").expect("an entry");
        assert!(entry.removed.is_nan() && entry.standard_error.is_nan());
        let why = refused.expect_err("it is refused").to_string();
        assert_eq!(entry.unknown.as_ref(), Some(&why));
        // What does not need the exact scene is known all the same.
        let settings = Settings {
            max_bounces: 1,
            ..with(&scene, offset)
        };
        let found = entries(&backend, &scene, &settings);
        let [bounces, nudge] = found.as_slice() else {
            panic!("{found:?}");
        };
        assert!(
            bounces.removed > 0.0 && bounces.unknown.is_none(),
            "{bounces:?}"
        );
        assert!(nudge.unknown.is_some(), "{nudge:?}");
        // Companion: the other ball off the first, there is a figure.
        let scene = across(2.0);
        let found = entries(&backend, &scene, &with(&scene, offset));
        let entry = found.iter().find(|e| e.setting == "offset");
        let entry = entry.expect("an entry");
        assert!(
            entry.removed.is_finite() && entry.unknown.is_none(),
            "{entry:?}"
        );
    }
}

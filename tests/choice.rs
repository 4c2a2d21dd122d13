//! `--integrator auto`: what it chooses, by which figures, and that these are right.

use crate::cli_support::{Folder, holds};
use crate::common::{render_gpu, scene, scene_file};
use gpu_trace::choice::{Candidate, Choice, Trial, choose};
use gpu_trace::film::{Estimate, Film};
use gpu_trace::scene::Scene;
use gpu_trace::settings::{GeometryChoice, Integrator, Rect, Settings};
use gpu_trace::statistics::{as_normal, mean_and_error, normal_limit};

fn chosen(scene: &Scene) -> Choice {
    choose(scene, &Settings::for_scene(scene), &[Candidate::Bsdf]).unwrap_or_else(|e| panic!("{e}"))
}

fn built_in(name: &str) -> Scene {
    scene_file(std::path::Path::new(&format!("scenes/{name}.toml")))
}

#[test]
fn what_pays_is_chosen() {
    // Few lamps in rooms; a sky that is nearly all of the light.
    for (name, integrator) in [
        ("lecture", Integrator::Path),
        ("disney", Integrator::Path),
        ("field", Integrator::Bsdf),
    ] {
        let choice = chosen(&built_in(name));
        assert_eq!(
            choice.candidate.integrator(),
            integrator,
            "{name}: {choice:?}"
        );
        let [path, bsdf] = &choice.trials[..] else {
            panic!("{name}: {choice:?}");
        };
        assert!(path.cost > bsdf.cost && path.relative_variance < bsdf.relative_variance);
        let pays = path.effort() < bsdf.effort();
        assert_eq!(pays, integrator == Integrator::Path, "{name}: {choice:?}");
    }
    // Nothing to choose.
    let furnace = chosen(&built_in("tests/furnace"));
    assert!(furnace.trials.is_empty() && furnace.without_pilot.is_some());
    assert_eq!(furnace.candidate, Candidate::Path);
}

#[test]
fn a_choice_is_a_function_of_the_scene_and_the_size() {
    let scene = built_in("field");
    let settings = Settings::for_scene(&scene);
    let other = Settings {
        seed: 7,
        crop: Rect {
            x: 3,
            y: 5,
            width: 16,
            height: 8,
        },
        samples: 1024..2048,
        classes: true,
        geometry: GeometryChoice::List,
        ..settings.clone()
    };
    let found = |settings| choose(&scene, settings, &[Candidate::Bsdf]).expect("a choice");
    assert_eq!(found(&settings), found(&other));
    // Companion: figures of another size are other ones.
    let wider = Settings {
        width: 2 * settings.width,
        ..settings.clone()
    };
    assert_ne!(found(&settings).trials, found(&wider).trials);
}

/// Renders that a pilot's figures are held against.
const SEEDS: u64 = 16;

/// How far a pilot's figure is off those of renders of the same kind, which differ by their seeds alone: as a normal
/// deviate, of Student's t.
fn off(figure: f64, renders: &[f64]) -> f64 {
    let (mean, error) = mean_and_error(renders);
    let count = renders.len() as f64;
    as_normal(
        (figure - mean) / (error * (count + 1.0).sqrt()),
        count - 1.0,
    )
}

/// Renders with images of about so many pixels.
fn films(scene: &Scene, integrator: Integrator, pixels: f64, samples: u64) -> Vec<Film> {
    let whole = Settings::for_scene(scene);
    let [width, height] = [whole.width, whole.height].map(f64::from);
    let scale = (pixels / (width * height)).sqrt();
    let [width, height] = [width, height].map(|side| (side * scale) as u32);
    let of = |seed| {
        let settings = Settings {
            width,
            height,
            crop: Rect::whole(width, height),
            samples: 0..samples,
            seed,
            integrator,
            ..whole.clone()
        };
        render_gpu(scene, &settings)
    };
    (1..=SEEDS).map(of).collect()
}

#[test]
fn figures_are_those_of_renders() {
    let limit = normal_limit(8);
    for name in ["lecture", "glass"] {
        let scene = built_in(name);
        let choice = chosen(&scene);
        for trial in &choice.trials {
            // As the pilots are: their variance is that of a pixel of this size, their rays are those of 256 paths.
            let variances = films(&scene, trial.candidate.integrator(), 1024.0, 64);
            let variances = variances.iter().map(|film| {
                let error = Estimate::of(film).error.expect("an error");
                error * error * 64.0
            });
            let variances: Vec<f64> = variances.collect();
            let rays = films(&scene, trial.candidate.integrator(), 256.0, 1);
            let rays = rays.iter();
            let rays: Vec<f64> = rays
                .map(|film| film.tally().rays as f64 / film.paths() as f64)
                .collect();
            // A connection whose BSDF is 0 has no ray: so few that it does not show.
            let off = |trial: &Trial| {
                [
                    off(trial.relative_variance, &variances),
                    off(trial.rays + trial.connections, &rays),
                ]
            };
            let found = off(trial);
            eprintln!("{name}: {found:.2?} of {limit:.2}, {trial:?}");
            assert!(found.iter().all(|z| *z < limit), "{name}: {found:?}");
            // Companions: the figures of the other estimator, and such as are a quarter too large.
            let larger = Trial {
                relative_variance: 1.25 * mean_and_error(&variances).0,
                rays: 1.25 * mean_and_error(&rays).0,
                connections: 0.0,
                ..trial.clone()
            };
            let others = choice.trials.iter().filter(|t| *t != trial);
            for other in others.chain([&larger]) {
                assert!(off(other).iter().all(|z| *z > limit), "{name}: {other:?}");
            }
        }
    }
}

/// A ball under a sky, and a lamp so small that no path of a pilot finds it.
fn far_lamp(radiance: f64) -> Scene {
    scene(&format!(
        "[camera]
        position = [0.0, 0.0, 6.0]
        look_at = [0.0, 0.0, 0.0]
        fov = 25.0
        [image]
        width = 32
        height = 32
        [environment]
        radiance = [1.0, 1.0, 1.0]
        [material.gray]
        type = \"diffuse\"
        albedo = [0.5, 0.5, 0.5]
        [material.lamp]
        type = \"diffuse\"
        albedo = [0.0, 0.0, 0.0]
        emission = [{radiance:?}, {radiance:?}, {radiance:?}]
        [[sphere]]
        center = [0.0, 0.0, 0.0]
        radius = 1.0
        material = \"gray\"
        [[sphere]]
        center = [0.0, 5.0, 5.0]
        radius = 1e-4
        material = \"lamp\"
        "
    ))
}

#[test]
fn a_pilot_that_misses_light_is_not_believed() {
    // A part of the light: without it BSDF sampling has hardly any variance, and would be chosen.
    let choice = chosen(&far_lamp(5.0e8));
    let bsdf = &choice.trials[1];
    assert!(bsdf.effort() < choice.trials[0].effort(), "{choice:?}");
    let doubt = bsdf.doubt.as_deref().unwrap_or_default();
    assert!(doubt.contains("missed light"), "{choice:?}");
    assert_eq!(choice.candidate.integrator(), Integrator::Path);
    // Companion: where the lamp is nothing beside the sky, it is not worth the connections.
    let choice = chosen(&far_lamp(1.0));
    assert_eq!(choice.trials[1].doubt, None, "{choice:?}");
    assert_eq!(choice.candidate.integrator(), Integrator::Bsdf);
}

#[test]
fn a_pilot_has_a_limit() {
    let mut many = built_in("lecture");
    let ball = many.spheres[0];
    for i in 0..7000 {
        let mut ball = ball;
        ball.center.x += 1.0e4 + 3.0 * f64::from(i) * ball.radius;
        many.spheres.push(ball);
    }
    let choice = chosen(&many);
    assert_eq!(choice.candidate.integrator(), Integrator::Path);
    let why = choice.without_pilot.unwrap_or_default();
    assert!(why.contains("more spheres"), "{choice:?}");
}

#[test]
fn the_command_line_says_what_is_chosen() {
    let folder = Folder::new();
    let said = folder.ok("effects field");
    holds(&said, &["What pays here is bsdf", "effort"]);
    let json: serde_json::Value =
        serde_json::from_str(&folder.ok("effects field --json")).expect("JSON");
    assert_eq!(json["integrator"], "bsdf");
    assert_eq!(json["choice"]["trials"][1]["integrator"], "bsdf");
    let of = |options: &str| {
        let text = folder.ok(&format!("effects field --json {options}"));
        let json: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        assert!(json["choice"].is_null(), "{options}: {json}");
        json["integrator"].as_str().map(str::to_owned)
    };
    // Who says which gets that; and who says how lights are sampled wants them to be.
    assert_eq!(of("--integrator path").as_deref(), Some("path"));
    assert_eq!(of("--light-sampling cone").as_deref(), Some("path"));
    folder.ok("field --size 32x18 --spp 4 --stats s.json -o f.png");
    let stats: serde_json::Value = serde_json::from_slice(&folder.read("s.json")).expect("JSON");
    assert_eq!(stats["integrator"], "bsdf");
}

/// Rooms gain by the radiance cache, balls under a lamp do not.
#[test]
fn the_radiance_cache_is_taken_where_it_pays() {
    let rivals = [Candidate::Bsdf, Candidate::RadianceCache];
    for (name, candidate) in [
        ("lecture", Candidate::RadianceCache),
        ("glass", Candidate::RadianceCache),
        ("tests/mirror-ball", Candidate::Path),
        ("tests/lamps", Candidate::Path),
    ] {
        let scene = built_in(name);
        let settings = Settings {
            width: 320,
            height: 320,
            max_bounces: 64,
            ..Settings::for_scene(&scene)
        };
        let choice = choose(&scene, &settings, &rivals).expect("a choice");
        eprintln!("{name}: {choice:?}");
        assert_eq!(choice.candidate, candidate, "{name}: {choice:?}");
        assert_eq!(choice.trials.len(), 3, "{name}");
    }
    // Where there can be none, the others are chosen from.
    let field = built_in("field");
    let choice = choose(&field, &Settings::for_scene(&field), &rivals).expect("a choice");
    assert_eq!(choice.trials.len(), 2, "{choice:?}");
}

//! Layers beside the image: light by the kind of its path, and what is seen first.

use crate::cli_support::{Folder, holds};
use crate::common::images::{Left, assert_alike, assert_same, class_image, with_values};
use crate::common::{gpu_renderer, render_cpu, render_gpu, scene, scene_file};
use gpu_trace::film::{Film, LightClass};
use gpu_trace::render::render_quietly;
use gpu_trace::scene::Scene;
use gpu_trace::settings::{Integrator, Settings};
use gpu_trace::verify::settings;

const INTEGRATORS: [Integrator; 4] = [
    Integrator::Path,
    Integrator::Bsdf,
    Integrator::Nee,
    Integrator::Lecture { termination: 0.2 },
];

fn with_aovs(scene: &Scene, integrator: Integrator, spp: u64) -> Settings {
    Settings {
        integrator,
        classes: true,
        features: true,
        ..settings(scene, 24, 18, spp)
    }
}

/// Renders with several seeds.
fn films(scene: &Scene, integrator: Integrator, seeds: u64) -> Vec<Film> {
    let mut renderer = gpu_renderer(scene, &with_aovs(scene, integrator, 256));
    let mut films = Vec::new();
    for seed in 0..seeds {
        let settings = Settings {
            seed,
            ..with_aovs(scene, integrator, 256)
        };
        renderer = renderer.with_seed(seed);
        let outcome = render_quietly(&mut renderer, &settings);
        films.push(outcome.unwrap_or_else(|e| panic!("{e}")).film);
    }
    films
}

/// The mean light of each class over the image, and its standard error as the spread of films.
fn class_means(films: &[Film]) -> Vec<(f64, f64)> {
    (0..5)
        .map(|class| {
            let mean = |film: &Film| {
                let sum = |i| {
                    film.aovs(i)
                        .map_or(0.0, |a| a.classes[class].iter().sum::<f64>())
                };
                (0..film.rect().pixels()).map(sum).sum::<f64>() / 256.0
            };
            let means: Vec<f64> = films.iter().map(mean).collect();
            gpu_trace::statistics::mean_and_error(&means)
        })
        .collect()
}

#[test]
fn the_classes_add_up_to_the_image() {
    for file in ["glass", "lecture-reflective", "tests/lamps", "tests/nested"] {
        let scene = scene_file(format!("scenes/{file}.toml"));
        for integrator in INTEGRATORS {
            let settings = with_aovs(&scene, integrator, 300);
            for film in [render_gpu(&scene, &settings), render_cpu(&scene, &settings)] {
                let name = format!("{file}, {}", integrator.name());
                let sum = |i: usize| {
                    let classes = film.aovs(i).expect("asked for").classes;
                    [0, 1, 2].map(|c| classes.iter().map(|class| class[c]).sum::<f64>() / 300.0)
                };
                let sums: Vec<[f64; 3]> = (0..film.rect().pixels()).map(sum).collect();
                let of_sums = with_values(&film, sums.iter().copied());
                let _left = Left::of(format!("classes, {name}"), &of_sums, &film);
                for (i, sum) in sums.iter().enumerate() {
                    for (sum, mean) in sum.iter().zip(film.mean(i)) {
                        // Plain sums of at most 256 numbers in f32.
                        let limit = 256.0 * gpu_trace::verify::ULP * mean;
                        let off = (sum - mean).abs();
                        assert!(off <= limit, "{name}, pixel {i}: {sum} and {mean}");
                    }
                }
            }
        }
    }
}

#[test]
fn the_image_is_the_same_with_and_without() {
    let scene = scene_file("scenes/glass.toml");
    let with = with_aovs(&scene, Integrator::Path, 64);
    let without = Settings {
        classes: false,
        features: false,
        ..with.clone()
    };
    let (with, without) = (render_gpu(&scene, &with), render_gpu(&scene, &without));
    assert_same("with layers", &with, &without);
    assert!(with.aovs(0).is_some() && without.aovs(0).is_none());
}

#[test]
fn every_estimator_has_the_same_classes() {
    let scene = scene_file("scenes/tests/lamps.toml");
    let truth = films(&scene, Integrator::Bsdf, 16);
    let reference = class_means(&truth);
    // A scene in which all kinds of paths matter.
    assert!(
        reference.iter().all(|(mean, _)| *mean > 0.0),
        "{reference:?}"
    );
    for integrator in [Integrator::Path, Integrator::Nee] {
        let found = films(&scene, integrator, 16);
        let means = class_means(&found);
        for (class, (a, b)) in means.iter().zip(&reference).enumerate() {
            let name = format!("{}, class {class}", integrator.name());
            let [own, wanted] = [&found, &truth].map(|films| class_image(films, class));
            let _left = Left::of(&name, &own, &wanted);
            let z = (a.0 - b.0) / a.1.hypot(b.1).max(1.0e-9 * b.0);
            // Ten comparisons with 30 degrees of freedom: a level of 1e-3 for all.
            assert!(z.abs() < 4.5, "{name}: {a:?}, {b:?}");
        }
        // Companion: 5 % of the direct light counted as indirect would be found.
        let (direct, indirect) = (
            means[LightClass::Direct as usize],
            means[LightClass::Indirect as usize],
        );
        let z = 0.05 * direct.0 / indirect.1.hypot(reference[LightClass::Indirect as usize].1);
        assert!(z > 4.5, "{direct:?}, {indirect:?}");
    }
}

#[test]
fn classes_are_what_their_names_say() {
    let class_sums = |film: &Film| {
        let mut sums = [0.0; 5];
        for i in 0..film.rect().pixels() {
            let classes = film.aovs(i).expect("asked for").classes;
            (0..5).for_each(|k| sums[k] += classes[k].iter().sum::<f64>());
        }
        sums
    };
    let scene = scene_file("scenes/tests/lamps.toml");
    for integrator in INTEGRATORS {
        // Uniform directions rarely are in the lobe, a hundredth of the hemisphere, and then see a lamp.
        let spp = match integrator {
            Integrator::Lecture { .. } => 2048,
            _ => 64,
        };
        let limited = |max_bounces| {
            let settings = Settings {
                max_bounces,
                ..with_aovs(&scene, integrator, spp)
            };
            let film = render_gpu(&scene, &settings);
            let name = format!("{}, {max_bounces} bounces", integrator.name());
            (class_sums(&film), Left::alone(name, &film))
        };
        // Without an event there is only what is seen itself; one makes it direct, or specular in mirrors.
        let ([emission, direct, indirect, specular, caustic], _left) = limited(0);
        assert!(emission > 0.0 && direct + indirect + specular + caustic == 0.0);
        let ([_, direct, indirect, _, caustic], _left) = limited(1);
        assert!(direct > 0.0 && indirect + caustic == 0.0);
        let ([_, _, indirect, specular, caustic], _left) = limited(4);
        assert!(
            indirect > 0.0 && specular + caustic > 0.0,
            "{integrator:?}: {indirect}, {specular}, {caustic}"
        );
    }
    // Of diffuse surfaces alone there are three classes.
    let lecture = scene_file("scenes/lecture.toml");
    let film = render_gpu(&lecture, &with_aovs(&lecture, Integrator::Path, 64));
    let _left = Left::alone("lecture, classes", &film);
    let [emission, direct, indirect, specular, caustic] = class_sums(&film);
    assert!(emission > 0.0 && direct > 0.0 && indirect > 0.0 && specular + caustic == 0.0);
}

#[test]
fn what_is_seen_first_is_where_it_is() {
    // A ball straight ahead and nothing else, near or far, moved or not.
    for (distance, radius, shift) in [
        (3.0, 1.0, 0.0),
        (3.0e4, 1.0e4, 1.0e6),
        (1.0e-3, 2.0e-4, 0.0),
    ] {
        let scene = scene(&format!(
            "[camera]\nposition = [{shift}, 0, 0]\nlook_at = [{shift}, 0, 1]\nfov = 0.5\n[image]\n\
             width = 4\nheight = 4\n[environment]\nradiance = [1, 1, 1]\n[material.ball]\n\
             type = \"diffuse\"\nalbedo = [0.25, 0.5, 0.75]\n[[sphere]]\n\
             center = [{shift}, 0, {distance}]\nradius = {radius}\nmaterial = \"ball\"\n"
        ));
        let settings = Settings {
            width: 4,
            height: 4,
            crop: settings(&scene, 4, 4, 16).crop,
            ..with_aovs(&scene, Integrator::Path, 16)
        };
        for film in [render_gpu(&scene, &settings), render_cpu(&scene, &settings)] {
            let _left = Left::alone(format!("seen first, {distance}"), &film);
            for i in 0..16 {
                let sums = film.aovs(i).expect("asked for");
                assert_eq!((sums.hits, sums.albedo), (16.0, [4.0, 8.0, 12.0]));
                // Within a quarter of a degree of the axis the ball is flat to 1e-4 of its size.
                let depth = sums.depth / 16.0;
                let near = (depth / (distance - radius) - 1.0).abs();
                assert!(near < 1.0e-4 * distance / radius, "{depth}");
                assert!(
                    (sums.normal[2] / 16.0 + 1.0).abs() < 1.0e-3,
                    "{:?}",
                    sums.normal
                );
            }
        }
    }
    let empty = scene_file("scenes/tests/empty.toml");
    let film = render_gpu(&empty, &with_aovs(&empty, Integrator::Path, 16));
    assert_eq!(film.aovs(0).map(|a| a.hits), Some(0.0));
}

#[test]
fn both_renderers_have_the_same_layers() {
    let scene = scene_file("scenes/tests/lamps.toml");
    for adaptive in [false, true] {
        let settings = Settings {
            adaptive,
            ..with_aovs(&scene, Integrator::Path, 256)
        };
        let (gpu, cpu) = (render_gpu(&scene, &settings), render_cpu(&scene, &settings));
        let mut apart = 0;
        for i in 0..gpu.rect().pixels() {
            let (a, b) = (
                gpu.aovs(i).expect("asked for"),
                cpu.aovs(i).expect("asked for"),
            );
            let near = |a: f64, b: f64| (a - b).abs() <= 1.0e-3 * (a.abs() + b.abs() + 1.0e-2);
            let numbers = |s: &gpu_trace::film::AovSums| {
                let mut all = s.classes.as_flattened().to_vec();
                all.extend(
                    s.normal
                        .into_iter()
                        .chain(s.albedo)
                        .chain([s.depth, s.hits]),
                );
                all
            };
            apart += numbers(a)
                .into_iter()
                .zip(numbers(b))
                .filter(|(a, b)| !near(*a, *b))
                .count();
        }
        // A few paths go other ways in f32: of each pixel's 23 numbers hardly one.
        let name = format!("layers, adaptive {adaptive}");
        let few = apart < gpu.rect().pixels() * 23 / 50;
        assert_alike(&name, &gpu, &cpu, few, format!("{apart} numbers differ"));
    }
}

#[test]
fn files_have_the_layers_that_were_asked_for() {
    let folder = Folder::with_scene();
    folder.ok(
        "good.toml --size 16x12 --spp 64 -o a.exr --aov emission,direct,indirect,specular,caustic,\
         normal,albedo,depth,samples,stderr",
    );
    let bytes = folder.read("a.exr");
    let text = String::from_utf8_lossy(&bytes);
    holds(
        &text,
        &[
            "direct.R",
            "caustic.B",
            "normal.X",
            "depth.Z",
            "albedo.G",
            "samples.N",
        ],
    );
    let run = folder.run("good.toml --aov normal -o a.png");
    assert_eq!(run.code, Some(2));
    holds(&run.stderr, &["--aov", ".exr"]);
    let words = ["good.toml", "--aov", "normals", "-o", "a.exr"];
    holds(&folder.refused(&words), &["normals", "normal"]);
}

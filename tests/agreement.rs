//! GPU images against the CPU reference: f32 against f64 on the same paths.
//!
//! Both renderers use the same sample stream, so that most pixels agree to rounding and the
//! difference of two images has a small variance of its own. Two tests an image: the pooled paired
//! z of the mean (|z| < 3.9), and equivalence: the 99 % interval of the bias lies within 0.1 % of the
//! mean. Power: a scene whose albedos are 1 % off fails (the companion).

use std::path::Path;

use crate::cli_support::Folder;
use crate::common::images::{assert_alike, assert_same, fault};
use crate::common::{job, render_cpu, render_gpu, scene_file, scene_files};
use crate::measured::{metal_file, nylon_file};
use gpu_trace::film::Film;
use gpu_trace::materials::MaterialKind;
use gpu_trace::scene::Scene;
use gpu_trace::scene::load::load_str_in;
use gpu_trace::settings::{GeometryChoice, Integrator, Settings};
use gpu_trace::statistics::mean_and_error;
use gpu_trace::verify::{image_bits, means, settings};

/// Bound of the bias of the mean, relative.
const EQUIVALENT: f64 = 1.0e-3;
/// 99 % of a normal distribution.
const INTERVAL: f64 = 2.576;

/// What a comparison says.
#[derive(Clone, Copy, Debug)]
struct Verdict {
    /// Pooled paired z.
    z: f64,
    /// Farthest end of the 99 % interval of the relative bias.
    bias: f64,
    /// Share of the values that agree to 1e-4: all their paths are the same.
    near: f64,
}

impl Verdict {
    fn of(film: &Film, reference: &Film) -> Self {
        let (a, b) = (means(film), means(reference));
        let differences: Vec<f64> = a.iter().zip(&b).map(|(x, y)| x - y).collect();
        let near = a
            .iter()
            .zip(&b)
            .filter(|(x, y)| (*x - *y).abs() <= 1.0e-4 * y.abs());
        let near = near.count() as f64 / a.len() as f64;
        let (mean, error) = mean_and_error(&differences);
        let size = b.iter().sum::<f64>() / b.len() as f64;
        Self {
            // Rounding has a mean of its own, which is no bias to speak of: 16 roundings of f32.
            z: (mean.abs() - 16.0 * gpu_trace::verify::U * size).max(0.0)
                / error.max(f64::MIN_POSITIVE),
            bias: (mean.abs() + INTERVAL * error) / size,
            near,
        }
    }

    fn passes(&self) -> bool {
        // The share says how far the two go the same ways; far below one, the tests above would
        // compare independent images, with little power at this size.
        self.z < 3.9 && self.bias < EQUIVALENT && self.near > 0.98
    }
}

/// Width, height and samples: what a few seconds of one core allow.
fn size(path: &Path) -> (u32, u32, u64) {
    if path.ends_with("field.toml") {
        (32, 18, 8)
    } else {
        (48, 48, 64)
    }
}

fn settings_of(path: &Path, scene: &Scene) -> Settings {
    let (width, height, spp) = size(path);
    settings(scene, width, height, spp)
}

/// Compares all jobs, and says what each of them found.
fn check(jobs: impl Iterator<Item = (String, Scene, Settings)>) {
    let mut failed = Vec::new();
    for (name, scene, settings) in jobs {
        let film = render_gpu(&scene, &settings);
        let reference = render_cpu(&scene, &settings);
        let verdict = Verdict::of(&film, &reference);
        eprintln!("{name}: {verdict:?}");
        let holds = verdict.passes() && film.tally().non_finite == 0;
        let what = format!("{verdict:?}, {:?}", film.tally());
        failed.extend(fault(&name, &film, &reference, holds, what));
    }
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

#[test]
fn every_scene_agrees_with_the_reference() {
    check(scene_files().into_iter().map(|path| {
        let scene = scene_file(&path);
        let settings = settings_of(&path, &scene);
        (path.display().to_string(), scene, settings)
    }));
}

/// With the radiance cache, in the two forms that charts have in the kernel.
fn cached(scene: &Scene, geometry: GeometryChoice) -> Settings {
    let settings = Settings {
        radiance_cache: true,
        max_bounces: 64,
        geometry,
        ..settings(scene, 48, 48, 64)
    };
    assert!(job(scene, &settings).cells().is_some(), "no cache");
    settings
}

#[test]
fn the_radiance_cache_agrees_with_the_reference() {
    let names = [
        "lecture",
        "glass",
        "lecture-reflective",
        "tests/three-lamps",
    ];
    let forms = [GeometryChoice::Baked, GeometryChoice::List];
    let all = names.iter().flat_map(|name| forms.map(|form| (name, form)));
    check(all.map(|(name, form)| {
        let scene = scene_file(format!("scenes/{name}.toml"));
        let settings = cached(&scene, form);
        (format!("{name}, {}, cache", form.name()), scene, settings)
    }));
}

/// With images of lamps, in a form of the geometry; `cache`: and with the radiance cache.
fn imaged(scene: &Scene, geometry: GeometryChoice, cache: bool) -> Settings {
    let settings = Settings {
        lamp_images: true,
        radiance_cache: cache,
        max_bounces: 64,
        geometry,
        ..settings(scene, 40, 40, 32)
    };
    let job = job(scene, &settings);
    assert_eq!(job.image_obstacle(), None);
    assert_eq!(job.cells().is_some(), cache);
    settings
}

#[test]
fn images_of_lamps_agree_with_the_reference() {
    let cases = [
        ("glass", GeometryChoice::Baked, false),
        ("glass", GeometryChoice::List, true),
        ("tests/mirror-ball", GeometryChoice::Baked, false),
        ("tests/glass-ball", GeometryChoice::Bvh, false),
    ];
    check(cases.into_iter().map(|(name, form, cache)| {
        let scene = scene_file(format!("scenes/{name}.toml"));
        let settings = imaged(&scene, form, cache);
        let what = format!("{name}, {}, images, cache {cache}", form.name());
        (what, scene, settings)
    }));
}

#[test]
fn companion_one_percent_is_found_with_images_of_lamps() {
    let scene = scene_file("scenes/glass.toml");
    let settings = imaged(&scene, GeometryChoice::Auto, false);
    let film = render_gpu(&perturbed(&scene, 0.99), &settings);
    let verdict = Verdict::of(&film, &render_cpu(&scene, &settings));
    assert!(!verdict.passes(), "{verdict:?}");
}

#[test]
fn companion_one_percent_is_found_with_the_radiance_cache() {
    let scene = scene_file("scenes/lecture.toml");
    let settings = cached(&scene, GeometryChoice::Auto);
    let film = render_gpu(&perturbed(&scene, 0.99), &settings);
    let verdict = Verdict::of(&film, &render_cpu(&scene, &settings));
    assert!(!verdict.passes(), "{verdict:?}");
}

#[test]
fn other_kernels_agree_with_the_reference() {
    let names = [
        "lecture",
        "glass",
        "lecture-reflective",
        "tests/glass-ball",
        "tests/nested",
        "tests/rough-glass",
    ];
    check(names.into_iter().flat_map(|name| {
        let scene = scene_file(format!("scenes/{name}.toml"));
        let base = settings(&scene, 40, 40, 32);
        let lecture = Settings {
            integrator: Integrator::Lecture { termination: 0.2 },
            ..base.clone()
        };
        let list = Settings {
            geometry: GeometryChoice::List,
            roulette: Some(false),
            max_bounces: 12,
            ..base
        };
        [
            (format!("{name}, lecture"), scene.clone(), lecture),
            (format!("{name}, list, without roulette"), scene, list),
        ]
    }));
}

/// The scene with all albedos and reflectances times `factor`, and glass of another index.
fn perturbed(scene: &Scene, factor: f64) -> Scene {
    let mut scene = scene.clone();
    for material in &mut scene.materials {
        match &mut material.kind {
            MaterialKind::Diffuse(m) => m.albedo *= factor,
            MaterialKind::Mirror(m) => m.reflectance *= factor,
            MaterialKind::Dielectric(m) => m.ior = m.ior.map(|ior| 1.0 + factor * (ior - 1.0)),
            MaterialKind::Reflective(m) => m.albedo *= factor,
            MaterialKind::Conductor(m) => m.k = m.k.map(|k| factor * k),
            MaterialKind::Ashikhmin(m) => m.diffuse *= factor,
            MaterialKind::Disney(m) => m.base_color *= factor,
            MaterialKind::Sheen(m) => m.color *= factor,
            MaterialKind::Nylon(m) => m.diffuse *= factor,
            MaterialKind::CarPaint(m) => m.diffuse = m.diffuse.map(|kd| factor * kd),
            MaterialKind::Measured(m) => m.scale *= factor,
            MaterialKind::Mix(m) => m.weight *= factor,
        }
    }
    scene
}

/// Balls of a measured metal and of measured nylon, from files of the MERL database's format: one is as narrow as its
/// entries allow, the other wide; they see each other, a floor and a lamp.
fn measured_balls() -> Scene {
    const BALLS: &str = r#"
        camera = { position = [0, 1.2, 5], look_at = [0, 0.6, 0], fov = 40 }
        image = { width = 48, height = 48 }
        environment = { radiance = [0.4, 0.5, 0.6] }
        [material.floor]
        type = "diffuse"
        albedo = [0.6, 0.5, 0.4]
        [material.metal]
        type = "measured"
        file = "metal.binary"
        [material.nylon]
        type = "measured"
        file = "nylon.binary"
        scale = [2.0, 1.5, 1.0]
        [material.lamp]
        type = "diffuse"
        albedo = [0, 0, 0]
        emission = [6, 5, 4]
        [[sphere]]
        center = [0, -20, 0]
        radius = 20
        material = "floor"
        [[sphere]]
        center = [-0.75, 0.7, 0]
        radius = 0.7
        material = "metal"
        [[sphere]]
        center = [0.75, 0.6, 0.3]
        radius = 0.6
        material = "nylon"
        [[sphere]]
        center = [1, 3, 2]
        radius = 0.7
        material = "lamp"
    "#;
    let folder = Folder::new();
    folder.write("metal.binary", metal_file());
    folder.write("nylon.binary", nylon_file());
    let loaded = load_str_in("balls", BALLS, &folder.path(""));
    loaded.unwrap_or_else(|e| panic!("{e}")).scene
}

#[test]
fn measured_materials_agree_with_the_reference() {
    let scene = measured_balls();
    let settings = settings(&scene, 48, 48, 64);
    let reference = render_cpu(&scene, &settings);
    let film = render_gpu(&scene, &settings);
    let verdict = Verdict::of(&film, &reference);
    eprintln!("{verdict:?}");
    let holds = verdict.passes() && film.tally().non_finite == 0;
    let what = format!("{verdict:?}, {:?}", film.tally());
    assert_alike("measured", &film, &reference, holds, what);
    // Companions: all colours 1 % darker; and of each of the two alone, the other's table.
    let wrong = perturbed(&scene, 0.99);
    let verdict = Verdict::of(&render_gpu(&wrong, &settings), &reference);
    assert!(!verdict.passes(), "{verdict:?}");
    for ball in [1, 2] {
        let mut wrong = scene.clone();
        wrong.spheres[ball].material = scene.spheres[3 - ball].material;
        let verdict = Verdict::of(&render_gpu(&wrong, &settings), &reference);
        assert!(!verdict.passes(), "{verdict:?}");
    }
}

#[test]
fn companion_one_percent_is_found() {
    for name in [
        "lecture",
        "glass",
        "tests/two-spheres",
        "tests/furnace",
        "tests/reflective",
    ] {
        let scene = scene_file(format!("scenes/{name}.toml"));
        let settings = settings(&scene, 48, 48, 64);
        let film = render_gpu(&perturbed(&scene, 0.99), &settings);
        let verdict = Verdict::of(&film, &render_cpu(&scene, &settings));
        assert!(!verdict.passes(), "{name}: {verdict:?}");
    }
}

#[test]
fn companion_a_moved_sphere_is_found() {
    let mut scene = scene_file("scenes/tests/two-spheres.toml");
    let settings = settings(&scene, 48, 48, 64);
    let reference = render_cpu(&scene, &settings);
    scene.spheres[1].radius *= 1.01;
    let verdict = Verdict::of(&render_gpu(&scene, &settings), &reference);
    assert!(!verdict.passes(), "{verdict:?}");
}

#[test]
fn of_coincident_spheres_the_first_wins() {
    // numerics.md, case 12; about a centre, and (the floor) about a pole.
    let alone = scene_file("scenes/tests/two-spheres.toml");
    let mut floor = alone.spheres[0];
    (floor.center.y, floor.radius) = (-1001.0, 1000.0);
    let mut twice = alone.clone();
    let mut alone = alone;
    alone.spheres.push(floor);
    for sphere in &alone.spheres[..2] {
        twice.spheres.push(*sphere);
    }
    twice.spheres.insert(2, floor);
    twice.spheres.push(floor);
    // The copies are of another material: they would show.
    for copy in &mut twice.spheres[3..] {
        copy.material = 1 - copy.material;
    }
    for geometry in [
        GeometryChoice::Baked,
        GeometryChoice::List,
        GeometryChoice::Bvh,
    ] {
        let settings = Settings {
            geometry,
            ..settings(&alone, 48, 48, 16)
        };
        let image = render_gpu(&alone, &settings);
        let name = format!("coincident, {geometry:?}");
        assert_same(name, &render_gpu(&twice, &settings), &image);
        twice.spheres.rotate_right(3);
        assert_ne!(
            image_bits(&image),
            image_bits(&render_gpu(&twice, &settings)),
            "companion: {geometry:?}"
        );
        twice.spheres.rotate_left(3);
    }
}

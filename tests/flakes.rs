//! Flakes of car paint: as many as `density` says, with slopes as wide as `spread` says, and the same on the device as in
//! f64, on small and on large spheres.

use std::f64::consts::{PI, TAU};

use crate::common::{gpu, probe, scene};
use glam::DVec3;
use gpu_trace::effects::Effects;
use gpu_trace::gpu::probe::Probe;
use gpu_trace::materials::flakes::Flakes;
use gpu_trace::materials::flakes::{flake_at, flake_normal, flake_words};
use gpu_trace::materials::ggx::Frame;
use gpu_trace::materials::lattice::LatticePoint;
use gpu_trace::placement::Placement;
use gpu_trace::scene::Scene;
use gpu_trace::settings::{GeometryChoice, Settings};
use gpu_trace::statistics::uniform_ks;
use gpu_trace::verify::{Random, Row, ULP, to_row, vector};

#[test]
fn words_are_those_of_the_device() {
    let mut random = Random::new("words of flakes");
    let mut inputs: Vec<[u32; 4]> = (0..50_000).map(|_| random.words()).collect();
    // Cells near the origin, and the first ones of all.
    for input in &mut inputs[..20_000] {
        *input = input.map(|x| (x % 8).wrapping_sub(4));
    }
    for input in &mut inputs {
        input[3] %= 2;
    }
    let outputs: Vec<[u32; 4]> = probe(&["car_paint_flakes"])
        .call("flake_words", &inputs)
        .expect("the probe runs");
    let wrong = |next: u32| {
        let pairs = inputs.iter().zip(&outputs);
        let differ = |([x, y, z, which], found): (&[u32; 4], &[u32; 4])| {
            flake_words([*x, *y, z.wrapping_add(next)], *which) != *found
        };
        pairs.filter(|pair| differ(*pair)).count()
    };
    assert_eq!(wrong(0), 0);
    assert_eq!(wrong(1), inputs.len());
}

/// The share of space that flakes own: so many points of lattices made by another generator, whose cells are all
/// looked at that can matter.
fn share(density: f64, jitter: f64, trials: u32) -> f64 {
    let mut random = Random::new(&format!("a lattice of flakes {density} {jitter}"));
    let mut owned = 0;
    for _ in 0..trials {
        let place = DVec3::new(random.unit(), random.unit(), random.unit());
        let mut found = false;
        for cell in 0..125 {
            let cell = DVec3::new(
                f64::from(cell % 5),
                f64::from(cell / 5 % 5),
                f64::from(cell / 25),
            );
            let shift = DVec3::new(
                random.range(-1.0, 1.0),
                random.range(-1.0, 1.0),
                random.range(-1.0, 1.0),
            );
            let centre = cell - 2.0 + 0.5 + jitter * shift;
            found |= random.unit() < density && centre.distance(place) < 0.5;
        }
        owned += u32::from(found);
    }
    f64::from(owned) / f64::from(trials)
}

#[test]
fn flakes_are_as_many_as_density_says() {
    const POINTS: u32 = 40_000;
    let mut random = Random::new("points among flakes");
    let mut missed = 0;
    for density in [0.0, 0.5, 1.0] {
        for jitter in [0.0, 0.5, 1.0] {
            let mut owned = 0;
            for _ in 0..POINTS {
                let mut along = || random.range(-1.0e6, 1.0e6);
                let point = LatticePoint::of(DVec3::new(along(), along(), along()), 1.0);
                owned += u32::from(flake_at(&point, density, jitter).is_some());
            }
            let found = f64::from(owned) / f64::from(POINTS);
            let (truth, variances) = if jitter == 0.0 {
                // Balls that do not overlap.
                (density * PI / 6.0, 1.0)
            } else {
                (share(density, jitter, POINTS), 2.0)
            };
            let error = (variances * truth * (1.0 - truth) / f64::from(POINTS)).sqrt();
            let z = |truth: f64| (found - truth).abs() / error.max(1.0e-9);
            eprintln!("density {density}, jitter {jitter}: {found} for {truth}");
            assert!(
                z(truth) < 4.5,
                "density {density}, jitter {jitter}: {found} for {truth}"
            );
            missed += u32::from(density > 0.0 && z(1.1 * truth) < 4.5);
        }
    }
    // Companion: 10 % more.
    assert_eq!(missed, 0);
}

/// The normal of a cell's flake where the surface has this one.
fn normal_about(normal: DVec3, cell: [u32; 3], spread: f64) -> DVec3 {
    let frame = Frame::around(normal);
    frame.to_world(flake_normal(cell, spread, &frame))
}

/// p-values of flakes' slopes, as large as in a distribution of width `spread`, and of their turns about the normal.
fn slopes(spread: f64, assumed: f64) -> [f64; 2] {
    let mut random = Random::new("slopes of flakes");
    let normal = DVec3::new(2.0, -1.0, 2.0) / 3.0;
    let [across, along] =
        [DVec3::new(1.0, 2.0, 0.0), DVec3::new(4.0, -2.0, -5.0)].map(DVec3::normalize);
    let (mut sizes, mut turns) = (Vec::new(), Vec::new());
    for _ in 0..40_000 {
        let [x, y, z, _] = random.words();
        let n = normal_about(normal, [x, y, z], spread);
        let slope = n / n.dot(normal) - normal;
        // Beckmann: exp(-slope^2/spread^2) is uniform.
        sizes.push((-slope.length_squared() / (assumed * assumed)).exp());
        turns.push(slope.dot(along).atan2(slope.dot(across)).rem_euclid(TAU) / TAU);
    }
    [uniform_ks(&mut sizes), uniform_ks(&mut turns)]
}

#[test]
fn normals_have_the_stated_spread() {
    for spread in [0.01, 0.3, 1.0] {
        let p = slopes(spread, spread);
        assert!(p.iter().all(|p| *p > 1.0e-4), "spread {spread}: {p:?}");
        // Companion: 3 % wider.
        assert!(slopes(spread, 1.03 * spread)[0] < 1.0e-4);
    }
    assert_eq!(normal_about(DVec3::Z, [1, 2, 3], 0.0), DVec3::Z);
}

/// A ball, one that is moved far away, and walls about their poles, all of the same paint.
const SPHERES: &str = r#"
    camera = { position = [0, 1, 6], look_at = [0, 0.5, 0], fov = 40 }
    image = { width = 16, height = 16 }
    environment = { radiance = [1, 1, 1] }
    [material.paint]
    type = "car-paint"
    preset = "polaris-silber"
    flakes = { density = 0.6, scale = 37.7, spread = 0.3, jitter = 0.4, color = [0.1, 0.1, 0.1] }
    [material.other]
    type = "diffuse"
    albedo = [0.5, 0.5, 0.5]
    [[sphere]]
    center = [0, 1, 0]
    radius = 1
    material = "paint"
    [[sphere]]
    center = [0.3, -1000, 0.1]
    radius = 1000
    material = "paint"
    [[sphere]]
    center = [0, 0, -1.00000005e7]
    radius = 9.9999994e6
    material = "paint"
    [[sphere]]
    center = [1e9, 0.5, 0.7]
    radius = 9.99999995e8
    material = "paint"
    [[sphere]]
    center = [2, 0.5, 0]
    radius = 0.5
    material = "other"
"#;

fn flakes() -> Flakes {
    Flakes {
        density: 0.6,
        scale: 37.7,
        spread: 0.3,
        jitter: 0.4,
        color: DVec3::splat(0.1),
    }
}

/// What was found of a sphere's points.
#[derive(Debug, Default)]
struct Found {
    points: usize,
    /// Points at which f64 says something else within the roundings of f32.
    edges: usize,
    /// Others at which the device and f64 differ.
    wrong: usize,
    /// The largest error of a place, in cells, and of a normal.
    place: f64,
    normal: f64,
}

/// Asks the device for flakes around the anchor of each sphere that has some. `anchor`: what the twin takes for where
/// an anchor is, for a companion.
fn compare(scene: &Scene, geometry: GeometryChoice, anchor: fn(DVec3) -> DVec3) -> Vec<Found> {
    const POINTS: usize = 20_000;
    let settings = Settings {
        geometry,
        ..Settings::for_scene(scene)
    };
    let placement = Placement::new(scene, settings.width, settings.height);
    assert_eq!(placement.poles, 3);
    let effects = Effects::derive(scene, &placement, &settings);
    let probe = Probe::new(&gpu(), scene, &placement, &effects);
    let mut random = Random::new("flakes on spheres");
    let flakes = flakes();
    let mut all = Vec::new();
    for (index, sphere) in placement.spheres.iter().enumerate() {
        if scene.materials[sphere.material].name != "paint" {
            continue;
        }
        let base = anchor(sphere.anchor_offset(placement.scale));
        let inputs: Vec<[Row; 2]> = (0..POINTS)
            .map(|_| {
                let reach = if sphere.pole.is_some() {
                    random.range(0.0, 10.0)
                } else {
                    1.0
                };
                let mut row = to_row(reach * random.direction(), 0.0);
                row[3] = f32::from_bits(index as u32);
                [row, to_row(random.direction(), 0.0)]
            })
            .collect();
        let outputs: Vec<[[u32; 4]; 3]> = probe.call("flake_at", &inputs).expect("the probe runs");
        let mut found = Found {
            points: POINTS,
            ..Found::default()
        };
        for ([row, normal], [flake, place, tilted]) in inputs.iter().zip(&outputs) {
            let twin = |moved: DVec3| {
                let point = LatticePoint::of(base + vector(*row) + moved, flakes.scale);
                (flake_at(&point, flakes.density, flakes.jitter), point)
            };
            let (truth, point) = twin(DVec3::ZERO);
            let device = (flake[3] != 0).then(|| [flake[0], flake[1], flake[2]]);
            // Scale, product, sum and the pole's place are rounded, and the distances to flakes, a few times: half an
            // ulp each of the cells that are crossed, or of one.
            // And f64 knows a place among 10^10 cells to 10^-6 of one.
            let error = 4.0 * ULP * (vector(*row).length() + 1.0 / flakes.scale)
                + 4.0 * f64::EPSILON * base.length();
            if device != truth {
                let near = (0..32).any(|_| twin(error * random.direction()).0 == device);
                *(if near {
                    &mut found.edges
                } else {
                    &mut found.wrong
                }) += 1;
                continue;
            }
            let found_place = vector(place.map(f32::from_bits));
            // Of points near the side of a cell, whole cells apart.
            let apart = found_place - point.place;
            let apart = (apart - apart.round()).length() / (flakes.scale * error);
            found.place = found.place.max(apart);
            if let Some(cell) = truth {
                let twin = normal_about(vector(*normal), cell, flakes.spread);
                let apart = (vector(tilted.map(f32::from_bits)) - twin).length();
                found.normal = found.normal.max(apart);
            }
        }
        all.push(found);
    }
    all
}

#[test]
fn flakes_are_the_same_on_small_and_large_spheres() {
    let scene = scene(SPHERES);
    for geometry in [
        GeometryChoice::Baked,
        GeometryChoice::List,
        GeometryChoice::Bvh,
    ] {
        for found in compare(&scene, geometry, |anchor| anchor) {
            eprintln!("{geometry:?}: {found:?}");
            assert_eq!(found.wrong, 0, "{found:?}");
            assert!(50 * found.edges < found.points, "{found:?}");
            assert!(found.place <= 1.0, "{found:?}");
            // Beside some roundings, what the logarithm and the circle's points are off by.
            assert!(found.normal < 2.0e-6, "{found:?}");
        }
    }
}

#[test]
fn companion_an_anchor_in_f32_is_found() {
    // Where the poles are, as f32 would have it: 4e4 to 4e10 cells from the centre.
    let found = compare(&scene(SPHERES), GeometryChoice::List, |anchor| {
        anchor.as_vec3().as_dvec3()
    });
    let wrong: Vec<usize> = found.iter().map(|found| found.wrong).collect();
    eprintln!("{wrong:?}");
    // The ball has no pole; the wall of radius 1000 is 1e-3 of a cell off, those beyond by cells.
    assert_eq!(wrong.iter().filter(|wrong| **wrong > 2_000).count(), 2);
}

/// Of paint with and without flakes, without anything else that is special: what its kernel holds.
#[test]
fn paint_without_flakes_has_none_of_their_code() {
    let text = |flakes: &str| {
        format!(
            "camera = {{ position = [0, 0, 6], look_at = [0, 0, 0], fov = 40 }}\n\
             image = {{ width = 16, height = 16 }}\nenvironment = {{ radiance = [1, 1, 1] }}\n\
             [material.paint]\ntype = \"car-paint\"\npreset = \"polaris-silber\"\n{flakes}\n\
             [[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = \"paint\"\n"
        )
    };
    let kernel = |flakes: &str| {
        let scene = scene(&text(flakes));
        let settings = Settings::for_scene(&scene);
        let placement = Placement::new(&scene, settings.width, settings.height);
        let effects = Effects::derive(&scene, &placement, &settings);
        let kernel =
            gpu_trace::shader::link(gpu_trace::shader::Stage::Path, &scene, &placement, &effects);
        kernel.unwrap_or_else(|e| panic!("{e}")).wgsl
    };
    const TRACES: [&str; 5] = [
        "flake",
        "lattice",
        "SCENE_UNIT",
        "third_frame",
        "coat_splits",
    ];
    let plain = kernel("");
    let traces = TRACES.iter().filter(|trace| plain.contains(**trace));
    assert_eq!(traces.count(), 0);
    let all = kernel(
        "clearcoat = { ior = 1.5 }\nflakes = { density = 0.6, scale = 30, spread = 0.3, jitter = 0.4, color = [0, 0, 0] }",
    );
    assert!(TRACES.iter().all(|trace| all.contains(*trace)));
}

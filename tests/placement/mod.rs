//! What the placement finds by a tree is what asking every sphere about every other one finds, bit for bit.

mod quadratic;

use std::path::{Path, PathBuf};

use glam::DVec3;
use gpu_trace::placement::{Media, Placement};
use gpu_trace::scene::load::{load_file, load_str};
use gpu_trace::scene::{Scene, Sphere};
use gpu_trace::verify::Random;

/// What is asked about pairs of spheres, all by index into the scene's spheres.
#[derive(Debug, PartialEq)]
struct Answers {
    /// The bits of the poles' normals.
    poles: Vec<Option<[u64; 3]>>,
    media: Media,
    containers: Vec<Option<usize>>,
    /// The lamps that light sampling chooses from.
    lamps: Vec<usize>,
}

impl Answers {
    fn of(placement: &Placement, count: usize) -> Self {
        let source = |i: usize| placement.spheres[i].source;
        let mut answers = Self {
            poles: vec![None; count],
            media: placement.media.clone(),
            containers: vec![None; count],
            lamps: Vec::new(),
        };
        for sphere in &placement.spheres {
            let bits = |v: DVec3| v.to_array().map(f64::to_bits);
            answers.poles[sphere.source] = sphere.pole.map(bits);
            answers.containers[sphere.source] = sphere.container.map(source);
        }
        let lights = placement.lights.table.iter();
        answers.lamps = lights.map(|light| source(light.sphere)).collect();
        answers.lamps.sort_unstable();
        answers
    }

    /// Which of the answers differ.
    fn differences(&self, other: &Self) -> [bool; 4] {
        [
            self.poles != other.poles,
            self.media != other.media,
            self.containers != other.containers,
            self.lamps != other.lamps,
        ]
    }
}

/// The answers of the placement of `scene`, and those by definition of `changed`.
fn both(scene: &Scene, changed: &Scene) -> [Answers; 2] {
    let placement = Placement::new(scene, 16, 16);
    let camera = &placement.camera;
    let origin = changed.camera.position + camera.approach / placement.scale * camera.forward;
    [
        Answers::of(&placement, scene.spheres.len()),
        quadratic::answers(changed, origin),
    ]
}

fn same(name: &str, scene: &Scene) -> Answers {
    let [found, wanted] = both(scene, scene);
    assert_eq!(found, wanted, "{name}");
    found
}

/// All files that end in `.toml` in a folder of the repository.
fn toml_files(folder: &str) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let mut found = Vec::new();
    let mut folders = vec![folder];
    while let Some(folder) = folders.pop() {
        let entries = folder
            .read_dir()
            .unwrap_or_else(|e| panic!("{folder:?}: {e}"));
        for path in entries.map(|entry| entry.expect("an entry").path()) {
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "toml") {
                found.push(path);
            }
        }
    }
    found
}

#[test]
fn scenes_of_the_repository_are_placed_by_definition() {
    let files: Vec<PathBuf> = ["scenes", "tests", "benches"]
        .iter()
        .flat_map(|folder| toml_files(folder))
        .collect();
    assert!(files.len() >= 30, "{files:?}");
    for file in files {
        let scene = load_file(&file).unwrap_or_else(|e| panic!("{e}")).scene;
        same(&file.display().to_string(), &scene);
    }
}

/// Materials of any kind, with and without light.
const MATERIALS: &str = r#"
    camera = { position = [0, 0, 0], look_at = [0, 0, -1], fov = 40 }
    image = { width = 16, height = 16 }
    material.glass = { type = "dielectric", ior = 1.5 }
    material.water = { type = "dielectric", ior = 1.33 }
    material.neon = { type = "dielectric", ior = 1.1, emission = [1, 0, 0] }
    material.lamp = { type = "diffuse", albedo = [0, 0, 0], emission = [1, 2, 3] }
    material.matte = { type = "diffuse", albedo = [0.5, 0.5, 0.5] }
    material.chrome = { type = "mirror", reflectance = [0.9, 0.9, 0.9] }
    material.shiny = { type = "mirror", reflectance = [0.9, 0.9, 0.9], emission = [0, 0, 9] }
"#;

/// A scene of `count` spheres that lie in all ways to each other; `glass` is the share of dielectrics; whether some
/// are `moving`.
fn random_scene(random: &mut Random, count: usize, glass: f64, moving: bool) -> Scene {
    let mut scene = load_str("random", MATERIALS)
        .unwrap_or_else(|e| panic!("{e}"))
        .scene;
    let materials = scene.materials.len();
    let [decades, place] = [random.range(0.0, 4.0), random.magnitude(-1.0, 7.0)];
    let far = place * random.direction();
    let place = 10.0 * random.direction() * random.unit();
    let spread = random.magnitude(-2.0, 2.0);
    // Whole numbers and axes now and then: there, roundings tie.
    let direction = |random: &mut Random| {
        let axis = (3.0 * random.unit()) as usize;
        let sign = if random.unit() < 0.5 { -1.0 } else { 1.0 };
        if random.unit() < 0.5 {
            sign * DVec3::AXES[axis]
        } else {
            random.direction()
        }
    };
    while scene.spheres.len() < count {
        let known = scene.spheres.len() as f64 * random.unit();
        let known = scene.spheres.get(known as usize).copied();
        let fresh = Sphere {
            center: far + place + spread * random.direction() * random.unit(),
            motion: DVec3::ZERO,
            radius: random.magnitude(-decades, 0.0),
            material: 0,
            priority: None,
        };
        let mut sphere = match known {
            None => fresh,
            Some(known) => match (8.0 * random.unit()) as u32 {
                // The same again.
                0 => known,
                // Just within, as far as it goes or not quite.
                1 => {
                    let thinner = random.magnitude(-17.0, -2.5) * known.radius;
                    let aside = random.range(0.0, 1.1) * thinner;
                    Sphere {
                        center: known.center + aside * direction(random),
                        radius: known.radius - thinner,
                        ..known
                    }
                }
                // Touching, from outside and from inside.
                2 => Sphere {
                    center: known.center + (known.radius + fresh.radius) * direction(random),
                    ..fresh
                },
                3 => {
                    let radius = 0.5 * known.radius;
                    let center = known.center + radius * direction(random);
                    Sphere {
                        center,
                        radius,
                        ..fresh
                    }
                }
                // On the surface, much smaller.
                4 => Sphere {
                    center: known.center + known.radius * direction(random),
                    radius: known.radius * random.magnitude(-6.0, -1.0),
                    ..fresh
                },
                // In the middle.
                5 => Sphere {
                    center: known.center,
                    radius: known.radius * random.range(0.01, 1.0),
                    ..fresh
                },
                _ => fresh,
            },
        };
        if random.unit() < 0.8 {
            let kinds = if random.unit() < glass {
                0..3
            } else {
                3..materials
            };
            sphere.material = random.range(kinds.start as f64, kinds.end as f64) as usize;
        }
        let kind = &scene.materials[sphere.material].kind;
        let chosen = kind.transmits() && random.unit() < 0.2;
        sphere.priority = chosen.then(|| random.range(-3.0, 3.0) as i32);
        // Some spheres move, some of them together with the one that they lie to.
        if moving && random.unit() < 0.5 {
            let way = random.magnitude(-4.0, 1.0) * sphere.radius;
            sphere.motion = way * direction(random);
        }
        if sphere.radius > 0.0 {
            scene.spheres.push(sphere);
        }
    }
    // The camera: anywhere, at a surface, or in a sphere.
    let near = scene.spheres[(count as f64 * random.unit()) as usize];
    let share = [0.0, 1.0, 1.01, 1.0 + 1.0e-9, 20.0, 300.0][(6.0 * random.unit()) as usize];
    scene.camera.position = near.center + share * near.radius * direction(random);
    scene.camera.look_at = scene.camera.position + direction(random);
    scene.camera.up = random.direction();
    if random.unit() < 0.2 {
        scene.camera.aperture_radius = random.magnitude(-9.0, -1.0) * near.radius;
        scene.camera.focus_distance = 1.0;
    }
    scene
}

/// Sizes and shares of dielectrics of the scenes of one test.
fn random_scenes(name: &str) -> impl Iterator<Item = (String, Scene)> {
    let mut random = Random::new(name);
    let sizes = std::iter::repeat_n(10, 150)
        .chain(std::iter::repeat_n(40, 100))
        .chain(std::iter::repeat_n(200, 30))
        .chain([700, 700, 2000, 2000])
        .map(|count| (count, false))
        // Spheres that move.
        .chain(std::iter::repeat_n((40, true), 100))
        .chain([(700, true)]);
    sizes.enumerate().map(move |(i, (count, moving))| {
        let glass = [0.1, 0.5, 0.9][i % 3];
        let scene = random_scene(&mut random, count, glass, moving);
        (format!("scene {i} of {count} spheres"), scene)
    })
}

#[test]
fn random_scenes_are_placed_by_definition() {
    let mut seen = [0; 5];
    for (name, scene) in random_scenes("placed") {
        let answers = same(&name, &scene);
        let lamp = |s: &Sphere| scene.materials[s.material].emission.max_element() > 0.0;
        for (seen, now) in seen.iter_mut().zip([
            answers.poles.iter().any(Option::is_some),
            answers.media.levels > 2,
            answers.containers.iter().any(Option::is_some),
            !answers.lamps.is_empty(),
            answers.lamps.len() < scene.spheres.iter().filter(|s| lamp(s)).count(),
        ]) {
            *seen += u32::from(now);
        }
    }
    // There was something to find.
    assert!(seen.iter().all(|n| *n > 40), "{seen:?}");
}

#[test]
fn companion_a_changed_scene_is_not_the_same() {
    let mut different = [0; 4];
    for (_, scene) in random_scenes("changed").take(250) {
        let mut changed = scene.clone();
        for sphere in &mut changed.spheres {
            sphere.radius *= 1.0 + 1.0e-3;
            sphere.center.x += 1.0e-3 * sphere.radius;
        }
        let [found, other] = both(&scene, &changed);
        for (count, differs) in different.iter_mut().zip(found.differences(&other)) {
            *count += u32::from(differs);
        }
    }
    assert!(different.iter().all(|n| *n > 20), "{different:?}");
}

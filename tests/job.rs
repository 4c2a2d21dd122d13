//! What may be rendered: `prepare` refuses the rest, whoever asks.

use std::ops::Range;
use std::sync::Arc;
use std::time::Duration;

use glam::DVec3;

use crate::common::{scene, scene_file};
use gpu_trace::error::Error;
use gpu_trace::image::Picture;
use gpu_trace::job::prepare;
use gpu_trace::materials::measured::{BrdfTable, Measured};
use gpu_trace::materials::texturable::texturable_key;
use gpu_trace::materials::{Material, MaterialKind, Texture, TextureImage};
use gpu_trace::scene::{Environment, Gradient, Scene, Sky};
use gpu_trace::settings::{GeometryChoice, Integrator, LightSampling, Offset, Rect, Settings};
use gpu_trace::verify::settings;

type Change = fn(&mut Settings);

const LECTURE: Integrator = Integrator::Lecture { termination: 0.2 };

fn lamps() -> Scene {
    scene_file("scenes/lecture.toml")
}

fn crop(rect: [u32; 4]) -> Rect {
    let [x, y, width, height] = rect;
    Rect {
        x,
        y,
        width,
        height,
    }
}

#[test]
fn settings_out_of_range_are_refused_and_their_neighbours_are_not() {
    let scene = lamps();
    let base = settings(&scene, 16, 16, 256);
    // What is refused, a part of what is said, and the nearest that is not.
    let cases: &[(Change, &str, Change)] = &[
        (|s| s.width = 0, "--size", |s| s.width = 65_536),
        (|s| s.height = 65_537, "--size", |s| s.height = 65_536),
        (
            |s| s.crop = crop([8, 0, 9, 16]),
            "--crop 8,0,9x16 reaches beyond the image of 16x16 pixels",
            |s| s.crop = crop([8, 0, 8, 16]),
        ),
        (
            |s| s.crop = crop([0, u32::MAX, 1, 2]),
            "--crop",
            |s| s.crop = crop([0, 15, 1, 1]),
        ),
        (|s| s.crop.width = 0, "--crop", |s| s.crop.width = 1),
        (|s| s.samples = 5..5, "no sample", |s| s.samples = 5..6),
        (
            |s| s.samples = 0..(1 << 48) + 1,
            "2^48",
            |s| s.samples = 0..1 << 48,
        ),
        (
            |s| (s.adaptive, s.samples) = (true, 0..127),
            "--adaptive needs at least 128",
            |s| (s.adaptive, s.samples) = (true, 0..128),
        ),
        (
            |s| (s.adaptive, s.samples) = (true, 1..200),
            "--sample-range",
            |s| s.samples = 1..200,
        ),
        (
            |s| s.error = Some(0.0),
            "--error",
            |s| s.error = Some(1.0e-9),
        ),
        (|s| s.error = Some(f64::NAN), "--error", |s| s.error = None),
        (
            |s| s.time = Some(Duration::ZERO),
            "--time: no time at all",
            |s| s.time = Some(Duration::from_nanos(1)),
        ),
        (
            |s| (s.integrator, s.light_sampling) = (Integrator::Bsdf, Some(LightSampling::Cone)),
            "--light-sampling says how path and nee sample lights: --integrator bsdf does not",
            |s| (s.integrator, s.light_sampling) = (Integrator::Nee, Some(LightSampling::Cone)),
        ),
        (
            |s| (s.integrator, s.light_sampling) = (LECTURE, Some(LightSampling::Projected)),
            "--integrator lecture does not",
            |s| s.integrator = LECTURE,
        ),
        (
            |s| (s.integrator, s.roulette) = (LECTURE, Some(true)),
            "--integrator lecture has its own roulette",
            |s| (s.integrator, s.roulette) = (Integrator::Bsdf, Some(false)),
        ),
        (
            |s| s.max_bounces = 65_536,
            "--max-bounces 65536",
            |s| s.max_bounces = 65_535,
        ),
        (
            |s| s.integrator = Integrator::Lecture { termination: 1.0 },
            "--termination 1",
            |s| s.integrator = Integrator::Lecture { termination: 0.99 },
        ),
        (
            |s| {
                s.integrator = Integrator::Lecture {
                    termination: f64::NAN,
                }
            },
            "--termination NaN",
            |s| s.integrator = Integrator::Lecture { termination: 0.0 },
        ),
        (
            |s| s.offset = Offset::Out(-1.0),
            "--offset out:-1.0",
            |s| s.offset = Offset::Out(0.0),
        ),
        (
            |s| s.offset = Offset::Back(f64::NAN),
            "--offset",
            |s| s.offset = Offset::Back(1.0e-4),
        ),
    ];
    for (wrong, part, right) in cases {
        let with = |change: &Change| {
            let mut settings = base.clone();
            change(&mut settings);
            prepare(&scene, &settings)
        };
        match with(wrong) {
            Err(Error::Usage(text)) => assert!(text.contains(part), "{part}: {text}"),
            other => panic!("{part}: {other:?}"),
        }
        with(right).unwrap_or_else(|e| panic!("{part}: {e}"));
    }
}

#[test]
fn a_scene_too_large_to_bake_is_refused() {
    let mut scene = lamps();
    let sphere = scene.spheres[0];
    let fill = |scene: &mut Scene, range: Range<u32>| {
        for i in range {
            let mut sphere = sphere;
            sphere.center.x += f64::from(i);
            scene.spheres.push(sphere);
        }
    };
    let there = scene.spheres.len() as u32;
    fill(&mut scene, there..256);
    let mut settings = settings(&scene, 16, 16, 16);
    settings.geometry = GeometryChoice::Baked;
    assert!(prepare(&scene, &settings).is_ok());
    fill(&mut scene, 256..257);
    let error = prepare(&scene, &settings).expect_err("257 spheres");
    assert!(error.to_string().contains("has 257"), "{error}");
    settings.geometry = GeometryChoice::Auto;
    assert!(prepare(&scene, &settings).is_ok());
}

/// Something of everything that a scene can be made of.
const ALL_SORTS: &str = r#"
    camera = { position = [0, 0, -9], look_at = [0, 0, 6], fov = 36, aperture_radius = 0.1, focus_distance = 9 }
    image = { width = 16, height = 16 }
    environment = { radiance = [0.5, 0.5, 0.5] }
    material.glass = { type = "dielectric", ior = 1.5, absorption = [0.1, 0, 0] }
    material.metal = { type = "conductor", preset = "gold", roughness = { checker = [0.1, 0.4], size = 0.5 } }
    material.paint = { type = "car-paint", preset = "polaris-silber", clearcoat = { ior = 1.5 } }
    material.lamp = { type = "diffuse", albedo = [0.5, 0.5, 0.5], emission = [1, 1, 1] }
    material.both = { type = "mix", materials = ["lamp", "paint"], weight = 0.5 }
    sphere = [
        { center = [-3, 0, 0], radius = 1, material = "glass", priority = 1 },
        { center = [0, 0, 0], radius = 1, material = "metal" },
        { center = [3, 0, 0], radius = 1, material = "paint" },
        { center = [0, 3, 0], radius = 1, material = "lamp" },
        { center = [0, -3, 0], radius = 1, material = "both" },
    ]
"#;

fn picture(texels: [[f32; 3]; 2]) -> Picture {
    Picture::new(2, 1, texels.into())
}

fn sky(texels: [[f32; 3]; 2], scale: f64) -> Option<Environment> {
    let sky = Sky::new("sky.exr", picture(texels), DVec3::splat(scale), 30.0);
    Some(Environment::Sky(sky))
}

fn measured(table: Option<BrdfTable>) -> MaterialKind {
    let measured = Measured {
        file: "a.binary".into(),
        scale: DVec3::ONE,
        table: table.map(Arc::new),
    };
    measured.into()
}

/// Gives a material the texture of a key.
fn put(scene: &mut Scene, index: usize, key: &str, texture: Texture) {
    let material = &mut scene.materials[index];
    let key = texturable_key(material.kind.name(), key).expect("a key");
    *material = material.clone().with_texture(key, texture);
}

fn checker(values: [f64; 2], size: f64) -> Texture {
    let values = values.map(DVec3::splat);
    Texture::Checker { values, size }
}

fn image(texels: [[f32; 3]; 2], number: bool, axis: DVec3) -> Texture {
    let picture = Arc::new(picture(texels));
    Texture::Image(TextureImage::new("a.exr", picture, number, axis))
}

/// A scene that was made or changed in code is held to what a file is held to.
#[test]
fn no_scene_reaches_a_renderer_unchecked() {
    type Change = fn(&mut Scene);
    let scene = scene(ALL_SORTS);
    let with = |change: Change| {
        let mut scene = scene.clone();
        change(&mut scene);
        prepare(&scene, &settings(&scene, 16, 16, 16))
    };
    // What is refused, and a part of what is said.
    let wrong: &[(Change, &str)] = &[
        (
            |s| s.width = 0,
            "`width` must be an integer in [1, 65536], and is 0",
        ),
        (|s| s.render.spp = Some(0), "`spp` must be an integer"),
        (
            |s| s.render.max_bounces = Some(65_536),
            "`max_bounces` must be",
        ),
        (
            |s| s.camera.position.x = f64::NAN,
            "the camera's `position` must be a finite number",
        ),
        (
            |s| s.camera.look_at.y = 2.0e20,
            "the camera's `look_at` must be in [-1e20, 1e20], and is 2e20",
        ),
        (
            |s| s.camera.fov = 180.0,
            "the camera's `fov` must be in (0, 180), and is 180",
        ),
        (
            |s| s.camera.look_at = s.camera.position,
            "`look_at` is the camera's `position`",
        ),
        (
            |s| s.camera.up = DVec3::Z,
            "`up` is parallel to the camera's view axis; set another",
        ),
        (|s| s.camera.up = DVec3::ZERO, "`up` has no direction"),
        (
            |s| s.camera.up = 1.0e-200 * DVec3::Y,
            "`up` is too long or too short",
        ),
        (
            |s| s.camera.aperture_radius = -1.0,
            "the camera's `aperture_radius` must be",
        ),
        (
            |s| s.camera.focus_distance = 0.0,
            "the camera's `focus_distance` must be greater than 0",
        ),
        (
            |s| s.environment = Some(Environment::Constant(DVec3::NEG_X)),
            "the environment's `radiance` must be at least 0",
        ),
        (
            |s| {
                s.environment = Some(Environment::Gradient(Gradient {
                    zenith: DVec3::ONE,
                    horizon: DVec3::splat(f64::INFINITY),
                    ground: DVec3::ONE,
                }));
            },
            "the environment's `horizon` must be a finite number",
        ),
        (
            |s| s.environment = sky([[1.0; 3], [f32::NAN, 0.0, 0.0]], 1.0),
            "the environment's image has a texel",
        ),
        (
            |s| s.environment = sky([[1.0; 3], [-1.0, 0.0, 0.0]], 1.0),
            "the environment's image has a texel",
        ),
        (
            |s| s.environment = sky([[1.0; 3], [2.0; 3]], 1.0e20),
            "the environment's image: its brightest value times `scale` is 2e20",
        ),
        (
            |s| s.materials[3].emission.z = -1.0,
            "material \"lamp\": `emission` must be at least 0, and is -1",
        ),
        (
            |s| {
                if let MaterialKind::Diffuse(lamp) = &mut s.materials[3].kind {
                    lamp.albedo.y = 1.5;
                }
            },
            "material \"lamp\": `albedo` must be in [0, 1], and is 1.5",
        ),
        (
            |s| {
                if let MaterialKind::Dielectric(glass) = &mut s.materials[0].kind {
                    glass.roughness = f64::NAN;
                }
            },
            "material \"glass\": `roughness` must be a finite number",
        ),
        (
            |s| {
                if let MaterialKind::Dielectric(glass) = &mut s.materials[0].kind {
                    glass.ior = None;
                }
            },
            "material \"glass\": a dielectric needs its index; give one of",
        ),
        (
            |s| {
                if let MaterialKind::CarPaint(paint) = &mut s.materials[2].kind {
                    paint.clearcoat = paint.clearcoat.map(|mut coat| {
                        coat.ior = 0.0;
                        coat
                    });
                }
            },
            "material \"paint\": `ior` must be greater than 0",
        ),
        (
            |s| {
                if let MaterialKind::Conductor(metal) = &mut s.materials[1].kind {
                    metal.roughness = 0.3;
                }
            },
            "material \"metal\": `roughness` is a texture",
        ),
        (
            |s| s.materials[1].textures.extend_from_within(..),
            "material \"metal\": `roughness` has two textures",
        ),
        (
            |s| s.materials[3].textures = s.materials[1].textures.clone(),
            "material \"lamp\": `roughness` is no texture of a diffuse material",
        ),
        (
            |s| put(s, 1, "roughness", checker([0.5, 1.5], 1.0)),
            "material \"metal\": `roughness` must be in [0, 1], and is 1.5",
        ),
        (
            |s| put(s, 1, "roughness", checker([0.5, -0.5], 1.0)),
            "material \"metal\": `roughness` must be in [0, 1], and is -0.5",
        ),
        (
            |s| put(s, 1, "roughness", checker([0.5, 0.6], 0.0)),
            "material \"metal\": `size` must be",
        ),
        (
            |s| {
                let values = [DVec3::ZERO, DVec3::ONE];
                let (size, octaves) = (1.0, 17);
                put(
                    s,
                    3,
                    "albedo",
                    Texture::Noise {
                        values,
                        size,
                        octaves,
                    },
                );
            },
            "material \"lamp\": `octaves` must be an integer in [1, 16], and is 17",
        ),
        (
            |s| {
                put(
                    s,
                    3,
                    "albedo",
                    image([[0.5; 3], [f32::NAN; 3]], false, DVec3::Y),
                )
            },
            "material \"lamp\": ",
        ),
        (
            |s| put(s, 3, "albedo", image([[0.5; 3]; 2], false, DVec3::ZERO)),
            "has no direction",
        ),
        (
            |s| s.materials[3].kind = measured(None),
            "material \"lamp\": the table of a measured material has not been read",
        ),
        (
            |s| {
                if let MaterialKind::Mix(mix) = &mut s.materials[4].kind {
                    mix.parts.clear();
                }
            },
            "material \"both\": the parts of a mix are not there",
        ),
        (
            |s| {
                let glass = s.materials[0].kind.clone();
                if let MaterialKind::Mix(mix) = &mut s.materials[4].kind {
                    mix.parts[0].material = Material::new("glass", glass);
                }
            },
            "material \"both\": a part of a mix is a dielectric",
        ),
        (
            |s| {
                if let MaterialKind::Mix(mix) = &mut s.materials[4].kind {
                    mix.parts[0].second = true;
                    mix.weight = 0.25;
                }
            },
            "material \"both\": the weights of a mix's parts do not add up to 1",
        ),
        (
            |s| {
                if let MaterialKind::Mix(mix) = &mut s.materials[4].kind
                    && let MaterialKind::Diffuse(lamp) = &mut mix.parts[0].material.kind
                {
                    lamp.albedo.x = -1.0;
                }
            },
            "material \"lamp\": `albedo` must be in [0, 1]",
        ),
        (
            |s| s.spheres[1].material = 5,
            "sphere 2 has the material of index 5, and there are 5",
        ),
        (
            |s| s.spheres[1].radius = 0.0,
            "sphere 2: `radius` must be greater than 0, and is 0",
        ),
        (
            |s| s.spheres[4].radius = f64::NAN,
            "sphere 5: `radius` must be a finite",
        ),
        (
            |s| s.spheres[2].center.z = f64::INFINITY,
            "sphere 3: `center` must be a finite number",
        ),
        (
            |s| s.spheres[2].motion.z = f64::NAN,
            "sphere 3 moves by what is no number",
        ),
        (
            |s| s.spheres[2].motion.x = 20_000.0,
            "sphere 3 moves by 20000 times its radius",
        ),
        (
            |s| s.spheres[1].priority = Some(2),
            "sphere 2: `priority` needs a dielectric, and `metal` is none",
        ),
        (
            |s| s.spheres.iter_mut().for_each(|s| s.radius = 1.0e-150),
            "the spheres are too small to compute with; one of them must have at least 1e-140",
        ),
    ];
    for (change, part) in wrong {
        match with(*change) {
            Err(Error::Placement(text)) => assert!(text.contains(part), "{part}: {text}"),
            Err(other) => panic!("{part}: {other:?}"),
            Ok(_) => panic!("{part}: it is prepared"),
        }
    }
    // And what is not.
    let right: &[Change] = &[
        |_| {},
        |s| s.camera.up = 1.0e30 * DVec3::X,
        |s| (s.camera.aperture_radius, s.camera.focus_distance) = (0.0, 0.0),
        |s| s.environment = sky([[1.0; 3], [0.0; 3]], 2.0),
        |s| put(s, 1, "roughness", checker([0.5, 1.0], 1.0)),
        |s| put(s, 3, "albedo", image([[0.5; 3], [1.0; 3]], false, DVec3::X)),
        |s| {
            let table = BrdfTable::sampled([2, 2, 2], |_, _| DVec3::splat(0.1));
            s.materials[3].kind = measured(Some(table));
        },
        |s| s.spheres[2].motion.x = 2.0,
        |s| s.spheres[1].material = 0,
        |s| s.spheres.truncate(0),
    ];
    for (place, change) in right.iter().enumerate() {
        with(*change).unwrap_or_else(|e| panic!("{place}: {e}"));
    }
}

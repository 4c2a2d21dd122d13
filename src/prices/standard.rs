//! The standard scene of an effect: one ball, and whatever calls for the effect.

use std::sync::Arc;

use glam::DVec3;

use crate::effects::Effect;
use crate::image::Picture;
use crate::materials::{
    ALL, MaterialKind,
    dielectric::{Dielectric, Glass},
    diffuse::Diffuse,
    forms,
    texturable::{texturable_key, textured_keys},
};
use crate::materials::{Material, Texture, TextureImage};
use crate::scene::load::load_str;
use crate::scene::{Environment, Gradient, Scene, Sky, Sphere, builtin};
use crate::settings::{
    DEFAULT_TERMINATION, GeometryChoice, Integrator, LightSampling, Offset, Settings, View,
};

/// A ball of half gray that fills most of a square image, a lamp and gray light from all around.
const BALL: &str = r#"
[camera]
position = [0.0, 0.0, 4.2]
look_at = [0.0, 0.0, 0.0]
fov = 30.0

[image]
width = 128
height = 128

[environment]
radiance = [0.5, 0.5, 0.5]

[material.ball]
type = "diffuse"
albedo = [0.5, 0.5, 0.5]

[material.lamp]
type = "diffuse"
albedo = [0.0, 0.0, 0.0]
emission = [30.0, 30.0, 30.0]

[[sphere]]
center = [0.0, 0.0, 0.0]
radius = 1.0
material = "ball"

[[sphere]]
center = [3.0, 3.0, 2.0]
radius = 0.5
material = "lamp"
"#;

/// Balls a side of the square that a tree is for.
const SIDE: i32 = 20;

/// The scene and settings in which `effect` is priced: the ball, or the lecture's room for what ends long paths. What
/// asks for it is there, but for those effects that follow from where spheres are, and for `adaptive`: their scene is the plain ball.
///
/// # Panics
/// If one of the program's own scenes is none.
#[must_use]
pub fn standard(effect: Effect) -> (Scene, Settings) {
    let loaded = load_str("ball", BALL).unwrap_or_else(|e| panic!("{e}"));
    let mut scene = loaded.scene;
    let mut settings = Settings::for_scene(&scene);
    match effect {
        Effect::List => settings.geometry = GeometryChoice::List,
        Effect::Bvh | Effect::BvhCost => {
            shatter(&mut scene);
            settings.geometry = GeometryChoice::Bvh;
            settings.view = (effect == Effect::BvhCost).then_some(View::BvhCost);
        }
        Effect::Nudge => settings.offset = Offset::Out(1.0e-4),
        Effect::Ulp => settings.offset = Offset::Ulp,
        Effect::Lens => scene.camera.aperture_radius = 0.05,
        Effect::Motion => scene.spheres[0].motion = DVec3::new(0.5, 0.25, 0.0),
        Effect::Classes => settings.classes = true,
        Effect::Features => settings.features = true,
        Effect::Form(code) => {
            let form = forms()[code as usize];
            let mut cases = ALL.iter().flat_map(|material| (material.cases)());
            if let Some(kind) = cases.find(|kind| kind.form() == form) {
                set_ball(&mut scene, kind);
            }
        }
        Effect::Absorption => set_ball(
            &mut scene,
            Dielectric {
                absorption: DVec3::new(0.1, 0.2, 0.4),
                ..Dielectric::smooth(1.5)
            },
        ),
        Effect::Dispersion => set_ball(
            &mut scene,
            Dielectric {
                preset: Some(Glass::SF10),
                ior: None,
                ..Dielectric::smooth(1.5)
            },
        ),
        Effect::TextureChecker => set_texture(&mut scene, "albedo", checker),
        Effect::TextureNoise => set_texture(&mut scene, "albedo", |values| Texture::Noise {
            values,
            size: 0.5,
            octaves: 4,
        }),
        Effect::TextureImage => set_texture(&mut scene, "albedo", |[a, b]| {
            let texels = (0..64).map(|i| if i % 2 == 0 { a } else { b });
            let texels = texels.map(|v| v.as_vec3().to_array()).collect();
            let image = Arc::new(Picture::new(8, 8, texels));
            Texture::Image(TextureImage::new("stripes", image, false, DVec3::Y))
        }),
        Effect::Textured(number) => {
            set_texture(&mut scene, textured_keys()[number as usize], checker);
        }
        Effect::Gradient => {
            scene.environment = Some(Environment::Gradient(Gradient {
                zenith: DVec3::splat(0.6),
                horizon: DVec3::splat(0.4),
                ground: DVec3::splat(0.3),
            }));
        }
        Effect::Sky | Effect::Skylight => scene.environment = Some(sky()),
        Effect::Lecture => {
            settings.integrator = Integrator::Lecture {
                termination: DEFAULT_TERMINATION,
            };
        }
        // They end long paths: those of a room.
        Effect::Roulette | Effect::RadianceCache => {
            settings.radiance_cache = effect == Effect::RadianceCache;
            scene = builtin::resolve(None)
                .unwrap_or_else(|e| panic!("{e}"))
                .scene;
            (scene.width, scene.height) = (settings.width, settings.height);
            settings.max_bounces = Settings::for_scene(&scene).max_bounces;
        }
        Effect::LampImages => {
            settings.lamp_images = true;
            set_ball(&mut scene, Dielectric::smooth(1.5));
            // What its images light.
            let floor = Sphere {
                center: DVec3::new(0.0, -101.0, 0.0),
                radius: 100.0,
                ..scene.spheres[0]
            };
            let glass = scene.materials[floor.material].clone();
            scene.materials.push(Material {
                name: "floor".into(),
                kind: Diffuse {
                    albedo: DVec3::splat(0.5),
                }
                .into(),
                ..glass
            });
            scene.spheres.push(Sphere {
                material: scene.materials.len() - 1,
                ..floor
            });
        }
        Effect::Table => settings.light_sampling = Some(LightSampling::Cone),
        Effect::Baked
        | Effect::Pole
        | Effect::Interior
        | Effect::Straddle
        | Effect::Nested
        | Effect::Sobol
        | Effect::Adaptive
        | Effect::Priority
        | Effect::Emission
        | Effect::Environment
        | Effect::Lights
        | Effect::Projected
        | Effect::Mis => {}
    }
    (scene, settings)
}

/// The material of the ball.
fn set_ball(scene: &mut Scene, kind: impl Into<MaterialKind>) {
    scene.materials[scene.spheres[0].material].kind = kind.into();
}

/// A texture for a key of the ball, whose material becomes the first of the test cases that has the key.
fn set_texture(scene: &mut Scene, key: &str, texture: impl Fn([DVec3; 2]) -> Texture) {
    let ball = &mut scene.materials[scene.spheres[0].material];
    let mut cases = ALL.iter().flat_map(|material| (material.cases)());
    let texturable = |kind: &MaterialKind| texturable_key(kind.name(), key);
    if texturable(&ball.kind).is_none()
        && let Some(kind) = cases.find(|kind| texturable(kind).is_some())
    {
        ball.kind = kind;
    }
    if let Some(key) = texturable(&ball.kind) {
        let values = [0.25, 0.5].map(DVec3::splat);
        *ball = ball.clone().with_texture(key, texture(values));
    }
}

fn checker(values: [DVec3; 2]) -> Texture {
    Texture::Checker { values, size: 0.5 }
}

/// A square of small balls in the place of the ball.
fn shatter(scene: &mut Scene) {
    let ball = scene.spheres[0];
    let spacing = 2.0 * ball.radius / f64::from(SIDE);
    let place = |i: i32| (f64::from(i) + 0.5) * spacing - ball.radius;
    let balls = (0..SIDE * SIDE).map(|i| Sphere {
        center: DVec3::new(place(i % SIDE), place(i / SIDE), 0.0),
        radius: 0.45 * spacing,
        ..ball
    });
    scene.spheres = balls.chain(scene.spheres.drain(..).skip(1)).collect();
}

/// An image of a light that is stronger above.
fn sky() -> Environment {
    let (width, height) = (64, 32);
    let rows = (0..height).flat_map(|row| {
        let value = 1.0 - row as f32 / height as f32;
        std::iter::repeat_n([value; 3], width)
    });
    let picture = Picture::new(width as u32, height as u32, rows.collect());
    Environment::Sky(Sky::new("gradient", picture, DVec3::ONE, 0.0))
}

//! Scenes and settings that ask for a set of effects.

use super::Set;
use glam::{DVec2, DVec3};
use gpu_trace::effects::Effect;
use gpu_trace::image::Picture;
use gpu_trace::materials::texturable::{texturable_key, textured_keys};
use gpu_trace::materials::{ALL, Material, MaterialKind, Texture, TextureImage, forms};
use gpu_trace::placement::lights::MOST_WEIGHED;
use gpu_trace::sampler::Sampler;
use gpu_trace::scene::{
    Camera, Environment, Gradient, Handedness, RenderDefaults, Scene, Sky, Sphere,
};
use gpu_trace::settings::{GeometryChoice, Integrator, LightSampling, Offset, Settings, View};
use std::sync::Arc;

/// The first case of a material that has this form.
fn of_form(code: u32) -> MaterialKind {
    let cases = ALL.iter().flat_map(|material| (material.cases)());
    let mut fitting = cases.filter(|kind| kind.form() == forms()[code as usize]);
    fitting.next().expect("a case of every form")
}

/// The environment that asks for the effects of `set`.
fn environment_of(set: &Set) -> Option<Environment> {
    let radiance = DVec3::new(0.5, 0.6, 0.7);
    let has = |effect| set.contains(&effect);
    match [Effect::Environment, Effect::Gradient, Effect::Sky].map(has) {
        [true, ..] => Some(Environment::Constant(radiance)),
        [_, true, _] => Some(Environment::Gradient(Gradient {
            zenith: radiance,
            horizon: 2.0 * radiance,
            ground: 0.5 * radiance,
        })),
        [.., true] => {
            let image = Picture::new(2, 1, vec![[0.5, 0.6, 0.7], [0.0; 3]]);
            Some(Environment::Sky(Sky::new("sky", image, DVec3::ONE, 0.0)))
        }
        _ => None,
    }
}

/// For each key that is a texture in `set` a material of one of `kinds` with each kind of textures in it.
fn textured(set: &Set, kinds: &[MaterialKind]) -> Vec<Material> {
    let keys = set.iter().filter_map(|effect| match effect {
        Effect::Textured(number) => Some(textured_keys()[*number as usize]),
        _ => None,
    });
    let mut materials = Vec::new();
    for name in keys {
        let of = |kind: &MaterialKind| Some((texturable_key(kind.name(), name)?, kind.clone()));
        let Some((key, kind)) = kinds.iter().find_map(of) else {
            continue;
        };
        // What is smooth stays so.
        let smooth = name == "roughness" && kind.is_delta();
        let values = match smooth {
            true => [DVec3::ZERO; 2],
            false => [DVec3::splat(0.3), DVec3::splat(0.6)],
        };
        let image = Picture::new(2, 1, values.map(|v| v.as_vec3().to_array()).into());
        let image = TextureImage::new("image", Arc::new(image), key.number, DVec3::Y);
        let size = 0.5;
        for (effect, texture) in [
            (Effect::TextureChecker, Texture::Checker { values, size }),
            (
                Effect::TextureNoise,
                Texture::Noise {
                    values,
                    size,
                    octaves: 2,
                },
            ),
            (Effect::TextureImage, Texture::Image(image)),
        ] {
            if set.contains(&effect) {
                let plain = Material::new(&format!("{name} {effect:?}"), kind.clone());
                materials.push(plain.with_texture(key, texture));
            }
        }
    }
    materials
}

/// A scene and settings that ask for exactly the effects of `set`, where that is possible.
pub(super) fn asking_for(set: &Set) -> (Scene, Settings) {
    let has = |effect| set.contains(&effect);
    let mut kinds: Vec<MaterialKind> = set
        .iter()
        .filter_map(|effect| match effect {
            Effect::Form(code) => Some(of_form(*code)),
            _ => None,
        })
        .collect();
    for kind in &mut kinds {
        let MaterialKind::Dielectric(glass) = kind else {
            continue;
        };
        if has(Effect::Absorption) {
            glass.absorption = DVec3::new(0.0, 0.1, 0.2);
        }
        if has(Effect::Dispersion) {
            glass.ior = None;
            glass.cauchy = Some(DVec2::new(1.5, 0.01));
        }
    }
    let material = |(i, kind): (usize, &MaterialKind)| Material {
        emission: DVec3::splat(if has(Effect::Emission) && i == 0 {
            2.0
        } else {
            0.0
        }),
        ..Material::new(&format!("m{i}"), kind.clone())
    };
    let glass = kinds.iter().position(|kind| kind.transmits());
    let plain = kinds.iter().enumerate().map(material);
    let materials: Vec<Material> = plain.chain(textured(set, &kinds)).collect();
    let mut spheres = Vec::new();
    let mut sphere = |material: usize, x: f64, y: f64, z: f64, radius: f64| {
        spheres.push(Sphere {
            center: DVec3::new(x, y, z),
            motion: DVec3::ZERO,
            radius,
            material,
            priority: None,
        });
    };
    // Off the view axis: what the view starts at has a pole frame.
    for i in 0..materials.len() {
        sphere(i, 2.0 * i as f64, 1.5, 0.0, 0.5);
    }
    if let Some(i) = glass {
        if has(Effect::Priority) {
            sphere(i, 2.0 * i as f64, 1.75, 0.0, 0.5);
        }
        if has(Effect::Nested) {
            sphere(0, 2.0 * i as f64, 1.5, 0.0, 0.49999);
        }
    }
    if has(Effect::Projected) && has(Effect::Table) {
        for i in 0..=MOST_WEIGHED {
            sphere(0, 0.4 * i as f64 - 1.6, 4.0, 0.0, 0.1);
        }
    }
    if has(Effect::LampImages) {
        // Whatever the first one is, there is a lamp apart from a sphere that makes images.
        sphere(0, 0.0, -3.0, 0.0, 0.5);
    }
    let nudged = has(Effect::Nudge) || has(Effect::Ulp);
    if has(Effect::Straddle) && !nudged {
        // Through the lens, with something so small and far that this one gets no pole frame.
        sphere(0, 0.0, 0.0, 0.0, 6.0);
        sphere(0, 900.0, 900.0, 0.0, 0.01);
    }
    if has(Effect::Pole) {
        sphere(0, 0.0, -10001.0, 0.0, 10000.0);
    }
    if has(Effect::Interior) && glass.is_none() && !has(Effect::Straddle) {
        // Around the camera, and too far away for a pole frame.
        sphere(0, 0.0, 0.0, 0.0, 100.0);
    }
    if has(Effect::Motion) {
        for sphere in &mut spheres {
            sphere.motion = DVec3::new(0.1, 0.0, 0.0);
        }
    }
    let scene = Scene {
        camera: Camera {
            position: DVec3::new(0.0, 0.0, 6.0),
            look_at: DVec3::ZERO,
            up: DVec3::Y,
            fov: 40.0,
            handedness: Handedness::Right,
            aperture_radius: if has(Effect::Lens) { 0.1 } else { 0.0 },
            focus_distance: 6.0,
        },
        width: 16,
        height: 16,
        render: RenderDefaults::default(),
        environment: environment_of(set),
        materials,
        spheres,
    };
    let settings = Settings {
        geometry: match [Effect::List, Effect::Bvh].map(has) {
            [true, _] => GeometryChoice::List,
            [_, true] => GeometryChoice::Bvh,
            _ => GeometryChoice::Baked,
        },
        integrator: match [
            has(Effect::Lecture),
            has(Effect::Mis),
            has(Effect::Lights) || has(Effect::Skylight),
        ] {
            [true, ..] => Integrator::Lecture { termination: 0.2 },
            [_, true, _] => Integrator::Path,
            [.., true] => Integrator::Nee,
            _ => Integrator::Bsdf,
        },
        light_sampling: (has(Effect::Lights) && !has(Effect::Projected))
            .then_some(LightSampling::Cone),
        roulette: (!has(Effect::Lecture)).then_some(has(Effect::Roulette)),
        radiance_cache: has(Effect::RadianceCache),
        lamp_images: has(Effect::LampImages),
        adaptive: has(Effect::Adaptive),
        classes: has(Effect::Classes),
        features: has(Effect::Features),
        view: has(Effect::BvhCost).then_some(View::BvhCost),
        sampler: match has(Effect::Sobol) {
            true => Sampler::Sobol,
            false => Sampler::Independent,
        },
        offset: match [Effect::Nudge, Effect::Ulp].map(has) {
            [true, _] => Offset::Out(1.0e-4),
            [_, true] => Offset::Ulp,
            _ => Offset::Exact,
        },
        ..Settings::for_scene(&scene)
    };
    (scene, settings)
}

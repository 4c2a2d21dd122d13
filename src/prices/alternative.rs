//! What an effect is measured against.

use glam::DVec3;

use super::Told;
use crate::effects::{BAKED_MOST, Effect};
use crate::job::{Job, prepare};
use crate::materials::mix::Weight;
use crate::materials::texturable::{EMISSION, WEIGHT, texturable_key, textured_keys};
use crate::materials::{Material, MaterialKind, Texture, Textured, diffuse::Diffuse, forms};
use crate::sampler::Sampler;
use crate::scene::Scene;
use crate::settings::{GeometryChoice, Integrator, LightSampling, Offset, Settings};

/// What stands in an effect's place.
#[derive(Clone, Debug)]
pub struct Alternative {
    /// What it is, in a few words.
    pub what: String,
    /// The job with it.
    pub job: Job,
}

/// Why an effect of where spheres are has no alternative.
const FROM_PLACES: &str = "it follows from where the spheres are: a kernel without it is wrong";

/// The alternative of an effect that `job` uses; or why there is none. For a material that is diffuse of its
/// colour; for a choice of how to render the other one; else nothing.
///
/// # Errors
/// With the reason.
pub fn alternative(job: &Job, effect: Effect) -> Told<Alternative> {
    let (mut scene, mut settings) = (job.scene().clone(), job.settings().clone());
    let what = change(effect, job, &mut scene, &mut settings)?;
    let other = prepare(&scene, &settings).map_err(|error| error.to_string())?;
    // It is in no settings that are measured.
    let keeps = job.effects().has(Effect::Adaptive) && effect != Effect::Adaptive;
    Ok(Alternative {
        what: what.to_owned(),
        job: match keeps {
            true => other
                .with_effects(&[Effect::Adaptive], "--adaptive")
                .map_err(|error| error.to_string())?,
            false => other,
        },
    })
}

/// Puts the alternative into scene or settings, and says what it is.
fn change(
    effect: Effect,
    job: &Job,
    scene: &mut Scene,
    settings: &mut Settings,
) -> Told<&'static str> {
    Ok(match effect {
        Effect::Baked | Effect::List => {
            settings.geometry = GeometryChoice::Bvh;
            "bvh"
        }
        Effect::Bvh if scene.spheres.len() <= BAKED_MOST => {
            settings.geometry = GeometryChoice::Baked;
            "baked"
        }
        Effect::Bvh => {
            settings.geometry = GeometryChoice::List;
            "list"
        }
        Effect::Pole | Effect::Interior | Effect::Straddle | Effect::Nested | Effect::Priority => {
            return Err(FROM_PLACES.into());
        }
        Effect::Nudge | Effect::Ulp => {
            settings.offset = Offset::Exact;
            "--offset exact"
        }
        Effect::Lens => {
            scene.camera.aperture_radius = 0.0;
            "a pinhole"
        }
        Effect::Motion => {
            for sphere in &mut scene.spheres {
                sphere.motion = DVec3::ZERO;
            }
            "spheres at rest in the middle of their ways"
        }
        Effect::Sobol => {
            settings.sampler = Sampler::Independent;
            "--sampler independent"
        }
        Effect::Classes => {
            settings.classes = false;
            "no such layers"
        }
        Effect::Features => {
            settings.features = false;
            "no such layers"
        }
        Effect::BvhCost => {
            settings.view = None;
            "light"
        }
        Effect::Adaptive => "all tiles alike",
        Effect::Form(code) => {
            let form = forms()[code as usize];
            if job.effects().has(effect) && form.lambertian {
                return Err("it is what other materials are measured against".into());
            }
            replace(scene, |kind| {
                let is_it = kind.form() == form;
                let albedo = kind.color().clamp(DVec3::ZERO, DVec3::ONE);
                is_it.then(|| Diffuse { albedo }.into())
            });
            // What is no dielectric any more fills no overlap.
            for sphere in &mut scene.spheres {
                let transmits = scene.materials[sphere.material].kind.transmits();
                sphere.priority = sphere.priority.filter(|_| transmits);
            }
            "diffuse of its colour"
        }
        Effect::Absorption => {
            replace(scene, |kind| kind.clear());
            "clear glass"
        }
        Effect::Dispersion => {
            replace(scene, |kind| kind.of_one_index());
            "the index of yellow light for all"
        }
        Effect::TextureChecker => {
            keep_textures(scene, |_, t| !matches!(t, Texture::Checker { .. }));
            "its largest value all over"
        }
        Effect::TextureNoise => {
            keep_textures(scene, |_, t| !matches!(t, Texture::Noise { .. }));
            "its largest value all over"
        }
        Effect::TextureImage => {
            keep_textures(scene, |_, t| !matches!(t, Texture::Image(_)));
            "its largest value all over"
        }
        Effect::Textured(number) => {
            let key = textured_keys()[number as usize];
            keep_textures(scene, |own, _| own != key);
            "its largest value all over"
        }
        Effect::Emission => {
            for material in &mut scene.materials {
                material.emission = DVec3::ZERO;
                material.textures.retain(|t| t.key.key != EMISSION);
            }
            "lamps that are off"
        }
        Effect::Environment | Effect::Gradient | Effect::Sky => {
            scene.environment = None;
            "darkness around"
        }
        Effect::Lecture => {
            settings.integrator = Integrator::Path;
            "--integrator path"
        }
        Effect::Lights | Effect::Skylight => {
            settings.integrator = Integrator::Bsdf;
            settings.light_sampling = None;
            "--integrator bsdf"
        }
        Effect::Projected => {
            settings.light_sampling = Some(LightSampling::Cone);
            "--light-sampling cone"
        }
        Effect::Table if settings.light_sampling() == LightSampling::Cone => {
            settings.light_sampling = Some(LightSampling::Projected);
            "--light-sampling projected"
        }
        Effect::Table => return Err("so many lamps are not weighed at each vertex".into()),
        Effect::Mis => {
            settings.integrator = Integrator::Nee;
            "--integrator nee"
        }
        Effect::RadianceCache => {
            settings.radiance_cache = false;
            "--radiance-cache off"
        }
        Effect::LampImages => {
            settings.lamp_images = false;
            "--lamp-images off"
        }
        Effect::Roulette => {
            settings.roulette = Some(false);
            "--roulette off"
        }
    })
}

/// All materials, and the parts of mixes.
fn each(scene: &mut Scene, mut change: impl FnMut(&mut Material)) {
    for material in &mut scene.materials {
        change(material);
        if let MaterialKind::Mix(mix) = &mut material.kind {
            mix.parts
                .iter_mut()
                .for_each(|part| change(&mut part.material));
        }
    }
}

/// Puts other materials in the place of those that `other` has something for.
fn replace(scene: &mut Scene, other: impl Fn(&MaterialKind) -> Option<MaterialKind>) {
    each(scene, |material| {
        if let Some(kind) = other(&material.kind) {
            let kept = |t: &Textured| texturable_key(kind.name(), t.key.key) == Some(t.key);
            material.textures.retain(kept);
            material.kind = kind;
        }
    });
}

/// Leaves the other textures' largest values, which their materials have.
fn keep_textures(scene: &mut Scene, is_kept: impl Fn(&str, &Texture) -> bool) {
    each(scene, |material| {
        material.textures.retain(|t| is_kept(t.key.key, &t.texture));
        let MaterialKind::Mix(mix) = &mut material.kind else {
            return;
        };
        for factor in mix.parts.iter_mut().flat_map(|part| &mut part.inner) {
            if let Weight::Texture(texture) = &factor.weight
                && !is_kept(WEIGHT, texture)
            {
                factor.weight = Weight::Number(texture.largest().x);
            }
        }
    });
}

//! Images of surfaces with textures.

use glam::DVec3;
use gpu_trace::film::Film;
use gpu_trace::image::Picture;
use gpu_trace::materials::Texture;
use gpu_trace::scene::Scene;
use gpu_trace::settings::{GeometryChoice, Integrator, LightSampling, Settings};
use gpu_trace::statistics::mean_and_error;
use gpu_trace::verify::{ULP, means, settings, share_off};

use super::{albedo, emission, image, random_picture};
use crate::common::blocks::{Blocks, blocks_of_seeds, deviation};
use crate::common::images::{
    Left, assert_alike, assert_same, largest_relative_difference, uniform, with_values,
};
use crate::common::{gpu_renderer, render_cpu, render_gpu, scene, scene_file};

const CAMERA: &str = "[camera]\nposition = [0, 0, 4]\nlook_at = [0, 0, 0]\nfov = 40.0\n[image]\nwidth = 16\nheight = 16\n";

/// A white ball in a white environment.
fn ball(fov: f64, radiance: f64) -> Scene {
    let camera = CAMERA.replace("40.0", &format!("{fov:?}"));
    scene(&format!(
        "{camera}[environment]\nradiance = {:?}\n[material.m]\ntype = \"diffuse\"\nalbedo = [1, 1, 1]\n\
         [[sphere]]\ncenter = [0, 0, 0]\nradius = 1.0\nmaterial = \"m\"\n",
        [radiance; 3]
    ))
}

/// The scene with a texture as the albedo of its first material.
fn with_albedo(scene: &Scene, texture: Texture) -> Scene {
    let mut scene = scene.clone();
    scene.materials[0] = scene.materials[0].clone().with_texture(albedo(), texture);
    scene
}

#[test]
fn constant_textures_are_plain_colours() {
    // Other spheres see it, and lamps light it.
    let base = scene_file("scenes/tests/lamps.toml");
    let place = base
        .materials
        .iter()
        .position(|m| m.kind.name() == "diffuse" && m.emission == DVec3::ZERO);
    let place = place.expect("a diffuse material");
    let color = base.materials[place].kind.color().as_vec3();
    let textured = |texture: Texture| {
        let mut scene = base.clone();
        scene.materials[place] = scene.materials[place]
            .clone()
            .with_texture(albedo(), texture);
        scene
    };
    let values = [color.as_dvec3(); 2];
    for geometry in [
        GeometryChoice::Baked,
        GeometryChoice::List,
        GeometryChoice::Bvh,
    ] {
        let settings = Settings {
            geometry,
            ..settings(&base, 32, 24, 16)
        };
        let plain = render_gpu(&base, &settings);
        let checker = textured(Texture::Checker { values, size: 0.5 });
        let name = format!("{geometry:?}");
        let found = render_gpu(&checker, &settings);
        assert_same(&name, &found, &plain);
        let picture = Picture::new(5, 3, vec![color.to_array(); 15]);
        // An interpolation has three roundings, of which there are three, at each of a few events.
        let constant = textured(image(picture, DVec3::X));
        let film = render_gpu(&constant, &settings);
        let off = largest_relative_difference(&film, &plain);
        assert_alike(&name, &film, &plain, off < 1.0e-5, off);
        let noise = textured(Texture::Noise {
            values,
            size: 0.5,
            octaves: 3,
        });
        let film = render_gpu(&noise, &settings);
        let off = largest_relative_difference(&film, &plain);
        assert_alike(&name, &film, &plain, off < 1.0e-5, off);
        // Companion: a hundredth brighter.
        let picture = Picture::new(5, 3, vec![(1.01 * color).to_array(); 15]);
        let other = textured(image(picture, DVec3::X));
        let film = render_gpu(&other, &settings);
        assert!(largest_relative_difference(&film, &plain) > 1.0e-3);
    }
}

#[test]
fn a_checker_in_white_light_is_its_mean() {
    // A ball alone in light of 1 shows its albedo. That of mirror images is the other value, and so the mean of what is
    // seen is the mean of both; the ball fills the image.
    let (a, b) = (DVec3::new(0.9, 0.2, 0.5), DVec3::new(0.3, 0.8, 0.1));
    let texture = Texture::Checker {
        values: [a, b],
        size: 0.11,
    };
    let scene = with_albedo(&ball(14.0, 1.0), texture);
    let film = render_gpu(&scene, &settings(&scene, 32, 32, 256));
    let (mean, truth) = (means(&film), 0.5 * (a + b));
    let _left = Left::of("a checker", &film, &uniform(&film, truth.to_array()));
    for channel in 0..3 {
        // Pairs of pixels that are each other's mirror image.
        let pixel = |x: usize, y: usize| mean[3 * (32 * y + x) + channel];
        let pairs = (0..32).flat_map(|y| (0..16).map(move |x| (x, y)));
        let pairs: Vec<f64> = pairs
            .map(|(x, y)| 0.5 * (pixel(x, y) + pixel(31 - x, y)))
            .collect();
        let (found, error) = mean_and_error(&pairs);
        let z = |truth: f64| (found - truth) / error.max(1.0e-6);
        eprintln!(
            "channel {channel}: {found} +- {error} for {}",
            truth[channel]
        );
        assert!(
            z(truth[channel]).abs() < 3.9,
            "{channel}: {found} +- {error}"
        );
        assert!(z(1.02 * truth[channel]).abs() > 3.9, "companion: {error}");
        // Each value is seen.
        let (low, high) = (a[channel].min(b[channel]), a[channel].max(b[channel]));
        assert!(
            pixel_range(&mean, channel).0 < low + 0.01
                && pixel_range(&mean, channel).1 > high - 0.01
        );
    }
}

fn pixel_range(means: &[f64], channel: usize) -> (f64, f64) {
    let values = means.iter().skip(channel).step_by(3);
    values.fold((f64::INFINITY, 0.0), |(low, high), x| {
        (low.min(*x), high.max(*x))
    })
}

#[test]
fn the_layer_albedo_shows_the_texture() {
    let picture = random_picture(8, 4, "layer");
    let scene = with_albedo(&ball(20.0, 1.0), image(picture, DVec3::new(0.0, 1.0, 0.3)));
    let settings = Settings {
        features: true,
        ..settings(&scene, 16, 16, 4)
    };
    let (gpu, cpu) = (render_gpu(&scene, &settings), render_cpu(&scene, &settings));
    let plain = render_gpu(&ball(20.0, 1.0), &settings);
    let albedo = |film: &Film, i: usize| film.aovs(i).expect("asked for").albedo;
    let layer = |film| with_values(film, (0..256).map(|i| albedo(film, i)));
    let _left = Left::of("layer albedo", &layer(&gpu), &layer(&cpu));
    for i in 0..256 {
        let of = |film| albedo(film, i);
        for ((a, b), light) in of(&gpu).iter().zip(of(&cpu)).zip(gpu.mean(i)) {
            assert!((a - b).abs() < 1.0e-4, "{i}: {a} {b}");
            // In light of 1 it is what is seen.
            assert!((a / 4.0 - light).abs() < 1.0e-4, "{i}: {a} {light}");
        }
        assert_ne!(of(&gpu), of(&plain), "companion");
    }
}

/// A dark room with a lamp of this emission, beside a second one, and a floor.
fn lit_by(texture: Option<Texture>, more: &str) -> Scene {
    let mut scene = scene(&format!(
        "[camera]\nposition = [0, 2, 6]\nlook_at = [0, 0.3, 0]\nfov = 40.0\n[image]\nwidth = 16\nheight = 16\n\
         {more}[material.lamp]\ntype = \"diffuse\"\nalbedo = [0, 0, 0]\nemission = [4, 4, 4]\n\
         [material.floor]\ntype = \"diffuse\"\nalbedo = [0.6, 0.6, 0.6]\n\
         [material.other]\ntype = \"diffuse\"\nalbedo = [0.5, 0.5, 0.5]\nemission = [1, 1, 1]\n\
         [[sphere]]\ncenter = [-1, 1, 0]\nradius = 0.6\nmaterial = \"lamp\"\n\
         [[sphere]]\ncenter = [0, -1000, 0]\nradius = 1000.0\nmaterial = \"floor\"\n\
         [[sphere]]\ncenter = [1.2, 0.5, 0.4]\nradius = 0.3\nmaterial = \"other\"\n"
    ));
    if let Some(texture) = texture {
        let lamp = scene
            .materials
            .iter_mut()
            .find(|m| m.name == "lamp")
            .expect("a lamp");
        *lamp = lamp.clone().with_texture(emission(), texture);
    }
    scene
}

/// The image and its mean, from seeds.
fn seen(scene: &Scene, integrator: Integrator, light_sampling: LightSampling) -> Blocks {
    let settings = Settings {
        integrator,
        light_sampling: integrator.samples_lights().then_some(light_sampling),
        ..settings(scene, 16, 16, 256)
    };
    blocks_of_seeds(gpu_renderer(scene, &settings), &settings, 0..8, 1)
}

#[test]
fn textured_lamps_are_the_same_for_all_estimators() {
    // Bright spots on a dark lamp, so that where it is bright matters.
    let texels = (0..8 * 4).map(|i| match i % 5 {
        0 => [9.0, 6.0, 3.0],
        _ => [0.0, 0.0, 0.1],
    });
    let spots = image(
        Picture::new(8, 4, texels.collect()),
        DVec3::new(1.0, 1.0, 0.0),
    );
    let values = [DVec3::new(6.0, 2.0, 0.0), DVec3::new(0.0, 1.0, 5.0)];
    let checker = Texture::Checker { values, size: 0.4 };
    let sky = "[environment]\nradiance = [0.1, 0.1, 0.1]\n";
    for (name, texture, more) in [("spots", spots, ""), ("checker", checker, sky)] {
        let scene = lit_by(Some(texture), more);
        let truth = seen(&scene, Integrator::Bsdf, LightSampling::Projected);
        for (integrator, sampling) in [
            (Integrator::Nee, LightSampling::Projected),
            (Integrator::Path, LightSampling::Projected),
            (Integrator::Nee, LightSampling::Cone),
            (Integrator::Path, LightSampling::Cone),
        ] {
            let found = seen(&scene, integrator, sampling);
            let name = format!("{name}, {}, {sampling:?}", integrator.name());
            let _left = Left::of(&name, &found, &truth);
            let ([mean, variance], truth) = (found.image, truth.image);
            let z = |scale: f64| deviation([scale * mean, variance], truth);
            // Means with their variances.
            let both = format!("{:?} for {truth:?}", found.image);
            eprintln!("{name}: {both}, z = {:.2}", z(1.0));
            assert!(z(1.0).abs() < 4.5, "{name}: {both}");
            assert!(z(1.1).abs() > 4.5, "a tenth is not found: {both}");
        }
        // Companion: a lamp that is as bright as the mean everywhere lights this floor otherwise.
        let lamp = scene
            .materials
            .iter()
            .find(|m| m.name == "lamp")
            .expect("a lamp");
        let mean = image(
            Picture::new(1, 1, vec![lamp.mean_emission().as_vec3().to_array()]),
            DVec3::Y,
        );
        let other = lit_by(Some(mean), more);
        let a = render_cpu(&scene, &settings(&scene, 16, 16, 16));
        let b = render_cpu(&other, &settings(&other, 16, 16, 16));
        assert!(share_off(&a, &b) > 0.5);
    }
}

#[test]
fn a_constant_lamp_is_a_plain_one() {
    let plain = lit_by(None, "");
    let picture = Picture::new(3, 2, vec![[4.0; 3]; 6]);
    let textured = lit_by(Some(image(picture, DVec3::Z)), "");
    let settings = settings(&plain, 24, 24, 16);
    let (a, b) = (
        render_gpu(&textured, &settings),
        render_gpu(&plain, &settings),
    );
    let off = largest_relative_difference(&a, &b);
    assert_alike("a constant lamp", &a, &b, off < 64.0 * ULP, off);
    // Companion: a hundredth brighter.
    let picture = Picture::new(3, 2, vec![[4.04; 3]; 6]);
    let other = lit_by(Some(image(picture, DVec3::Z)), "");
    assert!(largest_relative_difference(&render_gpu(&other, &settings), &b) > 64.0 * ULP);
}

/// A ground of radius 10^6 just below a camera, and a ball on it.
fn ground(texture: Texture, shift: f64) -> Scene {
    let scene = scene(&format!(
        "[camera]\nposition = [0.3, 1.5, 5]\nlook_at = [0.1, 0, 0]\nfov = 40.0\n[image]\nwidth = 32\nheight = 32\n\
         [environment]\nradiance = [0.8, 0.9, 1]\n\
         [material.ground]\ntype = \"diffuse\"\nalbedo = [1, 1, 1]\n\
         [material.ball]\ntype = \"diffuse\"\nalbedo = [0.5, 0.5, 0.5]\n\
         [[sphere]]\ncenter = [{shift:?}, -1000000.2, 0.1]\nradius = 1000000.0\nmaterial = \"ground\"\n\
         [[sphere]]\ncenter = [0.2, 0.3, 0]\nradius = 0.5\nmaterial = \"ball\"\n"
    ));
    with_albedo(&scene, texture)
}

#[test]
fn a_huge_ground_is_that_of_f64() {
    let values = [DVec3::new(0.9, 0.1, 0.5), DVec3::new(0.2, 0.8, 0.4)];
    for texture in [
        // Whose cells end where the ground's top is: its surface is all within the cells below.
        Texture::Checker { values, size: 0.5 },
        Texture::Checker { values, size: 0.45 },
        Texture::Noise {
            values,
            size: 0.45,
            octaves: 4,
        },
    ] {
        for geometry in [GeometryChoice::Baked, GeometryChoice::List] {
            let scene = ground(texture.clone(), 0.0);
            let settings = Settings {
                geometry,
                ..settings(&scene, 32, 32, 16)
            };
            let film = render_gpu(&scene, &settings);
            let reference = render_cpu(&scene, &settings);
            let off = share_off(&film, &reference);
            let name = format!("a ground, {geometry:?}");
            eprintln!("{name}: {off}");
            // Rays whose point is next to a border, or far beyond the pole.
            assert_alike(&name, &film, &reference, off < 0.03, off);
            // Companion: f32 has no digits for where the cells are, a sixteenth of a scene unit; by less than that.
            let moved = ground(texture.clone(), 0.03);
            let other = share_off(&film, &render_cpu(&moved, &settings));
            assert!(other > 2.0 * off + 0.1, "{other} and {off}");
        }
    }
}

#[test]
fn a_roughness_may_be_smooth_in_places() {
    // Metals and glass that are smooth in every other cell, in the kernel as in f64.
    let text = |kind: &str| {
        format!(
            "{CAMERA}[environment]\ngradient = {{ zenith = [1, 0.5, 0.2], horizon = [0.2, 0.3, 0.9], ground = [0.1, 0.4, 0.1] }}\n\
             [material.m]\n{kind}\nroughness = {{ checker = [0.0, 0.4], size = 0.3 }}\n\
             [material.lamp]\ntype = \"diffuse\"\nalbedo = [0, 0, 0]\nemission = [5, 5, 5]\n\
             [[sphere]]\ncenter = [0, 0, 0]\nradius = 1.0\nmaterial = \"m\"\n\
             [[sphere]]\ncenter = [2, 3, 2]\nradius = 0.5\nmaterial = \"lamp\"\n"
        )
    };
    for kind in [
        "type = \"conductor\"\npreset = \"gold\"",
        "type = \"dielectric\"\nior = 1.5",
    ] {
        let scene = scene(&text(kind));
        let settings = settings(&scene, 24, 24, 16);
        let film = render_gpu(&scene, &settings);
        let reference = render_cpu(&scene, &settings);
        let off = share_off(&film, &reference);
        eprintln!("{kind}: {off}");
        assert_alike(kind, &film, &reference, off < 0.06, off);
        let mut rough = scene.clone();
        rough.materials[0].textures.clear();
        let other = share_off(&film, &render_cpu(&rough, &settings));
        assert!(other > 0.3, "companion: {other}");
    }
}

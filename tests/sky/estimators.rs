//! Renders under images around all, by all ways to look for light.

use super::in_sky;
use super::light::with_sun;
use crate::common::images::{Left, assert_alike, bias, class_image};
use crate::common::{gpu, render_cpu, render_gpu, scene};
use glam::DVec3;
use gpu_trace::effects::{Effect, Effects};
use gpu_trace::error::Error;
use gpu_trace::film::{Film, LightClass};
use gpu_trace::gpu::renderer::GpuRenderer;
use gpu_trace::image::Picture;
use gpu_trace::job::Job;
use gpu_trace::placement::Placement;
use gpu_trace::scene::{Environment, Scene, Sky};
use gpu_trace::settings::{GeometryChoice, Integrator, LightSampling, Settings};
use gpu_trace::statistics::mean_and_error;
use gpu_trace::verify::{means, settings, share_off};

/// Balls of several materials on a floor, a lamp, glass with something in it, and a sky with a sun; `lamps` of them.
fn yard(lamps: usize, sky: Sky) -> Scene {
    let mut text = String::from(
        "[camera]\nposition = [0, 2, 7]\nlook_at = [0, 0.7, 0]\nfov = 45.0\n[image]\nwidth = 24\n\
         height = 18\n[render]\nmax_bounces = 6\n[material.floor]\ntype = \"diffuse\"\n\
         albedo = [0.5, 0.5, 0.5]\n[material.shiny]\ntype = \"reflective\"\nalbedo = [0.2, 0.2, 0.2]\n\
         specular = [1, 1, 1]\nepsilon = 0.01\nmu = 10.0\n[material.brass]\ntype = \"conductor\"\n\
         preset = \"gold\"\nroughness = 0.4\n[material.glass]\ntype = \"dielectric\"\nior = 1.5\n\
         [material.lamp]\ntype = \"diffuse\"\nalbedo = [0.3, 0.3, 0.3]\nemission = [2, 2, 3]\n",
    );
    let mut sphere = |center: [f64; 3], radius: f64, material: &str| {
        text += &format!(
            "[[sphere]]\ncenter = {center:?}\nradius = {radius:?}\nmaterial = \"{material}\"\n"
        );
    };
    sphere([0.0, -20.0, 0.0], 20.0, "floor");
    sphere([-2.0, 0.8, 0.0], 0.8, "shiny");
    sphere([0.0, 0.8, -0.5], 0.8, "brass");
    sphere([2.0, 0.8, 0.0], 0.8, "glass");
    sphere([2.0, 0.8, 0.0], 0.4, "floor");
    for i in 0..lamps {
        sphere([2.0 * i as f64 - 1.0, 2.5, -2.0], 0.3, "lamp");
    }
    let mut scene = scene(&text);
    scene.environment = Some(Environment::Sky(sky));
    scene
}

/// A sun of 2 % of the sky's texels, which BSDF sampling still finds.
fn sunny() -> Sky {
    Sky::new("sunny", with_sun(12, 8, [3, 2], 8.0), DVec3::ONE, 40.0)
}

fn rendered(scene: &Scene, how: (Integrator, LightSampling, GeometryChoice), spp: u64) -> Film {
    let (integrator, light_sampling, geometry) = how;
    let settings = Settings {
        integrator,
        light_sampling: integrator.samples_lights().then_some(light_sampling),
        geometry,
        ..settings(scene, 24, 18, spp)
    };
    render_gpu(scene, &settings)
}

#[test]
fn all_estimators_converge_to_the_same() {
    let cases = [
        (0, LightSampling::Projected),
        (2, LightSampling::Projected),
        (2, LightSampling::Cone),
        (12, LightSampling::Projected),
    ];
    for (lamps, sampling) in cases {
        let scene = yard(lamps, sunny());
        let geometries = [
            GeometryChoice::Baked,
            GeometryChoice::List,
            GeometryChoice::Bvh,
        ];
        let bsdf = (Integrator::Bsdf, sampling, GeometryChoice::Baked);
        let reference = rendered(&scene, bsdf, 1 << 12);
        for integrator in [Integrator::Path, Integrator::Nee] {
            let geometry = geometries[lamps % 3];
            let film = rendered(&scene, (integrator, sampling, geometry), 1 << 9);
            let name = format!("{lamps} lamps, {sampling:?}, {}", integrator.name());
            let (z, _) = bias(&film, &reference, 1.0);
            eprintln!("{name}: z = {z:.2}");
            assert_alike(&name, &film, &reference, z.abs() < 3.9, z);
            assert_eq!(film.tally().non_finite, 0);
            // Companion: 2 % too dark.
            let (z, _) = bias(&film, &reference, 0.98);
            assert!(z.abs() > 3.9, "2 % is not found: {z}");
        }
    }
}

#[test]
fn every_geometry_has_the_same_paths_as_the_reference() {
    for (lamps, sampling) in [
        (0, LightSampling::Projected),
        (2, LightSampling::Projected),
        (12, LightSampling::Projected),
        (2, LightSampling::Cone),
    ] {
        let scene = yard(lamps, sunny());
        for integrator in [Integrator::Path, Integrator::Nee] {
            let of = |geometry| Settings {
                integrator,
                light_sampling: Some(sampling),
                geometry,
                ..settings(&scene, 24, 18, 4)
            };
            let reference = render_cpu(&scene, &of(GeometryChoice::Auto));
            for geometry in [
                GeometryChoice::Baked,
                GeometryChoice::List,
                GeometryChoice::Bvh,
            ] {
                let film = render_gpu(&scene, &of(geometry));
                let off = share_off(&film, &reference);
                // A path in a hundred takes another way, where a rounding decides; a pixel has four.
                let name = format!("{lamps} lamps, {integrator:?}, {geometry:?}");
                assert_alike(&name, &film, &reference, off < 0.05, off);
                let rays = film.tally().rays as f64 / reference.tally().rays as f64;
                assert!((rays - 1.0).abs() < 0.01, "{rays}");
            }
            // Companion: turned by a degree it is another image.
            let sky = sunny();
            let turned = Sky::new("x", sky.image().clone(), sky.scale(), sky.rotation() + 1.0);
            let other = render_cpu(&yard(lamps, turned), &of(GeometryChoice::Auto));
            let off = share_off(&other, &reference);
            assert!(off > 0.5, "a turned image is not found: {off}");
        }
    }
}

#[test]
fn a_hot_sun_is_found() {
    // 1e-4 of the sphere has nearly all of the light: by BSDF sampling alone the error would be some ten times this.
    let sky = Sky::new("hot", with_sun(128, 64, [80, 20], 1.0e4), DVec3::ONE, 0.0);
    let scene = yard(0, sky);
    let error = |integrator| {
        let how = (integrator, LightSampling::Projected, GeometryChoice::Auto);
        let film = rendered(&scene, how, 256);
        let all = (0..film.rect().pixels()).map(|i| film.variance_of_mean(i).expect("batches")[0]);
        all.sum::<f64>().sqrt()
    };
    let (path, bsdf) = (error(Integrator::Path), error(Integrator::Bsdf));
    eprintln!("path {path:.3}, bsdf {bsdf:.3}");
    assert!(path < 0.3 * bsdf, "{path}, {bsdf}");
}

/// Seeds of which the means of layers are compared.
const SEEDS: u64 = 12;

#[test]
fn layers_are_those_of_bsdf_sampling() {
    let scene = yard(2, sunny());
    let films = |integrator, spp| -> Vec<Film> {
        (0..SEEDS)
            .map(|seed| {
                let settings = Settings {
                    integrator,
                    seed,
                    classes: true,
                    ..settings(&scene, 24, 18, spp)
                };
                render_gpu(&scene, &settings)
            })
            .collect()
    };
    let classes = |films: &[Film]| {
        let mean = |film: &Film, k: usize| {
            let pixels = film.rect().pixels();
            let of = |i: usize| film.aovs(i).expect("asked for").classes[k][1];
            (0..pixels).map(of).sum::<f64>() / (pixels as u64 * film.samples()) as f64
        };
        let of = |k| mean_and_error(&films.iter().map(|film| mean(film, k)).collect::<Vec<_>>());
        (0..5).map(of).collect::<Vec<_>>()
    };
    let truth = films(Integrator::Bsdf, 512);
    let reference = classes(&truth);
    for integrator in [Integrator::Path, Integrator::Nee] {
        let films = films(integrator, 128);
        let found = classes(&films);
        for (k, (a, b)) in found.iter().zip(&reference).enumerate() {
            // Directly seen light has no variance but that of places in pixels. Ten comparisons with some 20 degrees of
            // freedom: a level of 1e-3 for all.
            let z = (a.0 - b.0) / a.1.hypot(b.1).max(1.0e-6 * b.0);
            let name = format!("sky, {}, class {k}", integrator.name());
            eprintln!("{name}: {a:?}, {b:?}, z = {z:.2}");
            let _left = Left::of(name, &class_image(&films, k), &class_image(&truth, k));
            assert!(b.0 > 0.0);
            assert!(z.abs() < 4.8, "{integrator:?}, class {k}: {a:?}, {b:?}");
        }
        // Companion: 5 % of the direct light counted as indirect.
        let [direct, indirect] =
            [LightClass::Direct, LightClass::Indirect].map(|class| class as usize);
        let error = found[indirect].1.hypot(reference[indirect].1);
        let z = 0.05 * found[direct].0 / error;
        assert!(z > 4.8, "{integrator:?}: 5 % is not found, {z}");
    }
}

#[test]
fn what_sees_no_sky_does_not_look_for_it() {
    let has = |scene: &Scene, integrator, effect| {
        let settings = Settings {
            integrator,
            ..Settings::for_scene(scene)
        };
        let placement = Placement::new(scene, 16, 16);
        Effects::derive(scene, &placement, &settings).has(effect)
    };
    let room = "[material.wall]\ntype = \"diffuse\"\nalbedo = [0.5, 0.5, 0.5]\n[[sphere]]\n\
                center = [0, 0, 0]\nradius = 10.0\nmaterial = \"wall\"\n";
    let (open, closed) = (in_sky(sunny(), ""), in_sky(sunny(), room));
    for integrator in [Integrator::Path, Integrator::Nee, Integrator::Bsdf] {
        let looks = integrator != Integrator::Bsdf;
        assert!(has(&open, integrator, Effect::Sky));
        assert_eq!(has(&open, integrator, Effect::Skylight), looks);
        for effect in [Effect::Sky, Effect::Skylight, Effect::Mis] {
            assert!(!has(&closed, integrator, effect), "{effect:?}");
        }
    }
    // And the twin looks for nothing either.
    let film = render_cpu(&closed, &settings(&closed, 8, 8, 4));
    let _left = Left::alone("a room that sees no sky", &film);
    assert_eq!(means(&film).iter().sum::<f64>(), 0.0);
}

#[test]
fn an_image_beyond_the_device_is_refused_before_any_work() {
    let job = |width: u32, height: u32| {
        let image = Picture::new(width, height, vec![[0.5; 3]; (width * height) as usize]);
        let scene = in_sky(Sky::new("wide.exr", image, DVec3::ONE, 0.0), "");
        crate::common::job(&scene, &settings(&scene, 8, 8, 1))
    };
    let with = |most: u32, job: &Job| {
        let mut gpu = gpu();
        gpu.limits.max_texture_dimension_2d = most;
        GpuRenderer::new(gpu, job).map(|_| ())
    };
    for (width, height) in [(4097, 1), (1, 4097)] {
        let error = with(4096, &job(width, height)).expect_err("it is too large");
        assert!(matches!(error, Error::DeviceLimit(_)), "{error:?}");
        let text = error.to_string();
        let size = format!("wide.exr has {width} x {height} texels");
        assert!(
            text.contains(&size) && text.contains("limit of 4096"),
            "{text}"
        );
    }
    // Companion: just as large as the device allows.
    for (width, height) in [(4096, 1), (1, 4096)] {
        with(4096, &job(width, height)).expect("it fits");
    }
}

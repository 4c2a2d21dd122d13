//! Environments that are not the same everywhere: lookups against their f64 twins, and images against
//! quadrature.

mod estimators;
mod files;
mod gradient;
mod image;
mod light;

use std::f64::consts::TAU;

use glam::DVec3;
use gpu_trace::film::Film;
use gpu_trace::image::Picture;
use gpu_trace::sampling::directions::basis_around;
use gpu_trace::scene::{Environment, Scene, Sky};
use gpu_trace::settings::{Integrator, Settings};
use gpu_trace::statistics::mean_and_error;
use gpu_trace::verify::{Random, settings};

use crate::common::images::Left;
use crate::common::{render_gpu, scene};

/// A diffuse ball of albedo .8 that fills the image and shows the normal `n` alone, to a thousandth of a radian;
/// `more` are lines of the scene file.
fn ball_text(n: DVec3, more: &str) -> String {
    let [x, y, z] = (4.0 * n).to_array();
    // Along an axis that is not the normal's.
    let [a, b, c] = basis_around(n).tangent.to_array();
    format!(
        "[camera]\nposition = [{x:?}, {y:?}, {z:?}]\nlook_at = [0, 0, 0]\nup = [{a:?}, {b:?}, {c:?}]\n\
         fov = 0.02\n[image]\nwidth = 16\nheight = 16\n{more}\n[material.m]\ntype = \"diffuse\"\n\
         albedo = [0.8, 0.8, 0.8]\n[[sphere]]\ncenter = [0, 0, 0]\nradius = 1.0\nmaterial = \"m\"\n"
    )
}

fn seen(scene: &Scene, integrator: Integrator, spp: u64) -> Film {
    let settings = Settings {
        integrator,
        ..settings(scene, 16, 16, spp)
    };
    render_gpu(scene, &settings)
}

/// Mean and standard error of the red values that pixels show.
fn red(film: &Film) -> (f64, f64) {
    let values: Vec<f64> = (0..film.rect().pixels()).map(|i| film.mean(i)[0]).collect();
    mean_and_error(&values)
}

/// The integral of L cos/pi over the hemisphere about `n`, by the midpoint rule in the square of the sine and in
/// the azimuth.
fn mean_over_cosine(n: DVec3, side: u32, radiance: impl Fn(DVec3) -> f64) -> f64 {
    let basis = basis_around(n);
    let place = |i: u32| (f64::from(i) + 0.5) / f64::from(side);
    let direction = |i: u32, j: u32| {
        let (square, (sin, cos)) = (place(i), (TAU * place(j)).sin_cos());
        let across = square.sqrt() * (cos * basis.tangent + sin * basis.bitangent);
        across + (1.0 - square).sqrt() * n
    };
    let cells = (0..side).flat_map(|i| (0..side).map(move |j| (i, j)));
    let sum: f64 = cells.map(|(i, j)| radiance(direction(i, j))).sum();
    sum / f64::from(side * side)
}

/// Holds what `scene_of` shows of normals all around, by `integrators`, to the quadrature of `radiance`, and finds
/// `power` of a difference.
fn shows_the_integral(
    environment: &str,
    radiance: impl Fn(DVec3) -> f64,
    integrators: &[Integrator],
    spp: u64,
    power: f64,
) {
    let normals = [
        DVec3::Y,
        -DVec3::Y,
        DVec3::X,
        DVec3::new(1.0, 2.0, -0.5).normalize(),
        DVec3::new(-0.7, -0.2, 0.4).normalize(),
    ];
    for n in normals {
        let scene = scene(&ball_text(n, environment));
        let truth = 0.8 * mean_over_cosine(n, 1024, &radiance);
        for integrator in integrators {
            let film = seen(&scene, *integrator, spp);
            let name = format!("a ball of {n}, {}", integrator.name());
            let _left = Left::alone(name, &film);
            let (mean, error) = red(&film);
            // What the midpoint rule is off by where the radiance jumps, and rounding where all samples are the same.
            let error = error.hypot(2.0e-4 * truth);
            let z = |truth: f64| (mean - truth) / error;
            eprintln!("{n}, {}: {mean} +- {error} for {truth}", integrator.name());
            assert!(
                z(truth).abs() < 3.9,
                "{n}, {integrator:?}: {mean} +- {error} for {truth}"
            );
            // Companion.
            let off = z((1.0 + power) * truth);
            assert!(
                off.abs() > 3.9,
                "{n}, {integrator:?}: {power} is not found, {off}"
            );
        }
    }
}

/// Directions all around, with the axes and what is close to them among them, in f32 and of unit length to
/// rounding.
fn directions(count: usize, name: &str) -> Vec<[f32; 4]> {
    let mut random = Random::new(name);
    let near = |random: &mut Random| {
        let axes = [
            DVec3::X,
            DVec3::Y,
            DVec3::Z,
            -DVec3::X,
            -DVec3::Y,
            -DVec3::Z,
        ];
        let axis = axes[random.words()[0] as usize % 6];
        (axis + random.magnitude(-9.0, -1.0) * random.direction()).normalize()
    };
    let axes = DVec3::AXES.into_iter().flat_map(|axis| [axis, -axis]);
    let mut all: Vec<DVec3> = axes.collect();
    for i in all.len()..count {
        let direction = match i % 3 {
            0 => near(&mut random),
            _ => random.direction(),
        };
        all.push(direction);
    }
    let rows = all.into_iter().map(|w| w.as_vec3().extend(0.0).to_array());
    rows.collect()
}

/// A scene with a camera of 40 degrees in the middle of an image; `more` are lines of the scene file.
fn in_sky(sky: Sky, more: &str) -> Scene {
    let text = format!(
        "[camera]\nposition = [0, 0, 4]\nlook_at = [0, 0, 0]\nfov = 40.0\n[image]\nwidth = 16\n\
         height = 16\n{more}"
    );
    let mut scene = scene(&text);
    scene.environment = Some(Environment::Sky(sky));
    scene
}

/// An image of values whose logarithms are uniform over some `orders` of magnitude about 1; of 0, uniform to 1.
fn random_image(width: u32, height: u32, name: &str, orders: f64) -> Picture {
    let mut random = Random::new(name);
    let mut value = || match orders > 0.0 {
        true => random.magnitude(-0.5 * orders, 0.5 * orders) as f32,
        false => random.unit() as f32,
    };
    let texels = (0..width * height).map(|_| [value(), value(), value()]);
    Picture::new(width, height, texels.collect())
}

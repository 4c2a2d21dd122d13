//! What numerical trouble would do to images: acne, rings, leaks, dark rooms. Every image is compared
//! with the f64 reference on the same paths, pixel by pixel, or with a number; the companions show the
//! same test failing where paths leave surfaces by a nudge.

use std::fmt::Write as _;

use crate::common::images::{Left, assert_alike, uniform};
use crate::common::{render_cpu, render_gpu, scene};
use gpu_trace::film::Film;
use gpu_trace::scene::Scene;
use gpu_trace::settings::{Offset, Settings};
use gpu_trace::statistics::{mean_and_error, normal_limit};
use gpu_trace::verify::{means, settings};

/// The share of values that may differ by more than 0.1 %: a path that passes within a rounding of a
/// silhouette goes its own way, and takes its pixel along.
const OFF: f64 = 0.02;

/// What is wrong with `film`, if anything is: too many values that differ from the reference's, or an
/// 8x8 block or a row (a ring, seen from the side) whose mean does.
fn trouble(film: &Film, reference: &Film) -> Option<String> {
    if film.tally().non_finite > 0 {
        return Some(format!("{:?}", film.tally()));
    }
    let (a, b) = (means(film), means(reference));
    let off = |(x, y): &(&f64, &f64)| (*x - *y).abs() > 1.0e-3 * y.abs();
    let share = a.iter().zip(&b).filter(off).count() as f64 / a.len() as f64;
    if share > OFF {
        return Some(format!("{share} of the values differ"));
    }
    let width = film.rect().width as usize;
    let height = a.len() / 3 / width;
    let blocks = (0..height / 8).flat_map(|y| (0..width / 8).map(move |x| (8 * x, 8 * y, 8, 8)));
    let rows = (0..height).map(|y| (0, y, width, 1));
    let areas: Vec<_> = blocks.chain(rows).collect();
    let limit = normal_limit(areas.len());
    for (x, y, w, h) in &areas {
        let values = (*y..y + h).flat_map(|y| (*x..x + w).map(move |x| 3 * (y * width + x)));
        let differences: Vec<f64> = values.clone().map(|i| a[i] - b[i]).collect();
        let size = values.map(|i| b[i]).sum::<f64>() / (w * h) as f64;
        let (mean, error) = mean_and_error(&differences);
        // Rounding has a mean of its own.
        let excess = (mean.abs() - 1.0e-5 * size).max(0.0);
        if excess > limit * error && excess > 1.0e-3 * size {
            return Some(format!(
                "{w}x{h} pixels at ({x}, {y}): {mean:e} of {size} too much, +- {error:e}"
            ));
        }
    }
    None
}

fn assert_no_trouble(name: &str, film: &Film, reference: &Film) {
    let trouble = trouble(film, reference);
    let what = trouble.as_deref().unwrap_or_default();
    assert_alike(name, film, reference, trouble.is_none(), what);
}

fn check(name: &str, scene: &Scene, settings: &Settings) {
    let (film, reference) = (render_gpu(scene, settings), exact(scene, settings));
    assert_no_trouble(name, &film, &reference);
}

/// The reference, which always leaves surfaces exactly.
fn exact(scene: &Scene, settings: &Settings) -> Film {
    let offset = Offset::Exact;
    render_cpu(
        scene,
        &Settings {
            offset,
            ..settings.clone()
        },
    )
}

/// A companion: the same by a nudge is found.
fn nudged(name: &str, scene: &Scene, settings: &Settings, offset: Offset) {
    let settings = Settings {
        offset,
        ..settings.clone()
    };
    let film = render_gpu(scene, &settings);
    let found = trouble(&film, &exact(scene, &settings));
    eprintln!("{name}, --offset {offset}: {found:?}");
    assert!(found.is_some(), "{name}: --offset {offset} is not found");
}

/// A room of half width 1 whose walls are spheres of `radius`; two balls and a lamp in it.
fn room(radius: f64) -> Scene {
    let mut text = String::from(
        "[camera]\nposition = [0, 0, 0.9]\nlook_at = [0, -0.1, -1]\nfov = 70.0\n[image]\n\
         width = 16\nheight = 16\n[material.white]\ntype = \"diffuse\"\nalbedo = [0.7, 0.7, 0.7]\n\
         [material.red]\ntype = \"diffuse\"\nalbedo = [0.7, 0.1, 0.1]\n[material.lamp]\n\
         type = \"diffuse\"\nalbedo = [0.5, 0.5, 0.5]\nemission = [3, 3, 3]\n[material.glass]\n\
         type = \"dielectric\"\nior = 1.5\n",
    );
    let far = radius + 1.0;
    let walls = [
        ([-far, 0.0, 0.0], "red"),
        ([far, 0.0, 0.0], "white"),
        ([0.0, -far, 0.0], "white"),
        ([0.0, far, 0.0], "lamp"),
        ([0.0, 0.0, -far], "white"),
        ([0.0, 0.0, far], "white"),
    ];
    let balls = [([-0.4, -0.6, -0.3], "white"), ([0.4, -0.6, 0.0], "glass")];
    let walls = walls.map(|(center, material)| (center, radius, material));
    let balls = balls.map(|(center, material)| (center, 0.4, material));
    for (center, radius, material) in walls.into_iter().chain(balls) {
        let _ = writeln!(
            text,
            "[[sphere]]\ncenter = {center:?}\nradius = {radius:?}\nmaterial = \"{material}\""
        );
    }
    scene(&text)
}

#[test]
fn walls_of_any_radius_make_a_room() {
    for radius in [1.0e3, 1.0e4, 1.0e5, 1.0e6, 1.0e7, 1.0e8] {
        let scene = room(radius);
        check(
            &format!("walls of {radius:e}"),
            &scene,
            &settings(&scene, 48, 48, 64),
        );
    }
}

#[test]
fn companion_a_room_with_nudges_is_found() {
    let scene = room(1.0e3);
    let settings = settings(&scene, 48, 48, 64);
    for offset in [Offset::None, Offset::Out(1.0e-2), Offset::Back(1.0e-8)] {
        nudged("walls of 1e3", &scene, &settings, offset);
    }
}

/// A ball on a ground of `radius` under a bright sky, seen at a low angle.
fn ground(radius: f64, ball: f64) -> Scene {
    scene(&format!(
        "[camera]\nposition = [0, {}, {}]\nlook_at = [0, {}, 0]\nfov = 40.0\n[image]\nwidth = 16\n\
         height = 16\n[environment]\nradiance = [0.5, 0.7, 1.0]\n[material.ground]\n\
         type = \"diffuse\"\nalbedo = [0.6, 0.5, 0.4]\n[material.ball]\ntype = \"mirror\"\n\
         reflectance = [0.9, 0.9, 0.9]\n[[sphere]]\ncenter = [0, {:?}, 0]\nradius = {radius:?}\n\
         material = \"ground\"\n[[sphere]]\ncenter = [0, {ball:?}, 0]\nradius = {ball:?}\n\
         material = \"ball\"\n",
        1.5 * ball,
        8.0 * ball,
        0.5 * ball,
        -radius,
    ))
}

#[test]
fn no_rings_and_no_acne_on_a_ground() {
    for radius in [10.0, 1.0e3, 1.0e6, 1.0e8, 1.0e12] {
        for ball in [1.0, 1.0e-3] {
            let scene = ground(radius, ball);
            let name = format!("ground of {radius:e}, ball of {ball:e}");
            check(&name, &scene, &settings(&scene, 48, 48, 64));
        }
    }
    let scene = ground(1.0e3, 1.0e-3);
    let settings = settings(&scene, 48, 48, 64);
    for offset in [Offset::None, Offset::Out(1.0e-4), Offset::Back(1.0e-4)] {
        nudged("ball of 1e-3", &scene, &settings, offset);
    }
}

#[test]
fn a_moved_scene_is_the_same() {
    // The field's sums are not exact: 0.1 % on 98 % of the values.
    let text = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/glass.toml"))
        .expect("a scene of the repository");
    let base = scene(&text);
    let settings = settings(&base, 48, 36, 64);
    let film = render_gpu(&base, &settings);
    let at = |d: f64| {
        let mut moved = base.clone();
        let by = glam::DVec3::new(d, -d, d);
        for sphere in &mut moved.spheres {
            sphere.center += by;
        }
        moved.camera.position += by;
        moved.camera.look_at += by;
        moved
    };
    for d in [1.0, 1.0e3, 1.0e5, f64::from(1 << 26)] {
        let moved = render_gpu(&at(d), &settings);
        assert_no_trouble(&format!("moved by {d}"), &moved, &film);
    }
    // Companion: moved without the camera.
    let mut other = at(1.0e-2);
    other.camera = base.camera;
    assert!(trouble(&render_gpu(&other, &settings), &film).is_some());
}

#[test]
fn cameras_inside_on_and_touching_spheres() {
    let materials = [
        ("diffuse", "type = \"diffuse\"\nalbedo = [0.5, 0.6, 0.7]"),
        ("mirror", "type = \"mirror\"\nreflectance = [0.9, 0.8, 0.7]"),
        ("glass", "type = \"dielectric\"\nior = 1.5"),
    ];
    let ulp = f64::EPSILON;
    for (name, material) in materials {
        for distance in [
            0.0,
            0.5,
            1.0 - 1.0e-7,
            1.0 - ulp,
            1.0,
            1.0 + ulp,
            1.0 + 1.0e-7,
        ] {
            for aim in [-1.0, 1.0] {
                // A mirror around the camera keeps the light out.
                let emission = if name == "glass" { 0.0 } else { 0.25 };
                let scene = scene(&format!(
                    "[camera]\nposition = [0, 0, {distance:?}]\nlook_at = [0.1, 0.2, {:?}]\n\
                     fov = 60.0\n[image]\nwidth = 16\nheight = 16\n[environment]\n\
                     radiance = [0.5, 0.7, 1.0]\n[material.lamp]\ntype = \"diffuse\"\n\
                     albedo = [0.2, 0.2, 0.2]\nemission = [4, 4, 4]\n[material.m]\n{material}\n\
                     emission = [{emission}, {emission}, {emission}]\n[[sphere]]\n\
                     center = [0, 0, 0]\nradius = 1.0\nmaterial = \"m\"\n[[sphere]]\n\
                     center = [0.5, 0.5, {:?}]\nradius = 1.0\nmaterial = \"lamp\"\n",
                    distance + aim,
                    4.0 * aim,
                ));
                let name = format!("{name}, camera at {distance:?}, looking to {aim}");
                check(&name, &scene, &settings(&scene, 24, 24, 64));
            }
        }
    }
}

#[test]
fn furnaces_of_any_size_and_albedo_reach_their_radiance() {
    // With roulette; the bounce limit lies beyond what any path reaches.
    for radius in [1.0e-6, 1.0e-3, 1.0, 1.0e3, 1.0e6] {
        for albedo in [0.5, 0.9, 0.999] {
            let [x, y, z] = [0.3, -0.2, 0.1].map(|x| x * radius);
            let scene = scene(&format!(
                "[camera]\nposition = [{x:e}, {y:e}, {z:e}]\nlook_at = [{z:e}, {radius:e}, {x:e}]\n\
                 fov = 60.0\n[image]\nwidth = 16\nheight = 16\n[material.wall]\n\
                 type = \"diffuse\"\nalbedo = [{albedo}, {albedo}, {albedo}]\nemission = [1, 1, 1]\n\
                 [[sphere]]\ncenter = [0, 0, 0]\nradius = {radius:e}\nmaterial = \"wall\"\n"
            ));
            let settings = Settings {
                max_bounces: 60_000,
                ..settings(&scene, 16, 16, 64)
            };
            let film = render_gpu(&scene, &settings);
            assert_eq!(film.tally().cut_paths, 0);
            let values: Vec<f64> = (0..256).map(|i| film.mean(i)[0]).collect();
            let (mean, error) = mean_and_error(&values);
            // The kernel's albedo is the f32 one; an f32 sum of as many terms as a path has.
            let expected = 1.0 / (1.0 - f64::from(albedo as f32));
            let name = format!("furnace of {radius:e}, albedo {albedo}");
            let _left = Left::of(name, &film, &uniform(&film, [expected; 3]));
            let rounding = 2.0 * gpu_trace::verify::U / (1.0 - albedo);
            let off = |expected: f64| {
                ((mean / expected - 1.0).abs() - rounding) * expected / error.max(1.0e-9)
            };
            assert!(
                off(expected) < normal_limit(15),
                "radius {radius:e}, albedo {albedo}: {mean} +- {error} for {expected}"
            );
            assert!(off(1.05 * expected) > normal_limit(15), "5 % is not found");
        }
    }
}

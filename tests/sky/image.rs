//! Lookups in an image around all.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};
use gpu_trace::image::Picture;
use gpu_trace::placement::Placement;
use gpu_trace::reference::light::environment::{sky_place, sky_radiance};
use gpu_trace::scene::{Environment, Scene, Sky};
use gpu_trace::settings::Integrator;
use gpu_trace::verify::{Agreement, Random, ULP, settings, vector};

use super::{ball_text, directions, in_sky, random_image, red, seen};
use crate::common::images::{Left, assert_alike, largest_relative_difference};
use crate::common::{probe_of, render_cpu, render_gpu, scene};

/// Sizes with sides of one, of powers of two, and of neither.
const SIZES: [[u32; 2]; 6] = [[1, 1], [1, 7], [9, 1], [64, 32], [37, 19], [1024, 512]];

#[test]
fn turns_agree() {
    let mut random = Random::new("turns");
    let inputs: Vec<[f32; 4]> = (0..100_000)
        .map(|i| {
            let mut x = || {
                let size = random.magnitude(-12.0, 3.0);
                (size * (random.unit() - 0.5).signum()) as f32
            };
            let (x, y) = (x(), x());
            match i % 16 {
                0 => [x, 0.0, 0.0, 0.0],
                1 => [0.0, y, 0.0, 0.0],
                2 => [x, x, 0.0, 0.0],
                _ => [x, y, 0.0, 0.0],
            }
        })
        .collect();
    let scene = in_sky(
        Sky::new("x", Picture::new(1, 1, vec![[1.0; 3]]), DVec3::ONE, 0.0),
        "",
    );
    let outputs: Vec<[f32; 4]> = probe_of(&scene, &["sky"])
        .call("turn_of", &inputs)
        .expect("the probe runs");
    let holds = |shift: f64| {
        let mut agreement = Agreement::default();
        for (p, found) in inputs.iter().zip(&outputs) {
            let truth = f64::from(p[1]).atan2(p[0].into()) / (2.0 * PI);
            let off = f64::from(found[0]) - truth + shift;
            // What the fit leaves, and the roundings: 2.5 of the quotient, 2 of the last of its sums, of an eighth of a
            // turn; and one each of differences from 1/4, 1/2 and 1.
            agreement.add(
                (off - off.round()).abs(),
                1.0e-9 + (4.5 / 8.0 + 1.75) * ULP,
                || format!("{p:?}: {found:?} for {truth}"),
            );
        }
        agreement
    };
    holds(0.0).assert_holds(100_000);
    // Companion: two millionths of a turn.
    holds(2.0e-6).assert_fails();
}

/// The centre of a place of the image without rotation, by the definition.
fn direction_of(u: f64, v: f64) -> DVec3 {
    let ((sin, cos), (across, ahead)) = ((PI * v).sin_cos(), (2.0 * PI * u).sin_cos());
    DVec3::new(sin * across, cos, -sin * ahead)
}

#[test]
fn lookups_are_as_defined() {
    // By hand: -z is at U = 0, +x at a quarter, +z at a half; +y at V = 0.
    let image = random_image(8, 4, "by hand", 0.0);
    let at = |column: usize, row: usize| DVec3::from(image.pixels[8 * row + column].map(f64::from));
    let plain = Sky::new("x", image.clone(), DVec3::ONE, 0.0);
    let look = |sky: &Sky, w: DVec3| sky_radiance(sky, sky_place(sky, w));
    let near = |a: DVec3, b: DVec3| (a - b).abs().max_element() < 1.0e-12;
    // Centres of texels are themselves.
    for (column, row) in [(0, 0), (7, 0), (3, 1), (7, 3), (5, 2)] {
        let place = [(column as f64 + 0.5) / 8.0, (row as f64 + 0.5) / 4.0];
        let found = look(&plain, direction_of(place[0], place[1]));
        assert!(near(found, at(column, row)), "{column}, {row}: {found}");
    }
    // Between four texels the mean of them; across U = 0 the last and the first.
    let four = |a: DVec3, b: DVec3, c: DVec3, d: DVec3| 0.25 * (a + b + c + d);
    let between = four(at(1, 1), at(2, 1), at(1, 2), at(2, 2));
    assert!(
        near(look(&plain, DVec3::X), between),
        "+x is at a quarter, in the middle"
    );
    let seam = four(at(7, 1), at(0, 1), at(7, 2), at(0, 2));
    assert!(near(look(&plain, -DVec3::Z), seam));
    assert!(!near(seam, between));
    assert!(near(
        look(&plain, DVec3::Z),
        four(at(3, 1), at(4, 1), at(3, 2), at(4, 2))
    ));
    // Beyond the first row's centres nothing but that row.
    let up = look(&plain, direction_of(0.5 / 8.0, 0.01));
    assert!(near(up, at(0, 0)), "{up}");
    let down = look(&plain, direction_of(0.5 / 8.0, 0.99));
    assert!(near(down, at(0, 3)), "{down}");
    // Turned by 90 degrees, what was at +x is at +z; and by -270 as well. Times the scale.
    let scale = DVec3::new(2.0, 0.5, 3.0);
    for angle in [90.0, -270.0, 450.0] {
        let turned = Sky::new("x", image.clone(), scale, angle);
        assert!(near(look(&turned, DVec3::Z), scale * between), "{angle}");
        assert!(near(look(&turned, DVec3::X), scale * seam), "{angle}");
    }
}

#[test]
fn lookups_agree() {
    for [width, height] in SIZES {
        for rotation in [0.0, 37.5, 359.99] {
            let image = random_image(width, height, "lookups", 2.0);
            let sky = Sky::new("x", image, DVec3::new(1.0, 2.0, 0.5), rotation);
            let most = Environment::Sky(sky.clone()).brightest();
            let scene = in_sky(sky.clone(), "");
            let unit = Placement::new(&scene, 16, 16).radiance_scale;
            let inputs = directions(50_000, "lookups");
            let outputs: Vec<[[f32; 4]; 2]> = probe_of(&scene, &["sky"])
                .call("sky_radiance", &inputs)
                .expect("the probe runs");
            let size = DVec2::new(width.into(), height.into());
            // The turn as above, the turn of the image, and what is left of 1 after the difference; twice for the
            // angle from the pole, whose root has 4.5, all of it steep by at most 1/(2 pi).
            let turns = DVec2::new(6.0, 8.0) * ULP;
            let holds = |sky: &Sky| {
                let mut agreement = [Agreement::default(), Agreement::default()];
                for (w, [place, radiance]) in inputs.iter().zip(&outputs) {
                    // At the poles the azimuth is none.
                    if w[0] == 0.0 && w[2] == 0.0 {
                        continue;
                    }
                    let truth = sky_place(sky, vector(*w));
                    let mut off = vector(*place).truncate() - truth;
                    off.x -= size.x * (off.x / size.x).round();
                    let may_be = size * turns;
                    let share = (off.abs() / may_be).max_element();
                    agreement[0].add(share, 1.0, || format!("{w:?}: {place:?} for {truth}"));
                    // Interpolation is as steep as the largest difference, in either direction; three roundings of
                    // each mix.
                    let truth = sky_radiance(sky, truth);
                    let off = (vector(*radiance) / unit - truth).abs().max_element();
                    let may_be =
                        most * (may_be.x + may_be.y + 2.0 * ULP * 4.0 + 2.0 * ULP * size.x);
                    agreement[1].add(off, may_be, || format!("{w:?}: {radiance:?} for {truth}"));
                }
                agreement
            };
            for agreement in holds(&sky) {
                agreement.assert_holds(40_000);
            }
            if width > 1 {
                // Companion: an image turned by a hundredth of a texel is another one.
                let angle = rotation + 3.6 / f64::from(width);
                let other = Sky::new("x", sky.image().clone(), sky.scale(), angle);
                assert!(holds(&other)[0].any_fails());
            }
        }
    }
}

#[test]
fn images_agree_with_the_reference() {
    let text = "[material.chalk]\ntype = \"diffuse\"\nalbedo = [0.8, 0.8, 0.8]\n[material.glass]\n\
                type = \"dielectric\"\nior = 1.5\n[[sphere]]\ncenter = [-0.8, 0, 0]\nradius = 0.7\n\
                material = \"chalk\"\n[[sphere]]\ncenter = [0.8, 0, 0]\nradius = 0.7\nmaterial = \"glass\"\n";
    let image = random_image(37, 19, "agree", 1.0);
    let with = |rotation: f64| in_sky(Sky::new("x", image.clone(), DVec3::ONE, rotation), text);
    let scene = with(20.0);
    let settings = settings(&scene, 32, 32, 16);
    let bsdf = gpu_trace::settings::Settings {
        integrator: Integrator::Bsdf,
        ..settings
    };
    let film = render_gpu(&scene, &bsdf);
    let reference = render_cpu(&scene, &bsdf);
    let off = gpu_trace::verify::share_off(&film, &reference);
    assert_alike("sky, balls", &film, &reference, off < 0.01, off);
    // Companion: turned by half a degree.
    let other = render_cpu(&with(20.5), &bsdf);
    let off = gpu_trace::verify::share_off(&film, &other);
    assert!(off > 0.5, "{off}");
}

#[test]
fn a_constant_image_is_a_constant_environment() {
    let gray = |radiance: f32| Picture::new(5, 3, vec![[radiance; 3]; 15]);
    let ball = "[material.m]\ntype = \"diffuse\"\nalbedo = [0.5, 0.5, 0.5]\n[[sphere]]\ncenter = [0, 0, 0]\n\
                radius = 1.0\nmaterial = \"m\"\n";
    let image = in_sky(Sky::new("x", gray(0.75), DVec3::ONE, 30.0), ball);
    let mut constant = image.clone();
    constant.environment = Some(Environment::Constant(DVec3::splat(0.75)));
    // By BSDF sampling alone each path is the same, and so is the image, to the bit: interpolation between equal
    // numbers of few digits is exact.
    let by_bsdf = |scene: &Scene| {
        let settings = gpu_trace::settings::Settings {
            integrator: Integrator::Bsdf,
            ..settings(scene, 32, 32, 64)
        };
        render_gpu(scene, &settings)
    };
    let (film, reference) = (by_bsdf(&image), by_bsdf(&constant));
    let _left = Left::of("a constant sky", &film, &reference);
    // mix has three roundings, and there are three of them.
    let found = largest_relative_difference(&film, &reference);
    assert!(found < 16.0 * ULP, "{found:e}");
    let other = in_sky(Sky::new("x", gray(0.7501), DVec3::ONE, 30.0), ball);
    assert!(largest_relative_difference(&by_bsdf(&other), &reference) > 16.0 * ULP);
    // With light sampling the mean is the same, of a ball that fills the image: by a z-test that finds half a percent.
    let filled = |environment| {
        let mut scene = scene(&ball_text(DVec3::new(0.3, 0.8, -0.2).normalize(), ""));
        scene.environment = environment;
        scene
    };
    let (image, constant) = (filled(image.environment), filled(constant.environment));
    for integrator in [Integrator::Path, Integrator::Nee] {
        let films = [&image, &constant].map(|scene| seen(scene, integrator, 1024));
        let name = format!("a constant sky, {}", integrator.name());
        let _left = Left::of(name, &films[0], &films[1]);
        let [a, b] = films.each_ref().map(red);
        let z = |scale: f64| (scale * a.0 - b.0) / a.1.hypot(b.1).max(1.0e-6 * b.0);
        eprintln!("{}: {a:?}, {b:?}, z = {:.2}", integrator.name(), z(1.0));
        assert!(z(1.0).abs() < 3.9, "{integrator:?}: {a:?}, {b:?}");
        assert!(
            z(1.005).abs() > 3.9,
            "half a percent is not found: {a:?}, {b:?}"
        );
    }
}

#[test]
fn an_image_without_spheres_is_seen_as_it_is() {
    // A wide camera in the middle: each pixel is the lookup of its rays.
    let image = random_image(16, 8, "alone", 1.0);
    let scene = in_sky(Sky::new("x", image, DVec3::ONE, 0.0), "");
    let film = render_gpu(&scene, &settings(&scene, 16, 16, 16));
    let reference = render_cpu(&scene, &settings(&scene, 16, 16, 16));
    let off = gpu_trace::verify::share_off(&film, &reference);
    assert_alike("sky alone", &film, &reference, off == 0.0, off);
    let (mean, _) = red(&film);
    assert!(mean > 0.0);
    assert_eq!(film.tally().rays, 256 * 16, "nothing is looked for");
}

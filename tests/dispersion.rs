//! Indices by the wavelength: published values, constant indices against those of no dispersion, and colours in their
//! order. The functions against their twins are case 43 of `check`.

use glam::{DVec2, DVec3};
use gpu_trace::film::Film;
use gpu_trace::materials::dielectric::{Glass, Index};
use gpu_trace::materials::{Bsdf as _, MaterialKind};
use gpu_trace::sampling::spectrum::{INTEGRALS, srgb};
use gpu_trace::scene::Scene;
use gpu_trace::settings::{Integrator, Settings};
use gpu_trace::statistics::normal_limit;
use gpu_trace::verify::settings;

use crate::common::images::{Left, assert_uniform, channels, fault, uniform};
use crate::common::{render_gpu, scene};

/// Balls of these materials in an environment of 1.
fn balls(materials: &[&str]) -> Scene {
    let mut text = String::from(
        "[camera]\nposition = [0, 0, 9]\nlook_at = [0, 0, 0]\nfov = 40.0\n[image]\nwidth = 16\nheight = 16\n\
         [environment]\nradiance = [1, 1, 1]\n",
    );
    for (i, material) in materials.iter().enumerate() {
        text += &format!(
            "[material.m{i}]\ntype = \"dielectric\"\n{material}\n\
             [[sphere]]\ncenter = [{}, 0, 0]\nradius = 1\nmaterial = \"m{i}\"\n",
            3 * i
        );
    }
    scene(&text)
}

#[test]
fn presets_have_their_published_indices() {
    // Schott's catalogue, for the helium line d and for blue and red hydrogen (F and C); diamond at the sodium line.
    for (glass, wavelength, index) in [
        (Glass::BK7, 587.6, 1.5168),
        (Glass::BK7, 486.1, 1.522_38),
        (Glass::BK7, 656.3, 1.514_32),
        (Glass::SF10, 587.6, 1.728_28),
        (Glass::SF10, 486.1, 1.746_44),
        (Glass::SF10, 656.3, 1.720_91),
        (Glass::Diamond, 589.3, 2.4175),
        (Glass::Water, 500.0, 1.333),
    ] {
        let found = glass.index().at(wavelength);
        let tolerance = if glass == Glass::Diamond {
            2.0e-3
        } else {
            3.0e-5
        };
        assert!(
            (found - index).abs() < tolerance,
            "{glass:?} at {wavelength}: {found}"
        );
    }
    let flat = Index::Cauchy(DVec2::new(1.5, 0.0));
    assert!(
        !flat.is_dispersive(),
        "what does not disperse is in no kernel"
    );
}

/// A glass ball before a lamp and a floor, looked through and lighting the floor.
fn caustic(glass: &str) -> Scene {
    scene(&format!(
        "[camera]\nposition = [0, 1.0, 5]\nlook_at = [0, 0, 0]\nfov = 36.0\n[image]\nwidth = 16\nheight = 16\n\
         [environment]\nradiance = [0.3, 0.2, 0.1]\n[material.glass]\ntype = \"dielectric\"\n{glass}\n\
         [material.floor]\ntype = \"diffuse\"\nalbedo = [0.5, 0.6, 0.7]\n\
         [material.lamp]\ntype = \"diffuse\"\nalbedo = [0, 0, 0]\nemission = [3, 4, 5]\n\
         [[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = \"glass\"\n\
         [[sphere]]\ncenter = [0, -101, 0]\nradius = 100\nmaterial = \"floor\"\n\
         [[sphere]]\ncenter = [1.0, 2.5, -2.5]\nradius = 0.8\nmaterial = \"lamp\"\n"
    ))
}

#[test]
fn a_constant_index_is_that_of_the_plain_glass_in_the_mean() {
    // Terms so small that nothing but the code differs; smooth and rough, by all integrators, with roulette and
    // without.
    const ALL: usize = 27;
    let limit = normal_limit(ALL);
    let (mut differences, mut failed) = (Vec::new(), Vec::new());
    for rest in ["", "roughness = 0.5", "absorption = [0.3, 0.2, 0.1]"] {
        let [plain, dispersive] = ["ior = 1.6", "cauchy = [1.6, 1e-12]"]
            .map(|index| caustic(&format!("{index}\n{rest}")));
        let base = settings(&plain, 16, 16, 2048);
        let reference = render_gpu(
            &plain,
            &Settings {
                samples: 0..8192,
                ..base.clone()
            },
        );
        let truth = channels(&reference);
        for (integrator, roulette) in [
            (Integrator::Path, None),
            (Integrator::Path, Some(false)),
            (Integrator::Lecture { termination: 0.2 }, None),
        ] {
            let settings = Settings {
                integrator,
                roulette,
                max_bounces: 32,
                samples: 0..8192,
                seed: 5,
                ..base.clone()
            };
            let film = render_gpu(&dispersive, &settings);
            let found = channels(&film);
            for (c, ([found, own], [truth, error])) in found.iter().zip(&truth).enumerate() {
                let both = own.hypot(*error);
                let name = format!("{rest}, {} {roulette:?}, channel {c}", integrator.name());
                eprintln!(
                    "{name}: z = {:.2}, error {:.3} %",
                    (found - truth) / both,
                    100.0 * both / truth
                );
                let z = (found - truth) / both;
                failed.extend(fault(&name, &film, &reference, z.abs() < limit, z));
                differences.push((name, z, 0.03 * truth / both));
            }
        }
    }
    assert_eq!(differences.len(), ALL);
    assert!(failed.is_empty(), "beyond {limit}: {failed:?}");
    // Power: 3 % of the light would be found missing in most of them.
    let found = differences
        .iter()
        .filter(|(.., shift)| *shift > 2.0 * limit);
    assert!(
        4 * found.count() >= 3 * differences.len(),
        "{differences:?}"
    );
}

#[test]
fn a_white_furnace_stays_white_in_the_mean() {
    // Every path brings the weight of its wavelength, whatever the index: the mean is 1.
    let limit = normal_limit(9);
    for glass in [
        "preset = \"SF10\"",
        "preset = \"diamond\"",
        "cauchy = [1.3, 0.01]",
    ] {
        let scene = balls(&[glass]);
        let film = render_gpu(&scene, &settings(&scene, 16, 16, 8192));
        for (c, [mean, error]) in channels(&film).into_iter().enumerate() {
            let z = (mean - 1.0) / error;
            let name = format!("{glass}, channel {c}");
            let what = format!("{mean} +- {error}");
            assert_uniform(&name, &film, 1.0, z.abs() < limit, what);
            assert!(error > 0.0 && 0.01 > 2.0 * limit * error, "power: {error}");
        }
    }
}

/// A lamp seen through a ball.
fn through(glass: &str) -> Film {
    let scene = scene(&format!(
        "[camera]\nposition = [0, 0, 6]\nlook_at = [0, 0, 0]\nfov = 20.0\n[image]\nwidth = 32\nheight = 8\n\
         [material.glass]\ntype = \"dielectric\"\n{glass}\n\
         [material.lamp]\ntype = \"diffuse\"\nalbedo = [0, 0, 0]\nemission = [4, 4, 4]\n\
         [[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = \"glass\"\n\
         [[sphere]]\ncenter = [2.2, 0, -3]\nradius = 0.6\nmaterial = \"lamp\"\n"
    ));
    render_gpu(&scene, &settings(&scene, 32, 8, 8192))
}

/// The mean place along x of each channel's light of the lamp, and its standard error.
fn places(film: &Film) -> [[f64; 2]; 3] {
    std::array::from_fn(|c| {
        let mut sums = [0.0; 2];
        // The lamp itself is seen on the right; the ball turns what is behind it round.
        let left: Vec<usize> = (0..256).filter(|i| i % 32 < 16).collect();
        for i in &left {
            sums[0] += film.mean(*i)[c];
            sums[1] += film.mean(*i)[c] * (i % 32) as f64;
        }
        let place = sums[1] / sums[0];
        let variance = left.iter().map(|i| {
            let spread = (i % 32) as f64 - place;
            film.variance_of_mean(*i).expect("16 batches")[c] * spread * spread
        });
        [place, variance.sum::<f64>().sqrt() / sums[0].abs()]
    })
}

#[test]
fn colours_come_in_their_order() {
    // The index falls with the wavelength: blue is bent most, so that its image is nearest to the axis, on the right.
    for rest in ["", "roughness = 0.15"] {
        let film = through(&format!("preset = \"SF10\"\n{rest}"));
        let _left = Left::alone(format!("colours in their order, {rest}"), &film);
        let [red, green, blue] = places(&film);
        eprintln!("{rest}: {red:?}, {green:?}, {blue:?}");
        // Of the same paths: their errors are no larger than if they were independent.
        let apart = |a: [f64; 2], b: [f64; 2]| (b[0] - a[0]) / a[1].hypot(b[1]);
        assert!(apart(red, blue) > 3.9, "{rest}");
        assert!(red[0] < green[0] && green[0] < blue[0], "{rest}");
        // Companions: the other way round, and not at all.
        let wrong = places(&through(&format!("cauchy = [1.8, -0.03]\n{rest}")));
        assert!(apart(wrong[0], wrong[2]) < -3.9, "{rest}: {wrong:?}");
        let plain = places(&through(&format!("ior = 1.73\n{rest}")));
        assert!(
            plain[0] == plain[1] && plain[1] == plain[2],
            "{rest}: {plain:?}"
        );
    }
}

#[test]
fn no_colour_is_clamped() {
    // Between blue and green red is negative, and stays so: a small lamp whose image the glass draws apart.
    let scene = scene(
        "[camera]\nposition = [0, 0, 6]\nlook_at = [0, 0, 0]\nfov = 20.0\n[image]\nwidth = 96\nheight = 24\n\
         [material.glass]\ntype = \"dielectric\"\ncauchy = [1.3, 0.1]\n\
         [material.lamp]\ntype = \"diffuse\"\nalbedo = [0, 0, 0]\nemission = [4, 4, 4]\n\
         [[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = \"glass\"\n\
         [[sphere]]\ncenter = [0, 1.5, -3]\nradius = 0.1\nmaterial = \"lamp\"\n",
    );
    let film = render_gpu(&scene, &settings(&scene, 96, 24, 2048));
    let _left = Left::alone("colours below 0", &film);
    assert_eq!(film.tally().non_finite, 0);
    let pixels = film.rect().pixels();
    let below = |c: usize| {
        let significant = |i: &usize| {
            let variance = film.variance_of_mean(*i).expect("16 batches")[c];
            film.mean(*i)[c] < -4.0 * variance.sqrt() && variance > 0.0
        };
        (0..pixels).filter(significant).count()
    };
    eprintln!("pixels below 0: {} {} {}", below(0), below(1), below(2));
    assert!(below(0) > 0, "no pixel's red is below 0");
    let sum: DVec3 = (0..pixels).map(|i| DVec3::from(film.mean(i))).sum();
    assert!(
        sum.min_element() > 0.0,
        "and all of the light is not: {sum}"
    );
}

#[test]
fn a_camera_in_glass_begins_with_a_wavelength() {
    // From within, an environment of 1 is n^2 at each wavelength, as bright as its light counts.
    let glass = "cauchy = [1.2, 0.1]";
    let scene = scene(&format!(
        "[camera]\nposition = [0, 0, 0]\nlook_at = [0, 0, 1]\nfov = 20.0\n[image]\nwidth = 16\nheight = 16\n\
         [environment]\nradiance = [1, 1, 1]\n[material.glass]\ntype = \"dielectric\"\n{glass}\n\
         [[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = \"glass\"\n"
    ));
    let MaterialKind::Dielectric(glass) = &scene.materials[0].kind else {
        panic!("glass");
    };
    let index = glass.dispersion().expect("it disperses");
    let steps = 4700;
    let expected: DVec3 = (0..steps)
        .map(|i| {
            let l = 360.0 + (f64::from(i) + 0.5) * 470.0 / f64::from(steps);
            srgb(l) / INTEGRALS * index.at(l).powi(2) * 470.0 / f64::from(steps)
        })
        .sum();
    let film = render_gpu(&scene, &settings(&scene, 16, 16, 4096));
    let wanted = uniform(&film, expected.to_array());
    let _left = Left::of("a camera in glass", &film, &wanted);
    let limit = normal_limit(3);
    for (c, [mean, error]) in channels(&film).into_iter().enumerate() {
        let z = (mean - expected[c]) / error;
        assert!(
            z.abs() < limit,
            "channel {c}: {mean} +- {error} for {}",
            expected[c]
        );
        assert!(
            (0.02 * expected[c] / error).abs() > 2.0 * limit,
            "power: {error}"
        );
    }
}

//! Cases 16 to 21: lights.
//!
//! What light sampling knows of a light is measured function by function, the rest in whole images.
//! Their truth is known exactly, or comes from the same paths in f64.

use super::context::Context;
use super::{Case, sampled};
use crate::error::Result;
use crate::film::Film;
use crate::scene::Scene;
use crate::settings::{Integrator, Settings};
use crate::statistics::normal_limit;
use crate::verify::{Measure, SceneText, ULP, means};

pub(super) const CASES: &[Case] = &[
    Case {
        id: 16,
        name: "a far light, sampled",
        setup: "a light of 1e-8 to 1e-1 of its distance, above, across and on the horizon: solid \
                angle and projected solid angle against f64, directions within the light",
        run: sampled::far,
    },
    Case {
        id: 17,
        name: "a near light, sampled",
        setup: "a light at 1 + e radii, e = 1e-7 to 1e-1: solid angle and projected solid angle \
                within 1e-6/sqrt(2 e) of f64, or left to BSDF sampling below f32's resolution; walls of \
                radius 1e3 to 1e8 from 1e-6 to 10 above them, as well as f32 knows the height",
        run: sampled::near,
    },
    Case {
        id: 18,
        name: "inside a light",
        setup: "camera and diffuse balls inside an emitting sphere, radius 1e-5 to 1e6: every \
                direction hits, the furnace has its exact radiance, and over black walls no pixel \
                is off the same paths in f64 by more than one sample",
        run: inside,
    },
    Case {
        id: 19,
        name: "a light does not light itself",
        setup: "an emitter alone, radius 1e-5 to 1e6, diffuse, mirror and reflective, from 0.001 \
                to 3 radii away: every sample is exactly its emission or 0",
        run: itself,
    },
    Case {
        id: 20,
        name: "two strategies for one light",
        setup: "a lamp over a floor, radius 1e-5 to 1e6: no sample is blocked by the light's own \
                limb; a lamp in a diffuse hollow sphere: both strategies together, and light \
                sampling alone, give the exact radiance",
        run: sampled::strategies,
    },
    Case {
        id: 21,
        name: "bright beside dim",
        setup: "emission 2^20 beside 2^-20: each side bit for bit its image at emission 1, scaled, \
                and within its own error of f64; all times 2^66 and 2^-66: the mean scales by \
                2^k and its variance by 4^k, exactly",
        run: bright_and_dim,
    },
];

/// Half the height of the image plane at distance 1, for the field of view of [`SceneText`].
const HALF_HEIGHT: f64 = 0.324_919_696_232_906_3;

/// What a scene's lengths are multiplied by.
const RADII: [f64; 5] = [1.0e-5, 1.0e-3, 1.0, 1.0e3, 1.0e6];

/// Pixels along the sides of these images.
const SIDE: u32 = 16;

/// The sine of the angle to the view axis at (x, y) of an image of `side` pixels.
pub(super) fn sine(side: u32, x: f64, y: f64) -> f64 {
    let film = |at: f64| (2.0 * at / f64::from(side) - 1.0) * HALF_HEIGHT;
    let square = film(x).powi(2) + film(y).powi(2);
    (square / (1.0 + square)).sqrt()
}

/// The least and the largest in pixel `i`; the axis is on the corners of pixels.
fn sines(i: usize) -> [f64; 2] {
    let (x, y) = (i % SIDE as usize, i / SIDE as usize);
    let corners = [(0, 0), (0, 1), (1, 0), (1, 1)];
    let at = |(dx, dy): (usize, usize)| sine(SIDE, (x + dx) as f64, (y + dy) as f64);
    [
        corners.map(at).into_iter().fold(f64::INFINITY, f64::min),
        corners.map(at).into_iter().fold(0.0, f64::max),
    ]
}

fn inside(context: &Context) -> Result<Measure> {
    let mut measure = Measure::new(1.0, "of the bound");
    for &radius in context.size(&[1.0e-5, 1.0, 1.0e6][..], &RADII) {
        furnace(context, radius, &mut measure)?;
    }
    contrast(context, &mut measure)?;
    Ok(measure)
}

/// A camera in a hollow sphere with two balls, one of which almost touches the wall.
fn hollow(radius: f64) -> SceneText {
    let at = |v: [f64; 3]| v.map(|x| x * radius);
    let near = 1.0 - 0.05 - 1.0e-6;
    SceneText::new(at([0.3, -0.2, 0.1]), at([0.1, 1.0, 0.1]))
        .sphere([0.0; 3], radius, "wall")
        .sphere(at([0.1, 0.6, 0.2]), 0.2 * radius, "ball")
        .sphere(at([0.0, near, 0.0]), 0.05 * radius, "ball")
}

/// Wall and balls alike: after N events the radiance is (1 - albedo^(N + 1))/(1 - albedo) times the
/// emission, without any variance.
fn furnace(context: &Context, radius: f64, measure: &mut Measure) -> Result<()> {
    const BOUNCES: u32 = 16;
    let albedo = 0.7;
    let scene = hollow(radius)
        .diffuse("wall", albedo, 1.0)
        .diffuse("ball", albedo, 1.0)
        .load()?;
    // BSDF sampling, in which every direction hits: with light sampling the balls, which emit as well,
    // would be found in two ways, whose sum has a variance.
    let settings = Settings {
        integrator: Integrator::Bsdf,
        roulette: Some(false),
        max_bounces: BOUNCES,
        ..context.settings(&scene, SIDE, 16)
    };
    let film = context.render(&scene, &settings)?;
    let albedo = f64::from(albedo as f32);
    let exact: f64 = (0..=BOUNCES).map(|n| albedo.powi(n as i32)).sum();
    let truth = exact * context.disturbed(1.0e-4);
    // A rounding an event for the throughput, and one for the sum.
    let bound = 2.0 * f64::from(BOUNCES) * ULP;
    for (i, mean) in means(&film).iter().enumerate() {
        measure.add((mean / truth - 1.0).abs() / bound, || {
            format!("radius {radius:e}, value {i}: {mean} for {truth}")
        });
    }
    let rays = film.rect().pixels() as u64 * 16 * u64::from(BOUNCES + 1);
    let found = film.tally().rays;
    // A path that misses everything is short.
    measure.add(if found == rays { 0.0 } else { f64::INFINITY }, || {
        format!("radius {radius:e}: {found} rays for {rays}")
    });
    Ok(())
}

/// Diffuse balls that do not emit, in black emitting walls. A sample is 1, or a power of the albedo
/// 0.5 by how often the path met a ball; at a silhouette, within some 1e-6 of it, f32 may say
/// either, which moves a pixel by one sample.
fn contrast(context: &Context, measure: &mut Measure) -> Result<()> {
    let spp = context.size(16, 64);
    for &radius in context.size(&[1.0][..], &[1.0e-3, 1.0, 1.0e3]) {
        let scene = hollow(radius)
            .diffuse("wall", 0.0, 1.0)
            .diffuse("ball", 0.5, 0.0)
            .load()?;
        let settings = Settings {
            roulette: Some(false),
            ..context.settings(&scene, SIDE, spp)
        };
        let film = means(&context.render(&scene, &settings)?);
        let reference = means(&context.reference(&scene, &settings)?);
        let bound = 0.5 / spp as f64 + 1.0e-6;
        for (i, (mean, truth)) in film.iter().zip(&reference).enumerate() {
            let truth = truth * context.disturbed(0.2);
            measure.add((mean - truth).abs() / bound, || {
                format!("black walls, radius {radius:e}, value {i}: {mean} for {truth}")
            });
        }
    }
    Ok(())
}

/// Members of a material that emits 1 and reflects, by number.
fn emitter(text: SceneText, number: usize) -> SceneText {
    let emission = "emission = [1, 1, 1]";
    match number {
        0 => text.diffuse("lamp", 0.75, 1.0),
        1 => text.material(
            "lamp",
            &format!("type = \"mirror\"\nreflectance = [0.75, 0.75, 0.75]\n{emission}"),
        ),
        _ => text.material(
            "lamp",
            &format!(
                "type = \"reflective\"\nalbedo = [0.375, 0.375, 0.375]\n\
                 specular = [0.5, 0.5, 0.5]\nepsilon = 0.01\nmu = 10.0\n{emission}"
            ),
        ),
    }
}

fn itself(context: &Context) -> Result<Measure> {
    let mut measure = Measure::new(0.0, "off the emission");
    for (i, radius) in RADII.into_iter().enumerate() {
        for number in 0..3 {
            if !context.options.quick || number == i % 3 {
                alone(context, radius, number, &mut measure)?;
            }
        }
    }
    Ok(measure)
}

/// One emitter and nothing else: samples are sums of powers of two below 2^24, and so exact.
fn alone(context: &Context, radius: f64, number: usize, measure: &mut Measure) -> Result<()> {
    // The sphere fills the image, is seen with its silhouette, or is a floor.
    let distance = [2.0, 4.0, 1.001][number];
    let text = SceneText::new([0.0, 0.0, distance * radius], [0.0; 3]);
    let scene = emitter(text, number)
        .sphere([0.0; 3], radius, "lamp")
        .load()?;
    let spp = 64;
    let film = context.render(&scene, &context.settings(&scene, SIDE, spp))?;
    for i in 0..film.rect().pixels() {
        let mean = film.mean(i)[0];
        let [nearest, farthest] = sines(i).map(|sine| distance * sine);
        // f32 knows the silhouette much better than to 1e-3.
        let truth = if farthest < 0.999 {
            context.disturbed(1.0e-3)
        } else if nearest > 1.001 {
            0.0
        } else {
            // Some samples hit: a whole number, and not all may be beyond.
            (mean * spp as f64).round().min(spp as f64) / spp as f64
        };
        measure.add((mean - truth).abs(), || {
            format!("radius {radius:e} from {distance} radii, pixel {i}: {mean} for {truth}")
        });
    }
    Ok(())
}

/// On either side of a black sphere, which hides one from the other, a lamp over a diffuse ball;
/// emissions on the left and on the right.
fn two_sides(context: &Context, emissions: [f64; 2]) -> Result<(Scene, Settings)> {
    let mut text = SceneText::new([0.0, 0.0, 20.0], [0.0; 3])
        .diffuse("black", 0.0, 0.0)
        .diffuse("gray", 0.5, 0.0)
        .sphere([0.0; 3], 3.0, "black");
    for (name, emission, x) in [("left", emissions[0], -4.5), ("right", emissions[1], 4.5)] {
        text = text
            .diffuse(name, 0.0, emission)
            .sphere([x, 1.2, 0.0], 0.8, name)
            .sphere([x, -0.8, 0.0], 1.1, "gray");
    }
    let scene = text.load()?;
    // Which light is sampled depends on how strong the others are: only by BSDF sampling do the paths
    // not know of it.
    let settings = Settings {
        integrator: Integrator::Bsdf,
        ..context.settings(&scene, SIDE, context.size(64, 256))
    };
    Ok((scene, settings))
}

fn bright_and_dim(context: &Context) -> Result<Measure> {
    let mut measure = Measure::new(1.0, "of the bound");
    let (scene, settings) = two_sides(context, [1.0, 1.0])?;
    let plain = context.render(&scene, &settings)?;
    for exponents in [[20, -20], [-66, -66], [66, 66]] {
        let (scene, settings) = two_sides(context, exponents.map(|k| 2f64.powi(k)))?;
        let film = context.render(&scene, &settings)?;
        scaled(context, &plain, &film, exponents, &mut measure);
        if exponents[0] != exponents[1] {
            let reference = context.reference(&scene, &settings)?;
            within_errors(context, &film, &reference, &mut measure);
        }
    }
    Ok(measure)
}

/// The power of two of the side of pixel `i`.
fn power(exponents: [i32; 2], i: usize) -> f64 {
    let right = i % SIDE as usize >= SIDE as usize / 2;
    2f64.powi(exponents[usize::from(right)])
}

/// A power of two goes through every product and sum without a rounding, and the paths do not know
/// of it: means and variances must scale bit for bit.
fn scaled(
    context: &Context,
    plain: &Film,
    film: &Film,
    exponents: [i32; 2],
    measure: &mut Measure,
) {
    for i in 0..film.rect().pixels() {
        let factor = power(exponents, i) * context.disturbed(1.0e-3);
        let mut same = |what: &str, value: f64, truth: f64| {
            let error = if value == truth { 0.0 } else { f64::INFINITY };
            measure.add(error, || {
                format!("2^{exponents:?}, pixel {i}: {what} {value:e} for {truth:e}")
            });
        };
        same("mean", film.mean(i)[0], plain.mean(i)[0] * factor);
        let variance = |film: &Film| film.variance_of_mean(i).map_or(f64::NAN, |v| v[0]);
        same(
            "variance",
            variance(film),
            variance(plain) * factor * factor,
        );
    }
}

/// Every pixel within its own estimated error of the f64 image, and without any error the same.
fn within_errors(context: &Context, film: &Film, reference: &Film, measure: &mut Measure) {
    let pixels = film.rect().pixels();
    let limit = normal_limit(pixels);
    for i in 0..pixels {
        let (mean, truth) = (
            film.mean(i)[0],
            reference.mean(i)[0] * context.disturbed(0.2),
        );
        let variance = film.variance_of_mean(i).map_or(f64::NAN, |v| v[0]);
        // A few events of a few roundings each.
        let bound = limit * variance.sqrt() + 64.0 * ULP * truth;
        let error = if mean == truth {
            0.0
        } else {
            (mean - truth).abs() / bound
        };
        measure.add(error, || {
            format!("pixel {i}: {mean:e} for {truth:e}, variance {variance:e}")
        });
    }
}

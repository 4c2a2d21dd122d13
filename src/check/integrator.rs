//! Cases 29 to 31 and 38: light transport whose outcome is known.

use super::Case;
use super::context::Context;
use super::film::must;
use crate::error::Result;
use crate::film::Film;
use crate::scene::Scene;
use crate::settings::{Integrator, Settings};
use crate::statistics::mean_and_error;
use crate::verify::{Measure, SceneText, means};

pub(super) const CASES: &[Case] = &[
    Case {
        id: 29,
        name: "closed furnaces",
        setup: "inside a diffuse sphere of albedo 0.5 to 1 and radius 1e-6 to 1e6 that emits 1, no \
                roulette: the partial sum of the albedo's powers, in units of 2 N u, and no ray misses",
        run: furnaces,
    },
    Case {
        id: 30,
        name: "roulette",
        setup: "on and off have the same mean (3.9 standard errors); a path's weight is 0 or in \
                [1/4, 1]; what loses no light does not die",
        run: roulette,
    },
    Case {
        id: 31,
        name: "extreme emission, throughput and size",
        setup: "emission 1e20, radius 1e20 and 1e-20, 10000 bounces without loss, ior 0.1 to 10, \
                lobes down to 1e-20: no sample that is not finite, and known furnaces hold",
        run: extremes,
    },
    Case {
        id: 38,
        name: "a light inside a glass ball",
        setup: "an emitter of n^2 times the environment's radiance in glass, radius 1e-3 to 1e3: it \
                cannot be seen from outside or inside, in units of 64 u",
        run: light_in_glass,
    },
];

/// Unit roundoff of f32.
const U: f64 = 1.0 / (1 << 24) as f64;

/// The camera in a closed diffuse sphere.
pub(super) fn closed(albedo: f64, emission: f64, radius: f64) -> SceneText {
    let [x, y, z] = [0.3, -0.2, 0.1].map(|x| x * radius);
    SceneText::new([x, y, z], [z, radius, x])
        .diffuse("wall", albedo, emission)
        .sphere([0.0; 3], radius, "wall")
}

/// Radiance in a closed sphere that emits 1 after at most `bounces` scattering events, by the albedo
/// that the kernel has.
fn furnace(albedo: f64, bounces: u32) -> f64 {
    let albedo = f64::from(albedo as f32);
    (0..=bounces).rev().fold(0.0, |sum, _| 1.0 + albedo * sum)
}

/// The error of an f32 sum of it: a rounding an event for the throughput, one for the sum.
fn furnace_error(bounces: u32) -> f64 {
    2.0 * f64::from(bounces.max(1)) * U
}

fn furnaces(context: &Context) -> Result<Measure> {
    let mut all = vec![(0.5, 1.0e-6), (0.9, 1.0), (0.999, 1.0e6), (1.0, 1.0)];
    if !context.options.quick {
        let radii = [1.0e-6, 1.0e-3, 1.0, 7.0, 1.0e3, 1.0e6];
        let of_radius = |r| [0.5, 0.9, 0.999, 1.0].map(|albedo| (albedo, r));
        all = radii.into_iter().flat_map(of_radius).collect();
    }
    let mut measure = Measure::new(1.0, "of 2 N u");
    for (albedo, radius) in all {
        let scene = closed(albedo, 1.0, radius).load()?;
        let settings = Settings {
            roulette: Some(false),
            ..context.settings(&scene, 8, 8)
        };
        let film = context.render(&scene, &settings)?;
        let bounces = settings.max_bounces;
        let truth = furnace(albedo, bounces) * context.disturbed(1.0e-3);
        for mean in means(&film) {
            measure.add((mean / truth - 1.0).abs() / furnace_error(bounces), || {
                format!("albedo {albedo}, radius {radius:e}: {mean} for {truth}")
            });
        }
        // Every path goes on to the limit.
        let paths = settings.crop.pixels() as u64 * film.samples();
        let (rays, wanted) = (film.tally().rays, paths * u64::from(bounces + 1));
        must(&mut measure, rays == wanted, || {
            format!("albedo {albedo}, radius {radius:e}: {rays} rays instead of {wanted}")
        });
    }
    Ok(measure)
}

/// A gray scene where roulette matters: glass and a lamp over a dark floor.
fn gray() -> Result<Scene> {
    SceneText::new([0.0, 0.0, 4.0], [0.0, 0.0, 0.0])
        .environment(0.5)
        .diffuse("floor", 0.4, 0.0)
        .diffuse("lamp", 0.3, 2.0)
        .dielectric("glass", 1.5)
        .sphere([0.0, -1001.0, 0.0], 1000.0, "floor")
        .sphere([0.7, -0.5, 0.0], 0.5, "lamp")
        .sphere([-0.5, -0.4, 0.3], 0.6, "glass")
        .load()
}

fn roulette(context: &Context) -> Result<Measure> {
    let mut measure = Measure::new(3.9, "standard errors");
    for scene in [closed(0.5, 1.0, 1.0).load()?, gray()?] {
        let on = Settings {
            ..context.settings(&scene, 32, context.size(64, 1024))
        };
        // Other samples, so that the two are independent.
        let off = Settings {
            roulette: Some(false),
            seed: 1,
            ..on.clone()
        };
        let (on, off) = (context.render(&scene, &on)?, context.render(&scene, &off)?);
        let factor = context.disturbed(0.1);
        let differences: Vec<f64> = (0..on.rect().pixels())
            .map(|i| factor * on.mean(i)[0] - off.mean(i)[0])
            .collect();
        let (mean, error) = mean_and_error(&differences);
        measure.add((mean / error).abs(), || {
            format!("{:?}: {mean:.2e} +- {error:.1e} apart", first_kind(&scene))
        });
    }
    for albedo in context.size(&[0.3, 0.8][..], &[0.1, 0.3, 0.5, 0.8, 0.95][..]) {
        weights(context, *albedo, &mut measure)?;
    }
    lossless(context, &mut measure)?;
    Ok(measure)
}

/// What tells the scenes of this file apart.
fn first_kind(scene: &Scene) -> &str {
    scene.materials.first().map_or("", |m| m.name.as_str())
}

/// A black lamp of radiance 1 in a dark closed sphere: one sample is the weight with which its path
/// came to the lamp, or 0. Roulette ends a path of weight w below 1/4 with 1 - 4 w, else makes it 1/4.
fn weights(context: &Context, albedo: f64, measure: &mut Measure) -> Result<()> {
    let scene = SceneText::new([0.8, 0.0, 0.0], [0.0, 0.8, 0.3])
        .diffuse("wall", albedo, 0.0)
        .diffuse("lamp", 0.0, 1.0)
        .sphere([0.0; 3], 1.0, "wall")
        .sphere([0.0; 3], 0.4, "lamp")
        .load()?;
    // With light sampling, a sample would be a sum over the vertices of its path.
    let settings = Settings {
        integrator: Integrator::Bsdf,
        ..context.settings(&scene, 64, 1)
    };
    let film = context.render(&scene, &settings)?;
    let least = 0.25 * context.disturbed(0.5);
    // The product of the albedos and one division: less than a hundred roundings.
    let slack = 100.0 * U;
    let values = means(&film);
    for w in &values {
        let allowed = *w == 0.0 || (least * (1.0 - slack)..=1.0).contains(w);
        must(measure, allowed, || format!("albedo {albedo}: weight {w}"));
    }
    let seen = values.iter().any(|w| *w > 0.0);
    must(measure, seen, || {
        format!("albedo {albedo}: no path arrives")
    });
    Ok(())
}

/// A closed sphere that reflects everything: every path goes on to the limit.
fn lossless(context: &Context, measure: &mut Measure) -> Result<()> {
    let scene = closed(context.disturbed(-0.01), 1.0, 1.0).load()?;
    let settings = Settings {
        max_bounces: 200,
        ..context.settings(&scene, 8, 8)
    };
    let film = context.render(&scene, &settings)?;
    let (rays, wanted) = (film.tally().rays, 64 * 8 * 201);
    must(measure, rays == wanted, || {
        format!("lossless: {rays} rays instead of {wanted}")
    });
    Ok(())
}

/// Counts samples that are not finite, and pixels that are not, or not what is known.
fn sound(film: &Film, known: Option<(f64, f64)>, name: &str, measure: &mut Measure) {
    let tally = film.tally();
    let samples = film.samples() * film.rect().pixels() as u64;
    let wrong = |mean: &f64| {
        let off = known.map_or(0.0, |(truth, error)| (mean / truth - 1.0).abs() - error);
        !(mean.is_finite() && *mean >= 0.0 && off <= 0.0)
    };
    let values = means(film);
    let failures = values.iter().filter(|m| wrong(m)).count() as u64;
    let dark = values.iter().all(|m| *m == 0.0);
    measure.count(samples, tally.non_finite, || {
        format!("{name}: first {:?}", tally.first_non_finite)
    });
    measure.count(values.len() as u64, failures + u64::from(dark), || {
        let shown = values.iter().find(|m| wrong(m));
        format!("{name}: a pixel is {shown:?}, known {known:?}")
    });
}

fn extremes(context: &Context) -> Result<Measure> {
    let mut measure = Measure::new(0.0, "samples or values");
    let mut known = vec![
        ("emission 1e20, 10000 bounces", 1.0, 1.0e20, 1.0, 10_000),
        ("radius 1e20", 0.5, 1.0, 1.0e20, 64),
        ("radius 1e-20", 0.5, 1.0, 1.0e-20, 64),
    ];
    if !context.options.quick {
        known.extend([
            ("emission 1e-20", 0.999, 1.0e-20, 1.0, 64),
            ("emission 1e20 in radius 1e20", 0.999, 1.0e20, 1.0e20, 64),
            ("emission 1e20 in radius 1e-20", 0.999, 1.0e20, 1.0e-20, 64),
        ]);
    }
    for (name, albedo, emission, radius, bounces) in known {
        let scene = closed(albedo, emission, radius).load()?;
        let settings = Settings {
            max_bounces: bounces,
            roulette: Some(false),
            ..context.settings(&scene, 2, 4)
        };
        let film = context.render(&scene, &settings)?;
        let truth = context.disturbed(0.1) * furnace(albedo, bounces) * emission;
        // Emission has a rounding of its own.
        let error = furnace_error(bounces) + U;
        sound(&film, Some((truth, error)), name, &mut measure);
    }
    for (name, scene) in zoos(context)? {
        let film = context.render(&scene, &context.settings(&scene, 16, 8))?;
        sound(&film, None, name, &mut measure);
    }
    Ok(measure)
}

/// Spheres of extreme materials around a lamp of 1e20, in an environment of 1e20. f64 has no digits
/// for a camera beside a ball of radius 1e20: that is for furnaces, and here the ground has 1e12.
fn zoos(context: &Context) -> Result<Vec<(&'static str, Scene)>> {
    let base = || {
        SceneText::new([0.0, 0.0, 4.0], [0.0, 0.0, 0.0])
            .environment(1.0e20)
            .diffuse("lamp", 1.0, 1.0e20)
            .sphere([0.0, 1.2, 0.0], 0.5, "lamp")
    };
    // The disturbance: a lobe that makes 1e20 times 1e20 of the light.
    let mu = if context.options.disturb {
        1.0e20
    } else {
        1.0e19
    };
    let epsilon = if context.options.disturb {
        1.0e-2
    } else {
        1.0e-20
    };
    let lobe = |epsilon: f64, mu: f64| {
        format!(
            "type = \"reflective\"\nalbedo = [0.3, 0.3, 0.3]\nspecular = [1, 1, 1]\n\
             epsilon = {epsilon:?}\nmu = {mu:?}"
        )
    };
    let reflective = base()
        .material("needle", &lobe(epsilon, mu))
        .material("narrow", &lobe(1.0e-7, 1.0e6))
        .material("wide", &lobe(1.0, 0.2))
        .sphere([-0.8, 0.0, 0.0], 0.5, "needle")
        .sphere([0.8, 0.0, 0.0], 0.5, "narrow")
        .sphere([0.0, -1.0 - 1.0e12, 0.0], 1.0e12, "wide")
        .load()?;
    let glass = base()
        .dielectric("dense", 10.0)
        .dielectric("thin", 0.1)
        .dielectric("above", 1.0001)
        .dielectric("below", 0.9999)
        .dielectric("none", 1.0)
        .sphere([-0.8, 0.0, 0.0], 0.5, "dense")
        .sphere([0.8, 0.0, 0.0], 0.5, "thin")
        .sphere([0.0, 0.0, 0.5], 0.3, "above")
        .sphere([0.0, -0.8, 0.0], 0.3, "below")
        .sphere([0.0, 0.0, 2.0], 0.1, "none")
        .load()?;
    Ok(vec![("reflective", reflective), ("glass", glass)])
}

/// A ball of glass in an environment of 1, a black lamp in it, the camera on the axis.
fn lamp_in_glass(radius: f64, ior: f64, camera: f64, emission: f64) -> SceneText {
    let at = |z: f64| [0.0, 0.0, z * radius];
    SceneText::new(at(camera), at(-9.0))
        .environment(1.0)
        .dielectric("glass", ior)
        .diffuse("lamp", 0.0, emission)
        .sphere([0.0; 3], radius, "glass")
        .sphere(at(-0.5), 0.2 * radius, "lamp")
}

fn light_in_glass(context: &Context) -> Result<Measure> {
    const OUTSIDE: f64 = 4.0;
    // From here the wall is never beyond the critical angle, up to an index of 3.
    const INSIDE: f64 = 0.3;
    let mut all = vec![
        (1.0, 1.5, OUTSIDE),
        (1.0e-3, 2.4, OUTSIDE),
        (1.0e3, 1.33, INSIDE),
    ];
    if !context.options.quick {
        let of_radius = |r: f64| {
            let of_ior = move |n: f64| [(r, n, OUTSIDE), (r, n, INSIDE)];
            [0.7, 1.0001, 1.5, 2.4].into_iter().flat_map(of_ior)
        };
        all = [1.0e-3, 1.0, 1.0e3]
            .into_iter()
            .flat_map(of_radius)
            .collect();
    }
    let mut measure = Measure::new(1.0, "of 64 u");
    for (radius, ior, camera) in all {
        let square = ior * ior;
        let emission = square * context.disturbed(0.1);
        let scene = lamp_in_glass(radius, ior, camera, emission).load()?;
        let settings = Settings {
            // Grazing paths are in the glass for long.
            max_bounces: 1000,
            ..context.settings(&scene, 16, 64)
        };
        let film = context.render(&scene, &settings)?;
        let truth = if camera == INSIDE { square } else { 1.0 };
        // The surface is crossed at most twice, with weights of 1 between: each time two divisions
        // (5 u), two products and the error of a rounded index twice, 20 u; then the emission, and
        // the sums of a block.
        for mean in means(&film) {
            measure.add((mean / truth - 1.0).abs() / (64.0 * U), || {
                format!("radius {radius:e}, ior {ior}, camera at {camera}: {mean} for {truth}")
            });
        }
    }
    Ok(measure)
}

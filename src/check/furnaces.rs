//! Case 26: white furnaces.

use std::f64::consts::PI;

use super::Case;
use super::context::Context;
use super::lights::sine;
use crate::error::Result;
use crate::settings::Settings;
use crate::statistics::normal_limit;
use crate::verify::{Measure, SceneText, ULP, means};

pub(super) const CASES: &[Case] = &[Case {
    id: 26,
    name: "white furnaces",
    setup: "radius 1e-5 to 1e6 in a constant environment: lossless diffuse, mirror and glass \
            balls vanish to 1e-3 in every pixel, a diffuse one shows its albedo, the \
            reflective one its albedo by formula, by z-test",
    run: furnaces,
}];

/// Pixels along the sides of these images.
const SIDE: u32 = 16;

fn furnaces(context: &Context) -> Result<Measure> {
    let mut measure = Measure::new(1.0, "of the bound");
    let radii: &[f64] = context.size(
        &[1.0e-5, 1.0, 1.0e6],
        &[1.0e-5, 1.0e-3, 0.1, 1.0, 50.0, 1.0e3, 1.0e6],
    );
    for &radius in radii {
        white(context, radius, &mut measure)?;
    }
    for &radius in context.size(&[1.0][..], &[1.0e-5, 1.0, 1.0e6]) {
        gray(context, radius, &mut measure)?;
        lossy(context, radius, &mut measure)?;
    }
    Ok(measure)
}

/// Three lossless balls. A path that is lost or counted twice moves a pixel by 1/64, the roundings
/// of a path by less than 6e-5 (64 events of 16 halves of an ulp): 1e-3 lies between.
fn white(context: &Context, radius: f64, measure: &mut Measure) -> Result<()> {
    // Disturbed, the mirror loses a little.
    let reflectance = 2.0 - context.disturbed(1.0e-2);
    let at = |x: f64, y: f64| [x * radius, y * radius, 0.0];
    let scene = SceneText::new([0.0, 0.0, 8.0 * radius], [0.0; 3])
        .environment(1.0)
        .diffuse("chalk", 1.0, 0.0)
        .material(
            "mirror",
            &format!("type = \"mirror\"\nreflectance = {:?}", [reflectance; 3]),
        )
        .dielectric("glass", 1.5)
        .sphere(at(-1.15, 0.9), radius, "chalk")
        .sphere(at(1.15, 0.9), radius, "mirror")
        .sphere(at(0.0, -1.15), radius, "glass")
        .load()?;
    let settings = Settings {
        // Near grazing incidence light stays in glass for a while.
        max_bounces: 1024,
        ..context.settings(&scene, 2 * SIDE, 64)
    };
    let film = context.render(&scene, &settings)?;
    for (i, mean) in means(&film).iter().enumerate() {
        measure.add((mean - 1.0).abs() / 1.0e-3, || {
            format!("lossless, radius {radius:e}, value {i}: {mean}")
        });
    }
    Ok(())
}

/// A ball of albedo 0.7 that fills the image: a sample is one product.
fn gray(context: &Context, radius: f64, measure: &mut Measure) -> Result<()> {
    let scene = SceneText::new([0.0, 0.0, 2.0 * radius], [0.0; 3])
        .environment(1.0)
        .diffuse("gray", 0.7, 0.0)
        .sphere([0.0; 3], radius, "gray")
        .load()?;
    let film = context.render(&scene, &context.settings(&scene, SIDE, 16))?;
    let truth = f64::from(0.7f32) * context.disturbed(1.0e-4);
    for (i, mean) in means(&film).iter().enumerate() {
        // The product, and the sums of a block.
        measure.add((mean / truth - 1.0).abs() / (4.0 * ULP), || {
            format!("albedo 0.7, radius {radius:e}, value {i}: {mean}")
        });
    }
    Ok(())
}

/// The reflective material: albedo + mu pi (2 epsilon - epsilon^2) cos(theta), theta being the
/// angle at the camera's side, where the lobe is above the horizon; a ball that fills the image up
/// to 57 degrees.
fn lossy(context: &Context, radius: f64, measure: &mut Measure) -> Result<()> {
    let members = "type = \"reflective\"\nalbedo = [0.37, 0.37, 0.37]\nspecular = [1, 1, 1]\n\
                   epsilon = 0.01\nmu = 10.0";
    let scene = SceneText::new([0.0, 0.0, 2.0 * radius], [0.0; 3])
        .environment(1.0)
        .material("glossy", members)
        .sphere([0.0; 3], radius, "glossy")
        .load()?;
    let film = context.render(&scene, &context.settings(&scene, SIDE, 256))?;
    let pixels = film.rect().pixels();
    let lobe = 10.0 * PI * 0.01 * 1.99;
    let (mut sum, mut variances) = (0.0, 0.0);
    let limit = normal_limit(pixels + 1);
    for i in 0..pixels {
        let truth = (0.37 + lobe * mean_cosine(i)) * context.disturbed(0.03);
        let (mean, variance) = (film.mean(i)[0], film.variance_of_mean(i));
        let variance = variance.map_or(f64::NAN, |v| v[0]);
        sum += mean - truth;
        variances += variance;
        measure.add((mean - truth).abs() / variance.sqrt() / limit, || {
            format!("reflective, radius {radius:e}, pixel {i}: {mean} for {truth}")
        });
    }
    measure.add(sum.abs() / variances.sqrt() / limit, || {
        format!("reflective, radius {radius:e}: sum of all pixels off by {sum}")
    });
    Ok(())
}

/// The cosine at the surface of a ball at two radii, averaged over pixel `i`.
fn mean_cosine(i: usize) -> f64 {
    const STEPS: usize = 4;
    let (x, y) = ((i % SIDE as usize) as f64, (i / SIDE as usize) as f64);
    let place = |k: usize| (k as f64 + 0.5) / STEPS as f64;
    let cosines = (0..STEPS * STEPS).map(|k| {
        let impact = 2.0 * sine(SIDE, x + place(k % STEPS), y + place(k / STEPS));
        (1.0 - impact * impact).sqrt()
    });
    cosines.sum::<f64>() / (STEPS * STEPS) as f64
}

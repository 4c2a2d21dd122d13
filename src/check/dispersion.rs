//! Case 43: what a path takes up in dispersive glass.

use super::Case;
use super::context::Context;
use crate::effects::Effects;
use crate::error::Result;
use crate::gpu::probe::Probe;
use crate::placement::Placement;
use crate::sampling::spectrum::{sample_wavelength, srgb};
use crate::scene::Scene;
use crate::settings::Settings;
use crate::verify::{Measure, Random, Row, SceneText, ULP, vector};

pub(super) const CASES: &[Case] = &[Case {
    id: 43,
    name: "wavelengths and their indices",
    setup: "the wavelength that a path keeps, its weights for red, green and blue, and the indices of Sellmeier's and Cauchy's \
            glasses from 360 to 830 nm, those of f64 in units of their bounds",
    run: dispersion,
}];

/// By presets and by coefficients, one of them constant.
const GLASSES: [&str; 6] = [
    "preset = \"BK7\"",
    "preset = \"SF10\"",
    "preset = \"diamond\"",
    "preset = \"water\"",
    "cauchy = [1.5, 0.005]",
    "sellmeier = { b = [1.0, 0.2, 0.0], c = [0.01, -0.02, 0.3] }",
];

/// A ball of each.
fn balls() -> Result<Scene> {
    let mut text = SceneText::new([0.0, 0.0, 9.0], [0.0; 3]).environment(1.0);
    for (i, glass) in GLASSES.iter().enumerate() {
        let name = format!("glass{i}");
        text = text
            .material(&name, &format!("type = \"dielectric\"\n{glass}"))
            .sphere([3.0 * i as f64, 0.0, 0.0], 1.0, &name);
    }
    text.load()
}

fn dispersion(context: &Context) -> Result<Measure> {
    let scene = balls()?;
    let settings = Settings::for_scene(&scene);
    let placement = Placement::new(&scene, settings.width, settings.height);
    let effects = Effects::derive(&scene, &placement, &settings);
    let probe = Probe::new(&context.gpu, &scene, &placement, &effects);
    let mut measure = Measure::new(1.0, "of the bound");
    wavelengths(context, &probe, &mut measure)?;
    indices(context, &scene, &probe, &mut measure)?;
    Ok(measure)
}

fn wavelengths(context: &Context, probe: &Probe, measure: &mut Measure) -> Result<()> {
    let mut random = Random::new("wavelengths");
    let count = context.size(20_000, 200_000);
    let inputs: Vec<Row> = (0..count).map(|_| random.unit4()).collect();
    let outputs: Vec<Row> = probe.call("sample_wavelength", &inputs)?;
    let shift = context.disturbed(1.0e-3) - 1.0;
    for (input, output) in inputs.iter().zip(&outputs) {
        let twin = sample_wavelength(f64::from(input[0]) + shift);
        let place = || format!("{input:?}: {output:?} for {twin:?}");
        // The logarithm is within 2^-21 or 3 ulp, 69 nm a unit; l itself is rounded.
        let off = 69.4 * (2f64.powi(-21) + 8.0 * 4.3 * ULP) + 830.0 * ULP;
        measure.add((f64::from(output[3]) - twin.wavelength).abs() / off, place);
        // The weight changes by that, and has the roundings of three products of sums.
        let [before, after] =
            [-off, off].map(|off| srgb(twin.wavelength + off) / srgb(twin.wavelength));
        let slope = (before - 1.0).abs().max((after - 1.0).abs()) * twin.weight.abs();
        let bound = slope.max_element() + 64.0 * ULP * 8.0;
        let error = (vector(*output) - twin.weight).abs().max_element();
        measure.add(error / bound, place);
    }
    Ok(())
}

fn indices(context: &Context, scene: &Scene, probe: &Probe, measure: &mut Measure) -> Result<()> {
    let mut random = Random::new("indices");
    let inputs: Vec<[[u32; 4]; 2]> = (0..context.size(20_000, 200_000))
        .map(|i| {
            let wavelength = random.range(360.0, 830.0) as f32;
            [
                [0, 0, 0, (i % GLASSES.len()) as u32],
                [wavelength.to_bits(), 0, 0, 0],
            ]
        })
        .collect();
    let outputs: Vec<Row> = probe.call("index_at", &inputs)?;
    for ([place, wavelength], output) in inputs.iter().zip(&outputs) {
        let kind = &scene.materials[place[3] as usize].kind;
        let wavelength = f64::from(f32::from_bits(wavelength[0]));
        let index = kind.dispersion();
        let twin = index.map_or(kind.ior(), |index| index.at(wavelength)) * context.disturbed(1e-4);
        // l^2 has 3 roundings and the difference from c, a half of it at least, 8; 8 more.
        let bound = 16.0 * ULP * twin;
        measure.add((f64::from(output[0]) - twin).abs() / bound, || {
            format!(
                "{} at {wavelength}: {} for {twin}",
                GLASSES[place[3] as usize], output[0]
            )
        });
    }
    Ok(())
}

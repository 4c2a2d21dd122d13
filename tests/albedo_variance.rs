//! The variance of one sample of what a material scatters, f cos/pdf, over the square of its mean: what its
//! sampling leaves of the noise, by the f64 twin. At 45 degrees it is at most 0.3, in every channel and in
//! luminance; but 0.5 in a channel of car paint, some of whose cases have parts of quite different hues, of which one
//! sample finds one (docs/car-paint.md). docs/materials.md has the figures.
//!
//! The power: sampling by the cosine alone, which is what no material would be without its own, is beyond that
//! for every narrow lobe.

use glam::{DVec2, DVec3};
use gpu_trace::materials::car_paint::CarPaint;
use gpu_trace::materials::{ALL, MaterialKind, Surface, luminance};
use gpu_trace::sampling::directions::{basis_around, cosine_direction};
use gpu_trace::statistics::mean_and_error;
use gpu_trace::verify::Random;
use gpu_trace::verify::bsdf::draw::OFFSETS;

/// Those whose sampling is no closed matter.
const MATERIALS: &[&str] = &[
    "ashikhmin",
    "disney",
    "sheen",
    "nylon",
    "car-paint",
    "measured",
];
const BAR: f64 = 0.3;
/// For the channels.
fn channels_bar(name: &str) -> f64 {
    match name {
        "car-paint" => 0.5,
        _ => BAR,
    }
}

/// So many that the ratio is known to about 1 %.
const SAMPLES: usize = 200_000;

/// Luminance, and the channels.
type Ratios = [f64; 4];

/// Variance over squared mean of samples of the weight; 0 where the mean is.
fn ratios(mut weight: impl FnMut(&mut Random) -> DVec3, name: &str) -> Ratios {
    let mut random = Random::new(name);
    let weights: Vec<DVec3> = (0..SAMPLES).map(|_| weight(&mut random)).collect();
    let of = |part: &dyn Fn(&DVec3) -> f64| {
        let (mean, error) = mean_and_error(&weights.iter().map(part).collect::<Vec<_>>());
        match mean == 0.0 {
            true => 0.0,
            false => (error / mean).powi(2) * SAMPLES as f64,
        }
    };
    [
        of(&|w| luminance(*w)),
        of(&|w| w.x),
        of(&|w| w.y),
        of(&|w| w.z),
    ]
}

/// Where a material is looked at: one that looks at the offset at several, of which a flake has some.
fn places(kind: &MaterialKind) -> Vec<(&'static str, DVec3)> {
    let MaterialKind::CarPaint(CarPaint {
        flakes: Some(flakes),
        ..
    }) = kind
    else {
        return vec![("", DVec3::ZERO)];
    };
    let named = |offset| match flakes.normal_at(&place(offset).0) {
        Some(_) => (", on a flake", offset),
        None => (", beside", offset),
    };
    OFFSETS.map(named).into()
}

/// At 45 degrees, about a normal along no axis.
fn place(offset: DVec3) -> (Surface, DVec3) {
    let normal = DVec3::new(2.0, -1.0, 2.0) / 3.0;
    let wo = (normal - basis_around(normal).tangent).normalize();
    let surface = Surface {
        normal,
        eta: 1.0,
        offset,
    };
    (surface, wo)
}

fn by_its_own(kind: &MaterialKind, offset: DVec3) -> Ratios {
    let (surface, wo) = place(offset);
    let weight = |random: &mut Random| {
        let u = random.unit4().map(f64::from);
        kind.sample(&surface, wo, u).weight
    };
    ratios(weight, "own")
}

fn by_the_cosine(kind: &MaterialKind, offset: DVec3) -> Ratios {
    let (surface, wo) = place(offset);
    let weight = |random: &mut Random| {
        let [x, y, ..] = random.unit4().map(f64::from);
        let wi = cosine_direction(surface.normal, DVec2::new(x, y));
        let pdf = surface.normal.dot(wi) / std::f64::consts::PI;
        kind.evaluate(&surface, wo, wi).f_cos / pdf
    };
    ratios(weight, "cosine")
}

fn largest(ratios: &Ratios) -> f64 {
    ratios.iter().copied().fold(0.0, f64::max)
}

/// The figures of a row of the table in docs/materials.md; none, if there is no such row.
fn documented(name: &str, case: &str) -> Vec<f64> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/materials.md");
    let text = std::fs::read_to_string(path).expect(path);
    let start = format!("| `{name}` {case} |");
    let row = text.lines().find(|line| line.starts_with(&start));
    let cells = row.unwrap_or("").trim_matches('|').split('|').skip(1);
    cells
        .map(|cell| cell.trim().parse().expect("a number"))
        .collect()
}

#[test]
fn sampling_leaves_little() {
    let mut faults = Vec::new();
    for name in MATERIALS {
        let material = ALL.iter().find(|m| m.name == *name).expect(name);
        let mut beyond = 0;
        let cases = (material.cases)();
        let places = (1..).zip(&cases).flat_map(|(i, kind)| {
            places(kind)
                .into_iter()
                .map(move |(at, offset)| (format!("{i}{at}"), kind, offset))
        });
        for (case, kind, offset) in places {
            let (own, cosine) = (by_its_own(kind, offset), by_the_cosine(kind, offset));
            let [all, red, green, blue] = own;
            // The table's rows.
            eprintln!(
                "| `{name}` {case} | {all:.3} | {red:.3} | {green:.3} | {blue:.3} | {:.2} |",
                cosine[0]
            );
            let said = documented(name, &case);
            let as_said = own.iter().zip(&said).all(|(a, b)| (a - b).abs() <= 0.01);
            let within = all <= BAR && largest(&own) <= channels_bar(name);
            if !within || said.len() != 5 || !as_said {
                faults.push(format!("{name} {case}: {own:?}, documented {said:?}"));
            }
            beyond += usize::from(largest(&cosine) > BAR);
        }
        if beyond == 0 {
            faults.push(format!("{name}: the cosine does as well"));
        }
    }
    assert!(faults.is_empty(), "{faults:#?}");
}

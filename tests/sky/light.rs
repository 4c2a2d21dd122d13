//! Light sampling of an image around all.

use super::{ball_text, directions, in_sky, mean_over_cosine, random_image, red, seen};
use crate::common::images::Left;
use crate::common::{probe_of, scene};
use glam::DVec3;
use gpu_trace::image::Picture;
use gpu_trace::materials::luminance;
use gpu_trace::placement::Placement;
use gpu_trace::placement::sky::{Band, SkyTable};
use gpu_trace::reference::light::environment::{sky_place, sky_radiance};
use gpu_trace::reference::light::skylight::{part_of, sample_sky, sky_pdf};
use gpu_trace::reference::path::PathTracer;
use gpu_trace::scene::{Environment, Scene, Sky};
use gpu_trace::settings::{Integrator, Settings};
use gpu_trace::statistics::{chi_square, mean_and_error};
use gpu_trace::verify::{Agreement, Random, ULP, settings, vector};
use std::f64::consts::PI;

/// A dim image of small numbers with a hot texel.
pub(super) fn with_sun(width: u32, height: u32, [column, row]: [u32; 2], sun: f32) -> Picture {
    let mut image = random_image(width, height, "with a sun", 0.5);
    image.pixels[(row * width + column) as usize] = [sun, 0.9 * sun, 0.8 * sun];
    image
}

/// Images that are hard to sample, and by how much they are turned.
fn images() -> Vec<(&'static str, Picture, f64)> {
    let mut sparse = Picture::new(16, 9, vec![[0.0; 3]; 16 * 9]);
    sparse.pixels[3 * 16 + 15] = [5.0, 0.0, 0.0];
    sparse.pixels[6 * 16 + 4] = [1.0, 2.0, 1.0];
    vec![
        (
            "a sun at the pole above",
            with_sun(16, 8, [5, 0], 300.0),
            0.0,
        ),
        (
            "a sun at the pole below",
            with_sun(16, 8, [5, 7], 300.0),
            10.0,
        ),
        ("a sun at the seam", with_sun(32, 16, [0, 5], 1.0e3), 0.0),
        (
            "a sun at the other side of it",
            with_sun(32, 16, [31, 5], 1.0e3),
            123.4,
        ),
        (
            "one texel",
            Picture::new(1, 1, vec![[0.5, 0.25, 1.0]]),
            77.0,
        ),
        ("a row", with_sun(12, 1, [3, 0], 20.0), 300.0),
        ("a column", with_sun(1, 11, [0, 2], 20.0), 45.0),
        ("an odd number of rows", with_sun(7, 5, [2, 2], 50.0), 0.0),
        ("a range of 1e12", random_image(16, 8, "range", 12.0), 200.0),
        ("black but for two texels", sparse, 90.0),
        ("noise", random_image(37, 19, "noise", 1.0), 359.0),
    ]
}

fn skies() -> impl Iterator<Item = (&'static str, Sky)> {
    let scale = DVec3::new(1.0, 0.5, 2.0);
    images()
        .into_iter()
        .map(move |(name, image, angle)| (name, Sky::new(name, image, scale, angle)))
}

fn cells(sky: &Sky) -> impl Iterator<Item = (u32, u32)> + use<> {
    let [width, height] = [sky.image().width, sky.image().height];
    (0..height).flat_map(move |row| (0..width).map(move |column| (column, row)))
}

/// A direction in the middle of a part of a texel; both parts in (0, 1).
fn direction_in(sky: &Sky, (column, row): (u32, u32), part: [f64; 2]) -> DVec3 {
    let image = sky.image();
    let u = (f64::from(column) + part[0]) / f64::from(image.width) + sky.rotation() / 360.0;
    let v = (f64::from(row) + part[1]) / f64::from(image.height);
    let ((sin, cos), (across, ahead)) = ((PI * v).sin_cos(), (2.0 * PI * u).sin_cos());
    DVec3::new(sin * across, cos, -sin * ahead)
}

#[test]
fn the_table_is_a_pdf_and_positive_where_light_comes_from() {
    for (name, sky) in skies() {
        let table = SkyTable::new(&sky);
        let (width, height) = (sky.image().width, sky.image().height);
        let angle = |row| Band::of(row, height).solid_angle() / f64::from(width);
        let sum: f64 = cells(&sky).map(|(c, r)| table.pdf(c, r) * angle(r)).sum();
        // Two roundings to f32 of each.
        assert!((sum - 1.0).abs() < 2.0 * ULP, "{name}: {sum}");
        let all: f64 = (0..height)
            .map(|row| Band::of(row, height).solid_angle())
            .sum();
        assert!((all / (4.0 * PI) - 1.0).abs() < 1.0e-12);
        let dark = |table: &SkyTable| {
            let parts = [0.001, 0.3, 0.5, 0.7, 0.999];
            let seen = |cell| {
                let all = parts.iter().flat_map(|x| parts.map(|y| [*x, y]));
                all.map(|part| sky_radiance(&sky, sky_place(&sky, direction_in(&sky, cell, part))))
                    .fold(0.0, |most: f64, radiance| most.max(radiance.max_element()))
            };
            let lost = |cell: &(u32, u32)| table.pdf(cell.0, cell.1) == 0.0 && seen(*cell) > 0.0;
            cells(&sky).filter(lost).count()
        };
        assert_eq!(dark(&table), 0, "{name}");
        if name.starts_with("black") {
            // Companion: by the texels' own values it lacks what interpolation shows of their neighbours.
            assert!(dark(&by_their_own(&sky)) > 0);
            // Black is not looked for.
            assert!(cells(&sky).any(|(c, r)| table.pdf(c, r) == 0.0));
        }
    }
}

/// A table that lacks what interpolation shows of the neighbours.
fn by_their_own(sky: &Sky) -> SkyTable {
    SkyTable::by(sky, |row| {
        let columns = 0..sky.image().width;
        columns
            .map(|column| luminance(sky.texel(column, row)))
            .collect()
    })
}

#[test]
fn parts_are_exact() {
    let mut random = Random::new("parts");
    let inputs: Vec<[u32; 4]> = (0..100_000)
        .map(|i| {
            let count = match i % 4 {
                0 => 1 + random.words()[0] % 8,
                1 => 1 << (random.words()[0] % 17),
                _ => 1 + random.words()[0] % 65_536,
            };
            let u = match i % 7 {
                0 => 1.0 - f32::EPSILON / 2.0,
                1 => 0.0,
                _ => random.unit4()[0],
            };
            [u.to_bits(), count, 0, 0]
        })
        .collect();
    let sky = Sky::new("x", random_image(4, 2, "parts", 0.0), DVec3::ONE, 0.0);
    let outputs: Vec<[u32; 4]> = probe_of(&in_sky(sky, ""), &["sky", "skylight"])
        .call("part_of", &inputs)
        .expect("the probe runs");
    for (input, output) in inputs.iter().zip(&outputs) {
        let (index, rest) = part_of(f32::from_bits(input[0]).into(), input[1]);
        let found = (output[0], f64::from(f32::from_bits(output[1])));
        assert_eq!(found, (index, rest), "{input:?}");
        assert!(index < input[1] && rest < 1.0);
    }
}

#[test]
fn directions_are_drawn_by_their_pdf() {
    let mut random = Random::new("directions to skies");
    let mut p_values = Vec::new();
    for (name, sky) in skies() {
        let table = SkyTable::new(&sky);
        let scene = in_sky(sky.clone(), "");
        let probe = probe_of(&scene, &["sky", "skylight"]);
        let inputs: Vec<[f32; 4]> = (0..200_000).map(|_| random.unit4()).collect();
        let outputs: Vec<[f32; 4]> = probe.call("sample_sky", &inputs).expect("the probe runs");
        let image = sky.image();
        // Of each texel four quarters by solid angle.
        let mut counts = vec![0u64; image.pixels.len() * 4];
        let mut wanted = vec![0.0; counts.len()];
        for (cell, (column, row)) in cells(&sky).enumerate() {
            let angle = Band::of(row, image.height).solid_angle() / f64::from(image.width);
            let all = table.pdf(column, row) * angle;
            wanted[4 * cell..4 * cell + 4].fill(0.25 * all);
        }
        let mut agreement = Agreement::default();
        for (u, output) in inputs.iter().zip(&outputs) {
            let truth = sample_sky(&sky, &table, u.map(f64::from));
            let (w, pdf) = (vector(*output), f64::from(output[3]));
            // sin^2: three roundings, and the root doubles what 1 - s makes of them at the equator; the azimuth one of
            // the turn, the sum and the rest each, and what circle_point is off by; rows begin at rounded numbers.
            let off = (w - truth.wi).length();
            agreement.add(off, 2.0 * PI * 4.0 * ULP + 2.0e-6, || {
                format!("{name}, {u:?}: {w} for {}", truth.wi)
            });
            // The same texel, and so the same number.
            agreement.add((pdf / truth.pdf - 1.0).abs(), ULP, || {
                format!("{name}, {u:?}: {pdf} for {}", truth.pdf)
            });
            let place = sky_place(&sky, truth.wi);
            let column = (place.x as u32).min(image.width - 1);
            let row = (place.y as u32).min(image.height - 1);
            let band = Band::of(row, image.height);
            // sin^2 of half the angle to the nearer pole.
            let s = 0.5 * (1.0 - truth.wi.y.abs());
            let s = if (truth.wi.y < 0.0) == band.lower {
                s
            } else {
                1.0 - s
            };
            let part = (s - band.near) / band.step;
            let part = if band.lower { 1.0 - part } else { part };
            let down = (2.0 * part).clamp(0.0, 1.999) as usize;
            let across = (2.0 * place.x.fract()) as usize;
            counts[4 * (row * image.width + column) as usize + 2 * down + across] += 1;
        }
        agreement.assert_holds(400_000);
        p_values.push((name, chi_square(&counts, &wanted).p));
        // Companion: a fifth of what is in the first quarters is in the second ones.
        for quarters in counts.chunks_exact_mut(4) {
            let moved = quarters[0] / 5;
            quarters[0] -= moved;
            quarters[1] += moved;
        }
        let p = chi_square(&counts, &wanted).p;
        assert!(p < 1.0e-4, "{name}: a fifth is not found, {p}");
    }
    let limit = gpu_trace::statistics::sidak(p_values.len());
    assert!(p_values.iter().all(|(_, p)| *p > limit), "{p_values:?}");
}

#[test]
fn densities_agree_where_paths_arrive() {
    for (name, sky) in skies() {
        let table = SkyTable::new(&sky);
        let inputs = directions(50_000, "densities");
        let outputs: Vec<[f32; 4]> = probe_of(&in_sky(sky.clone(), ""), &["sky", "skylight"])
            .call("sky_pdf", &inputs)
            .expect("the probe runs");
        let holds = |table: &SkyTable| {
            let mut agreement = Agreement::default();
            for (w, found) in inputs.iter().zip(&outputs) {
                let place = sky_place(&sky, vector(*w));
                // Next to an edge f32 may have it in another texel: see `lookups_agree`.
                let off = (place - place.round()).abs();
                let may_be = 8.0 * ULP * f64::from(sky.image().width.max(sky.image().height));
                if off.min_element() > may_be && (w[0] != 0.0 || w[2] != 0.0) {
                    let truth = sky_pdf(&sky, table, place);
                    let error = (f64::from(found[0]) - truth).abs();
                    agreement.add(error, ULP * truth + f64::MIN_POSITIVE, || {
                        format!("{name}, {w:?}: {found:?} for {truth}")
                    });
                }
            }
            agreement
        };
        holds(&table).assert_holds(30_000);
        // Companion: a table of something else.
        if sky.image().pixels.len() > 1 {
            let other = SkyTable::by(&sky, |row| {
                (0..sky.image().width)
                    .map(|i| f64::from(1 + i + row))
                    .collect()
            });
            assert!(holds(&other).any_fails(), "{name}");
        }
    }
}

/// What a ball of albedo .8 shows of normal `n`, by the midpoint rule in parts of texels: no table, no sampling.
fn shown(sky: &Sky, n: DVec3) -> f64 {
    const PARTS: u32 = 24;
    let place = |i: u32| (f64::from(i) + 0.5) / f64::from(PARTS);
    let image = sky.image();
    let (across, down) = (
        2.0 * PI / f64::from(image.width),
        PI / f64::from(image.height),
    );
    let part = across * down / f64::from(PARTS * PARTS);
    let mut sum = 0.0;
    for cell in cells(sky) {
        for i in 0..PARTS * PARTS {
            let w = direction_in(sky, cell, [place(i % PARTS), place(i / PARTS)]);
            let sine = w.x.hypot(w.z);
            sum += sky_radiance(sky, sky_place(sky, w)).x * w.dot(n).max(0.0) * sine * part;
        }
    }
    0.8 / PI * sum
}

#[test]
fn a_ball_shows_the_integral_of_any_image() {
    let normals = [
        DVec3::new(0.3, 0.8, -0.2).normalize(),
        DVec3::new(-0.5, -0.6, 0.4).normalize(),
    ];
    for (name, sky) in skies() {
        for n in normals {
            let mut ball = scene(&ball_text(n, ""));
            ball.environment = Some(Environment::Sky(sky.clone()));
            let truth = shown(&sky, n);
            // Of a range of 1e12 a few texels are all, and interpolation between them is what varies.
            let power = if name.contains("1e12") { 0.2 } else { 0.05 };
            for (integrator, spp) in [(Integrator::Nee, 256), (Integrator::Path, 256)] {
                let film = seen(&ball, integrator, spp);
                let of_both = format!("{name}, {n}, {}", integrator.name());
                let _left = Left::alone(of_both, &film);
                let (mean, error) = red(&film);
                // What the midpoint rule is off by: at the horizon, in a part of a texel.
                let error = error.hypot(2.0e-4 * truth);
                let z = (mean - truth) / error;
                eprintln!(
                    "{name}, {}: {mean} +- {error} for {truth}, z = {z:.2}",
                    integrator.name()
                );
                assert!(
                    z.abs() < 3.9,
                    "{name}, {n}, {integrator:?}: {mean} +- {error} for {truth}"
                );
                // Companion.
                let off = (mean - (1.0 + power) * truth) / error;
                assert!(
                    off.abs() > 3.9,
                    "{name}, {n}, {integrator:?}: {power} is not found, {off:.1}"
                );
            }
        }
    }
}

#[test]
fn quadratures_agree() {
    // Two rules in other coordinates.
    let sky = Sky::new("x", random_image(37, 19, "noise", 1.0), DVec3::ONE, 10.0);
    let n = DVec3::new(0.3, 0.8, -0.2).normalize();
    let other = 0.8 * mean_over_cosine(n, 2048, |w| sky_radiance(&sky, sky_place(&sky, w)).x);
    let one = shown(&sky, n);
    assert!((one / other - 1.0).abs() < 3.0e-4, "{one}, {other}");
}

/// The mean of the red values of paths of the twin under `nee`, with its standard error.
pub(super) fn twin(scene: &Scene, placement: &Placement, spp: u64) -> (f64, f64) {
    let settings = Settings {
        integrator: Integrator::Nee,
        ..settings(scene, 16, 16, spp)
    };
    let tracer = PathTracer::new(scene, placement, &settings);
    let pixel = |i: u32| {
        let sum: f64 = (0..spp)
            .map(|s| tracer.trace([i % 16, i / 16], s).radiance.x)
            .sum();
        sum / spp as f64
    };
    mean_and_error(&(0..256).map(pixel).collect::<Vec<_>>())
}

#[test]
fn any_true_table_is_unbiased_and_companions_are_found() {
    let (_, sky) = skies()
        .find(|(name, _)| name.starts_with("black"))
        .expect("it is there");
    let n = DVec3::new(0.3, 0.8, -0.2).normalize();
    let mut ball = scene(&ball_text(n, ""));
    ball.environment = Some(Environment::Sky(sky.clone()));
    let truth = shown(&sky, n);
    let placement = Placement::new(&ball, 16, 16);
    let z = |ball: &Scene, placement: &Placement| {
        let (mean, error) = twin(ball, placement, 64);
        (mean - truth) / error.hypot(2.0e-4 * truth)
    };
    let whole = SkyTable::new(&sky);
    let with = |table: SkyTable| z(&ball, &placement.clone().with_sky_table(table));
    assert!(with(whole.clone()).abs() < 3.9);
    // What a table lacks, and says so, BSDF sampling finds.
    let lacking = with(by_their_own(&sky));
    assert!(lacking.abs() < 3.9, "{lacking}");
    // Companions: a table that never draws the texels of a half, and says that it does; and an image turned by
    // 20 degrees.
    let half = SkyTable::by(&sky, |_| (0..16).map(|i| f64::from(i / 8)).collect());
    let lost = with(half.that_claims(&whole));
    assert!(
        lost.abs() > 3.9,
        "half of the texels are not missed: {lost}"
    );
    let turned = Sky::new("x", sky.image().clone(), sky.scale(), sky.rotation() + 20.0);
    ball.environment = Some(Environment::Sky(turned));
    let found = z(&ball, &placement);
    assert!(found.abs() > 3.9, "a turned image is not found: {found}");
}

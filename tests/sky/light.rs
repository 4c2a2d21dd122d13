//! Light sampling of an image around all.

use std::f64::consts::PI;

use glam::DVec3;
use gpu_trace::effects::{Effect, Effects};
use gpu_trace::error::Error;
use gpu_trace::film::{Film, LightClass};
use gpu_trace::gpu::renderer::GpuRenderer;
use gpu_trace::image::Picture;
use gpu_trace::job::Job;
use gpu_trace::materials::luminance;
use gpu_trace::placement::Placement;
use gpu_trace::placement::sky::{Band, SkyTable};
use gpu_trace::reference::light::environment::{sky_place, sky_radiance};
use gpu_trace::reference::light::skylight::{part_of, sample_sky, sky_pdf};
use gpu_trace::reference::path::PathTracer;
use gpu_trace::scene::{Environment, Scene, Sky};
use gpu_trace::settings::{GeometryChoice, Integrator, LightSampling, Settings};
use gpu_trace::statistics::{chi_square, mean_and_error};
use gpu_trace::verify::{Agreement, Random, ULP, means, settings, share_off, vector};

use super::{ball_text, directions, in_sky, mean_over_cosine, random_image, seen};
use crate::common::images::{assert_alike, bias};
use crate::common::{gpu, probe_of, render_cpu, render_gpu, scene};

/// A dim image of small numbers with a hot texel.
fn with_sun(width: u32, height: u32, [column, row]: [u32; 2], sun: f32) -> Picture {
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
                let (mean, error) = seen(&ball, integrator, spp);
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
fn twin(scene: &Scene, placement: &Placement, spp: u64) -> (f64, f64) {
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

/// Balls of several materials on a floor, a lamp, glass with something in it, and a sky with a sun; `lamps` of them.
fn yard(lamps: usize, sky: Sky) -> Scene {
    let mut text = String::from(
        "[camera]\nposition = [0, 2, 7]\nlook_at = [0, 0.7, 0]\nfov = 45.0\n[image]\nwidth = 24\n\
         height = 18\n[render]\nmax_bounces = 6\n[material.floor]\ntype = \"diffuse\"\n\
         albedo = [0.5, 0.5, 0.5]\n[material.shiny]\ntype = \"reflective\"\nalbedo = [0.2, 0.2, 0.2]\n\
         specular = [1, 1, 1]\nepsilon = 0.01\nmu = 10.0\n[material.brass]\ntype = \"conductor\"\n\
         preset = \"gold\"\nroughness = 0.4\n[material.glass]\ntype = \"dielectric\"\nior = 1.5\n\
         [material.lamp]\ntype = \"diffuse\"\nalbedo = [0.3, 0.3, 0.3]\nemission = [2, 2, 3]\n",
    );
    let mut sphere = |center: [f64; 3], radius: f64, material: &str| {
        text += &format!(
            "[[sphere]]\ncenter = {center:?}\nradius = {radius:?}\nmaterial = \"{material}\"\n"
        );
    };
    sphere([0.0, -20.0, 0.0], 20.0, "floor");
    sphere([-2.0, 0.8, 0.0], 0.8, "shiny");
    sphere([0.0, 0.8, -0.5], 0.8, "brass");
    sphere([2.0, 0.8, 0.0], 0.8, "glass");
    sphere([2.0, 0.8, 0.0], 0.4, "floor");
    for i in 0..lamps {
        sphere([2.0 * i as f64 - 1.0, 2.5, -2.0], 0.3, "lamp");
    }
    let mut scene = scene(&text);
    scene.environment = Some(Environment::Sky(sky));
    scene
}

/// A sun of 2 % of the sky's texels, which BSDF sampling still finds.
fn sunny() -> Sky {
    Sky::new("sunny", with_sun(12, 8, [3, 2], 8.0), DVec3::ONE, 40.0)
}

fn rendered(scene: &Scene, how: (Integrator, LightSampling, GeometryChoice), spp: u64) -> Film {
    let (integrator, light_sampling, geometry) = how;
    let settings = Settings {
        integrator,
        light_sampling: integrator.samples_lights().then_some(light_sampling),
        geometry,
        ..settings(scene, 24, 18, spp)
    };
    render_gpu(scene, &settings)
}

#[test]
fn all_estimators_converge_to_the_same() {
    let cases = [
        (0, LightSampling::Projected),
        (2, LightSampling::Projected),
        (2, LightSampling::Cone),
        (12, LightSampling::Projected),
    ];
    for (lamps, sampling) in cases {
        let scene = yard(lamps, sunny());
        let geometries = [
            GeometryChoice::Baked,
            GeometryChoice::List,
            GeometryChoice::Bvh,
        ];
        let bsdf = (Integrator::Bsdf, sampling, GeometryChoice::Baked);
        let reference = rendered(&scene, bsdf, 1 << 12);
        for integrator in [Integrator::Path, Integrator::Nee] {
            let geometry = geometries[lamps % 3];
            let film = rendered(&scene, (integrator, sampling, geometry), 1 << 9);
            let name = format!("{lamps} lamps, {sampling:?}, {}", integrator.name());
            let (z, _) = bias(&film, &reference, 1.0);
            eprintln!("{name}: z = {z:.2}");
            assert_alike(&name, &film, &reference, z.abs() < 3.9, z);
            assert_eq!(film.tally().non_finite, 0);
            // Companion: 2 % too dark.
            let (z, _) = bias(&film, &reference, 0.98);
            assert!(z.abs() > 3.9, "2 % is not found: {z}");
        }
    }
}

#[test]
fn every_geometry_has_the_same_paths_as_the_reference() {
    for (lamps, sampling) in [
        (0, LightSampling::Projected),
        (2, LightSampling::Projected),
        (12, LightSampling::Projected),
        (2, LightSampling::Cone),
    ] {
        let scene = yard(lamps, sunny());
        for integrator in [Integrator::Path, Integrator::Nee] {
            let of = |geometry| Settings {
                integrator,
                light_sampling: Some(sampling),
                geometry,
                ..settings(&scene, 24, 18, 4)
            };
            let reference = render_cpu(&scene, &of(GeometryChoice::Auto));
            for geometry in [
                GeometryChoice::Baked,
                GeometryChoice::List,
                GeometryChoice::Bvh,
            ] {
                let film = render_gpu(&scene, &of(geometry));
                let off = share_off(&film, &reference);
                // A path in a hundred takes another way, where a rounding decides; a pixel has four.
                let name = format!("{lamps} lamps, {integrator:?}, {geometry:?}");
                assert_alike(&name, &film, &reference, off < 0.05, off);
                let rays = film.tally().rays as f64 / reference.tally().rays as f64;
                assert!((rays - 1.0).abs() < 0.01, "{rays}");
            }
            // Companion: turned by a degree it is another image.
            let sky = sunny();
            let turned = Sky::new("x", sky.image().clone(), sky.scale(), sky.rotation() + 1.0);
            let other = render_cpu(&yard(lamps, turned), &of(GeometryChoice::Auto));
            let off = share_off(&other, &reference);
            assert!(off > 0.5, "a turned image is not found: {off}");
        }
    }
}

#[test]
fn a_hot_sun_is_found() {
    // 1e-4 of the sphere has nearly all of the light: by BSDF sampling alone the error would be some ten times this.
    let sky = Sky::new("hot", with_sun(128, 64, [80, 20], 1.0e4), DVec3::ONE, 0.0);
    let scene = yard(0, sky);
    let error = |integrator| {
        let how = (integrator, LightSampling::Projected, GeometryChoice::Auto);
        let film = rendered(&scene, how, 256);
        let all = (0..film.rect().pixels()).map(|i| film.variance_of_mean(i).expect("batches")[0]);
        all.sum::<f64>().sqrt()
    };
    let (path, bsdf) = (error(Integrator::Path), error(Integrator::Bsdf));
    eprintln!("path {path:.3}, bsdf {bsdf:.3}");
    assert!(path < 0.3 * bsdf, "{path}, {bsdf}");
}

/// Seeds of which the means of layers are compared.
const SEEDS: u64 = 12;

#[test]
fn layers_are_those_of_bsdf_sampling() {
    let scene = yard(2, sunny());
    let classes = |integrator, spp| {
        let films: Vec<Film> = (0..SEEDS)
            .map(|seed| {
                let settings = Settings {
                    integrator,
                    seed,
                    classes: true,
                    ..settings(&scene, 24, 18, spp)
                };
                render_gpu(&scene, &settings)
            })
            .collect();
        let mean = |film: &Film, k: usize| {
            let pixels = film.rect().pixels();
            let of = |i: usize| film.aovs(i).expect("asked for").classes[k][1];
            (0..pixels).map(of).sum::<f64>() / (pixels as u64 * spp) as f64
        };
        let of = |k| mean_and_error(&films.iter().map(|film| mean(film, k)).collect::<Vec<_>>());
        (0..5).map(of).collect::<Vec<_>>()
    };
    let reference = classes(Integrator::Bsdf, 512);
    for integrator in [Integrator::Path, Integrator::Nee] {
        let found = classes(integrator, 128);
        for (k, (a, b)) in found.iter().zip(&reference).enumerate() {
            // Directly seen light has no variance but that of places in pixels. Ten comparisons with some 20 degrees of
            // freedom: a level of 1e-3 for all.
            let z = (a.0 - b.0) / a.1.hypot(b.1).max(1.0e-6 * b.0);
            eprintln!("{}, class {k}: {a:?}, {b:?}, z = {z:.2}", integrator.name());
            assert!(b.0 > 0.0);
            assert!(z.abs() < 4.8, "{integrator:?}, class {k}: {a:?}, {b:?}");
        }
        // Companion: 5 % of the direct light counted as indirect.
        let [direct, indirect] =
            [LightClass::Direct, LightClass::Indirect].map(|class| class as usize);
        let error = found[indirect].1.hypot(reference[indirect].1);
        let z = 0.05 * found[direct].0 / error;
        assert!(z > 4.8, "{integrator:?}: 5 % is not found, {z}");
    }
}

#[test]
fn what_sees_no_sky_does_not_look_for_it() {
    let has = |scene: &Scene, integrator, effect| {
        let settings = Settings {
            integrator,
            ..Settings::for_scene(scene)
        };
        let placement = Placement::new(scene, 16, 16);
        Effects::derive(scene, &placement, &settings).has(effect)
    };
    let room = "[material.wall]\ntype = \"diffuse\"\nalbedo = [0.5, 0.5, 0.5]\n[[sphere]]\n\
                center = [0, 0, 0]\nradius = 10.0\nmaterial = \"wall\"\n";
    let (open, closed) = (in_sky(sunny(), ""), in_sky(sunny(), room));
    for integrator in [Integrator::Path, Integrator::Nee, Integrator::Bsdf] {
        let looks = integrator != Integrator::Bsdf;
        assert!(has(&open, integrator, Effect::Sky));
        assert_eq!(has(&open, integrator, Effect::Skylight), looks);
        for effect in [Effect::Sky, Effect::Skylight, Effect::Mis] {
            assert!(!has(&closed, integrator, effect), "{effect:?}");
        }
    }
    // And the twin looks for nothing either.
    let film = render_cpu(&closed, &settings(&closed, 8, 8, 4));
    assert_eq!(means(&film).iter().sum::<f64>(), 0.0);
}

#[test]
fn an_image_beyond_the_device_is_refused_before_any_work() {
    let job = |width: u32, height: u32| {
        let image = Picture::new(width, height, vec![[0.5; 3]; (width * height) as usize]);
        let scene = in_sky(Sky::new("wide.exr", image, DVec3::ONE, 0.0), "");
        crate::common::job(&scene, &settings(&scene, 8, 8, 1))
    };
    let with = |most: u32, job: &Job| {
        let mut gpu = gpu();
        gpu.limits.max_texture_dimension_2d = most;
        GpuRenderer::new(gpu, job).map(|_| ())
    };
    for (width, height) in [(4097, 1), (1, 4097)] {
        let error = with(4096, &job(width, height)).expect_err("it is too large");
        assert!(matches!(error, Error::DeviceLimit(_)), "{error:?}");
        let text = error.to_string();
        let size = format!("wide.exr has {width} x {height} texels");
        assert!(
            text.contains(&size) && text.contains("limit of 4096"),
            "{text}"
        );
    }
    // Companion: just as large as the device allows.
    for (width, height) in [(4096, 1), (1, 4096)] {
        with(4096, &job(width, height)).expect("it fits");
    }
}

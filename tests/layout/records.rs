//! Records in textures: what the kernel reads of each is what the placement and the scene's tables say.

use bytemuck::Pod;
use glam::DVec3;

use crate::common::{gpu, job, scene_file};
use gpu_trace::effects::Effect;
use gpu_trace::gpu::probe::Probe;
use gpu_trace::placement::PlacedSphere;
use gpu_trace::records::tables::SceneTables;
use gpu_trace::sampler::Sampler;
use gpu_trace::scene::Scene;
use gpu_trace::settings::{GeometryChoice, Integrator, LightSampling, Settings};

/// Four words.
type Row = [u32; 4];

/// What the kernel reads by a function, and what it should: rows of each record.
struct Read {
    function: &'static str,
    found: Vec<Vec<Row>>,
    expected: Vec<Vec<Row>>,
}

impl Read {
    /// What is wrong, if anything is.
    fn mismatch(&self) -> Option<String> {
        let mut records = self.found.iter().zip(&self.expected).enumerate();
        let wrong = records.find(|(_, (found, expected))| found != expected);
        wrong.map(|(number, (found, expected))| {
            format!("{} of {number}: {found:?}, not {expected:?}", self.function)
        })
    }
}

/// Asks a probe for as many records as there are in `expected`, of `ROWS` rows each.
fn read<const ROWS: usize>(
    probe: &Probe,
    function: &'static str,
    expected: Vec<[Row; ROWS]>,
) -> Read
where
    [Row; ROWS]: Pod,
{
    let numbers: Vec<Row> = (0..expected.len()).map(|i| [i as u32, 0, 0, 0]).collect();
    let found: Vec<[Row; ROWS]> = match numbers.is_empty() {
        true => Vec::new(),
        false => probe
            .call(function, &numbers)
            .unwrap_or_else(|e| panic!("{e}")),
    };
    let rows = |records: Vec<[Row; ROWS]>| records.into_iter().map(|r| r.to_vec()).collect();
    Read {
        function,
        found: rows(found),
        expected: rows(expected),
    }
}

fn row(v: DVec3, last: f64) -> Row {
    v.as_vec3().extend(last as f32).to_array().map(f32::to_bits)
}

fn words(record: &impl Pod, row: usize) -> Row {
    let all: &[Row] = bytemuck::cast_slice(bytemuck::bytes_of(record));
    all[row]
}

/// All that the kernel of a scene reads by records.
fn all(scene: &Scene, settings: &Settings) -> Vec<Read> {
    let job = job(scene, settings);
    let (placement, effects) = (job.placement(), job.effects());
    let probe = Probe::new(&gpu(), scene, placement, effects);
    let tables = SceneTables::new(scene, placement);
    let has = |effect| effects.has(effect);
    let when = |asked: bool, row: Row| if asked { row } else { [0; 4] };
    let number = |index: Option<&usize>| index.map_or(u32::MAX, |&i| i as u32);
    let spheres = &placement.spheres;
    let mut reads = Vec::new();
    if effects.keeps_spheres() {
        let attributes = |(i, sphere): (usize, &PlacedSphere)| {
            let light =
                placement
                    .lights
                    .of_sphere(i)
                    .map_or(0.0, |light| match has(Effect::Table) {
                        true => light.probability,
                        false => light.luminance * placement.radiance_scale,
                    });
            let place = i.checked_sub(placement.poles).filter(|_| has(Effect::Bvh));
            let core = |n: usize| number(sphere.cores.get(n));
            [
                // Which record is its material's is for those who look at materials to say.
                [
                    0,
                    sphere.side as u32 * u32::from(has(Effect::Interior)),
                    place.map_or(0, |centered| placement.tree().places[centered]),
                    (light as f32).to_bits() * u32::from(has(Effect::Lights)),
                ],
                when(
                    has(Effect::Priority),
                    [
                        sphere.level,
                        if has(Effect::Nested) {
                            number(sphere.container.as_ref())
                        } else {
                            0
                        },
                        0,
                        0,
                    ],
                ),
                when(has(Effect::Nested), [core(0), core(1), core(2), core(3)]),
            ]
        };
        let expected = spheres.iter().enumerate().map(attributes).collect();
        let mut read = read(&probe, "attributes_of", expected);
        read.found.iter_mut().for_each(|record| record[0][0] = 0);
        reads.push(read);
    }
    if has(Effect::List) {
        let expected = spheres
            .iter()
            .map(|s| [row(s.anchor, s.radius), row(s.motion, 0.0)]);
        let mut read = read(&probe, "sphere_of", expected.collect());
        read.found.drain(..placement.poles);
        read.expected.drain(..placement.poles);
        reads.push(read);
    }
    if effects.keeps_spheres() && has(Effect::Pole) {
        let of_pole = |s: &PlacedSphere| {
            let curvature = 1.0 / s.radius;
            Some([
                row(s.anchor, curvature),
                row(s.pole?, 0.0),
                row(s.motion, 0.0),
            ])
        };
        let expected = spheres.iter().filter_map(of_pole).collect();
        reads.push(read(&probe, "pole_of", expected));
    }
    if effects.keeps_spheres() && has(Effect::RadianceCache) {
        let of_chart = |index: usize| {
            let chart = placement.cells().expect("a cache").charts()[index];
            let width = chart.width.unwrap_or(0.0) as f32;
            let [across, down] = chart.axes.map(|axis| row(axis, 0.0));
            [
                [
                    chart.first,
                    chart.side,
                    u32::from(chart.diffuse),
                    width.to_bits(),
                ],
                across,
                down,
            ]
        };
        let expected = (0..spheres.len()).map(of_chart).collect();
        reads.push(read(&probe, "chart_record", expected));
    }
    if effects.reads_lamps() {
        let expected = placement.lights.table.iter().map(|light| {
            let sphere = &spheres[light.sphere];
            let radius = if sphere.pole.is_some() {
                0.0
            } else {
                sphere.radius
            };
            let weight = match has(Effect::Table) {
                true => light.probability,
                false => light.luminance * placement.radiance_scale,
            };
            let [weight, threshold] = [weight, light.threshold].map(|x| (x as f32).to_bits());
            let pole = row(sphere.pole.unwrap_or_default(), 1.0 / sphere.radius);
            [
                row(sphere.anchor, radius),
                [weight, threshold, light.alias as u32, light.sphere as u32],
                when(has(Effect::Pole), pole),
                row(sphere.motion, 0.0),
            ]
        });
        reads.push(read(&probe, "lamp_of", expected.collect()));
    }
    if effects.has_patterns() {
        let expected = tables.textures.patterns().iter().map(|pattern| {
            let about_pole = |row| when(has(Effect::Pole), words(pattern, row));
            [
                words(pattern, 0),
                words(pattern, 1),
                about_pole(2),
                about_pole(3),
            ]
        });
        reads.push(read(&probe, "pattern_of", expected.collect()));
    }
    if has(Effect::TextureImage) {
        let images = tables.textures.images().iter();
        let expected = images.map(|image| [0, 1, 2, 3].map(|row| words(image, row)));
        reads.push(read(&probe, "image_of", expected.collect()));
    }
    if effects.has_mixes() {
        let parts = tables.mixes.part_texels();
        let expected = parts.map(|part| {
            let weighed = tables.mixes.weights().is_empty();
            [if weighed {
                [part[0], part[1], 0, 0]
            } else {
                part
            }]
        });
        reads.push(read(&probe, "mix_part_of", expected.collect()));
    }
    if !tables.mixes.weights().is_empty() {
        let weights = tables.mixes.weights().iter();
        let expected = weights.map(|&[number, second]| [[number, second, 0, 0]]);
        reads.push(read(&probe, "part_weight_of", expected.collect()));
    }
    reads
}

/// Scenes that have records of every kind between them, in both forms with spheres in textures.
fn everywhere() -> Vec<Read> {
    let mut reads = Vec::new();
    for file in [
        "everything",
        "tests/nested",
        "tests/lamps",
        "tests/motion",
        "tests/mix",
        "tests/textures",
    ] {
        let scene = scene_file(format!("scenes/{file}.toml"));
        for geometry in [GeometryChoice::List, GeometryChoice::Bvh] {
            let settings = Settings {
                geometry,
                ..Settings::for_scene(&scene)
            };
            let table = Settings {
                light_sampling: Some(LightSampling::Cone),
                ..settings.clone()
            };
            reads.extend(all(&scene, &settings));
            reads.extend(all(&scene, &table));
        }
    }
    let glass = scene_file("scenes/glass.toml");
    let cache = Settings {
        geometry: GeometryChoice::List,
        integrator: Integrator::Path,
        sampler: Sampler::Sobol,
        radiance_cache: true,
        ..Settings::for_scene(&glass)
    };
    reads.extend(all(&glass, &cache));
    reads
}

#[test]
fn records_are_those_of_the_scene() {
    let reads = everywhere();
    for read in &reads {
        assert_eq!(read.found.len(), read.expected.len(), "{}", read.function);
        assert_eq!(read.mismatch(), None);
    }
    for function in [
        "attributes_of",
        "sphere_of",
        "pole_of",
        "chart_record",
        "lamp_of",
        "pattern_of",
        "image_of",
        "mix_part_of",
        "part_weight_of",
    ] {
        let some = reads
            .iter()
            .any(|read| read.function == function && !read.expected.is_empty());
        assert!(some, "no scene has {function}");
    }
}

#[test]
fn companion_a_record_of_another_is_found() {
    let scene = scene_file("scenes/tests/lamps.toml");
    let settings = Settings {
        geometry: GeometryChoice::List,
        ..Settings::for_scene(&scene)
    };
    let mut reads = all(&scene, &settings);
    reads.retain(|read| read.expected.len() > 1);
    assert!(reads.len() > 2, "{} functions", reads.len());
    for read in &mut reads {
        read.found.rotate_left(1);
        assert!(read.mismatch().is_some(), "{}", read.function);
    }
}

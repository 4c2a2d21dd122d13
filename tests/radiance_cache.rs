//! The radiance cache: its charts, that it changes no mean, its error bars, and where it is off.
//!
//! That the kernel traces the reference's paths is in `agreement`, that any split gives the same bits in `claims`.

use glam::{DVec2, DVec3};
use gpu_trace::cells::chart::Chart;
use gpu_trace::cells::{Cells, obstacle};
use gpu_trace::film::Film;
use gpu_trace::job::Job;
use gpu_trace::placement::Placement;
use gpu_trace::reference::cells::{CORRECTED, Cache};
use gpu_trace::reference::path::PathTracer;
use gpu_trace::reference::survey::survey;
use gpu_trace::render::render_quietly;
use gpu_trace::sampler::Sampler;
use gpu_trace::scene::Scene;
use gpu_trace::settings::{GeometryChoice, Integrator, Offset, Settings, View};
use gpu_trace::verify::{Random, settings};

use crate::common::{gpu_renderer, job, scene, scene_file};
use crate::thorough::thorough;

/// With the cache.
fn cached(scene: &Scene, width: u32, height: u32, spp: u64) -> Settings {
    Settings {
        radiance_cache: true,
        ..settings(scene, width, height, spp)
    }
}

fn cells(job: &Job) -> &Cells {
    job.cells().expect("a cache")
}

fn room() -> Scene {
    scene_file("scenes/lecture.toml")
}

/// A sphere that has a grid, and one that has an octahedral map.
fn charts(placement: &Placement) -> Vec<(usize, Chart)> {
    let is_wall = |i: &usize| placement.spheres[*i].pole.is_some();
    let all = 0..placement.spheres.len();
    let [wall, ball] = [true, false].map(|pole| {
        let found = all.clone().find(|i| is_wall(i) == pole);
        found.expect("one of each")
    });
    [wall, ball]
        .map(|i| (i, Chart::of(&placement.spheres[i], 0.4)))
        .into()
}

/// The largest difference of area() from what small steps on the chart tell, relative, with the area of all maps
/// multiplied by `factor` where a map is folded over.
fn area_off(chart: &Chart, placement: &Placement, index: usize, factor: f64) -> f64 {
    let sphere = &placement.spheres[index];
    let mut random = Random::new("areas");
    let mut worst = 0.0f64;
    for _ in 0..2000 {
        let [x, y, ..] = random.unit4().map(|u| 1.8 * f64::from(u) - 0.9);
        let place = DVec2::new(x, y);
        // Not over a fold.
        let step = 1.0e-5;
        let folds = [x, y, x.abs() + y.abs() - 1.0];
        if folds.iter().any(|x| x.abs() < 2.0 * step) {
            continue;
        }
        let at = |d: DVec2| chart.point(sphere, place + d).offset;
        let along = |d: DVec2| (at(d) - at(-d)) / (2.0 * step);
        let area = along(DVec2::X * step)
            .cross(along(DVec2::Y * step))
            .length();
        let folded = x.abs() + y.abs() > 1.0 && chart.width.is_none();
        let said = chart.area(sphere, place) * if folded { factor } else { 1.0 };
        worst = worst.max((said / area - 1.0).abs());
    }
    worst
}

#[test]
fn charts_are_one_to_one_and_know_their_areas() {
    let room = room();
    let placement = Placement::new(&room, 64, 64);
    for (index, chart) in charts(&placement) {
        let sphere = &placement.spheres[index];
        let mut random = Random::new("places");
        for _ in 0..2000 {
            let [x, y, ..] = random.unit4().map(|u| 1.8 * f64::from(u) - 0.9);
            let place = DVec2::new(x, y);
            let point = chart.point(sphere, place);
            let back = chart.place(point.offset);
            assert!(
                (back - place).abs().max_element() < 1.0e-9,
                "{place} {back}"
            );
            let [column, row] = chart.cell(place);
            let inside = chart.place_in([column, row], DVec2::splat(0.5)) - place;
            assert!(inside.abs().max_element() <= 1.0 / f64::from(chart.side) + 1.0e-12);
            assert!((point.normal.length() - 1.0).abs() < 1.0e-12);
        }
        let off = area_off(&chart, &placement, index, 1.0);
        assert!(off < 1.0e-6, "{off}");
        // A companion: an area that is a thousandth off.
        if chart.width.is_none() {
            assert!(area_off(&chart, &placement, index, 1.001) > 5.0e-4);
        }
    }
}

#[test]
fn cells_are_those_of_scene_and_size() {
    let room = room();
    let with = |change: &dyn Fn(&mut Settings)| {
        let mut settings = cached(&room, 320, 320, 64);
        change(&mut settings);
        cells(&job(&room, &settings)).clone()
    };
    let plain = with(&|_| {});
    assert!(
        (1000..10_000).contains(&plain.used().len()),
        "{}",
        plain.used().len()
    );
    for change in [
        &(|s: &mut Settings| s.seed = 7) as &dyn Fn(&mut Settings),
        &|s| s.samples = 64..128,
        &|s| s.crop.width = 8,
    ] {
        assert!(plain == with(change));
    }
    // Pilots take a tenth of the paths that an image has.
    for batch in [4, 16, 64] {
        let paths = plain.used().len() as u64 * u64::from(plain.samples(batch));
        assert!(10 * paths <= 320 * 320 * batch, "{batch}");
    }
    // A companion: of another size they are others.
    assert!(
        with(&|s| (s.width, s.height, s.crop.width, s.crop.height) = (32, 32, 32, 32)) != plain
    );
}

/// Mean and standard error of an image, by channel.
fn mean(film: &Film) -> [[f64; 2]; 3] {
    let pixels = film.rect().pixels();
    let variance = film.variance_of_image_mean().expect("16 batches");
    [0, 1, 2].map(|c| {
        let sum: f64 = (0..pixels).map(|i| film.mean(i)[c]).sum();
        [sum / pixels as f64, variance[c].sqrt()]
    })
}

fn film(scene: &Scene, settings: &Settings) -> Film {
    let mut renderer = gpu_renderer(scene, settings);
    let outcome = render_quietly(&mut renderer, settings).unwrap_or_else(|e| panic!("{e}"));
    outcome.film
}

/// How far the mean with the cache is from that without at most, with a confidence of 99 %, relative; and in
/// standard errors.
fn bias(with: &Film, without: &Film) -> [f64; 2] {
    let channels = std::iter::zip(mean(with), mean(without));
    let of = channels.map(|([a, e], [b, f])| {
        let error = e.hypot(f);
        [((a - b).abs() + 2.576 * error) / b, (a - b).abs() / error]
    });
    of.fold([0.0; 2], |[x, y], [a, b]| [x.max(a), y.max(b)])
}

/// Scenes, and the bias that is looked for: what the samples can tell.
fn scenes() -> Vec<(&'static str, u64, f64)> {
    match thorough() {
        false => vec![("lecture", 4096, 2.0e-3), ("glass", 4096, 4.0e-3)],
        true => vec![
            ("lecture", 1 << 15, 1.0e-3),
            ("glass", 1 << 15, 1.5e-3),
            ("lecture-reflective", 1 << 15, 1.0e-3),
            ("tests/three-lamps", 1 << 14, 1.0e-3),
            ("tests/nested", 1 << 14, 2.0e-3),
        ],
    }
}

#[test]
fn it_changes_no_mean() {
    for (name, spp, most) in scenes() {
        let scene = scene_file(format!("scenes/{name}.toml"));
        let with = cached(&scene, 48, 48, spp);
        if job(&scene, &with).cells().is_none() {
            continue;
        }
        let without = Settings {
            radiance_cache: false,
            seed: 99,
            ..with.clone()
        };
        let [bias, z] = bias(&film(&scene, &with), &film(&scene, &without));
        eprintln!("{name}: biased by at most {bias:.5}, z {z:.2}");
        assert!(bias < most && z < 4.1, "{name}: {bias} {z}");
    }
}

/// The mean of a small image over paths of the reference, and its standard error from the batches, by channel.
fn reference_mean(scene: &Scene, corrected: f64, factor: f64, batches: u64) -> [[f64; 2]; 3] {
    let settings = cached(scene, 12, 12, 64);
    let placement = Placement::new(scene, 12, 12);
    let cells = survey(
        scene,
        &placement,
        &Settings {
            width: 200,
            height: 200,
            ..settings.clone()
        },
    );
    let plain = PathTracer::new(scene, &placement, &settings);
    let of_batch = |b: u64| {
        let first = 64 + 16 * b;
        let (mut values, _) = plain.pilot(&cells, first, 16);
        values.iter_mut().for_each(|value| *value *= factor);
        let tracer = PathTracer {
            cache: Some(Cache {
                cells: &cells,
                values: &values,
                corrected,
            }),
            ..plain
        };
        let mut sum = DVec3::ZERO;
        for pixel in 0..144 {
            for sample in first..first + 16 {
                sum += tracer.trace([pixel % 12, pixel / 12], sample).radiance;
            }
        }
        sum / (144.0 * 16.0)
    };
    let sums: Vec<DVec3> = (0..batches).map(of_batch).collect();
    [0, 1, 2].map(|c| {
        let values: Vec<f64> = sums.iter().map(|sum| sum[c]).collect();
        let (mean, error) = gpu_trace::statistics::mean_and_error(&values);
        [mean, error]
    })
}

/// Without corrections, or with values that are wrong, the mean is another one: what the corrections are for.
#[test]
fn companion_without_corrections_the_mean_is_wrong() {
    let room = scene(
        "[camera]\nposition = [0, 1, 4]\nlook_at = [0, 0.8, 0]\nfov = 50.0\n[image]\nwidth = 12\nheight = 12\n\
         [environment]\nradiance = [0.3, 0.3, 0.3]\n\
         [material.floor]\ntype = \"diffuse\"\nalbedo = [0.8, 0.8, 0.8]\n\
         [material.lamp]\ntype = \"diffuse\"\nalbedo = [0, 0, 0]\nemission = [40, 40, 40]\n\
         [[sphere]]\ncenter = [0, -1000, 0]\nradius = 1000\nmaterial = \"floor\"\n\
         [[sphere]]\ncenter = [-0.7, 0.6, 0]\nradius = 0.6\nmaterial = \"floor\"\n\
         [[sphere]]\ncenter = [0.7, 0.5, 0.2]\nradius = 0.5\nmaterial = \"floor\"\n\
         [[sphere]]\ncenter = [0.1, 2, 0.5]\nradius = 0.1\nmaterial = \"lamp\"\n",
    );
    let batches = if thorough() { 400 } else { 60 };
    let right = reference_mean(&room, CORRECTED, 1.0, batches);
    let truth = {
        let plain = settings(&room, 12, 12, 16_384);
        mean(&film(&room, &plain))
    };
    let apart = |means: [[f64; 2]; 3]| {
        let z = std::iter::zip(means, truth).map(|([a, e], [b, f])| (a - b).abs() / e.hypot(f));
        z.fold(0.0, f64::max)
    };
    let uncorrected = reference_mean(&room, 0.0, 1.0, batches);
    let bright = reference_mean(&room, CORRECTED, 1.1, batches);
    let [right, uncorrected, bright] = [right, uncorrected, bright].map(apart);
    eprintln!("right {right:.2}, uncorrected {uncorrected:.2}, brighter values {bright:.2}");
    assert!(right < 4.1, "{right}");
    assert!(uncorrected > 4.5 && bright > 4.5, "{uncorrected} {bright}");
}

/// The variance of an image's mean over seeds, over what films say of it from their batches' means, and over what
/// independent pixels would have; for the channel sums.
fn stated(scene: &Scene, seeds: u64) -> [f64; 2] {
    let settings = cached(scene, 32, 32, 256);
    let mut renderer = gpu_renderer(scene, &settings);
    let (mut means, mut said, mut independent) = (Vec::new(), 0.0, 0.0);
    for seed in 0..seeds {
        renderer = renderer.with_seed(seed);
        let outcome = render_quietly(&mut renderer, &settings).unwrap_or_else(|e| panic!("{e}"));
        let film = outcome.film;
        let pixels = film.rect().pixels();
        means.push(mean(&film)[1][0]);
        said += mean(&film)[1][1].powi(2) / seeds as f64;
        let own = |i| film.variance_of_mean(i).expect("16 batches")[1];
        let own: f64 = (0..pixels).map(own).sum();
        independent += own / (pixels as f64).powi(2) / seeds as f64;
    }
    let (_, error) = gpu_trace::statistics::mean_and_error(&means);
    let true_ = error * error * seeds as f64;
    [true_ / said, true_ / independent]
}

#[test]
fn the_error_of_the_mean_is_that_of_the_batches() {
    let seeds: u64 = if thorough() { 200 } else { 60 };
    let [said, independent] = stated(&room(), seeds);
    eprintln!(
        "variance over seeds: {said:.3} of what is said, {independent:.3} of independent pixels'"
    );
    // A variance from n seeds has a standard error of sqrt(2/n).
    let most = 4.0 * f64::sqrt(2.0 / seeds as f64);
    assert!((said - 1.0).abs() < most, "{said}");
    // A companion: as if pixels were independent.
    assert!(independent > 1.0 + most, "{independent}");
}

#[test]
fn it_is_off_where_it_would_not_be_right() {
    let room = room();
    let lens = scene_file("scenes/glass.toml");
    let why = |scene: &Scene, change: &dyn Fn(&mut Settings)| {
        let mut settings = cached(scene, 64, 64, 64);
        change(&mut settings);
        let job = job(scene, &settings);
        assert_eq!(job.cells().is_none(), job.cache_obstacle().is_some());
        job.cache_obstacle()
    };
    assert_eq!(why(&room, &|_| {}), None);
    assert_eq!(why(&lens, &|_| {}), None);
    let changes: [(&dyn Fn(&mut Settings), &str); 8] = [
        (&|s| s.integrator = Integrator::Bsdf, "--integrator"),
        (&|s| s.sampler = Sampler::Independent, "--sampler"),
        (&|s| s.max_bounces = 63, "--max-bounces"),
        (&|s| s.max_bounces = 1025, "--max-bounces"),
        (&|s| s.classes = true, "layers"),
        (&|s| s.offset = Offset::Ulp, "--offset"),
        (&|s| s.geometry = GeometryChoice::Bvh, "tree"),
        (
            &|s| (s.view, s.geometry) = (Some(View::BvhCost), GeometryChoice::Bvh),
            "--view",
        ),
    ];
    for (change, word) in changes {
        let why = why(&room, change).expect("an obstacle");
        assert!(why.contains(word), "{why}");
    }
    for (name, word) in [
        ("motion", "move"),
        ("prism", "dispersion"),
        ("field", "tree"),
        ("mix", "diffuse"),
    ] {
        let scene = scene_file(format!("scenes/{name}.toml"));
        let settings = cached(&scene, 64, 64, 64);
        let placement = Placement::new(&scene, 64, 64);
        let why = obstacle(&scene, &placement, &settings);
        assert!(why.is_some_and(|why| why.contains(word)), "{name}: {why:?}");
    }
}

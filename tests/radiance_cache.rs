//! The radiance cache: its charts, that it changes no mean, its error bars, and where it is off.
//!
//! That the kernel traces the reference's paths is in `agreement`, that any split gives the same bits in `claims`.

use glam::DVec2;
use gpu_trace::effects::{Effect, Effects, cache_obstacle};
use gpu_trace::film::Film;
use gpu_trace::gpu::renderer::GpuRenderer;
use gpu_trace::job::Job;
use gpu_trace::placement::Placement;
use gpu_trace::placement::cells::Cells;
use gpu_trace::placement::cells::chart::{Chart, EVEN};
use gpu_trace::render::render_quietly;
use gpu_trace::sampler::Sampler;
use gpu_trace::scene::Scene;
use gpu_trace::settings::{GeometryChoice, Integrator, Offset, Settings, View};
use gpu_trace::shader::steps::{LOOP_ITERATIONS, vertex_steps};
use gpu_trace::statistics::mean_and_error;
use gpu_trace::verify::{Random, settings};

use crate::common::blocks::blocks_of_seeds;
use crate::common::images::{Left, assert_alike, channels_by_batches};
use crate::common::{cpu_renderer, gpu, gpu_renderer, job, scene, scene_file};
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

/// The largest difference of area() from what small steps on the chart tell, relative, with the area multiplied by
/// `factor` in the outer part: where a map is folded over, or a grid is no longer even.
fn area_off(chart: &Chart, placement: &Placement, index: usize, factor: f64) -> f64 {
    let sphere = &placement.spheres[index];
    let mut random = Random::new("areas");
    let mut worst = 0.0f64;
    for _ in 0..2000 {
        let [x, y, ..] = random.unit4().map(|u| 1.8 * f64::from(u) - 0.9);
        let place = DVec2::new(x, y);
        // Not over a fold, nor where a grid changes. Central differences are off by the square of the step.
        let step = 1.0e-5;
        let folds = [
            x,
            y,
            x.abs() + y.abs() - 1.0,
            x.abs() - EVEN,
            y.abs() - EVEN,
        ];
        if folds.iter().any(|x| x.abs() < 2.0 * step) {
            continue;
        }
        let at = |d: DVec2| chart.point(sphere, place + d).offset;
        let along = |d: DVec2| (at(d) - at(-d)) / (2.0 * step);
        let area = along(DVec2::X * step)
            .cross(along(DVec2::Y * step))
            .length();
        let outer = match chart.width {
            None => x.abs() + y.abs() > 1.0,
            Some(_) => place.abs().max_element() > EVEN,
        };
        let said = chart.area(sphere, place) * if outer { factor } else { 1.0 };
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
        // A companion: an area that is a hundred thousandth off.
        assert!(area_off(&chart, &placement, index, 1.0 + 1.0e-5) > 1.0e-6);
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

fn film_of(renderer: &mut GpuRenderer, settings: &Settings) -> Film {
    let outcome = render_quietly(renderer, settings).unwrap_or_else(|e| panic!("{e}"));
    outcome.film
}

/// Pixels of a side of the image, and of the blocks whose means are compared.
const SIZE: u32 = 128;
const BLOCK: usize = 16;

/// A small lamp close to a floor beside a wall: its spot is smaller than a cell, and what of the cell is seen from the
/// wall depends on where.
fn corner() -> Scene {
    scene(
        "[camera]\nposition = [2, 1, 0.5]\nlook_at = [0, 0.4, 0]\nfov = 45.0\n[image]\nwidth = 128\nheight = 128\n\
         [material.gray]\ntype = \"diffuse\"\nalbedo = [0.8, 0.7, 0.6]\n\
         [material.lamp]\ntype = \"diffuse\"\nalbedo = [0, 0, 0]\nemission = [400, 400, 400]\n\
         [[sphere]]\ncenter = [0, -1000, 0]\nradius = 1000\nmaterial = \"gray\"\n\
         [[sphere]]\ncenter = [-1000, 0, 0]\nradius = 1000\nmaterial = \"gray\"\n\
         [[sphere]]\ncenter = [0.5, 0.8, -0.4]\nradius = 0.3\nmaterial = \"gray\"\n\
         [[sphere]]\ncenter = [0.3, 0.04, 0]\nradius = 0.02\nmaterial = \"lamp\"\n",
    )
}

/// Scenes with the seeds over which they are averaged, and whether corrections show at that.
fn scenes() -> Vec<(&'static str, Scene, u64, bool)> {
    let file = |name: &str| scene_file(format!("scenes/{name}.toml"));
    match thorough() {
        false => vec![("corner", corner(), 8, true)],
        true => vec![
            ("corner", corner(), 100, true),
            ("lecture", file("lecture"), 100, false),
            ("glass", file("glass"), 100, false),
            ("lecture-reflective", file("lecture-reflective"), 60, false),
            ("three-lamps", file("tests/three-lamps"), 60, false),
        ],
    }
}

/// What the mean of the squares may be. Blocks have noise in common: in `corner` they vary as some 18 independent ones
/// would, so that it has a standard deviation of a third. Without corrections it is 19 there with 8 seeds, 205 with 100.
const APART: f64 = 2.2;

#[test]
fn it_changes_no_mean() {
    for (name, scene, seeds, shows) in scenes() {
        let with = Settings {
            max_bounces: 64,
            ..cached(&scene, SIZE, SIZE, 128)
        };
        let without = Settings {
            radiance_cache: false,
            ..with.clone()
        };
        assert!(job(&scene, &with).cells().is_some(), "{name}");
        let renderer = gpu_renderer(&scene, &without);
        let truth = blocks_of_seeds(renderer, &without, seeds..2 * seeds, BLOCK);
        let found = blocks_of_seeds(gpu_renderer(&scene, &with), &with, 0..seeds, BLOCK);
        let _left = Left::of(format!("radiance cache, {name}"), &found, &truth);
        let [squares, z, unseen] = found.apart(&truth);
        eprintln!(
            "{name}: squares of z {squares:.3}; mean: z {z:.2}, biases below {unseen:.5} are not seen"
        );
        // The image's mean is one number; its t has some 14 degrees of freedom with the fewest seeds.
        assert!(squares < APART && z < 4.5, "{name}: {squares} {z}");
        if !shows {
            continue;
        }
        // A companion: without corrections blocks have other means.
        let never = [("CORRECTED", -1.0)];
        let renderer = GpuRenderer::with_constants(gpu(), &job(&scene, &with), &never);
        let renderer = renderer.unwrap_or_else(|e| panic!("{e}"));
        let wrong = blocks_of_seeds(renderer, &with, 0..seeds, BLOCK);
        let [squares, z, _] = wrong.apart(&truth);
        eprintln!("{name} without corrections: squares of z {squares:.3}; mean: z {z:.2}");
        assert!(squares > APART, "{name}: {squares}");
    }
}

/// The variance of an image's mean over seeds, over what films say of it from their batches' means, and over what
/// independent pixels would have; of red, which reaches most by way of walls.
fn stated(scene: &Scene, seeds: u64) -> [f64; 2] {
    let settings = cached(scene, 128, 128, 64);
    let mut renderer = gpu_renderer(scene, &settings);
    let (mut means, mut said, mut independent) = (Vec::new(), 0.0, 0.0);
    for seed in 0..seeds {
        renderer = renderer.with_seed(seed);
        let film = film_of(&mut renderer, &settings);
        let [value, error] = channels_by_batches(&film)[0];
        means.push(value);
        said += error.powi(2) / seeds as f64;
        let pixels = film.rect().pixels();
        let own = |i| film.variance_of_mean(i).expect("16 batches")[0];
        let own: f64 = (0..pixels).map(own).sum();
        independent += own / (pixels as f64).powi(2) / seeds as f64;
    }
    let (_, error) = mean_and_error(&means);
    let variance = error * error * seeds as f64;
    [variance / said, variance / independent]
}

#[test]
fn the_error_of_the_mean_is_that_of_the_batches() {
    let seeds: u64 = if thorough() { 200 } else { 40 };
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

/// The dark underside of a ball, from which no lamp is seen: many cells have no light in a pilot, nor any ray, and are
/// cells all the same.
#[test]
fn dark_cells_are_cells() {
    let ball = |albedo: f64| {
        scene(&format!(
            "[camera]\nposition = [0, 2, 6]\nlook_at = [0, 0.5, 0]\nfov = 40.0\n[image]\nwidth = 96\nheight = 96\n\
             [material.dark]\ntype = \"diffuse\"\nalbedo = [{albedo}, {albedo}, {albedo}]\n\
             [material.light]\ntype = \"diffuse\"\nalbedo = [0.9, 0.9, 0.9]\n\
             [material.lamp]\ntype = \"diffuse\"\nalbedo = [0, 0, 0]\nemission = [20, 20, 20]\n\
             [[sphere]]\ncenter = [0, -100, 0]\nradius = 100\nmaterial = \"light\"\n\
             [[sphere]]\ncenter = [0, 1.8, 0]\nradius = 1.5\nmaterial = \"dark\"\n\
             [[sphere]]\ncenter = [3, 6, 2]\nradius = 0.5\nmaterial = \"lamp\"\n",
        ))
    };
    let dark = ball(0.03);
    let settings = cached(&dark, 96, 96, 64);
    let outcome = render_quietly(&mut cpu_renderer(&dark, &settings), &settings);
    let reference = outcome.unwrap_or_else(|e| panic!("{e}")).film;
    let film = |scene: &Scene| film_of(&mut gpu_renderer(scene, &settings), &settings);
    let off = |film: &Film| {
        let [found, wanted] = [film, &reference].map(channels_by_batches);
        let pairs = std::iter::zip(found, wanted);
        let off = pairs.map(|([a, _], [b, _])| (a / b - 1.0).abs());
        off.fold(0.0, f64::max)
    };
    // Found 1e-7, which is rounding; 1e-4 where such cells were taken for none.
    let found = film(&dark);
    let by = off(&found);
    assert_alike("dark cells", &found, &reference, by < 1.0e-5, by);
    // A companion: a hundredth more is reflected.
    assert!(off(&film(&ball(0.0303))) > 1.0e-5);
}

/// The reference says the same of the image's mean, and parts of a render add up to the whole.
#[test]
fn the_error_of_the_mean_is_that_of_all_parts() {
    let room = room();
    let whole = cached(&room, 24, 24, 128);
    let film = film_of(&mut gpu_renderer(&room, &whole), &whole);
    let parts = [0..64, 64..128].map(|samples| {
        let part = Settings {
            samples,
            ..whole.clone()
        };
        film_of(&mut gpu_renderer(&room, &part), &part)
    });
    let [first, rest] = parts;
    let mut joined = first.clone();
    joined.join(&rest);
    let outcome = render_quietly(&mut cpu_renderer(&room, &whole), &whole);
    let reference = outcome.unwrap_or_else(|e| panic!("{e}")).film;
    let errors_of = |film: &Film| channels_by_batches(film).map(|[_, error]| error);
    let errors = [&film, &joined, &reference].map(errors_of);
    let near = |a: [f64; 3], b: [f64; 3], most: f64| {
        std::iter::zip(a, b).all(|(a, b)| (a / b - 1.0).abs() < most)
    };
    let said = format!("{errors:?}");
    let of_parts = near(errors[1], errors[0], 1.0e-9);
    assert_alike("the error of parts", &joined, &film, of_parts, &said);
    let of_reference = near(errors[2], errors[0], 1.0e-2);
    assert_alike("the error", &film, &reference, of_reference, &said);
    // A companion: a part has another error.
    assert!(!near(errors_of(&first), errors[0], 1.0e-2));
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
    type Change<'a> = &'a dyn Fn(&mut Settings);
    let changes: [(Change<'_>, &str); 8] = [
        (&|s| s.integrator = Integrator::Bsdf, "--integrator"),
        (&|s| s.sampler = Sampler::Independent, "--sampler"),
        (&|s| s.max_bounces = 63, "--max-bounces"),
        (&|s| s.max_bounces = 129, "--max-bounces"),
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
        ("mix", "textures"),
    ] {
        let scene = scene_file(format!("scenes/{name}.toml"));
        let settings = Settings {
            max_bounces: 64,
            ..cached(&scene, 64, 64, 64)
        };
        let placement = Placement::new(&scene, 64, 64);
        let why = cache_obstacle(&scene, &placement, &settings);
        assert!(why.is_some_and(|why| why.contains(word)), "{name}: {why:?}");
    }
}

/// A room of large spheres with the most lamps that are weighed, and a ball of a mix: a mirror and flaked paints.
fn mixed_room(parts: usize) -> Scene {
    let mut text = String::from(
        "[camera]\nposition = [0, 0, 3]\nlook_at = [0, 0, 0]\nfov = 40\n[image]\nwidth = 8\nheight = 8\n\
         [material.wall]\ntype = \"diffuse\"\nalbedo = [0.5, 0.5, 0.5]\n[material.glass]\ntype = \"dielectric\"\n\
         ior = 1.5\n[material.lamp]\ntype = \"diffuse\"\nalbedo = [0, 0, 0]\nemission = [1, 1, 1]\n\
         [material.paint0]\ntype = \"mirror\"\nreflectance = [0.9, 0.9, 0.9]\n",
    );
    for i in 1..parts {
        text += &format!(
            "[material.paint{i}]\ntype = \"car-paint\"\ndiffuse = [0.1, 0.1, 0.0{i}]\n\
             specular = [[0.03, 0.03, 0.03], [0.05, 0.05, 0.05], [0, 0, 0]]\nf0 = [0.8, 0.8, 0.8]\n\
             m = [0.4, 0.2, 0.1]\nclearcoat = {{ ior = 1.5 }}\n\
             flakes = {{ density = 0.5, scale = 20.0, spread = 0.2, jitter = 0.5, color = [0.1, 0.1, 0.1] }}\n"
        );
    }
    for i in 1..parts {
        let rest = if i + 1 < parts { "mix" } else { "paint" };
        let rest = format!("{rest}{}", if i + 1 < parts { i + 1 } else { 0 });
        text += &format!(
            "[material.mix{i}]\ntype = \"mix\"\nmaterials = [\"paint{i}\", \"{rest}\"]\nweight = 0.5\n"
        );
    }
    let mut sphere = |[x, y, z]: [f64; 3], radius: f64, material: &str| {
        text += &format!(
            "[[sphere]]\ncenter = [{x:?}, {y:?}, {z:?}]\nradius = {radius:?}\nmaterial = \"{material}\"\n"
        );
    };
    sphere([0.0; 3], 0.5, if parts > 1 { "mix1" } else { "paint0" });
    sphere([0.0, 0.0, -2.0], 0.5, "glass");
    for i in 0..8 {
        sphere([f64::from(i), 6.0, 0.0], 0.2, "lamp");
    }
    for i in 0..54 {
        sphere([0.0, -1.0e4 - 1.0 - f64::from(i), 0.0], 1.0e4, "wall");
    }
    scene(&text)
}

/// A pilot's loop does not look whether a driver has ended it, so a path of it must make fewer iterations than drivers
/// stand, in the worst of all scenes that have a cache.
#[test]
fn a_pilots_path_fits_what_drivers_stand() {
    let iterations = |parts: usize| {
        let scene = mixed_room(parts);
        let settings = Settings {
            geometry: GeometryChoice::List,
            ..cached(&scene, 8, 8, 16)
        };
        let placement = Placement::new(&scene, 8, 8);
        assert!(placement.poles > 50 && placement.lights.table.len() == 8);
        let effects = Effects::derive(&scene, &placement, &settings);
        let effects = effects.with(&[Effect::RadianceCache], "the worst case");
        let steps = vertex_steps(&placement, &effects);
        let why = cache_obstacle(&scene, &placement, &settings);
        (
            why,
            (u64::from(settings.max_bounces) + 1) * u64::from(steps),
        )
    };
    let (why, most) = iterations(4);
    assert_eq!(why, None);
    assert!(most <= LOOP_ITERATIONS, "{most}");
    // Companion: beyond what has a cache it would not fit.
    let (why, more) = iterations(8);
    assert!(why.is_some_and(|why| why.contains("more than 4 materials")));
    assert!(more > LOOP_ITERATIONS, "{more}");
    // Without a mix there may be more bounces: the forms that look for flakes are the longest.
    let scene = mixed_room(1);
    let placement = Placement::new(&scene, 8, 8);
    let settings = Settings {
        geometry: GeometryChoice::List,
        max_bounces: 128,
        ..cached(&scene, 8, 8, 16)
    };
    assert_eq!(cache_obstacle(&scene, &placement, &settings), None);
    let effects = Effects::derive(&scene, &placement, &settings);
    let flaked = Effect::named("car_paint_coated_flakes").expect("a form");
    let steps = vertex_steps(&placement, &effects.with(&[flaked], "the worst case"));
    assert!(129 * u64::from(steps) <= LOOP_ITERATIONS, "{steps}");
}

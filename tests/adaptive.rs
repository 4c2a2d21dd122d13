//! Adaptive sampling: samples go where the error is, and no pixel's mean has a bias.

use std::collections::BTreeSet;

use crate::common::blocks::Blocks;
use crate::common::images::{Left, assert_alike, assert_same, mean};
use crate::common::{cpu_renderer, gpu_renderer, render_cpu, render_gpu, scene, scene_file};
use crate::thorough::thorough;
use gpu_trace::film::{
    Allocation, Estimate, Film, PILOT_SAMPLES, PixelSums, Tally, Window, next_look, window_end,
};
use gpu_trace::gpu::renderer::{DispatchLimits, GpuRenderer};
use gpu_trace::render::{Control, Renderer as _, render_quietly};
use gpu_trace::scene::Scene;
use gpu_trace::settings::{Integrator, Rect, Settings};
use gpu_trace::statistics::mean_and_error;
use gpu_trace::verify::settings;

fn adaptive(scene: &Scene, width: u32, height: u32, spp: u64) -> Settings {
    Settings {
        // Where nothing looks for lamps, they are found by chance.
        integrator: Integrator::Bsdf,
        adaptive: true,
        ..settings(scene, width, height, spp)
    }
}

/// A film of 64 samples in 16 batches with this mean and standard deviation of a sample.
fn pilot(rect: Rect, sample: impl Fn(u32, u32) -> (f64, f64)) -> Film {
    let mut film = Film::new(rect);
    let pixel = |i: usize| {
        let (mean, deviation) = sample(i as u32 % rect.width, i as u32 / rect.width);
        PixelSums {
            sum: [64.0 * mean; 3],
            // 15 degrees of freedom of a batch of 4.
            m2: [15.0 * 4.0 * deviation * deviation; 3],
        }
    };
    film.add(&Window {
        image: Vec::new(),
        rect,
        samples: 0..64,
        batch: 4,
        pixels: (0..rect.pixels()).map(pixel).collect(),
        aovs: Vec::new(),
        tally: Tally::default(),
    });
    film
}

#[test]
fn samples_go_as_the_root_of_the_variance() {
    let rect = Rect {
        x: 3,
        y: 5,
        width: 61,
        height: 20,
    };
    // Columns of tiles of errors 1, 1, 1, 4, 4, 16, 16, 16.
    let errors = [1.0, 1.0, 1.0, 4.0, 4.0, 16.0, 16.0, 16.0];
    let film = pilot(rect, |x, _| (1.0, errors[x as usize / 8]));
    let allocation = Allocation::of(&film, 100.0);
    let steps: Vec<u8> = (0..8).map(|t| allocation.step(t * 8)).collect();
    // A neighbour counts half: the last of the ones has 2, the last of the fours 8.
    assert_eq!(steps, [0, 0, 1, 2, 3, 4, 4, 4]);
    let last_row = (rect.pixels() - rect.width as usize)..rect.pixels();
    let row: Vec<u8> = last_row.clone().map(|i| allocation.step(i)).collect();
    assert!((0..61).all(|x| row[x] == steps[x / 8]), "{row:?}");
    // The mean weight and the counts are those of the pixels.
    let all: f64 = (0..rect.pixels())
        .map(|i| f64::exp2(allocation.step(i).into()))
        .sum();
    assert!((allocation.mean_weight() - all / rect.pixels() as f64).abs() < 1.0e-12);
    assert_eq!(
        allocation.counts().iter().sum::<u64>(),
        rect.pixels() as u64
    );
    // No more than was allowed, and nothing where nothing is known.
    assert!(Allocation::of(&film, 3.0).mean_weight() <= 3.0);
    assert_eq!(Allocation::of(&film, 1.0), Allocation::uniform(rect));
    let black = pilot(rect, |_, _| (0.0, 0.0));
    assert_eq!(Allocation::of(&black, 100.0), Allocation::uniform(rect));
    assert_eq!(
        Allocation::of(&Film::new(rect), 100.0),
        Allocation::uniform(rect)
    );
    // One spot does not starve the rest: what is all alike stays so.
    let spot = pilot(rect, |x, y| {
        (1.0, if (x, y) == (30, 10) { 40.0 } else { 1.0 })
    });
    let steps: Vec<u8> = (0..8)
        .map(|t| Allocation::of(&spot, 100.0).step(t * 8))
        .collect();
    assert_eq!((steps[0], steps[7]), (0, 0), "{steps:?}");
}

/// A floor under a sky, with a lamp of this radius and radiance at a height above it.
fn lamp(radius: f64, height: f64, emission: f64) -> Scene {
    scene(&format!(
        "camera = {{ position = [0, 1, 9], look_at = [0, 1.2, 0], fov = 40 }}
        image = {{ width = 32, height = 24 }}
        environment = {{ radiance = [0.3, 0.3, 0.3] }}
        [render]
        max_bounces = 4
        [material.floor]
        type = \"diffuse\"
        albedo = [0.7, 0.6, 0.5]
        [material.lamp]
        type = \"diffuse\"
        albedo = [0, 0, 0]
        emission = [{emission:?}, {emission:?}, {emission:?}]
        [[sphere]]
        center = [0, -20, 0]
        radius = 20
        material = \"floor\"
        [[sphere]]
        center = [0.9, {height:?}, 0.5]
        radius = {radius:?}
        material = \"lamp\""
    ))
}

/// All of its light falls on what is near it.
fn local() -> Scene {
    lamp(0.05, 0.12, 40.0)
}

#[test]
fn counts_add_up_and_the_error_falls() {
    let scene = local();
    let renders = |settings: &Settings| {
        let mut renderer = gpu_renderer(&scene, settings);
        render_quietly(&mut renderer, settings).unwrap_or_else(|e| panic!("{e}"))
    };
    let outcome = renders(&adaptive(&scene, 64, 48, 1024));
    let film = &outcome.film;
    assert_eq!(outcome.pilot, PILOT_SAMPLES);
    let all: u64 = (0..film.rect().pixels()).map(|i| film.samples_of(i)).sum();
    assert_eq!(
        film.paths(),
        all + PILOT_SAMPLES * film.rect().pixels() as u64
    );
    assert!(film.paths() <= 1024 * film.rect().pixels() as u64);
    assert!(film.mean_samples() > 900.0, "{}", film.mean_samples());
    assert!(film.most_samples() >= 4 * film.samples(), "{film:?}");
    assert!((film.mean_samples() - all as f64 / film.rect().pixels() as f64).abs() < 1.0e-9);
    // With no more samples than a uniform render has.
    let uniform = renders(&Settings {
        adaptive: false,
        ..adaptive(&scene, 64, 48, 1024)
    });
    let _left = Left::of("adaptive or not", film, &uniform.film);
    let error = |outcome: &gpu_trace::render::Outcome| outcome.estimate.error.expect("an error");
    eprintln!(
        "error {:.4}, uniform {:.4}",
        error(&outcome),
        error(&uniform)
    );
    assert!(error(&outcome) < 0.8 * error(&uniform));
    // The last tiles' share of samples is what the error says.
    let again = renders(&adaptive(&scene, 64, 48, 1024));
    assert_same("adaptive again", &again.film, film);
}

#[test]
fn timing_changes_no_bits() {
    let scene = local();
    let settings = adaptive(&scene, 61, 44, 300);
    let whole = render_gpu(&scene, &settings);
    let limits = DispatchLimits {
        tiles: 3,
        samples: 20,
    };
    let mut renderer: GpuRenderer = gpu_renderer(&scene, &settings).with_limits(limits);
    let parts = render_quietly(&mut renderer, &settings).unwrap_or_else(|e| panic!("{e}"));
    assert_same("adaptive in parts", &parts.film, &whole);
    let variances = |film: &Film| -> Vec<_> {
        (0..film.rect().pixels())
            .map(|i| film.variance_of_mean(i))
            .collect()
    };
    assert_eq!(variances(&whole), variances(&parts.film));
    assert_eq!(whole.tally(), parts.film.tally());
}

#[test]
fn device_and_host_take_the_same_samples() {
    struct On;
    impl Control for On {
        fn proceed(&mut self, _: u64) -> bool {
            true
        }
    }
    for name in ["lecture", "tests/lamps"] {
        let scene = scene_file(format!("scenes/{name}.toml"));
        let settings = adaptive(&scene, 60, 44, 192);
        let (a, b) = (render_gpu(&scene, &settings), render_cpu(&scene, &settings));
        // Rounding in f32 may move a tile across a boundary between two steps.
        let pixels = a.rect().pixels();
        let alike = |i: &usize| a.allocation().step(*i) == b.allocation().step(*i);
        let same = (0..pixels).filter(alike).count();
        let what = format!("{same} of {pixels} have as many samples");
        let of_both = format!("adaptive, {name}");
        assert_alike(&of_both, &a, &b, 10 * same >= 9 * pixels, what);
        assert!(a.most_samples() > a.samples(), "{name}: nothing to compare");
        // The same tiles of both.
        let tiles = a.allocation().tiles(1).expect("several steps");
        let mut device = gpu_renderer(&scene, &settings);
        let mut host = cpu_renderer(&scene, &settings);
        // What was there before must not shine through.
        for samples in [0..16, 16..64] {
            let a = device.render_tiles(samples.clone(), Some(&tiles), &mut On);
            let b = host.render_tiles(samples.clone(), Some(&tiles), &mut On);
            let (a, b) = (a.expect("a window"), b.expect("a window"));
            let mut near = 0;
            for (i, (a, b)) in a.pixels.iter().zip(&b.pixels).enumerate() {
                let chosen = tiles.has_pixel(i as u32 % 60, i as u32 / 60);
                assert!(
                    chosen || (a.sum, b.sum) == ([0.0; 3], [0.0; 3]),
                    "pixel {i}"
                );
                near += usize::from((a.sum[1] - b.sum[1]).abs() <= 1.0e-4 * b.sum[1]);
            }
            assert!(10 * near >= 9 * pixels, "{name}: {near} of {pixels} agree");
            let rays = a.tally.rays as f64 / b.tally.rays as f64;
            assert!((rays - 1.0).abs() < 1.0e-3, "{rays}");
        }
        device
            .render_tiles(64..128, None, &mut On)
            .expect("all tiles");
    }
}

/// The green of each pixel.
fn green(film: &Film) -> Vec<f64> {
    (0..film.rect().pixels()).map(|i| film.mean(i)[1]).collect()
}

/// The mean over the image if the first 64 samples of each pixel decide whether it gets more, and
/// count: `last` has the others.
fn careless(first: &Film, last: &Film) -> f64 {
    let pixels = first.rect().pixels();
    let estimate = Estimate::of(first);
    let floor = (0.1 * estimate.mean).powi(2);
    let limit = estimate.error.expect("16 batches").powi(2);
    let value = |i: usize| {
        let (m, v) = (
            first.mean(i)[1],
            first.variance_of_mean(i).expect("16 batches")[1],
        );
        if v / (m * m + floor) <= limit {
            return m;
        }
        let (a, b) = (first.samples() as f64, last.samples() as f64);
        (a * m + b * last.mean(i)[1]) / (a + b)
    };
    (0..pixels).map(value).sum::<f64>() / pixels as f64
}

#[test]
fn looks_at_the_error_are_few() {
    let (mut look, mut looks) = (next_look(0), Vec::new());
    let mut end = 0;
    while end < 1 << 20 {
        end = window_end(end, 1 << 20);
        if end >= look {
            looks.push(end);
            look = next_look(end);
        }
    }
    assert_eq!(looks[..8], [64, 128, 256, 512, 768, 1024, 1280, 1536]);
    assert!(looks.windows(2).all(|l| 8 * l[1] >= 9 * l[0]), "{looks:?}");
    assert!(looks.len() < 70, "{}", looks.len());
}

#[test]
fn nothing_is_too_dark() {
    // So small that the pilot finds it in some pixels and not in most.
    let scene = lamp(0.15, 0.8, 150.0);
    let (width, height) = (24, 16);
    let run = |renderer: &mut GpuRenderer, settings: &Settings| {
        let outcome = render_quietly(renderer, settings);
        outcome.unwrap_or_else(|e| panic!("{e}")).film
    };
    let long = gpu_trace::verify::settings(&scene, width, height, 1 << 18);
    let reference = render_gpu(&scene, &long);
    let variances = (0..reference.rect().pixels())
        .map(|i| reference.variance_of_mean(i).expect("16 batches")[1]);
    let noise = variances.sum::<f64>().sqrt() / reference.rect().pixels() as f64;
    let truth = mean(&green(&reference));

    let mut renderer = gpu_renderer(&scene, &adaptive(&scene, width, height, 256));
    let (mut all, mut stopped, mut companion) = (Vec::new(), Vec::new(), Vec::new());
    let (mut images, mut stopped_images) = (Vec::new(), Vec::new());
    let mut looks = BTreeSet::new();
    // As many as the companion needs to be found; the long form finds half the bias.
    for seed in 1..=if thorough() { 600 } else { 150 } {
        let settings = Settings {
            seed,
            ..adaptive(&scene, width, height, 256)
        };
        renderer = renderer.with_seed(seed);
        let film = run(&mut renderer, &settings);
        assert!(film.most_samples() > film.samples());
        all.push(mean(&green(&film)));
        images.push(Blocks::of(&film, 1));
        let part = |samples| Settings {
            adaptive: false,
            samples,
            ..settings.clone()
        };
        // Stopped by the error of the image, after very different numbers of samples.
        let film = run(
            &mut renderer,
            &Settings {
                error: Some(0.12),
                ..part(0..1 << 14)
            },
        );
        assert!(Estimate::of(&film).error_at_most <= Some(0.12));
        looks.insert(film.samples());
        stopped.push(mean(&green(&film)));
        stopped_images.push(Blocks::of(&film, 1));
        let first = run(&mut renderer, &part(0..64));
        let last = run(&mut renderer, &part(64..256));
        companion.push(careless(&first, &last));
    }
    let _left = [("adaptive", &images), ("stopped", &stopped_images)]
        .map(|(name, images)| Left::of(name, &Blocks::mean_of(images), &reference));
    let z = |name: &str, means: &[f64]| {
        let (mean, error) = mean_and_error(means);
        let (bias, error) = (mean - truth, error.hypot(noise));
        let [shown, power] = [bias, 3.9 * error].map(|x| 100.0 * x / truth);
        eprintln!("{name}: bias {shown:+.4} %; one of {power:.4} % would be found");
        bias / error
    };
    let z = [
        z("adaptive", &all),
        z("stopped", &stopped),
        z("careless", &companion),
    ];
    eprintln!("stopped at {looks:?}");
    assert!(looks.len() > 3, "{looks:?}");
    assert!(z[0].abs() < 3.9 && z[1].abs() < 3.9, "{z:?}");
    assert!(z[2] < -3.9, "companion: {z:?}");
}

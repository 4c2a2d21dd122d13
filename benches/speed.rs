//! `cargo bench --bench speed`: the kernel against the baseline `naive/kernel.wgsl`, side by side, and what
//! the kernel's own choices are worth. Prints Markdown tables for `benches/RESULTS.md`.
//!
//! Every figure is a ratio of two things that ran in turns, since machines are noisy: the medians
//! of several rounds. Nothing is asserted.

mod loading;
mod materials;
#[expect(dead_code, reason = "f64 is for `hazards` and the tests")]
mod naive;
mod offsets;
mod roofline;
mod trees;

use std::time::Instant;

use gpu_trace::effects::Effect;
use gpu_trace::film::Film;
use gpu_trace::gpu::device::{self, DeviceChoice};
use gpu_trace::gpu::renderer::GpuRenderer;
use gpu_trace::job::prepare;
use gpu_trace::prices::is_absent;
use gpu_trace::render::render_quietly;
use gpu_trace::sampler::Sampler;
use gpu_trace::scene::{Scene, builtin};
use gpu_trace::settings::{GeometryChoice, Integrator, Rect, Settings};
use naive::flat::FlatScene;
use naive::kernel::Kernel;

/// Rounds in which all contestants take turns.
const ROUNDS: usize = 5;
/// Samples a pixel in one turn.
const SPP: u64 = 64;

fn main() {
    // `cargo bench` passes `--bench`; other words choose tables.
    let wanted: Vec<String> = std::env::args()
        .skip(1)
        .filter(|a| !a.starts_with("--"))
        .collect();
    let chosen = |name: &str| wanted.is_empty() || wanted.iter().any(|w| w == name);
    let gpu = device::open(&DeviceChoice::Best).unwrap_or_else(|e| panic!("{e}"));
    let s = &gpu.summary;
    println!("device: {} ({}, {})\n", s.name, s.backend, s.driver);
    if chosen("naive") {
        against_naive();
    }
    if chosen("unused") {
        unused_effects();
    }
    if chosen("geometry") {
        geometry_forms();
    }
    if chosen("materials") {
        materials::run();
    }
    if chosen("trees") {
        trees::run();
    }
    if wanted.iter().any(|w| w == "scale") {
        trees::scale();
    }
    if chosen("roofline") {
        roofline::run();
    }
    if chosen("offsets") {
        offsets::run();
    }
    if chosen("loading") {
        loading::run(&gpu);
    }
}

fn scene(name: &str) -> Scene {
    builtin::resolve(Some(name))
        .unwrap_or_else(|e| panic!("{e}"))
        .scene
}

/// A contestant: renders one turn and returns (paths, seconds).
type Contestant<'a> = Box<dyn FnMut() -> (f64, f64) + 'a>;

/// One of our kernels; `with` names effects that it holds although the scene does not ask.
fn ours(
    scene: &Scene,
    change: impl FnOnce(&mut Settings),
    with: &[&'static str],
) -> Contestant<'static> {
    let mut settings = Settings {
        samples: 0..SPP,
        // What the baseline has: the same paths.
        integrator: Integrator::Bsdf,
        sampler: Sampler::Independent,
        ..Settings::for_scene(scene)
    };
    change(&mut settings);
    let mut job = prepare(scene, &settings).unwrap_or_else(|e| panic!("{e}"));
    if !with.is_empty() {
        let effect =
            |name: &&str| Effect::named(name).unwrap_or_else(|| panic!("no effect {name}"));
        let with: Vec<Effect> = with.iter().map(effect).collect();
        job = job
            .with_effects(&with, "forced")
            .unwrap_or_else(|e| panic!("{e}"));
    }
    let gpu = device::open(&DeviceChoice::Best).unwrap_or_else(|e| panic!("{e}"));
    let mut renderer = GpuRenderer::new(gpu, &job).unwrap_or_else(|e| panic!("{e}"));
    let paths =
        settings.crop.pixels() as f64 * (settings.samples.end - settings.samples.start) as f64;
    Box::new(move || {
        let begin = Instant::now();
        render_quietly(&mut renderer, &settings).unwrap_or_else(|e| panic!("{e}"));
        (paths, begin.elapsed().as_secs_f64())
    })
}

/// The baseline.
fn baseline(scene: &Scene) -> Contestant<'static> {
    let bounces = Settings::for_scene(scene).max_bounces;
    let mut kernel = Kernel::new(&FlatScene::of(scene), bounces);
    let paths = f64::from(scene.width) * f64::from(scene.height) * SPP as f64;
    Box::new(move || {
        let begin = Instant::now();
        kernel.render(0..SPP as u32);
        (paths, begin.elapsed().as_secs_f64())
    })
}

/// One render by our kernel.
fn film_of(scene: &Scene, settings: &Settings) -> Film {
    let job = prepare(scene, settings).unwrap_or_else(|e| panic!("{e}"));
    let gpu = device::open(&DeviceChoice::Best).unwrap_or_else(|e| panic!("{e}"));
    let mut renderer = GpuRenderer::new(gpu, &job).unwrap_or_else(|e| panic!("{e}"));
    let outcome = render_quietly(&mut renderer, settings).unwrap_or_else(|e| panic!("{e}"));
    outcome.film
}

/// Runs all in turns and prints a table with ratios to the first.
fn compare(title: &str, contestants: &mut [(&str, Contestant<'_>)]) {
    for (_, run) in contestants.iter_mut() {
        run();
    }
    let mut rates = vec![Vec::new(); contestants.len()];
    for _ in 0..ROUNDS {
        for ((_, run), rates) in contestants.iter_mut().zip(&mut rates) {
            let (paths, seconds) = run();
            rates.push(paths / seconds);
        }
    }
    println!("{title}\n\n| kernel | Mpaths/s | ratio (median of {ROUNDS}) | lowest | highest |");
    println!("|---|---|---|---|---|");
    for ((name, _), own) in contestants.iter().zip(&rates) {
        let mut ratios: Vec<f64> = own.iter().zip(&rates[0]).map(|(a, b)| a / b).collect();
        ratios.sort_by(f64::total_cmp);
        println!(
            "| {name} | {:.2} | {:.2} | {:.2} | {:.2} |",
            median(own.clone()) * 1.0e-6,
            ratios[ROUNDS / 2],
            ratios[0],
            ratios[ROUNDS - 1],
        );
    }
    println!();
}

/// The middle one of an odd number.
fn median(mut numbers: Vec<f64>) -> f64 {
    numbers.sort_by(f64::total_cmp);
    numbers[numbers.len() / 2]
}

fn against_naive() {
    let scene = scene("lecture");
    compare(
        "`lecture`, 640x640, 64 bounces, the same roulette",
        &mut [
            ("naive (baseline)", baseline(&scene)),
            ("gpu-trace", ours(&scene, |_| (), &[])),
            (
                "gpu-trace, list",
                ours(&scene, |s| s.geometry = GeometryChoice::List, &[]),
            ),
        ],
    );
}

fn unused_effects() {
    let scene = scene("lecture");
    // A build without an effect renders by the same kernel where it has the same text: there is nothing to time.
    let job = prepare(&scene, &Settings::for_scene(&scene)).unwrap_or_else(|e| panic!("{e}"));
    let unused = job.effects().rows().filter(|(_, why)| why.is_empty());
    let (same, differing): (Vec<_>, Vec<_>) = unused
        .map(|(row, _)| row)
        .partition(|row| is_absent(&job, row.effect).unwrap_or_else(|e| panic!("{e}")));
    let differing: Vec<&str> = differing.iter().map(|row| row.name).collect();
    println!(
        "`lecture` does not use {} effects; without the sources of each its kernel is the same, byte for byte, for {} \
         of them, and another one for {differing:?}.\n",
        same.len() + differing.len(),
        same.len(),
    );
    let extras = [
        "interior",
        "mirror",
        "dielectric",
        "reflective",
        "lens",
        "environment",
    ];
    let mut all: Vec<(&str, Contestant<'_>)> =
        vec![("what the scene asks for", ours(&scene, |_| (), &[]))];
    all.push(("the same again", ours(&scene, |_| (), &[])));
    for extra in extras {
        let with: &[&'static str] = if extra == "dielectric" {
            &["dielectric", "interior"]
        } else {
            &[extra]
        };
        all.push((extra, ours(&scene, |_| (), with)));
    }
    all.push(("all of them", ours(&scene, |_| (), &extras)));
    compare(
        "`lecture` with effects that it does not use forced into the kernel",
        &mut all,
    );
}

fn geometry_forms() {
    let field = scene("field");
    for count in [8, 24, 64, 128] {
        let mut part = field.clone();
        part.spheres.truncate(count);
        let small = |s: &mut Settings| {
            (s.width, s.height) = (320, 180);
            s.crop = Rect::whole(320, 180);
        };
        let list = ours(
            &part,
            |s| {
                small(s);
                s.geometry = GeometryChoice::List
            },
            &[],
        );
        let begin = Instant::now();
        let baked = ours(
            &part,
            |s| {
                small(s);
                s.geometry = GeometryChoice::Baked
            },
            &[],
        );
        let compile = begin.elapsed().as_secs_f64();
        compare(
            &format!(
                "the first {count} spheres of `field`, 320x180; baked is compiled in {compile:.2} s"
            ),
            &mut [("list", list), ("baked", baked)],
        );
    }
}

//! From a scene file's text to the first dispatch: the time of each stage, and how it grows with the spheres.

use std::fmt::Write as _;
use std::time::Instant;

use gpu_trace::effects::Effects;
use gpu_trace::gpu::device::Gpu;
use gpu_trace::gpu::renderer::GpuRenderer;
use gpu_trace::job::prepare;
use gpu_trace::placement::Placement;
use gpu_trace::scene::load::load_str;
use gpu_trace::settings::Settings;
use gpu_trace::verify::Random;

/// Spheres of each scene.
const COUNTS: [usize; 3] = [1_000, 10_000, 100_000];
/// Of each time the median of so many is shown.
const ROUNDS: usize = 3;

const STAGES: [&str; 4] = [
    "TOML to scene",
    "placement",
    "effects",
    "kernel, upload, first dispatch",
];

/// The text of a scene with `count` spheres.
type Text = fn(count: usize) -> String;

/// Prints a table for each of some kinds of scenes.
pub(crate) fn run(gpu: &Gpu) {
    let scenes: [(&str, Text); 5] = [
        ("diffuse balls on a wall", diffuse),
        ("lamps, some of them in glass", lamps),
        ("balls of glass that touch", glass),
        ("the same in a plane across x", column),
        ("shells of glass in each other, by four", shells),
    ];
    for (name, text) in scenes {
        table(gpu, name, text);
    }
}

fn table(gpu: &Gpu, name: &str, text: Text) {
    let times = COUNTS.map(|count| {
        let text = text(count);
        let mut rounds: Vec<[f64; 4]> = (0..ROUNDS).map(|_| stages(gpu, &text)).collect();
        let middle = |stage: usize, rounds: &mut Vec<[f64; 4]>| {
            rounds.sort_by(|a, b| a[stage].total_cmp(&b[stage]));
            rounds[ROUNDS / 2][stage]
        };
        [0, 1, 2, 3].map(|stage| middle(stage, &mut rounds))
    });
    println!(
        "{name}: seconds\n\n| spheres | {} | all |",
        STAGES.join(" | ")
    );
    println!("|---|---|---|---|---|---|");
    let row = |first: &str, values: &[f64], digits: usize| {
        let mut line = format!("| {first} |");
        for value in values {
            let _ = write!(line, " {value:.digits$} |");
        }
        println!("{line}");
    };
    let with_sum = |times: &[f64; 4]| [&times[..], &[times.iter().sum()]].concat();
    let times = times.each_ref().map(with_sum);
    for (count, times) in COUNTS.iter().zip(&times) {
        row(&count.to_string(), times, 3);
    }
    // t ~ N^x
    for (from, to) in [(1, 2), (0, 2)] {
        let decades = ((COUNTS[to] / COUNTS[from]) as f64).log10();
        let growth: Vec<f64> = times[to]
            .iter()
            .zip(&times[from])
            .map(|(b, a)| (b / a).log10() / decades)
            .collect();
        let name = format!("exponent from {}", COUNTS[from]);
        row(&name, &growth, 2);
    }
    println!();
}

/// The seconds of each stage.
fn stages(gpu: &Gpu, text: &str) -> [f64; 4] {
    let mut times = [0.0; 4];
    let mut begin = Instant::now();
    let mut lap = |stage: usize| {
        times[stage] = begin.elapsed().as_secs_f64();
        begin = Instant::now();
    };
    let scene = load_str("scene", text)
        .unwrap_or_else(|e| panic!("{e}"))
        .scene;
    lap(0);
    let settings = Settings::for_scene(&scene);
    let placement =
        Placement::with_offset(&scene, settings.width, settings.height, settings.offset);
    lap(1);
    let _ = Effects::derive(&scene, &placement, &settings);
    lap(2);
    // That prepares all of this again; a dispatch of nothing is the last that it does.
    let job = prepare(&scene, &settings).unwrap_or_else(|e| panic!("{e}"));
    let renderer = GpuRenderer::new(gpu.clone(), &job);
    lap(3);
    drop(renderer.unwrap_or_else(|e| panic!("{e}")));
    times
}

fn header() -> String {
    String::from(
        "[camera]\nposition = [0, 5, 40]\nlook_at = [0, 0, 0]\nfov = 40.0\n[image]\nwidth = 64\nheight = 64\n\
         [environment]\nradiance = [0.5, 0.5, 0.5]\n\
         [material.matte]\ntype = \"diffuse\"\nalbedo = [0.5, 0.5, 0.5]\n\
         [material.lamp]\ntype = \"diffuse\"\nalbedo = [0, 0, 0]\nemission = [9, 9, 9]\n\
         [material.glass]\ntype = \"dielectric\"\nior = 1.5\n",
    )
}

fn sphere(text: &mut String, center: [f64; 3], radius: f64, material: &str) {
    let _ = writeln!(
        text,
        "[[sphere]]\ncenter = {center:?}\nradius = {radius:?}\nmaterial = \"{material}\""
    );
}

/// A point of a cube around the origin in which `count` balls of a radius around 0.1 lie loosely.
fn place(random: &mut Random, count: usize) -> [f64; 3] {
    let half = 0.2 * (count as f64).cbrt();
    [(); 3].map(|()| random.range(-half, half))
}

fn diffuse(count: usize) -> String {
    let mut random = Random::new("diffuse");
    let mut text = header();
    sphere(&mut text, [0.0, -1.0e5, 0.0], 1.0e5, "matte");
    for _ in 1..count {
        let center = place(&mut random, count);
        sphere(&mut text, center, random.magnitude(-3.0, -1.0), "matte");
    }
    text
}

fn lamps(count: usize) -> String {
    let mut random = Random::new("lamps");
    let mut text = header();
    for i in 0..count / 2 {
        let center = place(&mut random, count);
        let radius = random.range(0.02, 0.1);
        sphere(&mut text, center, 0.5 * radius, "lamp");
        let other = if i % 2 == 0 { "glass" } else { "lamp" };
        let center = if i % 2 == 0 {
            center
        } else {
            place(&mut random, count)
        };
        sphere(&mut text, center, radius, other);
    }
    text
}

fn glass(count: usize) -> String {
    let mut random = Random::new("glass");
    let mut text = header();
    for _ in 0..count {
        let center = place(&mut random, count);
        sphere(&mut text, center, random.range(0.05, 0.2), "glass");
    }
    text
}

fn column(count: usize) -> String {
    let mut random = Random::new("column");
    let mut text = header();
    let half = 0.1 * (count as f64).sqrt();
    for _ in 0..count {
        let [y, z] = [(); 2].map(|()| random.range(-half, half));
        sphere(&mut text, [0.0, y, z], random.range(0.05, 0.15), "glass");
    }
    text
}

fn shells(count: usize) -> String {
    let mut random = Random::new("shells");
    let mut text = header();
    for _ in 0..count / 4 {
        let center = place(&mut random, count);
        let radius = random.range(0.02, 0.05);
        for i in 0..4 {
            sphere(
                &mut text,
                center,
                radius * (1.0 - 1.0e-4 * f64::from(i)),
                "glass",
            );
        }
    }
    text
}

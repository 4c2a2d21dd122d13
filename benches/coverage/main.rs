//! `cargo bench --bench coverage`: do 95 % intervals hold the truth in 95 % of all pixels? Prints the
//! table of `docs/accuracy.md`; words choose scenes, a number the seeds. After the word `trust`: do verdicts find the
//! errors that are not? Nothing is asserted here: that is for `tests/coverage.rs`.

#[expect(dead_code, reason = "the test asks for more")]
mod study;
mod trust;

use gpu_trace::gpu::device::{self, DeviceChoice};
use gpu_trace::sampler::Sampler;
use gpu_trace::scene::builtin;
use gpu_trace::settings::{Rect, Settings};
use study::{Truth, coverage, runs};

/// Samples at which renders are looked at.
const SAMPLES: [u64; 3] = [128, 512, 2048];
/// Another render's error at these is what renders stop at.
const STOP: u64 = 768;

/// Scene and size.
const CASES: [(&str, u32, u32); 6] = [
    ("lecture", 32, 32),
    ("glass", 40, 32),
    ("lecture-reflective", 32, 32),
    ("field", 16, 9),
    ("scenes/tests/lamps.toml", 40, 30),
    ("scenes/tests/three-lamps.toml", 40, 30),
];

fn main() {
    // `cargo bench` passes `--bench`.
    let words: Vec<String> = std::env::args()
        .skip(1)
        .filter(|a| !a.starts_with("--"))
        .collect();
    let seeds = words.iter().find_map(|w| w.parse().ok()).unwrap_or(200);
    let names: Vec<&String> = words.iter().filter(|w| w.parse::<u64>().is_err()).collect();
    let gpu = device::open(&DeviceChoice::Best).unwrap_or_else(|e| panic!("{e}"));
    let s = &gpu.summary;
    println!(
        "device: {} ({}, {}), {seeds} seeds\n",
        s.name, s.backend, s.driver
    );
    if let Some((_, names)) = names
        .split_first()
        .filter(|(word, _)| word.as_str() == "trust")
    {
        trust::table(&gpu, seeds, names);
        return;
    }
    println!(
        "| scene | sampler | spp | normal | Student | ours | values below 90 %: Student | ours | \
         error | estimated/actual |\n|---|---|---|---|---|---|---|---|---|---|"
    );
    for (scene_name, width, height) in CASES {
        if !names.is_empty() && !names.iter().any(|n| scene_name.contains(n.as_str())) {
            continue;
        }
        let loaded = builtin::resolve(Some(scene_name)).unwrap_or_else(|e| panic!("{e}"));
        let of = |sampler| {
            let settings = Settings {
                width,
                height,
                crop: Rect::whole(width, height),
                sampler,
                ..Settings::for_scene(&loaded.scene)
            };
            runs(&gpu, &loaded.scene, &settings, seeds, &SAMPLES, STOP)
        };
        let both = [Sampler::Sobol, Sampler::Independent].map(|s| (s, of(s)));
        let longest = SAMPLES.len() - 1;
        let truth = Truth::of(both.iter().flat_map(|(_, runs)| &runs.said[longest]));
        for (sampler, runs) in &both {
            for (at, said) in runs.said.iter().enumerate() {
                let c = coverage(said, &runs.said[longest], &truth, 1.0);
                let samples: u64 = said.iter().map(|s| s.samples).sum();
                let spp = match SAMPLES.get(at) {
                    Some(spp) => spp.to_string(),
                    None => format!("{} (`--error {:.2}%`)", samples / seeds, 100.0 * runs.limit),
                };
                let name = scene_name.rsplit('/').next().unwrap_or(scene_name);
                println!(
                    "| `{}` | {} | {spp} | {:.1} % | {:.1} % | **{:.1} %** | {:.1} % | {:.1} % | \
                     {:.2} % | {:.3} |",
                    name.trim_end_matches(".toml"),
                    sampler.name(),
                    100.0 * c.normal,
                    100.0 * c.student,
                    100.0 * c.ours,
                    100.0 * c.poor[0],
                    100.0 * c.poor[1],
                    100.0 * c.error,
                    c.honesty,
                );
            }
        }
    }
}

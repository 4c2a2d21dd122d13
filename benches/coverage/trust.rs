//! Verdicts on stated errors.

use gpu_trace::gpu::device::Gpu;
use gpu_trace::job::prepare;
use gpu_trace::scene::builtin;
use gpu_trace::settings::{DEFAULT_TERMINATION, Integrator, Rect, Settings};
use gpu_trace::variance::VarianceClass;

use super::study::{Truth, runs, verdicts};

/// Samples at which renders are judged; the last are the truth.
const SAMPLES: [u64; 3] = [128, 256, 1024];

const LECTURE: Integrator = Integrator::Lecture {
    termination: DEFAULT_TERMINATION,
};

/// Scene, size and estimator: the gallery, and scenes that hide light.
const CASES: [(&str, u32, u32, Integrator); 15] = [
    ("lecture", 32, 32, Integrator::Path),
    ("lecture-reflective", 32, 32, Integrator::Path),
    ("glass", 40, 32, Integrator::Path),
    ("field", 32, 18, Integrator::Path),
    ("ashikhmin", 48, 20, Integrator::Path),
    ("disney", 48, 20, Integrator::Path),
    ("sheen", 48, 20, Integrator::Path),
    ("nylon", 48, 20, Integrator::Path),
    ("frosted-glass", 48, 30, Integrator::Path),
    ("prism", 48, 30, Integrator::Path),
    ("scenes/tests/lamps.toml", 40, 30, Integrator::Path),
    ("scenes/tests/three-lamps.toml", 40, 30, Integrator::Path),
    ("scenes/tests/three-lamps.toml", 40, 30, Integrator::Bsdf),
    ("scenes/tests/rare-lamp.toml", 24, 16, Integrator::Bsdf),
    ("scenes/tests/heavy-tail.toml", 32, 32, LECTURE),
];

/// Prints the table, of all scenes or of those that are named.
pub(crate) fn table(gpu: &Gpu, seeds: u64, names: &[&String]) {
    println!(
        "| scene | estimator | spp | off by a quarter or more | of these `doubtful` | within a tenth | of these `good` |\n\
         |---|---|---|---|---|---|---|"
    );
    for (scene_name, width, height, integrator) in CASES {
        if !names.is_empty() && !names.iter().any(|n| scene_name.contains(n.as_str())) {
            continue;
        }
        let loaded = builtin::resolve(Some(scene_name)).unwrap_or_else(|e| panic!("{e}"));
        let settings = Settings {
            width,
            height,
            crop: Rect::whole(width, height),
            integrator,
            ..Settings::for_scene(&loaded.scene)
        };
        let job = prepare(&loaded.scene, &settings).unwrap_or_else(|e| panic!("{e}"));
        let heavy = job.variance().class == VarianceClass::HeavyTailed;
        let runs = runs(gpu, &loaded.scene, &settings, seeds, &SAMPLES, 128);
        let own = &runs.said[SAMPLES.len() - 1];
        let truth = Truth::of(own.iter());
        for (spp, said) in SAMPLES.iter().zip(&runs.said) {
            let v = verdicts(said, own, &truth, heavy);
            let name = scene_name.rsplit('/').next().unwrap_or(scene_name);
            println!(
                "| `{}` | {} | {spp} | {} | {} | {} | {} |",
                name.trim_end_matches(".toml"),
                integrator.name(),
                v.off,
                v.doubted,
                v.close,
                v.trusted
            );
        }
    }
}

//! Error bars are true: 95 % intervals hold the truth in about 95 % of all pixels, also of renders that
//! stopped by their error. The long form is `cargo xtask bench coverage`.

#[path = "../benches/coverage/study.rs"]
#[expect(dead_code, reason = "the long form shows more")]
mod study;

use crate::common::{gpu, scene_file};
use gpu_trace::sampler::Sampler;
use gpu_trace::settings::{Integrator, Settings};
use gpu_trace::verify::settings;
use study::{Truth, Verdicts, coverage, runs, verdicts};

const SEEDS: u64 = 60;
const SAMPLES: [u64; 2] = [128, 512];

/// And so are verdicts: errors that are not are `doubtful`.
#[test]
fn intervals_hold_the_truth() {
    let [mut rare_light, mut gallery] = [Verdicts::default(); 2];
    for (name, integrator, sampler) in [
        ("lecture", Integrator::Bsdf, Sampler::Sobol),
        ("lecture", Integrator::Bsdf, Sampler::Independent),
        ("glass", Integrator::Bsdf, Sampler::Sobol),
        ("tests/lamps", Integrator::Path, Sampler::Sobol),
    ] {
        let scene = scene_file(format!("scenes/{name}.toml"));
        let settings = Settings {
            integrator,
            sampler,
            ..settings(&scene, 20, 16, 512)
        };
        let runs = runs(&gpu(), &scene, &settings, SEEDS, &SAMPLES, 128);
        // Where light is rare, what pixels have not met is in no estimate: docs/accuracy.md.
        let rare = if name == "tests/lamps" { 0.25 } else { 0.05 };
        let own = &runs.said[SAMPLES.len() - 1];
        let truth = Truth::of(own.iter());
        for said in &runs.said {
            let c = coverage(said, own, &truth, 1.0);
            let v = verdicts(said, own, &truth, false);
            let all = match name {
                "tests/lamps" => &mut rare_light,
                _ => &mut gallery,
            };
            all.off += v.off;
            all.doubted += v.doubted;
            all.close += v.close;
            all.trusted += v.trusted;
            let spp = said.iter().map(|s| s.samples).sum::<u64>() / SEEDS;
            // Pixels are nearly independent of each other.
            let error = (0.05 * 0.95 / c.count).sqrt();
            eprintln!(
                "{name}, {}, {spp} spp: {:.2} +- {:.2} %, error {:.4}, estimated/actual {:.3}",
                sampler.name(),
                100.0 * c.ours,
                100.0 * error,
                c.error,
                c.honesty
            );
            let slack = 3.9 * error;
            assert!(
                (0.93 - slack..0.97 + slack).contains(&c.ours),
                "{name}: {}",
                c.ours
            );
            assert!(
                (1.0 - rare..1.05).contains(&c.honesty),
                "{name}: {}",
                c.honesty
            );
            // Companions: normal intervals where batches are few, and ours of three quarters of the width.
            let few = sampler == Sampler::Sobol;
            assert!(!few || c.normal < 0.935, "{name}: normal {}", c.normal);
            let narrow = coverage(said, own, &truth, 0.75).ours;
            assert!(narrow < 0.93 - slack, "{name}: narrow {narrow}");
        }
        // What the stopped ones promised: looks come late, never early.
        let stopped = coverage(&runs.said[SAMPLES.len()], own, &truth, 1.0);
        assert!(
            stopped.error < (1.0 + rare) * runs.limit,
            "{name}: {} of {}",
            stopped.error,
            runs.limit
        );
    }
    // No verdict is right for both, whatever is rendered: each is the other's companion.
    eprintln!("rare light: {rare_light:?}; gallery: {gallery:?}");
    assert!(rare_light.off > 20, "{rare_light:?}");
    let share = |part: usize, all: usize| part as f64 / all as f64;
    assert!(
        share(rare_light.doubted, rare_light.off) > 0.9,
        "{rare_light:?}"
    );
    assert!(gallery.close > 200, "{gallery:?}");
    assert!(share(gallery.trusted, gallery.close) > 0.95, "{gallery:?}");
}

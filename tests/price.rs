//! Forecasts: what `price` says against what renders do.

use std::time::Duration;

use crate::cli_support::{BLACK, Folder, holds};
use crate::common::{gpu_renderer, job, scene_file};
use crate::thorough::thorough;
use gpu_trace::forecast::{self, Pilot};
use gpu_trace::render::render_quietly;
use gpu_trace::sampler::Sampler;
use gpu_trace::settings::Settings;
use gpu_trace::verify::settings;
use serde_json::Value;

/// The shortest pilot: of what it needs at least.
fn pilot(name: &str, settings: &Settings) -> Pilot {
    let scene = scene_file(format!("scenes/{name}.toml"));
    let mut renderer = gpu_renderer(&scene, settings);
    let job = job(&scene, settings);
    forecast::run(&mut renderer, &job, Duration::ZERO, &|| true)
        .unwrap_or_else(|e| panic!("{name}: {e}"))
        .expect("nothing stops it")
}

/// The estimated error of a render.
fn rendered(name: &str, settings: &Settings) -> f64 {
    let scene = scene_file(format!("scenes/{name}.toml"));
    let mut renderer = gpu_renderer(&scene, settings);
    let outcome = render_quietly(&mut renderer, settings).unwrap_or_else(|e| panic!("{e}"));
    outcome.estimate.error.expect("enough batches")
}

/// A forecast that is 12 % off the error fails, and so 25 % off the time, for both samplers, for an image
/// that is seen as a whole and one of which half is, with and without a caustic. The long form has
/// more scenes.
#[test]
fn forecast_errors_are_those_of_renders() {
    // Small images, of which a pilot sees all, and larger ones, of which it sees half.
    let mut cases = vec![
        ("glass", Sampler::Sobol, [128, 96]),
        ("lecture", Sampler::Independent, [128, 96]),
        ("lecture", Sampler::Sobol, [256, 192]),
    ];
    if thorough() {
        cases.extend([
            ("lecture", Sampler::Sobol, [128, 96]),
            ("lecture-reflective", Sampler::Sobol, [128, 96]),
            ("field", Sampler::Sobol, [64, 48]),
        ]);
    }
    for (name, sampler, [width, height]) in cases {
        let scene = scene_file(format!("scenes/{name}.toml"));
        let settings = Settings {
            sampler,
            ..settings(&scene, width, height, 512)
        };
        // Another seed: pilot and render share no sample.
        let other = Settings {
            seed: 7,
            ..settings.clone()
        };
        let pilot = pilot(name, &other);
        let error = rendered(name, &settings);
        let ratio = pilot.to_samples(512).error / error;
        // 12 % of the error is 25 % of the time.
        assert!(
            (0.88..1.12).contains(&ratio),
            "{name}, {sampler:?}, {width}x{height}: {ratio} of {error}"
        );
        // Companion: the short batches of the first samples have more variance.
        if sampler == Sampler::Sobol && name == "lecture" {
            let mut naive = pilot.clone();
            naive.variance = vec![pilot.variance[0]; 3];
            let ratio = naive.to_samples(512).error / error;
            assert!(ratio > 1.12, "{ratio}");
        }
    }
}

#[test]
fn tables_and_json_say_the_same() {
    let folder = Folder::with_scene();
    let short = "good.toml --size 32x24 --pilot 1ms";
    let text = folder.ok(&format!("price {short}"));
    holds(
        &text,
        &["good: 32x24", "Mpaths/s", "0.100 %", "95 % interval"],
    );
    let json: Value =
        serde_json::from_str(&folder.ok(&format!("price {short} --json"))).expect("JSON");
    let targets = json["targets"].as_array().expect("a list");
    let errors: Vec<f64> = targets.iter().filter_map(|t| t["error"].as_f64()).collect();
    assert_eq!(errors, [0.05, 0.02, 0.01, 0.005, 0.001]);
    for target in targets {
        let number = |name: &str| target[name].as_f64().unwrap_or_else(|| panic!("{target}"));
        assert_eq!(target["backend"], "gpu");
        assert!(number("seconds_low") < number("seconds"));
        assert!(number("seconds") < number("seconds_high"));
        assert!(number("spp") >= 64.0);
    }
    assert!(json["backends"][0]["seconds"]["compile"].as_f64() > Some(0.0));
    assert!(json["backends"][0]["host_bytes"].as_u64() >= Some(128 * 32 * 24));
}

#[test]
fn only_what_was_asked_for_is_priced() {
    let folder = Folder::with_scene();
    let json = |options: &str| -> Vec<Value> {
        let all = folder.ok(&format!(
            "price good.toml --size 32x24 --pilot 1ms --json {options}"
        ));
        let all: Value = serde_json::from_str(&all).expect("JSON");
        all["targets"].as_array().expect("a list").clone()
    };
    let targets = json("--error 3% --time 1h --spp 4096 --backends gpu,cpu");
    let asked: Vec<&Value> = targets.iter().map(|t| &t["asked"]).collect();
    assert_eq!(asked, ["error", "time", "spp", "error", "time", "spp"]);
    assert_eq!(targets[0]["error"], 0.03);
    assert_eq!(targets[2]["spp"], 4096);
    assert_eq!(
        (&targets[0]["backend"], &targets[3]["backend"]),
        (&"gpu".into(), &"cpu".into())
    );
    // The same paths: the two differ in time alone.
    let (gpu, cpu) = (&targets[2]["error"].as_f64(), &targets[5]["error"].as_f64());
    let ratio = gpu.unwrap_or(0.0) / cpu.unwrap_or(0.0);
    assert!((ratio - 1.0).abs() < 1.0e-3, "{ratio}");
    let hour = targets[1]["seconds"].as_f64().expect("a number");
    assert!((3500.0..=3600.0).contains(&hour), "{hour}");
}

#[test]
fn what_cannot_be_priced_is_said() {
    let folder = Folder::with_scene();
    folder.write("black.toml", BLACK);
    let run = folder.run("price black.toml --pilot 1ms");
    assert_eq!(run.code, Some(0));
    holds(&run.stdout, &["5.00 %", "unknown"]);
    holds(&run.stderr, &["warning", "no light that varies"]);
    let run = folder.run("price lecture --integrator lecture --size 32x32");
    assert_eq!(run.code, Some(2), "{run:?}");
    holds(&run.stderr, &["no error can be forecast", "infinite"]);
    for (arguments, said) in [
        ("good.toml --backends gpu,tpu", "tpu"),
        (
            "good.toml --backends gpu --backend cpu",
            "cannot be used with",
        ),
        ("good.toml --pilot soon", "soon"),
        ("nothing.toml", "nothing.toml"),
        ("good.toml --error 0", "0"),
    ] {
        let words: Vec<&str> = std::iter::once("price")
            .chain(arguments.split(' '))
            .collect();
        holds(&folder.refused(&words), &[said]);
    }
}

//! Light transport: estimators, what their variance is said to be, and devices.

use serde_json::{Value, json};

use crate::cli_support::{Folder, holds, mean};
use crate::common::images::{Left, assert_alike, assert_same};

#[test]
fn no_bounces_show_the_lamp_alone() {
    let folder = Folder::new();
    let summary = folder.ok("--size 16x16 --spp 8 --max-bounces 0 -o r.npy --stats r.json");
    let picture = folder.npy("r.npy");
    // Shares of eighths of the ceiling's radiance of 2, in each channel.
    let lit = |p: &[f32; 3]| p[0] == p[1] && p[1] == p[2] && (p[0] * 4.0).fract() == 0.0;
    assert!(picture.pixels.iter().all(lit), "{:?}", picture.pixels);
    let count = |value: f32| picture.pixels.iter().filter(|p| p[0] == value).count();
    assert!(count(2.0) > 20 && count(0.0) > 100, "{:?}", picture.pixels);
    let stats = folder.json("r.json");
    assert_eq!(stats["bounce_limit"]["paths"], json!(16 * 16 * 8));
    assert_eq!(stats["rays"], stats["samples"]);
    assert!(summary.contains("max-bounces 0 took "), "{summary}");
    assert!(
        stats["ledger"][0]["removed"].as_f64() > Some(0.5),
        "{stats}"
    );
}

#[test]
fn the_estimators_agree() {
    let folder = Folder::new();
    for (options, integrator, roulette, tolerance) in [
        ("", "path", true, 0.02),
        ("--roulette on", "path", true, 0.02),
        ("--roulette off", "path", false, 0.02),
        ("--integrator lecture", "lecture", false, 0.1),
        (
            "--integrator lecture --termination 0.4",
            "lecture",
            false,
            0.1,
        ),
        (
            "--integrator lecture --termination 0",
            "lecture",
            false,
            0.1,
        ),
    ] {
        let run = folder.run(&format!(
            "--size 16x16 --spp 256 {options} -o r.npy --stats r.json"
        ));
        // The lecture's estimator has an infinite variance between white walls.
        let warned = usize::from(integrator == "lecture");
        assert_eq!(run.code, Some(0), "{run:?}");
        assert_eq!(run.stderr.matches("warning: ").count(), warned, "{run:?}");
        let (picture, stats) = (folder.npy("r.npy"), folder.json("r.json"));
        assert_eq!(stats["integrator"], json!(integrator), "{options}");
        assert_eq!(stats["roulette"], json!(roulette), "{options}");
        let effects = stats["effects"].as_array().expect("a list");
        for (name, used) in [("roulette", roulette), ("lecture", integrator == "lecture")] {
            assert_eq!(effects.contains(&json!(name)), used, "{options}: {name}");
        }
        // The converged mean of the three channels over the whole image.
        let mean = mean(&picture);
        let _left = Left::alone(format!("lecture {options}"), &picture);
        assert!(
            (mean / 0.8201 - 1.0).abs() < tolerance,
            "{options}: mean {mean}"
        );
    }
}

/// A closed diffuse sphere that emits 1.
fn furnace(albedo: f64) -> String {
    format!(
        "[camera]\nposition = [0.3, 0, 0]\nlook_at = [0, 0, 1]\nfov = 40.0\n[image]\nwidth = 8\n\
         height = 8\n[material.wall]\ntype = \"diffuse\"\nalbedo = [0.1, {albedo}, 0.1]\n\
         emission = [1, 1, 1]\n[[sphere]]\ncenter = [0, 0, 0]\nradius = 1.0\nmaterial = \"wall\"\n"
    )
}

#[test]
fn an_infinite_variance_has_no_error() {
    let folder = Folder::new();
    let lecture = "--spp 256 --error 90% --integrator lecture";
    for (albedo, options, advice) in [
        (0.8, lecture, "use --termination 0.14 or less"),
        (
            0.9,
            lecture,
            "no --termination is low enough: use --integrator bsdf",
        ),
        (
            0.75,
            "--spp 256 --error 90% --integrator lecture --termination 0.3 --backend cpu",
            "use --termination 0.25 or less",
        ),
    ] {
        folder.write("furnace.toml", furnace(albedo));
        let run = folder.run(&format!(
            "furnace.toml {options} --progress json -o r.npy --stats r.json"
        ));
        assert_eq!(run.code, Some(0), "{run:?}");
        holds(
            &run.stdout,
            &["256 spp, error unknown (infinite variance), "],
        );
        let named = format!("\\\"wall\\\" (albedo {albedo:.3})");
        holds(&run.stderr, &["may be infinite", &named, advice]);
        assert!(!run.stderr.contains("\"error\":0"), "{run:?}");
        let stats = folder.json("r.json");
        assert_eq!(stats["estimated_error"], Value::Null);
        assert_eq!(stats["variance"], json!("infinite"));
        assert_eq!(stats["stopped_by"], json!("spp"));
        let warnings = stats["warnings"].as_array().expect("a list");
        // The other is that the error was not reached.
        let asked = usize::from(options.contains("--error"));
        assert_eq!(warnings.len(), 1 + asked, "{stats}");
    }
}

#[test]
fn a_heavy_tail_is_said_and_other_errors_are_known() {
    let folder = Folder::new();
    for (albedo, options, class) in [
        (0.7, "--integrator lecture", "heavy-tailed"),
        (0.5, "--integrator lecture", "finite"),
        (0.9, "--integrator bsdf", "finite"),
        (0.9, "--integrator lecture --max-bounces 3", "finite"),
    ] {
        folder.write("furnace.toml", furnace(albedo));
        let run = folder.run(&format!(
            "furnace.toml --spp 1024 --error 60% {options} -o r.npy --stats r.json"
        ));
        assert_eq!(run.code, Some(0), "{run:?}");
        let stats = folder.json("r.json");
        assert_eq!(stats["variance"], json!(class), "{options}");
        assert!(stats["estimated_error"].is_f64(), "{stats}");
        assert_eq!(stats["stopped_by"], json!("error"), "{stats}");
        let warned = usize::from(class != "finite");
        assert_eq!(run.stderr.matches("heavy tail").count(), warned, "{run:?}");
        assert_eq!(run.stderr.is_empty(), warned == 0, "{run:?}");
    }
}

#[test]
fn devices_geometries_and_threads_agree() {
    let folder = Folder::new();
    let names = folder.ok("devices --json");
    let names: Value = serde_json::from_str(&names).expect("JSON");
    let name = names[0]["name"].as_str().expect("a name");
    let word = name
        .split_whitespace()
        .next()
        .expect("a word")
        .to_uppercase();
    let base = "glass --size 16x12 --spp 16";
    let expected = folder.render(base).0;
    for (options, key, value) in [
        ("--backend gpu", "backend", "gpu"),
        ("--geometry list", "geometry", "list"),
        ("--geometry baked", "geometry", "baked"),
        ("--geometry bvh", "geometry", "bvh"),
        ("--device 0", "backend", "gpu"),
        (&format!("--device {word}"), "backend", "gpu"),
        ("--backend cpu", "backend", "cpu"),
    ] {
        let (picture, stats) = folder.render(&format!("{base} {options}"));
        assert_eq!(stats[key], json!(value), "{options}");
        let pixels = picture
            .pixels
            .as_flattened()
            .iter()
            .zip(expected.pixels.as_flattened());
        // The same paths, but for the few that rounding sends elsewhere.
        let close = pixels
            .filter(|(a, b)| (*a - *b).abs() <= 1e-3 * b.abs())
            .count();
        let (most, what) = (
            close * 100 >= 98 * 16 * 12 * 3,
            format!("{close} values agree"),
        );
        assert_alike(options, &picture, &expected, most, what);
    }
    let threads = |n: u32| {
        let (picture, _) = folder.render(&format!("{base} --backend cpu --threads {n}"));
        picture
    };
    assert_same("one thread and three", &threads(3), &threads(1));
}

/// The radiance cache: on where there can be one, with a word where not; by choice; and parts of one image only.
#[test]
fn a_radiance_cache_is_used_or_said_to_be_off() {
    let folder = Folder::new();
    folder.ok("--size 48x48 --spp 64 --radiance-cache on -o on.exr --aov stderr --stats on.json --checkpoint on.film");
    let stats = folder.json("on.json");
    assert_eq!(stats["radiance_cache"], json!(true));
    assert_eq!(stats["integrator"], json!("path"));
    assert!(stats["mean_stderr"][0].as_f64() > Some(0.0), "{stats}");
    let has = |file: &str| {
        let bytes = folder.read(file);
        bytes.windows(11).any(|word| word == b"mean_stderr")
    };
    // Where pixels are independent of each other nobody has to be told.
    folder.ok("--size 48x48 --spp 64 --seed 1 -o off.exr --aov stderr --stats off.json --checkpoint off.film");
    assert_eq!(folder.json("off.json")["radiance_cache"], json!(false));
    assert!(has("on.exr") && !has("off.exr"));
    folder.ok("compare on.exr off.exr");

    let merged = folder.run("merge on.film off.film -o merged.exr");
    assert_eq!(merged.code, Some(2), "{merged:?}");
    for options in [
        "--integrator bsdf",
        "--sampler independent",
        "--adaptive",
        "--max-bounces 8",
    ] {
        let run = folder.run(&format!(
            "--size 16x16 --spp 128 --radiance-cache on {options} -o r.png --stats r.json"
        ));
        assert_eq!(run.code, Some(0), "{run:?}");
        let word = options.split(' ').next().unwrap_or_default();
        holds(
            &run.stderr,
            &["--radiance-cache on is without effect", word],
        );
        assert_eq!(folder.json("r.json")["radiance_cache"], json!(false));
    }
    // By choice: a room gains.
    let said = folder.ok("effects --size 320x320 --radiance-cache auto");
    holds(&said, &["What pays here is path, cache", "radiance_cache"]);
}

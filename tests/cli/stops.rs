//! When a render stops, and its progress until then.

use serde_json::{Value, json};

use crate::cli_support::{BLACK, Folder, holds};

#[test]
fn whichever_rule_comes_first_ends_the_render() {
    let folder = Folder::new();
    for (options, stopped_by, said) in [
        ("--error 30%", "error", "error reached"),
        ("--error 0.3 --time 1h", "error", "error reached"),
        ("--time 0.3", "time", "time is up"),
        ("--time 300ms --error 0.0001%", "time", "time is up"),
        ("--spp 80 --error 0.0001% --time 1h", "spp", "80 spp"),
        (
            "--sample-range 8..88 --error 0.0001% --sampler independent",
            "spp",
            "80 spp",
        ),
        (
            "--sample-range 256..1280 --error 0.0001%",
            "spp",
            "1024 spp",
        ),
    ] {
        let run = folder.run(&format!("--size 16x16 {options} -o r.npy --stats r.json"));
        assert_eq!(run.code, Some(0), "{options}: {run:?}");
        let missed = stopped_by == "spp";
        assert_eq!(run.stderr.is_empty(), !missed, "{options}: {run:?}");
        if missed {
            let samples = format!("was not reached within {said} samples a pixel");
            holds(&run.stderr, &[&samples.replace(" spp", "")]);
        }
        let summary = run.stdout;
        let stats = folder.json("r.json");
        assert_eq!(stats["stopped_by"], json!(stopped_by), "{options}: {stats}");
        holds(&summary, &[said]);
        let error = stats["estimated_error"].as_f64();
        // A busy machine may take less in the time.
        let known = stats["spp"].as_u64() >= Some(64);
        assert_eq!(error.is_some(), known, "{options}: {stats}");
        let reached = error.is_some_and(|error| error <= 0.3);
        assert!(stopped_by != "error" || reached, "{options}: {stats}");
        let seconds = stats["seconds"]["render"].as_f64().expect("a number");
        assert!(stopped_by != "time" || seconds >= 0.3, "{options}: {stats}");
    }
}

#[test]
fn adaptive_samples_are_shared_out() {
    let folder = Folder::new();
    let base = "lecture-reflective --size 48x40 --adaptive";
    let summary = folder.ok(&format!(
        "{base} --spp 512 -o a.exr --aov samples --stats a.json"
    ));
    let stats = folder.json("a.json");
    let number = |value: &Value| value.as_u64().expect("a count");
    let (least, most) = (
        number(&stats["spp_range"][0]),
        number(&stats["spp_range"][1]),
    );
    assert!(64 <= least && 2 * least <= most, "{stats}");
    holds(
        &summary,
        &[&format!("{} spp ({least} to {most}), error", stats["spp"])],
    );
    assert_eq!(stats["pilot_spp"], json!(64));
    let samples = number(&stats["samples"]);
    assert!(
        samples <= 512 * 48 * 40 && samples > 480 * 48 * 40,
        "{stats}"
    );
    // The layer holds all samples but the pilot's.
    let image = exr::prelude::read_first_flat_layer_from_file(folder.path("a.exr"));
    let channels = image.expect("an EXR file").layer_data.channel_data.list;
    let counts = channels.into_iter().find(|c| c.name.eq("samples.N"));
    let counts = counts.expect("the channel").sample_data;
    let all: f64 = counts.values_as_f32().map(f64::from).sum();
    assert_eq!(all as u64, samples - 64 * 48 * 40);
    // Other rules end it too; whatever does, every pixel has samples.
    folder.ok(&format!("{base} --error 30% -o a.npy --stats a.json"));
    assert_eq!(folder.json("a.json")["stopped_by"], json!("error"));
    folder.ok(&format!("{base} --time 1ms -o a.npy --stats a.json"));
    let stats = folder.json("a.json");
    assert_eq!(stats["stopped_by"], json!("time"));
    assert!(number(&stats["spp_range"][0]) > 0, "{stats}");
    for (wrong, said) in [
        ("--spp 127", "at least 128 samples"),
        ("--sample-range 0..512", "--sample-range"),
    ] {
        let arguments = format!("{base} {wrong}");
        let words: Vec<&str> = arguments.split_whitespace().collect();
        holds(&folder.refused(&words), &[said]);
    }
}

#[test]
fn an_error_out_of_reach_ends_at_the_cap() {
    let folder = Folder::new();
    folder.write("black.toml", BLACK);
    let run = folder.run("black.toml --size 1x1 --error 1% --stats r.json -o r.npy");
    assert_eq!(run.code, Some(0), "{run:?}");
    holds(&run.stdout, &["1048576 spp, black"]);
    holds(
        &run.stderr,
        &["the error of 1.00 % was not reached within 1048576 samples"],
    );
    let stats = folder.json("r.json");
    assert_eq!(
        (&stats["stopped_by"], &stats["black"]),
        (&json!("spp"), &json!(true))
    );
    assert_eq!(stats["estimated_error"], Value::Null);
    let warnings = stats["warnings"].as_array().expect("a list");
    for (warning, begin) in warnings.iter().zip([
        "the scene has no light",
        "the scene has no spheres",
        "the image is black",
        "the error of 1.00 %",
    ]) {
        assert!(
            warning.as_str().is_some_and(|text| text.starts_with(begin)),
            "{warning}"
        );
    }
    assert_eq!(warnings.len(), 4);
    assert_eq!(run.stderr.matches("warning: ").count(), 4, "{}", run.stderr);
}

#[test]
fn progress_for_programs_is_an_object_a_line() {
    let folder = Folder::new();
    let run = folder.run("--size 32x32 --time 1.3s --progress json -v");
    assert_eq!(run.code, Some(0), "{run:?}");
    let lines: Vec<Value> = run
        .stderr
        .lines()
        .map(|line| serde_json::from_str(line).unwrap_or_else(|e| panic!("{e}: {line}")))
        .collect();
    let of = |kind: &str| {
        lines
            .iter()
            .filter(|l| l["type"] == kind)
            .collect::<Vec<_>>()
    };
    assert_eq!(of("message").len(), 2, "device and effects");
    let progress = of("progress");
    assert!(progress.len() >= 2, "{lines:?}");
    let last = progress[progress.len() - 1];
    assert_eq!(last["fraction"], json!(1.0));
    assert_eq!(
        last["samples"].as_u64(),
        last["spp"].as_u64().map(|spp| spp * 32 * 32)
    );
    for pair in progress.windows(2) {
        assert!(
            pair[0]["samples"].as_u64() < pair[1]["samples"].as_u64(),
            "{lines:?}"
        );
    }
    let run = folder.run("--size 8x8 --spp 64 --progress plain");
    holds(&run.stderr, &["100 %  64/64 spp"]);
    assert_eq!(folder.ok("--size 8x8 --spp 64 --progress none --quiet"), "");
}

//! `gpu-trace converge` from its options to its files.

mod shown;

use std::collections::BTreeMap;
use std::fs;

use crate::cli_support::{BLACK, Background, Folder, holds};
use gpu_trace::input::read;
use serde_json::{Value, json};
use shown::{balanced, drawn, self_contained};

/// Small enough for a second or two.
const SMALL: &str = "good.toml --size 16x12 --spp 64 --seeds 4 --progress none";

/// The errors of all points, by series, seed and samples: all that time has no part in.
fn errors(study: &Value) -> BTreeMap<String, (String, String)> {
    let runs = study["runs"].as_array().expect("runs");
    let mut all = BTreeMap::new();
    for run in runs {
        for point in run["points"].as_array().expect("points") {
            let name = format!("{} {} {}", run["series"], run["seed"], point["spp"]);
            let value = (point["mse"].to_string(), point["relmse"].to_string());
            assert!(all.insert(name, value).is_none(), "a point twice: {point}");
        }
    }
    all
}

fn lines(folder: &Folder, name: &str) -> Vec<String> {
    let text = String::from_utf8(folder.read(name)).expect("text");
    text.lines().map(String::from).collect()
}

#[test]
fn a_study_leaves_what_it_promises() {
    let folder = Folder::with_scene();
    let arguments = "--integrators bsdf,lecture --samplers sobol --backends gpu -o s";
    let run = folder.run(&format!("converge {SMALL} {arguments}"));
    assert_eq!(run.code, Some(0), "{run:?}");
    holds(&run.stdout, &["After ", "bsdf", "lecture", "report.html"]);
    let mut names: Vec<String> = fs::read_dir(folder.path("s"))
        .expect("a directory")
        .map(|e| e.expect("an entry").file_name().to_string_lossy().into())
        .collect();
    names.sort();
    assert_eq!(
        names,
        [
            "converge.csv",
            "converge.json",
            "error-spp.svg",
            "error-time.svg",
            "images",
            "reference.exr",
            "report.html",
            "runs.jsonl"
        ]
    );

    // 2 series, 4 seeds, 1 to 64 samples.
    let bytes = folder.read("s/converge.csv");
    let mut csv = csv::Reader::from_reader(bytes.as_slice());
    let columns = csv.headers().expect("names").clone();
    let rows: Vec<csv::StringRecord> = csv.records().map(|row| row.expect("a row")).collect();
    assert_eq!(rows.len(), 2 * 4 * 7);
    let column = |name: &str| {
        let found = columns.iter().position(|c| c == name);
        found.unwrap_or_else(|| panic!("no column {name}"))
    };
    let study = folder.json("s/converge.json");
    let members: Vec<&String> = study.as_object().expect("an object").keys().collect();
    assert_eq!(
        members,
        [
            "command",
            "complete",
            "equal_error",
            "equal_time",
            "exposure",
            "pairs",
            "reference_mean",
            "reference_noise",
            "runs",
            "series",
            "study",
            "warnings"
        ]
    );
    assert_eq!(study["complete"], json!(true));
    assert_eq!(study["runs"].as_array().map(Vec::len), Some(8));
    let bsdf = &study["series"][0];
    assert_eq!(bsdf["label"], json!("bsdf"));
    assert_eq!(bsdf["levels"].as_array().map(Vec::len), Some(7));
    for member in ["slope_spp", "slope_time", "efficiency"] {
        let [low, high] = [0, 1].map(|i| bsdf[member]["range"][i].as_f64().expect(member));
        let value = bsdf[member]["value"].as_f64().expect(member);
        assert!(
            low <= value && value <= high,
            "{member}: {low} {value} {high}"
        );
    }

    // The measured error is what compare measures, of the image that render makes.
    let row = rows
        .iter()
        .find(|cells| {
            &cells[0] == "bsdf" && &cells[column("seed")] == "2" && &cells[column("spp")] == "64"
        })
        .expect("a row");
    folder
        .ok("good.toml --size 16x12 --spp 64 --seed 2 --integrator bsdf --backend gpu -q -o r.exr");
    let json = folder.ok("compare r.exr s/reference.exr --json");
    let figures: Value = serde_json::from_str(&json).expect("JSON");
    let compared = figures["figures"]["relrmse"].as_f64().expect("a number");
    let measured: f64 = row[column("relrmse_measured")].parse().expect("a number");
    assert!(
        (measured / compared - 1.0).abs() < 1.0e-4,
        "{measured} {compared}"
    );
    let corrected: f64 = row[column("relrmse")].parse().expect("a number");
    assert!(corrected < measured, "the reference's noise is subtracted");
    // The companion: another seed has another error.
    folder
        .ok("good.toml --size 16x12 --spp 64 --seed 3 --integrator bsdf --backend gpu -q -o r.exr");
    let json = folder.ok("compare r.exr s/reference.exr --json");
    let figures: Value = serde_json::from_str(&json).expect("JSON");
    let other = figures["figures"]["relrmse"].as_f64().expect("a number");
    assert!(
        (measured / other - 1.0).abs() > 1.0e-3,
        "{measured} {other}"
    );

    for name in ["s/error-time.svg", "s/error-spp.svg"] {
        let svg = String::from_utf8(folder.read(name)).expect("text");
        assert!(
            svg.starts_with("<svg xmlns") && svg.contains(">bsdf</text>"),
            "{svg}"
        );
        balanced(&svg);
        drawn(&svg, 2).expect("every viewer shows it");
    }
    let html = String::from_utf8(folder.read("s/report.html")).expect("text");
    balanced(&html);
    self_contained(&html);
    // The reference, and at equal time images and maps of those that have started by then.
    let images = html.matches("<img ").count();
    assert!(images == 3 || images == 5, "{images} images");
}

#[test]
fn a_limit_on_bounces_shows_as_bias_and_nothing_else_does() {
    let folder = Folder::with_scene();
    let arguments = "--integrators bsdf --samplers independent --backends cpu --max-bounces 1,64";
    folder.ok(&format!(
        "converge good.toml --size 16x12 --spp 512 --seeds 8 --progress none {arguments} -o s"
    ));
    let study = folder.json("s/converge.json");
    let bias = |label: &str| {
        let series = study["series"].as_array().expect("series");
        let found = series.iter().find(|s| s["label"] == label);
        found.unwrap_or_else(|| panic!("no {label} in {series:?}"))["bias"].clone()
    };
    let (cut, whole) = (bias("1 bounce"), bias("64 bounces"));
    assert_eq!(
        (&cut["biased"], &whole["biased"]),
        (&json!(true), &json!(false))
    );
    // The bias that is fitted is the difference of the two truths, within a tenth.
    for (name, bounces) in [("a", 1), ("b", 64)] {
        folder.ok(&format!(
            "good.toml --size 16x12 --spp 8192 --backend cpu --integrator bsdf --max-bounces {bounces} -q -o {name}.exr"
        ));
    }
    let json = folder.ok("compare a.exr b.exr --json");
    let figures: Value = serde_json::from_str(&json).expect("JSON");
    let mse = figures["figures"]["mse"].as_f64().expect("a number");
    let fitted = cut["b_squared"]["value"].as_f64().expect("a number");
    assert!((fitted / mse - 1.0).abs() < 0.1, "{fitted} {mse}");
}

#[test]
fn f32_and_nudges_are_told_from_the_same_samples_in_f64() {
    let folder = Folder::new();
    let arguments =
        "--integrators bsdf --samplers sobol --backends gpu,cpu --offsets exact,back:1e-4";
    folder.ok(&format!(
        "converge glass --size 16x12 --spp 64 --seeds 4 --progress none {arguments} -o s"
    ));
    let study = folder.json("s/converge.json");
    let pairs = study["pairs"].as_array().expect("pairs");
    let last = |label: &str| {
        let pair = pairs.iter().find(|p| p["label"] == label);
        let pair = pair.unwrap_or_else(|| panic!("no {label} in {pairs:?}"));
        let levels = pair["levels"].as_array().expect("levels");
        let level = levels.last().expect("a level");
        level["relrmse"].as_f64().expect("a number")
    };
    // Rounding moves a path off its twin now and then, the nudge very many of them; and that it is the
    // nudge, not f32, is what the same nudge in f64 shows.
    let (exact, nudged) = (last("GPU f32"), last("GPU f32 · back:1e-4"));
    assert!(exact < 0.1 * nudged, "{exact} {nudged}");
    let wide = last("CPU f64 · back:1e-4");
    assert!((wide / nudged - 1.0).abs() < 0.3, "{wide} {nudged}");
}

#[test]
fn a_study_that_is_killed_goes_on() {
    let folder = Folder::with_scene();
    let arguments = "converge good.toml --size 64x48 --spp 128 --seeds 6 --backends cpu \
                     --integrators bsdf --samplers sobol,independent --progress json";
    let mut run = Background::start(&folder, &format!("{arguments} -o s"));
    run.wait_for("run 3/12");
    run.signal("KILL");
    drop(run);
    let before = lines(&folder, "s/runs.jsonl");
    assert!(
        before.len() >= 3,
        "the study and two runs: {}",
        before.len()
    );
    assert!(!folder.path("s/report.html").exists());
    // As if it had been killed within a write.
    let mut torn = folder.read("s/runs.jsonl");
    torn.extend(br#"{"series":{"integ"#);
    folder.write("s/runs.jsonl", torn);

    let run = folder.run(&format!("{arguments} -o s"));
    assert_eq!(run.code, Some(0), "{run:?}");
    let done = before.len() - 1;
    holds(
        &run.stderr,
        &[&format!("{done} of 12 runs are done already")],
    );
    let after = lines(&folder, "s/runs.jsonl");
    assert_eq!(after[..before.len()], before[..], "what was done is kept");
    assert_eq!(after.len(), 13);
    let whole = folder.run(&format!("{arguments} -o whole"));
    assert_eq!(whole.code, Some(0), "{whole:?}");
    let (resumed, whole) = (
        folder.json("s/converge.json"),
        folder.json("whole/converge.json"),
    );
    assert_eq!(errors(&resumed), errors(&whole));
    assert_eq!(errors(&whole).len(), 12 * 8);

    // A third time there is nothing to do, and more seeds go on from there.
    folder.run(&format!("{arguments} -o s"));
    assert_eq!(lines(&folder, "s/runs.jsonl"), after);
    let more = arguments.replace("--seeds 6", "--seeds 7");
    assert_eq!(folder.run(&format!("{more} -o s")).code, Some(0));
    assert_eq!(lines(&folder, "s/runs.jsonl").len(), 15);
}

#[cfg(unix)]
#[test]
fn a_signal_ends_a_study_with_a_report_of_what_there_is() {
    let folder = Folder::with_scene();
    let arguments = "converge good.toml --size 64x48 --spp 4096 --seeds 50 --backends cpu \
                     --reference-spp 64 --integrators bsdf --samplers sobol --progress json -o s";
    let mut run = Background::start(&folder, arguments);
    run.wait_for("run 1/50");
    run.signal("INT");
    let run = run.finish();
    assert_eq!(run.code, Some(130), "{run:?}");
    assert!(!run.stderr.contains("error: "), "{run:?}");
    let study = folder.json("s/converge.json");
    assert_eq!(study["complete"], json!(false));
    let html = String::from_utf8(folder.read("s/report.html")).expect("text");
    holds(&html, &["The study is not complete"]);
    balanced(&html);
    let runs = lines(&folder, "s/runs.jsonl");
    let last: Value = serde_json::from_str(runs.last().expect("a line")).expect("JSON");
    if runs.len() == 2 {
        assert_eq!(last["complete"], json!(false));
    }
}

#[test]
fn a_signal_before_the_first_error_leaves_no_report() {
    let folder = Folder::with_scene();
    let arguments = "converge good.toml --size 64x48 --reference-spp 1000000 --backends cpu \
                     --progress json -o s";
    let mut run = Background::start(&folder, arguments);
    run.wait_for("\"reference\"");
    run.signal("TERM");
    let run = run.finish();
    assert_eq!(run.code, Some(143), "{run:?}");
    holds(&run.stdout, &["before the reference was done"]);
    assert!(!folder.path("s/report.html").exists());
}

#[test]
fn what_cannot_be_measured_is_refused_with_both_facts() {
    let folder = Folder::with_scene();
    let small = "--size 16x12 --spp 64 -q -o";
    folder.ok(&format!("good.toml {small} good.exr --seed 99"));
    folder.ok(&format!("good.toml {small} good.png --seed 99"));
    folder.ok(&format!("good.toml {small} seed2.exr --seed 2"));
    folder.ok(&format!("glass {small} glass.exr --seed 99"));
    let refused = |arguments: &str, parts: &[&str]| {
        let small = "good.toml --size 16x12 --seeds 4";
        let words = format!("converge {small} --backends cpu -o s {arguments}");
        let words: Vec<&str> = words.split_whitespace().collect();
        holds(&folder.refused(&words), parts);
    };
    refused(
        "--reference glass.exr",
        &["glass.exr shows glass (", "the study is of good ("],
    );
    refused("--reference good.png", &["PNG", "EXR or NPY"]);
    refused("--reference seed2.exr", &["seed 2", "seeds 0 to 3"]);
    refused("--reference none.exr", &["cannot read none.exr"]);
    refused(
        "--reference good.exr --reference-spp 64",
        &["--reference-spp"],
    );
    refused("--integrators bsdf --termination 0.1", &["lecture"]);
    refused("--integrators bsdf,fast", &["fast", "path"]);
    refused("--offsets out", &["out:1e-4"]);
    refused(
        "--study cheap",
        &["cpu-gpu, precision, lecture, estimators"],
    );
    refused("--spp 0", &["2^48"]);
    refused("--device 0", &["--backends cpu uses none"]);
    refused("--seed 18446744073709551615", &["2^64 - 1"]);
    let words = "converge good.toml --size 20x12 --backends cpu --reference good.exr -o s";
    let words: Vec<&str> = words.split_whitespace().collect();
    holds(
        &folder.refused(&words),
        &["good.exr has 16x12", "the study 20x12"],
    );
    // Files of others are not strewn about.
    let words: Vec<&str> = ["converge", "good.toml", "--backends", "cpu", "-o", "."].into();
    holds(&folder.refused(&words), &["holds other files and no study"]);
    assert!(!folder.path("s").exists());
}

#[test]
fn a_directory_of_another_study_is_refused_with_both_facts() {
    let folder = Folder::with_scene();
    let base = "--size 8x6 --backends cpu --integrators bsdf --samplers sobol --seeds 1 -q -o s";
    folder.run(&format!("converge good.toml --spp 16 {base}"));
    let before = folder.read("s/runs.jsonl");
    for (arguments, parts) in [
        ("good.toml --spp 32", ["another spp", "16 there, 32 now"]),
        ("glass --spp 16", ["another scene", "good there, glass now"]),
        (
            "good.toml --spp 16 --time 1m",
            ["another time", "none there, 60.0 now"],
        ),
    ] {
        let words = format!("converge {arguments} {base}");
        let words: Vec<&str> = words.split_whitespace().collect();
        let text = folder.refused(&words);
        holds(&text, &parts);
        holds(&text, &["--fresh"]);
        assert_eq!(folder.read("s/runs.jsonl"), before);
    }
    let run = folder.run(&format!("converge good.toml --spp 32 {base} --fresh"));
    assert_eq!(run.code, Some(0), "{run:?}");
    assert_eq!(lines(&folder, "s/runs.jsonl").len(), 2);
    // A build whose kernel is another: that of the directory, or what it does not say.
    let there = lines(&folder, "s/runs.jsonl");
    let words = format!("converge good.toml --spp 32 {base}");
    let words: Vec<&str> = words.split_whitespace().collect();
    let mut identity: Value = serde_json::from_str(&there[0]).expect("JSON");
    let kernel = identity["kernels"]["bsdf sobol exact 64"].take();
    let kernel = kernel.as_str().expect("a hash");
    identity["kernels"]["bsdf sobol exact 64"] = json!("0123");
    folder.write("s/runs.jsonl", format!("{identity}\n{}\n", there[1]));
    let text = folder.refused(&words);
    let facts = format!("0123 there, {kernel} now");
    holds(
        &text,
        &["another kernel for bsdf sobol exact 64", &facts, "--fresh"],
    );
    identity.as_object_mut().expect("members").remove("kernels");
    folder.write("s/runs.jsonl", format!("{identity}\n{}\n", there[1]));
    holds(
        &folder.refused(&words),
        &["did not say which kernels", "--fresh"],
    );
    folder.write("s/runs.jsonl", there.join("\n") + "\n");
    folder.run(&words.join(" "));
    assert_eq!(
        lines(&folder, "s/runs.jsonl"),
        there,
        "a companion: the same kernel"
    );
    // Damage is told by its line.
    folder.write(
        "s/runs.jsonl",
        lines(&folder, "s/runs.jsonl")[0].clone() + "\n{\n",
    );
    let words = format!("converge good.toml --spp 32 {base}");
    let words: Vec<&str> = words.split_whitespace().collect();
    holds(&folder.refused(&words), &["line 2 is damaged", "--fresh"]);
}

#[test]
fn a_black_scene_has_no_relative_error() {
    let folder = Folder::new();
    folder.write("black.toml", BLACK);
    let run = folder.run("converge black.toml --backends cpu --spp 16 --seeds 1 -o s");
    assert_eq!(run.code, Some(2), "{run:?}");
    holds(&run.stderr, &["the reference", "no relative error"]);
}

#[test]
fn a_time_limit_ends_runs_at_a_doubling() {
    let folder = Folder::with_scene();
    let arguments = "--integrators bsdf --samplers sobol --backends cpu --spp 1000000 --time 0.2";
    folder.ok(&format!(
        "converge good.toml --size 16x12 --seeds 2 --reference-spp 256 --progress none {arguments} -o s"
    ));
    let study = folder.json("s/converge.json");
    for run in study["runs"].as_array().expect("runs") {
        let points = run["points"].as_array().expect("points");
        let last = points.last().expect("a point")["spp"]
            .as_u64()
            .expect("a number");
        assert!(last < 1_000_000 && last.is_power_of_two(), "{last}");
        assert_eq!(run["complete"], json!(true));
    }
}

/// A study in `s`, of one series on the CPU if `arguments` do not say otherwise.
fn small(folder: &Folder, arguments: &str) {
    let run = folder.run(&format!(
        "converge --spp 16 --reference-spp 1024 --samplers sobol --progress none {arguments}"
    ));
    assert_eq!(run.code, Some(0), "{arguments}: {run:?}");
}

/// The size of the reference in `s`, and what it says of its bounces.
fn reference(folder: &Folder) -> ([u32; 2], String) {
    let input = read(&folder.path("s/reference.exr")).expect("an image");
    let size = [input.picture.width, input.picture.height];
    (size, input.about["max_bounces"].clone())
}

/// A fresh study measures what one in a new directory does, whatever the old reference is of.
#[test]
fn a_fresh_study_has_its_own_reference() {
    let folder = Folder::with_scene();
    let all = "good.toml --backends cpu --integrators bsdf --seeds 1";
    small(&folder, &format!("{all} --size 16x12 -o s"));
    assert_eq!(reference(&folder), ([16, 12], "64".into()));
    let more = format!("{all} --size 24x20 --max-bounces 200");
    small(&folder, &format!("{more} --fresh -o s"));
    assert_eq!(reference(&folder), ([24, 20], "200".into()));
    small(&folder, &format!("{more} -o new"));
    let [fresh, new] = ["s", "new"].map(|d| folder.json(&format!("{d}/converge.json")));
    assert_eq!(errors(&fresh), errors(&new));
}

/// Whatever image lies where the reference should: it is rendered again, unless it is just that.
#[test]
fn a_reference_that_is_another_is_not_used() {
    let folder = Folder::with_scene();
    let all = "good.toml --backends cpu --integrators bsdf --size 16x12 -o s --seeds";
    small(&folder, &format!("{all} 1"));
    // Not the bytes: the order of attributes in a file is by chance.
    let there = || read(&folder.path("s/reference.exr")).expect("an image");
    let own = there();
    let seed = u64::MAX;
    let mut seeds = 1;
    for options in [
        "--size 24x20",
        "--size 12x16",
        "--max-bounces 1",
        "--integrator bsdf",
        "--sampler independent",
        "--spp 512",
        "--seed 5",
        "--backend gpu",
    ] {
        // The last option of a name counts.
        let mut words: Vec<String> = Vec::new();
        let usual = format!(
            "--size 16x12 --max-bounces 64 --sampler sobol --spp 1024 --seed {seed} --backend cpu"
        );
        let (name, _) = options.split_once(' ').expect("an option with a value");
        for option in usual.split("--").skip(1).map(|o| format!("--{}", o.trim())) {
            if !option.starts_with(&format!("{name} ")) {
                words.push(option);
            }
        }
        folder.ok(&format!(
            "good.toml {} {options} -q -o s/reference.exr",
            words.join(" ")
        ));
        assert!(there() != own, "{options}");
        seeds += 1;
        small(&folder, &format!("{all} {seeds}"));
        assert!(there() == own, "{options}");
    }
    // The companion: what is just that is used.
    let time = || fs::metadata(folder.path("s/reference.exr")).and_then(|data| data.modified());
    let before = time().expect("a time");
    small(&folder, &format!("{all} {}", seeds + 1));
    assert_eq!(time().expect("a time"), before);
}

#[test]
fn images_are_those_of_their_run() {
    let folder = Folder::new();
    let images = |options: &str| -> Vec<String> {
        let all = "--study lecture --backends cpu --size 16x12 --seeds 2 -o s";
        small(&folder, &format!("{all} {options}"));
        let html = String::from_utf8(folder.read("s/report.html")).expect("text");
        let sources = html.split("src=\"").skip(1);
        sources
            .map(|s| s.split('"').next().unwrap_or_default().to_owned())
            .collect()
    };
    let first = images("--termination 0.2");
    // After 1 sample and at the end, with their maps, and the reference.
    assert_eq!(first.len(), 5);
    for other in ["--termination 0.6", "--termination 0.2 --seed 1"] {
        let others = images(other);
        assert!(others[0] != first[0] && others[2] != first[2], "{other}");
        assert!(images("--termination 0.2") == first, "{other}");
    }
}

/// The pairs are those of a study in one go, whichever of the two was there first.
#[test]
fn a_series_that_joins_later_makes_its_pairs() {
    let pairs = |stages: &[&str]| {
        let folder = Folder::with_scene();
        for backends in stages {
            let all = "good.toml --integrators bsdf --size 16x12 --seeds 2 --reference-backend cpu";
            small(&folder, &format!("{all} --backends {backends} -o s"));
        }
        folder.json("s/converge.json")["pairs"].clone()
    };
    let whole = pairs(&["gpu,cpu"]);
    assert_eq!(whole[0]["levels"].as_array().map(Vec::len), Some(5));
    assert_eq!(pairs(&["gpu", "gpu,cpu"]), whole);
    assert_eq!(pairs(&["cpu", "gpu,cpu"]), whole);
}

/// Without a word on the reference it stays what it was.
#[test]
fn the_gpu_joins_a_study_of_the_cpu() {
    let folder = Folder::with_scene();
    let all = "good.toml --integrators bsdf --size 16x12 --seeds 1 -o s --backends";
    small(&folder, &format!("{all} cpu"));
    let own = folder.read("s/reference.exr");
    small(&folder, &format!("{all} cpu,gpu"));
    assert!(folder.read("s/reference.exr") == own);
    let study = folder.json("s/converge.json");
    assert_eq!(study["runs"].as_array().map(Vec::len), Some(2));
    assert_eq!(study["study"]["reference"]["own"]["backend"], json!("cpu"));
    assert!(study["study"]["gpu"].is_string());
}

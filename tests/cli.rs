//! What the program does when it is used as it should be, through its binary.

use crate::cli_support::{BLACK, Folder, bits, holds, mean};
use exr::meta::MetaData;
use exr::prelude::{AttributeValue, Text};
use serde_json::{Value, json};

// ---- Images ----

#[test]
fn the_default_render_is_the_lecture_beside_the_user() {
    let folder = Folder::new();
    let summary = folder.ok("--size 24x16 --spp 16");
    assert!(
        summary.starts_with("lecture.png: 24x16, 16 spp, "),
        "{summary}"
    );
    assert_eq!(summary.matches('\n').count(), 1, "{summary}");
    assert_eq!(folder.names(), ["lecture.png"]);

    let image = image::open(folder.path("lecture.png"))
        .expect("a PNG")
        .into_rgb8();
    assert_eq!(image.dimensions(), (24, 16));
    // The lamp is the ceiling, the left wall is red, the right one blue.
    let sum = |x0: u32, y0: u32, x1: u32, y1: u32| {
        let inside = |x, y| (x0..x1).contains(&x) && (y0..y1).contains(&y);
        let pixels = image.enumerate_pixels().filter(|(x, y, _)| inside(*x, *y));
        pixels.fold([0; 3], |s, (_, _, p)| {
            [0, 1, 2].map(|c| s[c] + u32::from(p[c]))
        })
    };
    assert_eq!(sum(8, 0, 16, 1), [8 * 255; 3]);
    let ([r, g, b], [s, h, c]) = (sum(0, 4, 4, 12), sum(20, 4, 24, 12));
    assert!(r > 1000 && g == 0 && b == 0, "left {r} {g} {b}");
    assert!(s == 0 && h == 0 && c > 1000, "right {s} {h} {c}");
}

#[test]
fn one_render_writes_every_format_over_what_was_there() {
    let folder = Folder::new();
    folder.write("a.png", "old");
    let summary =
        folder.ok("render lecture --size 5x3 --spp 8 --seed 7 -o a.png -o b.EXR --output c.npy");
    assert!(
        summary.starts_with("a.png, b.EXR, c.npy: 5x3, 8 spp"),
        "{summary}"
    );
    assert_eq!(folder.names(), ["a.png", "b.EXR", "c.npy"]);
    let picture = folder.npy("c.npy");
    assert_eq!(
        (picture.width, picture.height, picture.pixels.len()),
        (5, 3, 15)
    );
    holds(
        &String::from_utf8_lossy(&folder.read("c.npy")),
        &["'<f4'", "(3, 5, 3)"],
    );
    let image = image::open(folder.path("a.png"))
        .expect("a PNG")
        .into_rgb8();
    assert_eq!(image.dimensions(), (5, 3));

    let exr = exr::prelude::read_first_rgba_layer_from_file(
        folder.path("b.EXR"),
        |size, _| vec![[0.0_f32; 3]; size.area()],
        |pixels, at, (r, g, b, _): (f32, f32, f32, f32)| pixels[at.y() * 5 + at.x()] = [r, g, b],
    );
    let exr = exr.expect("an EXR file").layer_data.channel_data.pixels;
    assert_eq!(exr, picture.pixels);
    let header = MetaData::read_from_file(folder.path("b.EXR"), true).expect("a header");
    let own = &header.headers[0].own_attributes;
    assert_eq!(
        own.software_name,
        Some(Text::from(concat!("gpu-trace ", env!("CARGO_PKG_VERSION"))))
    );
    let text = |text: &str| AttributeValue::Text(Text::from(text));
    for (name, value) in [
        ("scene", text("lecture")),
        ("sample_range", text("0..8")),
        ("integrator", text("path")),
        ("seed", AttributeValue::I32(7)),
        ("spp", AttributeValue::I32(8)),
    ] {
        let name = format!("gpu-trace:{name}");
        assert_eq!(
            own.other.get(&Text::from(name.as_str())),
            Some(&value),
            "{name}"
        );
    }
}

#[test]
fn exposure_brightens_the_png_alone() {
    let folder = Folder::new();
    folder.ok("--size 6x6 --spp 16 -o plain.png -o plain.npy");
    folder.ok("--size 6x6 --spp 16 -o bright.png -o bright.npy --exposure 2");
    folder.ok("--size 6x6 --spp 16 -o dark.png --exposure -20");
    assert_eq!(folder.read("plain.npy"), folder.read("bright.npy"));
    let sum = |name: &str| {
        let image = image::open(folder.path(name)).expect("a PNG").into_rgb8();
        image.as_raw().iter().map(|x| u64::from(*x)).sum::<u64>()
    };
    assert!(sum("bright.png") > sum("plain.png") + 500);
    assert_eq!(sum("dark.png"), 0);
}

#[test]
fn sample_ranges_average_to_the_whole() {
    let folder = Folder::new();
    for backend in ["cpu", "gpu"] {
        let base = format!("--size 16x9 --backend {backend}");
        let whole = folder.render(&format!("{base} --spp 64")).0;
        let ranges = [0..16_u64, 16..40, 40..64];
        let parts = ranges.clone().map(|range| {
            let (from, to) = (range.start, range.end);
            let (part, stats) = folder.render(&format!("{base} --sample-range {from}..{to}"));
            assert_eq!(stats["sample_range"], json!([from, to]));
            assert_eq!(stats["spp"], json!(to - from));
            part
        });
        assert_ne!(bits(&parts[1]), bits(&parts[2]));
        for (i, whole) in whole.pixels.as_flattened().iter().enumerate() {
            let values = parts.each_ref().map(|part| part.pixels.as_flattened()[i]);
            let weights = ranges.each_ref().map(|r| (r.end - r.start) as f64 / 64.0);
            let average: f64 = values
                .iter()
                .zip(weights)
                .map(|(v, w)| f64::from(*v) * w)
                .sum();
            let largest = values.iter().fold(*whole, |a, b| a.max(*b));
            let ulp = f64::from(largest.next_up()) - f64::from(largest);
            // Each part and the whole are rounded once.
            let distance = (average - f64::from(*whole)).abs() / ulp;
            assert!(distance <= 1.0, "{backend}, value {i}: {distance} ulp");
        }
    }
}

#[test]
fn a_crop_has_the_pixels_of_the_whole() {
    let folder = Folder::new();
    let whole = folder.render("glass --size 29x23 --spp 8").0;
    let (part, stats) = folder.render("glass --size 29x23 --spp 8 --crop 5,3,17x11");
    assert_eq!((part.width, part.height), (17, 11));
    assert_eq!(
        (&stats["width"], &stats["height"]),
        (&json!(17), &json!(11))
    );
    let rows = whole.pixels.chunks(29).skip(3).take(11);
    let expected: Vec<_> = rows.flat_map(|row| &row[5..22]).copied().collect();
    assert_eq!(part.pixels, expected);
}

#[test]
fn the_seed_decides_the_bits() {
    let folder = Folder::new();
    let seeds = [0, 1, 1 << 32, u64::MAX];
    let images = seeds.map(|seed| {
        let (picture, stats) = folder.render(&format!("--size 9x9 --spp 4 --seed {seed}"));
        assert_eq!(stats["seed"], json!(seed));
        bits(&picture)
    });
    for (i, one) in images.iter().enumerate() {
        assert!(
            images[..i].iter().all(|other| other != one),
            "seed {}",
            seeds[i]
        );
    }
    assert_eq!(
        bits(&folder.render("--size 9x9 --spp 4").0),
        images[0],
        "0 is the default"
    );
}

// ---- Statistics ----

#[test]
fn the_statistics_say_what_was_done() {
    let folder = Folder::new();
    let (_, stats) =
        folder.render("glass --size 12x8 --spp 64 --seed 3 --max-bounces 5 --crop 1,2,10x4");
    for (key, value) in [
        ("version", json!(env!("CARGO_PKG_VERSION"))),
        ("scene", json!("glass")),
        ("seed", json!(3)),
        ("sample_range", json!([0, 64])),
        ("spp", json!(64)),
        ("width", json!(10)),
        ("height", json!(4)),
        ("backend", json!("gpu")),
        ("geometry", json!("baked")),
        ("integrator", json!("path")),
        ("sampler", json!("sobol")),
        ("max_bounces", json!(5)),
        ("roulette", json!(true)),
        ("samples", json!(10 * 4 * 64)),
        ("black", json!(false)),
        ("non_finite", json!(0)),
        ("stopped_by", json!("spp")),
        ("warnings", json!([])),
    ] {
        assert_eq!(stats[key], value, "{key}");
    }
    assert_eq!(stats["scene_hash"].as_str().map(str::len), Some(16));
    for key in ["name", "backend", "driver"] {
        assert!(
            stats["device"][key]
                .as_str()
                .is_some_and(|text| !text.is_empty()),
            "{stats}"
        );
    }
    let effects = stats["effects"].as_array().expect("a list");
    assert!(
        effects.contains(&json!("dielectric")) && !effects.contains(&json!("lens")),
        "{stats}"
    );
    let number = |value: &Value| {
        value
            .as_f64()
            .unwrap_or_else(|| panic!("{value} in {stats}"))
    };
    let [total, setup, compile, render] =
        ["total", "setup", "compile", "render"].map(|key| number(&stats["seconds"][key]));
    assert!(setup > 0.0 && compile > 0.0 && render > 0.0, "{stats}");
    assert!(setup + compile + render <= total, "{stats}");
    let rate = number(&stats["samples"]) / render;
    assert!(
        (number(&stats["paths_per_second"]) / rate - 1.0).abs() < 1e-9,
        "{stats}"
    );
    assert!(
        number(&stats["rays"]) >= number(&stats["samples"]),
        "{stats}"
    );
    let error = number(&stats["estimated_error"]);
    assert!(error > 0.0 && error < 1.0, "{stats}");
    assert!(number(&stats["bounce_limit"]["paths"]) > 0.0, "{stats}");
    assert!(
        number(&stats["bounce_limit"]["throughput"]) > 0.0,
        "{stats}"
    );
}

#[test]
fn the_command_line_wins_over_the_scene() {
    let folder = Folder::with_scene();
    let scene = crate::cli_support::GOOD.replace(
        "[environment]",
        "[render]\nspp = 12\nmax_bounces = 3\n[environment]",
    );
    folder.write("own.toml", scene);
    let kept =
        |stats: &Value| ["width", "height", "spp", "max_bounces"].map(|key| stats[key].as_u64());
    assert_eq!(kept(&folder.render("own.toml").1), [8, 6, 12, 3].map(Some));
    let (picture, stats) = folder.render("own.toml --size 3x2 --spp 5 --max-bounces 9");
    assert_eq!(kept(&stats), [3, 2, 5, 9].map(Some));
    assert_eq!((picture.width, picture.height), (3, 2));
    assert_eq!(
        kept(&folder.render("good.toml").1),
        [8, 6, 256, 64].map(Some),
        "the defaults"
    );
}

#[test]
fn quiet_and_verbose() {
    let folder = Folder::new();
    assert_eq!(folder.ok("--size 4x4 --spp 1 --quiet"), "");
    let run = folder.run("--size 4x4 --spp 1 -v");
    assert_eq!(run.code, Some(0));
    holds(
        &run.stderr,
        &[
            "device: ",
            "effects: baked, pole, sobol, diffuse, emission, lights, projected, mis, roulette",
        ],
    );
    folder.write("black.toml", BLACK);
    let run = folder.run("black.toml --spp 1 -q");
    assert_eq!(run.stdout, "");
    holds(&run.stderr, &["warning: the image is black"]);
}

// ---- Light transport and devices ----

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
        assert!(
            close * 100 >= 98 * 16 * 12 * 3,
            "{options}: {close} values agree"
        );
    }
    let threads = |n: u32| {
        bits(
            &folder
                .render(&format!("{base} --backend cpu --threads {n}"))
                .0,
        )
    };
    assert_eq!(threads(1), threads(3));
}

// ---- When to stop ----

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

// ---- What cannot be rendered as it stands ----

/// A scene with the camera at `position`, a lens of `aperture`, and spheres.
fn glasses(position: &str, aperture: f64, spheres: &[(&str, f64, &str)]) -> String {
    let mut text = format!(
        "[camera]\nposition = {position}\nlook_at = [7.0, 0.0, -5.0]\nfov = 5.0\n\
         aperture_radius = {aperture:?}\nfocus_distance = 10.0\n[image]\nwidth = 4\nheight = 4\n\
         [environment]\nradiance = [1, 1, 1]\n[material.glass]\ntype = \"dielectric\"\nior = 1.5\n\
         [material.white]\ntype = \"diffuse\"\nalbedo = [0.99, 0.99, 0.99]\n[material.chrome]\n\
         type = \"mirror\"\nreflectance = [1, 1, 1]\n"
    );
    for (center, radius, material) in spheres {
        text += &format!(
            "[[sphere]]\ncenter = {center}\nradius = {radius:?}\nmaterial = \"{material}\"\n"
        );
    }
    text
}

#[test]
fn coincident_spheres_are_said_to_be_left_out() {
    let folder = Folder::new();
    let ball = ("[3, 0, -2]", 0.5, "glass");
    folder.write("twice.toml", glasses("[0, 0, 0]", 0.0, &[ball, ball]));
    let run = folder.run("twice.toml --spp 4 -o a.npy");
    assert_eq!(run.code, Some(0), "{run:?}");
    holds(&run.stderr, &["warning: sphere 2 coincides with sphere 1"]);
    folder.write("once.toml", glasses("[0, 0, 0]", 0.0, &[ball]));
    let run = folder.run("once.toml --spp 4 -o b.npy");
    assert!(
        run.code == Some(0) && !run.stderr.contains("coincides"),
        "{run:?}"
    );
    assert_eq!(folder.read("a.npy"), folder.read("b.npy"));
}

#[test]
fn a_lens_across_one_of_several_media_is_refused() {
    let folder = Folder::new();
    let spheres = [("[0, 0, 0]", 1.0, "glass"), ("[0.75, 0, 1]", 0.4, "glass")];
    folder.write("across.toml", glasses("[0, 0, 0.99]", 0.3, &spheres));
    let run = folder.run("across.toml --spp 4");
    assert_eq!(run.code, Some(2), "{run:?}");
    holds(
        &run.stderr,
        &["the lens lies on both sides of sphere 1", "aperture_radius"],
    );
    // By the sign of a nudge it can be rendered, but what the nudge does cannot be known.
    let run = folder.run("across.toml --spp 4 --offset out:1e-2 -o r.npy --stats r.json");
    assert_eq!(run.code, Some(0), "{run:?}");
    holds(&run.stdout, &["what offset out:0.01 took is unknown"]);
    holds(
        &run.stderr,
        &["warning: what offset out:0.01 took is unknown: the lens lies on both sides of sphere 1"],
    );
    let stats = folder.json("r.json");
    let entries = stats["ledger"].as_array().expect("a list");
    let entry = entries.iter().find(|e| e["setting"] == "offset");
    let entry = entry.expect("an entry");
    assert_eq!(
        (&entry["removed"], &entry["standard_error"]),
        (&Value::Null, &Value::Null)
    );
    holds(
        entry["unknown"].as_str().expect("a reason"),
        &["the lens lies on both sides"],
    );
    let warnings = stats["warnings"].to_string();
    holds(
        &warnings,
        &["what offset out:0.01 took is unknown: the lens"],
    );
    // A study against an exact reference of its own is refused before anything is rendered.
    let text = folder.refused(&[
        "converge",
        "across.toml",
        "--offsets",
        "out:1e-2",
        "--spp",
        "4",
    ]);
    holds(&text, &["the lens lies on both sides of sphere 1"]);
    // One alone is no question.
    folder.write("alone.toml", glasses("[0, 0, 0.99]", 0.3, &spheres[..1]));
    let run = folder.run("alone.toml --spp 4");
    assert_eq!(run.code, Some(0), "{run:?}");
}

#[test]
fn an_offset_beyond_the_scene_is_refused() {
    let folder = Folder::new();
    let tiny = [("[7e-20, 0, -5e-20]", 1.0e-20, "white")];
    folder.write("tiny.toml", glasses("[0, 0, 0]", 0.0, &tiny));
    let run = folder.run("tiny.toml --spp 4 --offset out:1e20");
    assert_eq!(run.code, Some(2), "{run:?}");
    holds(&run.stderr, &["the distance of --offset"]);
}

#[test]
fn mirrors_do_not_hide_a_heavy_tail() {
    // A diffuse ball in a room of mirrors: without termination the mirror's factor is 1, not 0.
    let folder = Folder::new();
    let spheres = [("[0, 0, 0]", 9.0, "chrome"), ("[3, 0, -2]", 0.5, "white")];
    folder.write("room.toml", glasses("[0, 0, 0]", 0.0, &spheres));
    let class = |termination: &str| -> Value {
        let run = folder.run(&format!(
            "room.toml --spp 64 --integrator lecture --termination {termination} -o r.npy --stats r.json"
        ));
        assert_eq!(run.code, Some(0), "{run:?}");
        let stats: Value = serde_json::from_slice(&folder.read("r.json")).expect("JSON");
        stats["variance"].clone()
    };
    assert_eq!(class("0"), class("0.01"));
    assert_ne!(class("0"), json!("finite"));
}

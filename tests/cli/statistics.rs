//! What the program says of a render.

use serde_json::{Value, json};

use crate::cli_support::{BLACK, Folder, GOOD, holds};

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
    let scene = GOOD.replace(
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

//! Scenes that cannot be rendered as they stand, or only with a warning.

use serde_json::{Value, json};

use crate::cli_support::{Folder, holds};

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

//! The scene loader from outside: what it accepts, and what it says about everything else.

use std::fs;
use std::path::{Path, PathBuf};

use glam::DVec3;
use gpu_trace::error::Error;
use gpu_trace::materials::MaterialKind;
use gpu_trace::materials::dielectric::Dielectric;
use gpu_trace::placement::Placement;
use gpu_trace::scene::load::{load_file, load_str};
use gpu_trace::scene::{Environment, Handedness, builtin, summary};

/// A scene without mistakes. Every case below changes one place of it.
const GOOD: &str = r#"[camera]
position = [0.0, 0.0, -4.0]
look_at = [0.0, 0.0, 6.0]
up = [0.0, 1.0, 0.0]
fov = 36.0
handedness = "left"
aperture_radius = 0.1
focus_distance = 4.0
[image]
width = 64
height = 48
[render]
spp = 16
max_bounces = 8
[environment]
radiance = [0.7, 0.8, 1.0]
[material.white]
type = "diffuse"
albedo = [0.9, 0.8, 0.7]
emission = [2.0, 2.0, 2.0]
[material.glass]
type = "dielectric"
ior = 1.5
[material.shiny]
type = "reflective"
albedo = [0.3, 0.3, 0.3]
specular = [1.0, 1.0, 1.0]
epsilon = 0.01
mu = 10.0
[[sphere]]
center = [0.0, 1.0, 2.0]
radius = 1.0
material = "white"
[[sphere]]
center = [3.0, 1.0, 2.0]
radius = 0.5
material = "glass"
priority = 2
[[sphere]]
center = [6.0, 1.0, 2.0]
radius = 0.5
material = "shiny"
"#;

/// The cells of a table whose columns are separated by bars; `\n` is a newline.
fn rows<const N: usize>(table: &str) -> impl Iterator<Item = [String; N]> {
    table.trim().lines().map(|row| {
        let cell = |cell: &str| match cell.trim() {
            "(nothing)" => String::new(),
            cell => cell.replace("\\n", "\n"),
        };
        let cells: Vec<_> = row.split(" | ").map(cell).collect();
        cells
            .try_into()
            .unwrap_or_else(|_| panic!("not {N} cells: {row}"))
    })
}

/// What is said about the good scene with one place changed; the place must exist.
fn complaint(from: &str, to: &str) -> String {
    assert!(GOOD.contains(from), "{from:?} is not in the good scene");
    match load_str("bad.toml", &GOOD.replacen(from, to, 1)) {
        Err(Error::Scene(text)) => text,
        other => panic!("{from:?} -> {to:?} should be refused: {other:?}"),
    }
}

fn check(from: &str, to: &str, place: &str, parts: &[&str]) {
    let text = complaint(from, to);
    let header = format!("┌─ bad.toml:{place}\n");
    assert!(text.starts_with("error: "), "{text}");
    assert!(text.contains(&header), "no {place} for {to:?} in\n{text}");
    for part in parts {
        assert!(text.contains(part), "no {part:?} for {to:?} in\n{text}");
    }
    assert_eq!(text.matches("error: ").count(), 1, "one mistake:\n{text}");
}

#[test]
fn the_good_scene_is_read_as_written() {
    let loaded = load_str("good", GOOD).expect("good");
    assert_eq!(loaded.warnings, [""; 0]);
    assert_eq!(loaded.name, "good");
    let scene = loaded.scene;
    assert_eq!(scene.camera.position, DVec3::new(0.0, 0.0, -4.0));
    assert_eq!(scene.camera.handedness, Handedness::Left);
    assert_eq!((scene.width, scene.height), (64, 48));
    assert_eq!(scene.render.spp, Some(16));
    let sky = Environment::Constant(DVec3::new(0.7, 0.8, 1.0));
    assert_eq!(scene.environment, Some(sky));
    let names: Vec<_> = scene.materials.iter().map(|m| m.name.as_str()).collect();
    assert_eq!(names, ["white", "glass", "shiny"], "in file order");
    assert_eq!(
        scene.materials[1].kind,
        MaterialKind::from(Dielectric::smooth(1.5))
    );
    assert_eq!(scene.materials[0].emission, DVec3::splat(2.0));
    assert_eq!(scene.spheres[1].priority, Some(2));
    assert_eq!(scene.spheres[2].material, 2);
}

#[test]
fn defaults_are_those_of_the_documentation() {
    let text = "camera = { position = [-0.0, 2, 3], look_at = [0, 2, 7], fov = 40 }\n\
                image = { width = 2, height = 3 }\n\
                environment = { radiance = [-0.0, 0, 0] }\n";
    let scene = load_str("inline", text)
        .expect("inline tables are TOML too")
        .scene;
    assert!(
        scene.camera.position.x.is_sign_positive(),
        "there is one zero"
    );
    assert_eq!(scene.camera.up, DVec3::Y);
    assert_eq!(scene.camera.handedness, Handedness::Right);
    assert_eq!(scene.camera.aperture_radius, 0.0);
    assert_eq!(scene.camera.focus_distance, 4.0);
    assert_eq!(scene.environment, None, "black is no environment");
    assert_eq!((scene.render.spp, scene.render.max_bounces), (None, None));
    assert!(!scene.moves());
}

#[test]
fn values_at_the_ends_of_their_ranges_are_legal() {
    for [from, to] in rows(
        r#"
        fov = 36.0 | fov = 179.999
        radius = 1.0 | radius = 1e20
        radius = 1.0 | radius = 1
        radius = 1.0 | radius = 5e-324
        [0.0, 1.0, 2.0] | [-1e20, 1e20, -0.0]
        [0.9, 0.8, 0.7] | [0, 1, 0.5]
        width = 64 | width = 65_536
        width = 64 | width = 0x40
        spp = 16 | spp = 281474976710656
        max_bounces = 8 | max_bounces = 0
        priority = 2 | priority = -2147483648
        aperture_radius = 0.1\nfocus_distance = 4.0 | aperture_radius = 0
        epsilon = 0.01\nmu = 10.0 | epsilon = 1\nmu = 0
        "#,
    ) {
        let text = GOOD.replacen(&from, &to, 1);
        assert_ne!(text, GOOD, "{from:?} is not in the good scene");
        load_str("good", &text).unwrap_or_else(|error| panic!("{to:?}: {error}"));
    }
    // Whatever an editor makes of line ends and of the start of the file.
    let good = load_str("good", GOOD).expect("good").scene;
    for text in [GOOD.replace('\n', "\r\n"), format!("\u{feff}{GOOD}")] {
        assert_eq!(load_str("good", &text).expect("good").scene, good);
    }
}

#[test]
fn numbers_outside_of_their_range_are_refused() {
    for [from, to, place, part] in rows(
        r#"
        radius = 1.0 | radius = 0 | 32:10 | `radius` must be greater than 0
        radius = 1.0 | radius = -0.0 | 32:10 | greater than 0
        radius = 1.0 | radius = -1 | 32:10 | ^^ negative
        radius = 1.0 | radius = nan | 32:10 | finite number
        radius = 1.0 | radius = -nan | 32:10 | finite number
        radius = 1.0 | radius = inf | 32:10 | ^^^ infinite
        radius = 1.0 | radius = 1e400 | 32:10 | too large for 64 bits
        radius = 1.0 | radius = 1.0001e20 | 32:10 | at most 1e20
        radius = 1.0 | radius = 10000000000000000000 | 32:10 | with a point
        [0.0, 1.0, 2.0] | [0.0, nan, 2.0] | 31:16 | `center` must be a finite number
        [0.0, 1.0, 2.0] | [0.0, 1.0, -2e20] | 31:21 | [-1e20, 1e20]
        [0.9, 0.8, 0.7] | [0.9, 1.001, 0.7] | 19:16 | `albedo` must be in [0, 1]
        [0.9, 0.8, 0.7] | [0.9, 0.8, -1e-9] | 19:21 | `albedo` must be in [0, 1]
        specular = [1.0 | specular = [1.1 | 27:13 | `specular` must be in [0, 1]
        emission = [2.0 | emission = [-2.0 | 20:13 | `emission` must be at least 0
        radiance = [0.7 | radiance = [-0.7 | 16:13 | `radiance` must be at least 0
        ior = 1.5 | ior = 0.0 | 23:7 | `ior` must be greater than 0
        ior = 1.5 | ior = 1.5\nroughness = 1.1 | 24:13 | `roughness` must be in [0, 1]
        ior = 1.5 | ior = 1.5\nabsorption = [0, -1, 0] | 24:18 | `absorption` must be
        ior = 1.5 | cauchy = [1.5] | 23:10 | `cauchy` must have exactly 2 numbers
        ior = 1.5 | preset = "BK8" | 23:10 | did you mean "BK7"?
        ior = 1.5 | sellmeier = { b = [1, 0, 0] } | 23:13 | `c` is missing in
        fov = 36.0 | fov = 0 | 5:7 | `fov` must be in (0, 180)
        fov = 36.0 | fov = 180 | 5:7 | `fov` must be in (0, 180)
        epsilon = 0.01 | epsilon = 0 | 28:11 | `epsilon` must be in (0, 1]
        epsilon = 0.01 | epsilon = 1.5 | 28:11 | `epsilon` must be in (0, 1]
        mu = 10.0 | mu = -1.0 | 29:6 | `mu` must be at least 0
        radius = 0.1 | radius = -0.1 | 7:19 | `aperture_radius` must be at least 0
        focus_distance = 4.0 | focus_distance = 0 | 8:18 | greater than 0
        distance = 4.0 | distance = 4.0\nshutter = [0, nan] | 9:15 | `shutter` must be a finite number
        distance = 4.0 | distance = 4.0\nshutter = [0, 1e300] | 9:15 | `shutter` must be in
        distance = 4.0 | distance = 4.0\nshutter = [1, 0.5] | 9:11 | help: `shutter = [0.5, 1.0]` opens first
        distance = 4.0 | distance = 4.0\nshutter = [1] | 9:11 | exactly 2 numbers
        radius = 1.0 | radius = 1.0\nvelocity = [0, inf, 0] | 33:16 | `velocity` must be a finite number
        radius = 1.0 | radius = 1.0\nvelocity = 2 | 33:12 | write `[2, 2, 2]`
        width = 64 | width = 0 | 10:9 | an integer in [1, 65536]
        height = 48 | height = 65537 | 11:10 | an integer in [1, 65536]
        spp = 16 | spp = 0 | 13:7 | an integer in [1, 281474976710656]
        spp = 16 | spp = -1 | 13:7 | ^^ negative
        max_bounces = 8 | max_bounces = -1 | 14:15 | integer in [0, 65535]
        max_bounces = 8 | max_bounces = 99999999999999999999 | 14:15 | too large
        priority = 2 | priority = 2147483648 | 38:12 | 2147483647]
        "#,
    ) {
        check(&from, &to, &place, &[&part]);
    }
}

/// Lengths that are legal alone and whose squares or inverses no f64 holds.
#[test]
fn lengths_too_small_to_compute_with_are_refused_or_of_use() {
    check(
        "look_at = [0.0, 0.0, 6.0]",
        "look_at = [0.0, 1e-200, -4.0]",
        "3:11",
        &["`look_at` is too near to the camera's `position`"],
    );
    check(
        "focus_distance = 4.0",
        "focus_distance = 1e-300",
        "8:18",
        &["`focus_distance` is too small", "help: the least is 1e-140"],
    );
    let tiny = |text: &str| {
        let small = ["1e-150", "5e-324", "1e-300"].into_iter();
        small.fold(text.replace("radius = 1.0", "radius = 0.5"), |text, r| {
            text.replacen("\nradius = 0.5", &format!("\nradius = {r}"), 1)
        })
    };
    let Err(Error::Scene(text)) = load_str("bad.toml", &tiny(GOOD)) else {
        panic!("no sphere can be computed with");
    };
    let parts = ["the spheres are too small", "┌─ bad.toml:32:10\n", "1e-140"];
    assert!(parts.iter().all(|part| text.contains(part)), "{text}");

    for (from, to) in [
        ("up = [0.0, 1.0, 0.0]", "up = [0.0, 1e-300, 1e-300]"),
        ("up = [0.0, 1.0, 0.0]", "up = [0.0, 5e-324, 0.0]"),
        ("look_at = [0.0, 0.0, 6.0]", "look_at = [1e-120, 0.0, 6.0]"),
        ("focus_distance = 4.0", "focus_distance = 1e-130"),
        ("radius = 1.0", "radius = 5e-324"),
    ] {
        assert!(GOOD.contains(from), "{from}");
        let scene = load_str("good", &GOOD.replacen(from, to, 1));
        let scene = scene.unwrap_or_else(|error| panic!("{to}: {error}")).scene;
        let camera = Placement::new(&scene, 64, 48).camera;
        for vector in [camera.forward, camera.across, camera.down, camera.lens_down] {
            assert!(vector.is_finite(), "{to}: {camera:?}");
        }
        assert!(camera.across.length() > 0.0 && camera.focus.is_finite());
    }
}

#[test]
fn types_and_lengths_are_checked() {
    for [from, to, place, part] in rows(
        r#"
        radius = 1.0 | radius = "1" | 32:10 | help: remove the quotes
        radius = 1.0 | radius = true | 32:10 | this is a boolean
        radius = 1.0 | radius = 2025-01-01 | 32:10 | this is a date
        [0.0, 1.0, 2.0] | [0.0, 1.0] | 31:10 | exactly 3 numbers
        [0.0, 1.0, 2.0] | [0.0, 1.0, 2.0, 3] | 31:10 | ^ has 4
        [0.0, 1.0, 2.0] | [0.0, [1.0], 2.0] | 31:16 | this is an array
        [0.9, 0.8, 0.7] | 0.9 | 19:10 | write `[0.9, 0.9, 0.9]`
        width = 64 | width = 64.0 | 10:9 | without a decimal point
        material = "white" | material = 1 | 33:12 | must be a string
        [image] | [[image]] | 9:1 | write `[image]`, with one bracket
        [render]\nspp = 16 | [render]\nspp = {} | 13:7 | this is a table
        "#,
    ) {
        check(&from, &to, &place, &[&part]);
    }
    let text = "[camera]\nposition=[0,0,0]\nlook_at=[0,0,1]\nfov=9\n[image]\nwidth=1\nheight=1\n[sphere]\n";
    let error = load_str("a", text).expect_err("one bracket").to_string();
    assert!(
        error.contains("write `[[sphere]]`, with two brackets"),
        "{error}"
    );
}

#[test]
fn misspelt_words_get_a_suggestion() {
    for [from, to, place, part] in rows(
        r#"
        radius = 1.0 | radus = 1.0 | 32:1 | did you mean `radius`?
        center | centre | 31:1 | did you mean `center`?
        [camera] | [kamera] | 1:2 | did you mean `camera`?
        [[sphere]] | [[spheres]] | 30:3 | did you mean `sphere`?
        look_at | lookat | 3:1 | did you mean `look_at`?
        "diffuse" | "difuse" | 18:8 | did you mean "diffuse"?
        "left" | "Left" | 6:14 | did you mean "left"?
        = "white" | = "whyte" | 33:12 | did you mean "white"?
        emission | emision | 20:1 | did you mean `emission`?
        "#,
    ) {
        check(&from, &to, &place, &["error: unknown", &part]);
    }
    // And no suggestion where nothing is near.
    let text = complaint("= \"white\"", "= \"obsidian\"");
    assert!(!text.contains("did you mean"), "{text}");
    assert!(
        text.contains("the materials here are `white`, `glass` and `shiny`"),
        "{text}"
    );
    let text = complaint("priority = 2", "temperature = 2");
    assert!(!text.contains("did you mean"), "{text}");
    assert!(text.contains("the keys here are "), "{text}");
}

#[test]
fn missing_keys_name_their_table() {
    for [from, to, place, part] in rows(
        r#"
        fov = 36.0\n | (nothing) | 1:1 | `fov` is missing in `[camera]`
        height = 48\n | (nothing) | 9:1 | `height` is missing in `[image]`
        radius = 0.5\n | (nothing) | 34:1 | `radius` is missing in this `[[sphere]]`
        type = "dielectric"\n | (nothing) | 21:1 | help: add `type = "dielectric"`
        radiance = [0.7, 0.8, 1.0]\n | (nothing) | 15:1 | is missing in `[environment]`
        [image]\nwidth = 64\nheight = 48\n | (nothing) | 1:1 | `image` is missing in the scene file
        "#,
    ) {
        check(&from, &to, &place, &[&part]);
    }
}

#[test]
fn keys_of_another_material_say_whose_they_are() {
    check(
        "emission = [2.0, 2.0, 2.0]",
        "ior = 1.5",
        "20:1",
        &[
            "a diffuse material has no `ior`",
            "^^^ belongs to `dielectric`",
            "the type is chosen here",
        ],
    );
    check(
        "ior = 1.5",
        "albedo = [1, 1, 1]",
        "23:1",
        &["belongs to `diffuse` and `reflective`"],
    );
}

#[test]
fn values_that_contradict_each_other_are_refused() {
    for [from, to, place, part] in rows(
        r#"
        [0.0, 0.0, 6.0] | [0, 0, -4] | 3:11 | is the camera's `position`
        up = [0.0, 1.0, 0.0] | up = [0, 0, 0] | 4:6 | its length is 0
        up = [0.0, 1.0, 0.0] | up = [0, 0, -1e-9] | 4:6 | `up = [0.0, 1.0, 0.0]`
        [0.0, 0.0, 6.0]\nup = [0.0, 1.0, 0.0]\n | [0, 9, -4]\n | 3:11 | `up`, (0, 1, 0) by default,
        focus_distance = 4.0\n | (nothing) | 7:19 | `focus_distance = 10.0` focuses on `look_at`
        material = "glass" | material = "white" | 38:12 | priority` needs a dielectric
        ior = 1.5\n | (nothing) | 22:1 | a dielectric needs its index in `[material.glass]`
        ior = 1.5 | preset = "BK7"\nior = 1.5 | 23:1 | the index is given more than once in `[material.glass]`
        ior = 1.5 | ior = 1.5\ncauchy = [1.5, 0.01] | 24:1 | give one of `ior`, `preset`, `cauchy` and `sellmeier`
        ior = 1.5 | cauchy = [1.0, -0.2] | 23:1 | `cauchy` is no index at some wavelength from 360 to 830 nm
        ior = 1.5 | sellmeier = { b = [1, 0, 0], c = [0.3, 0, 0] } | 23:1 | `sellmeier` is no index at some wavelength
        "#,
    ) {
        check(&from, &to, &place, &[&part]);
    }
    // Nearly parallel is still a direction.
    let text = GOOD.replace("up = [0.0, 1.0, 0.0]", "up = [0, 1e-6, -1]");
    load_str("good", &text).expect("an up that is nearly parallel");
}

#[test]
fn syntax_errors_look_like_the_others() {
    for [from, to, place, part] in rows(
        r#"
        fov = 36.0 | fov = 36,5 | 5:9 | the line should end here
        fov = 36.0 | fov = 36.0\nfov = 37.0 | 6:1 | duplicate key
        fov = 36.0 | fov 36 | 5:5 | a key without a value
        fov = 36.0 | fov = .5 | 5:7 | 0.5, 1.0
        fov = 36.0 | fov = 5. | 5:9 | 0.5, 1.0
        [image] | [image | 9:7 | unclosed table
        "white" | white | 33:12 | words "in quotes"
        "left" | "left | 6:19 | invalid basic string
        "#,
    ) {
        check(&from, &to, &place, &[&part]);
    }
}

#[test]
fn every_mistake_of_a_file_is_reported_in_order() {
    // By name, glass comes before white; in the file it does not.
    let text = GOOD
        .replace("fov = 36.0", "fov = 0")
        .replace("albedo = [0.9", "albedo = [9")
        .replace("ior = 1.5", "ior = -1")
        .replace("radius = 0.5", "radus = 0.5");
    let error = load_str("bad.toml", &text).expect_err("bad").to_string();
    let places = ["5:7", "19:11", "23:7", "36:1", "41:1"];
    let found = places.map(|place| error.find(&format!("bad.toml:{place}\n")));
    assert!(found.iter().all(Option::is_some), "{error}");
    assert!(found.is_sorted(), "{error}");
    assert_eq!(error.matches("error: ").count(), places.len(), "{error}");
}

#[test]
fn warnings_name_their_place() {
    let warnings = |from: &str, to: &str| {
        let text = GOOD.replacen(from, to, 1);
        assert_ne!(text, GOOD);
        load_str("odd.toml", &text).expect("legal").warnings
    };
    let gains = warnings("albedo = [0.3, 0.3, 0.3]", "albedo = [0.3, 0.38, 0.3]");
    assert_eq!(gains.len(), 1, "{gains:?}");
    assert!(gains[0].contains("odd.toml:24:11") && gains[0].contains("up to 1.005 times"));
    // The lecture's limit, as it is rounded there, is silent.
    assert_eq!(
        warnings("albedo = [0.3, 0.3, 0.3]", "albedo = [0.375, 0, 0]"),
        [""; 0]
    );

    let unused = warnings("material = \"shiny\"", "material = \"white\"");
    assert_eq!(unused.len(), 1);
    assert!(unused[0].starts_with("warning: material \"shiny\" is used by no sphere"));
    assert!(unused[0].contains("┌─ odd.toml:24:11\n"), "{}", unused[0]);

    let dark = GOOD.replace("radiance = [0.7, 0.8, 1.0]", "radiance = [0, 0, 0]");
    let dark = dark.replace("emission = [2.0, 2.0, 2.0]\n", "");
    let warnings = load_str("dark", &dark).expect("legal").warnings;
    assert_eq!(warnings.len(), 1);
    assert!(warnings[0].contains("no light"), "{}", warnings[0]);
    let empty = &GOOD[..GOOD.find("[material.white]").expect("there")];
    let warnings = load_str("empty", empty).expect("legal").warnings;
    assert!(
        warnings.len() == 1 && warnings[0].contains("no spheres"),
        "{warnings:?}"
    );
}

#[test]
fn files_that_are_no_scenes_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = |name: &str, bytes: &[u8]| -> PathBuf {
        let path = folder.path().join(name);
        fs::write(&path, bytes).expect("written");
        path
    };
    let text = |path: &Path| load_file(path).expect_err("refused").to_string();
    assert!(text(&file("empty.toml", b"")).starts_with("error: the scene file is empty\n"));
    assert!(text(&file("comment.toml", b"# only\n")).contains("comment.toml:1:1"));
    let latin = text(&file("latin.toml", b"# a\n# caf\xe9\n"));
    assert!(
        latin.contains("byte 0xe9") && latin.contains("latin.toml:2:6"),
        "{latin}"
    );
    assert!(text(&file("image.toml", b"\x89PNG\r\n\x1a\n\0\0")).contains("binary data"));
    for (path, part) in [
        (folder.path().join("missing.toml"), "cannot read"),
        (folder.path().to_owned(), "is a directory"),
    ] {
        let error = load_file(&path).expect_err("refused");
        assert!(matches!(error, Error::File { .. }), "{error:?}");
        assert!(error.to_string().contains(part), "{error}");
        assert!(
            error.to_string().contains(&path.display().to_string()),
            "{error}"
        );
    }
    // A sparse file of 256 MiB and one byte; at the limit it is read, and is no TOML.
    let huge = fs::File::create(folder.path().join("huge.toml")).expect("created");
    huge.set_len((256 << 20) + 1).expect("sparse");
    let error = text(&folder.path().join("huge.toml"));
    assert!(error.contains("larger than 256 MiB"), "{error}");
    let good = load_file(&file("room.v2.toml", GOOD.as_bytes())).expect("good");
    assert_eq!(good.name, "room.v2");
}

/// Without what a material leaves out by design, which every scene that has it is told.
fn unmeant(warnings: &[String]) -> Vec<&str> {
    let by_design = |w: &&str| w.contains("by design") && !w.contains("gains");
    let all = warnings.iter().map(String::as_str);
    all.filter(|w| !by_design(w)).collect()
}

#[test]
fn the_gallery_and_the_test_scenes_load() {
    for name in builtin::names() {
        let loaded = builtin::resolve(Some(name)).expect(name);
        assert_eq!(unmeant(&loaded.warnings), [""; 0], "{name}");
        assert_eq!(loaded.name, name);
        assert!(!builtin::get(name).expect(name).description.is_empty());
        assert!(summary(&loaded).contains(&loaded.hash));
    }
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let mut count = 0;
    for folder in [scenes.clone(), scenes.join("tests")] {
        for entry in fs::read_dir(folder).expect("scenes") {
            let path = entry.expect("entry").path();
            if path
                .extension()
                .is_some_and(|extension| extension == "toml")
            {
                let loaded = load_file(&path).unwrap_or_else(|error| panic!("{error}"));
                let stem = path.file_stem().expect("stem").to_string_lossy();
                // Every scene of the gallery's folder is built in, but for those that name files; and the empty one is
                // empty.
                let alone = path.parent() == Some(&scenes) && loaded.files.is_empty();
                assert!(!alone || builtin::get(&stem).is_some(), "{stem}");
                assert_eq!(
                    unmeant(&loaded.warnings).is_empty(),
                    stem != "empty",
                    "{:?}",
                    loaded.warnings
                );
                count += 1;
            }
        }
    }
    assert!(count >= 15, "only {count} scenes");
}

#[test]
fn of_many_unknown_materials_each_that_is_shown_has_its_suggestion() {
    let sphere = "[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = \"whit\"\n";
    for (count, shown, more) in [
        (20, 20, None),
        (25, 20, Some("error: and 5 more like these")),
    ] {
        let text = format!("{GOOD}{}", sphere.repeat(count));
        let Err(Error::Scene(message)) = load_str("scene", &text) else {
            panic!("{count} unknown materials are accepted");
        };
        assert_eq!(message.matches("unknown material \"whit\"").count(), shown);
        assert_eq!(message.matches("did you mean \"white\"?").count(), shown);
        let last = message
            .lines()
            .last()
            .filter(|line| line.starts_with("error: and"));
        assert_eq!(last, more);
    }
}

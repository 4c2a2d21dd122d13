//! Scene files, and what is made of a scene.

use std::fmt::Debug;
use std::path::Path;

use glam::DVec3;
use gpu_trace::effects::Effects;
use gpu_trace::error::Error;
use gpu_trace::placement::media::MAX_LEVELS;
use gpu_trace::placement::{PlacedCamera, Placement};
use gpu_trace::scene::load::{Loaded, load_file, load_str};
use gpu_trace::scene::{Scene, summary};
use gpu_trace::settings::Settings;

use super::{fuzz, numbers};

/// The scene files but the largest.
pub(super) fn scene_files() -> Vec<Vec<u8>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = Vec::new();
    for folder in ["scenes", "scenes/tests"] {
        let entries = std::fs::read_dir(root.join(folder)).expect("the folder of scenes");
        let paths = entries.map(|entry| entry.expect("an entry of the folder").path());
        files.extend(paths.filter(|path| path.extension().is_some_and(|e| e == "toml")));
    }
    files.sort();
    let read = |path| std::fs::read(path).expect("a file");
    let seeds: Vec<_> = files
        .iter()
        .map(read)
        .filter(|text| text.len() < 10_000)
        .collect();
    assert!(seeds.len() >= 10);
    seeds
}

/// That an error of `file` is one that a user can work with: whole reports with a place that exists.
pub(super) fn place_of(error: &str, file: &str, text: &str) {
    assert!(error.starts_with("error: "), "{error}");
    assert!(error.len() < 100_000, "{} bytes", error.len());
    let control = |c: char| c.is_control() && c != '\n' && c != '\t';
    assert!(!error.contains(control), "{error:?}");
    let place = error
        .split_once(&format!("─ {file}:"))
        .map(|(_, place)| place);
    let place = place.and_then(|place| place.lines().next());
    let place = place.and_then(|place| place.split_once(':'));
    let (line, column) = place.unwrap_or_else(|| panic!("no place: {error}"));
    let number = |text: &str| text.parse::<usize>().unwrap_or_else(|_| panic!("{error}"));
    let (line, column) = (number(line), number(column));
    let lines: Vec<&str> = text.split('\n').collect();
    assert!((1..=lines.len()).contains(&line), "line {line}: {error}");
    let most = lines[line - 1].chars().count() + 1;
    assert!((1..=most).contains(&column), "column {column}: {error}");
}

/// Everything that is done with a scene before a device is asked for.
fn use_scene(loaded: &Loaded) {
    let scene = &loaded.scene;
    let _ = summary(loaded);
    let placement = Placement::new(scene, scene.width, scene.height);
    assert_finite(&placement);
    if placement.media.levels <= MAX_LEVELS {
        let effects = Effects::derive(scene, &placement, &Settings::for_scene(scene));
        assert!(effects.names().count() < 100);
    }
}

pub(super) fn assert_finite(placement: &Placement) {
    let number = |name: &str, x: f64| assert!(x.is_finite(), "{name} is {x}");
    let vector = |name: &str, x: DVec3| assert!(x.is_finite(), "{name} is {x}");
    number("scale", placement.scale);
    assert!(placement.scale > 0.0, "scale is {}", placement.scale);
    number("light", placement.radiance_scale);
    assert!(
        placement.radiance_scale > 0.0,
        "light is {}",
        placement.radiance_scale
    );
    for sphere in &placement.spheres {
        vector("anchor", sphere.anchor);
        vector("motion", sphere.motion);
        number("radius", sphere.radius);
        vector("pole", sphere.pole.unwrap_or_default());
    }
    let PlacedCamera {
        anchor,
        approach,
        corner,
        across,
        down,
        forward,
        lens_across,
        lens_down,
        focus,
        lens_share,
    } = placement.camera;
    vector("camera.anchor", anchor);
    number("camera.approach", approach);
    vector("camera.corner", corner);
    vector("camera.across", across);
    vector("camera.down", down);
    vector("camera.forward", forward);
    vector("camera.lens_across", lens_across);
    vector("camera.lens_down", lens_down);
    number("camera.focus", focus);
    number("camera.lens_share", lens_share);
}

fn is_scene<T: Debug>(loaded: Result<T, Error>, text: &str) -> Option<T> {
    match loaded {
        Ok(loaded) => Some(loaded),
        Err(Error::Scene(error)) => {
            place_of(&error, "fuzz.toml", text);
            None
        }
        Err(other) => panic!("{other}"),
    }
}

/// A scene with members that options meet, and without lamps: for each set of words a pilot would choose the estimator.
pub(super) fn ball() -> Scene {
    let path =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/tests/white-furnace-diffuse.toml");
    load_file(&path).expect("a scene").scene
}

#[test]
fn no_bytes_upset_the_scene_loader() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("fuzz.toml");
    let tried = fuzz("scenes", numbers(8_000), &scene_files(), |_, bytes| {
        let Ok(text) = str::from_utf8(bytes) else {
            std::fs::write(&path, bytes).expect("it can be written");
            return match load_file(&path) {
                Err(Error::Scene(text)) => {
                    assert!(
                        text.starts_with("error: ") && text.contains("fuzz.toml"),
                        "{text}"
                    );
                    false
                }
                other => panic!("{other:?}"),
            };
        };
        let loaded = is_scene(load_str("fuzz.toml", text), text);
        if let Some(loaded) = &loaded {
            for warning in &loaded.warnings {
                place_of(
                    &warning.replacen("warning: ", "error: ", 1),
                    "fuzz.toml",
                    text,
                );
            }
            use_scene(loaded);
        }
        loaded.is_some()
    });
    // Some damage is harmless, most is not.
    assert!(tried.accepted > tried.refused / 50, "{tried:?}");
    assert!(tried.refused > tried.accepted / 50, "{tried:?}");
}

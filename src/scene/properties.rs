//! Properties of the loader on random scenes and random damage.

use std::fmt::Write;

use glam::DVec3;
use proptest::prelude::*;

use super::load::load_str;
use super::view::SHORTEST;
use super::{
    Camera, Environment, Gradient, Handedness, MAX_BOUNCES, MAX_SIDE, MAX_SPP, RenderDefaults,
    Scene, Sphere,
};
use crate::error::Error;
use crate::materials::schema::MAX_MAGNITUDE;
use crate::materials::{ALL, Material, MaterialKind, Value};

fn vector(v: DVec3) -> String {
    format!("[{:?}, {:?}, {:?}]", v.x, v.y, v.z)
}

fn value_text(value: Value) -> String {
    match value {
        Value::Number(number) => format!("{number:?}"),
        Value::Vector(v) => vector(v),
        Value::Pair(pair) => format!("[{:?}, {:?}]", pair.x, pair.y),
        Value::Vectors(all) => {
            let all: Vec<String> = all.into_iter().map(vector).collect();
            format!("[{}]", all.join(", "))
        }
        Value::File { .. } | Value::Names(_) => unreachable!("random scenes have neither"),
        Value::Table(values) => {
            let pairs = values.into_iter();
            let pairs = pairs.map(|(key, value)| format!("{key} = {}", value_text(value)));
            format!("{{ {} }}", pairs.collect::<Vec<_>>().join(", "))
        }
    }
}

/// The scene as a scene file. `{:?}` writes the shortest decimal that reads back as the same f64.
fn to_toml(scene: &Scene) -> String {
    let camera = &scene.camera;
    let mut text = format!(
        "[camera]\nposition = {}\nlook_at = {}\nup = {}\nfov = {:?}\nhandedness = {:?}\n\
         aperture_radius = {:?}\nfocus_distance = {:?}\n[image]\nwidth = {}\nheight = {}\n[render]\n",
        vector(camera.position),
        vector(camera.look_at),
        vector(camera.up),
        camera.fov,
        match camera.handedness {
            Handedness::Left => "left",
            Handedness::Right => "right",
        },
        camera.aperture_radius,
        camera.focus_distance,
        scene.width,
        scene.height,
    );
    let mut add = |line: String| writeln!(text, "{line}").expect("a String takes everything");
    if let Some(spp) = scene.render.spp {
        add(format!("spp = {spp}"));
    }
    if let Some(bounces) = scene.render.max_bounces {
        add(format!("max_bounces = {bounces}"));
    }
    match &scene.environment {
        None => {}
        Some(Environment::Constant(radiance)) => {
            add(format!("[environment]\nradiance = {}", vector(*radiance)));
        }
        Some(Environment::Sky(_)) => unreachable!("random scenes have no files"),
        Some(Environment::Gradient(gradient)) => add(format!(
            "[environment.gradient]\nzenith = {}\nhorizon = {}\nground = {}",
            vector(gradient.zenith),
            vector(gradient.horizon),
            vector(gradient.ground)
        )),
    }
    for material in &scene.materials {
        add(format!(
            "[material.{:?}]\ntype = {:?}\nemission = {}",
            material.name,
            material.kind.name(),
            vector(material.emission)
        ));
        for (key, value) in material.kind.parameters() {
            add(format!("{key} = {}", value_text(value)));
        }
    }
    for sphere in &scene.spheres {
        let name = &scene.materials[sphere.material].name;
        let (center, radius) = (vector(sphere.center), sphere.radius);
        add(format!(
            "[[sphere]]\ncenter = {center}\nradius = {radius:?}\nmaterial = {name:?}"
        ));
        if let Some(priority) = sphere.priority {
            add(format!("priority = {priority}"));
        }
    }
    text
}

/// Any magnitude from the smallest to the largest, not only those near the largest.
fn positive() -> impl Strategy<Value = f64> {
    (-300.0..20.0_f64).prop_map(|exponent| 10_f64.powf(exponent).min(MAX_MAGNITUDE))
}

fn coordinate() -> impl Strategy<Value = f64> {
    prop_oneof![
        Just(0.0),
        -10.0..10.0_f64,
        positive(),
        positive().prop_map(|x| -x)
    ]
}

fn three(each: impl Strategy<Value = f64> + Clone) -> impl Strategy<Value = DVec3> {
    [each.clone(), each.clone(), each].prop_map(DVec3::from_array)
}

fn radiance() -> impl Strategy<Value = DVec3> {
    three(prop_oneof![Just(0.0), positive()].boxed())
}

fn environment() -> impl Strategy<Value = Environment> {
    let gradient = [radiance(), radiance(), radiance()];
    prop_oneof![
        radiance().prop_map(Environment::Constant),
        gradient.prop_map(|[zenith, horizon, ground]| Environment::Gradient(Gradient {
            zenith,
            horizon,
            ground,
        })),
    ]
}

/// The test cases of all materials; what their numbers may be is the schema's, and damaged elsewhere.
fn kind() -> impl Strategy<Value = MaterialKind> {
    let mut all: Vec<MaterialKind> = ALL.iter().flat_map(|material| (material.cases)()).collect();
    // Random scenes have neither files nor mixes.
    all.retain(|kind| kind.table().is_none() && kind.parts().is_empty());
    prop::sample::select(all)
}

fn camera() -> impl Strategy<Value = Camera> {
    let handedness = prop_oneof![Just(Handedness::Left), Just(Handedness::Right)];
    let point = || three((-1e3..1e3_f64).boxed());
    let lens = (prop_oneof![Just(0.0), positive()], positive());
    (point(), point(), point(), 0.1..179.9_f64, handedness, lens)
        .prop_filter("lengths to compute with", |camera| {
            camera.5.0 == 0.0 || camera.5.1 > SHORTEST
        })
        .prop_filter("a direction and an upward one", |camera| {
            (camera.1 - camera.0).cross(camera.2).length() > 1e-3
        })
        .prop_map(|(position, look_at, up, fov, handedness, lens)| Camera {
            position,
            look_at,
            up,
            fov,
            handedness,
            aperture_radius: lens.0,
            focus_distance: lens.1,
        })
}

fn scene() -> impl Strategy<Value = Scene> {
    // Names that need quotes and escapes too; each once, made so by its index.
    let material = ("[ -~é]{0,6}", kind(), radiance());
    let materials = prop::collection::vec(material, 1..5);
    let sphere = (
        three(coordinate().boxed()),
        positive(),
        any::<prop::sample::Index>(),
        any::<Option<i32>>(),
    );
    let render = (
        prop::option::of(1..=MAX_SPP),
        prop::option::of(0..=MAX_BOUNCES),
    );
    (
        camera(),
        (1..=MAX_SIDE, 1..=MAX_SIDE),
        render,
        prop::option::of(environment().prop_filter("not black", |e| e.brightest() > 0.0)),
        materials,
        prop::collection::vec(sphere, 0..8).prop_filter("lengths to compute with", |spheres| {
            spheres.is_empty() || spheres.iter().any(|sphere| sphere.1 > SHORTEST)
        }),
    )
        .prop_map(|(camera, size, render, environment, materials, spheres)| {
            let materials: Vec<_> = materials
                .into_iter()
                .enumerate()
                .map(|(index, (name, kind, emission))| Material {
                    emission,
                    ..Material::new(&format!("{name}{index}"), kind)
                })
                .collect();
            let spheres = spheres
                .into_iter()
                .map(|(center, radius, material, priority)| {
                    let material = material.index(materials.len());
                    let glass = materials[material].kind.transmits();
                    Sphere {
                        center,
                        motion: DVec3::ZERO,
                        radius,
                        material,
                        priority: priority.filter(|_| glass),
                    }
                })
                .collect();
            Scene {
                camera,
                width: size.0,
                height: size.1,
                render: RenderDefaults {
                    spp: render.0,
                    max_bounces: render.1,
                },
                environment,
                materials,
                spheres,
            }
        })
}

/// Every place that a text of errors names, as line and column.
fn places(text: &str) -> Vec<(usize, usize)> {
    text.lines()
        .filter_map(|line| line.trim_start().strip_prefix("┌─ damaged:"))
        .map(|place| {
            let (line, column) = place.split_once(':').expect("line:column");
            (
                line.parse().expect("a line"),
                column.parse().expect("a column"),
            )
        })
        .collect()
}

/// Either a scene, or errors that all name a place within the text.
fn loads_or_says_where(text: &str) -> Result<(), TestCaseError> {
    match load_str("damaged", text) {
        Ok(_) => Ok(()),
        Err(Error::Scene(errors)) => {
            let lines: Vec<_> = text.lines().collect();
            let places = places(&errors);
            prop_assert!(!places.is_empty(), "no place in {errors}");
            for (line, column) in places {
                prop_assert!(line >= 1 && line <= lines.len().max(1), "{errors}");
                let length = lines.get(line - 1).map_or(0, |line| line.chars().count());
                // One past the end is where something is missing, and one more is the line end.
                prop_assert!(column >= 1 && column <= length + 2, "{errors}");
            }
            Ok(())
        }
        Err(other) => Err(TestCaseError::fail(format!("{other:?}"))),
    }
}

/// What people and broken programs put into scene files.
fn fragment() -> impl Strategy<Value = String> {
    const KNOWN: &[&str] = &[
        "nan",
        "inf",
        "1e400",
        "-",
        "=",
        "[",
        "]",
        "[[sphere]]",
        "\"",
        "'",
        "\"\"\"",
        "\n",
        "\r",
        "#",
        ".",
        ",",
        "{",
        "}",
        "\\u12",
        "\0",
        "\u{1b}",
        "é",
        "99999999999999999999",
        "0x",
        "true",
        "1979-05-27",
        "type = \"mirror\"\n",
        "[camera]",
        "radius",
        "[material]\n",
        "a.b.c = 1\n",
    ];
    prop_oneof![
        prop::sample::select(KNOWN).prop_map(str::to_owned),
        any::<String>()
    ]
}

proptest! {
    #[test]
    fn a_scene_survives_its_file(scene in scene()) {
        let text = to_toml(&scene);
        let loaded = load_str("random", &text)
            .map_err(|error| TestCaseError::fail(format!("{error}\n{text}")))?;
        prop_assert_eq!(&loaded.scene, &scene);
        prop_assert_eq!(loaded.hash, super::content_hash(&scene));
    }

    #[test]
    fn damage_is_refused_with_its_place(
        scene in scene(),
        damage in prop::collection::vec((any::<prop::sample::Index>(), 0..20_usize, fragment()), 1..4),
    ) {
        let mut text = to_toml(&scene);
        for (at, remove, insert) in damage {
            let start = text.floor_char_boundary(at.index(text.len() + 1));
            let end = text.ceil_char_boundary(start + remove);
            text.replace_range(start..end, &insert);
        }
        loads_or_says_where(&text)?;
    }

    #[test]
    fn any_text_is_refused_with_its_place(text in any::<String>()) {
        loads_or_says_where(&text)?;
    }
}

#[test]
fn the_place_check_can_fail() {
    assert_eq!(places("error: x\n   ┌─ damaged:3:14\n"), [(3, 14)]);
    // A text whose errors name a line that it does not have.
    let Err(Error::Scene(errors)) = load_str("damaged", "\n\n\nx") else {
        panic!("not a scene")
    };
    assert_eq!(places(&errors), [(4, 2)]);
}

#[test]
fn deep_nesting_is_refused() {
    let depth = 100_000;
    for text in [
        format!("a = {}", "[".repeat(depth)),
        format!("a = {}1{}", "[".repeat(depth), "]".repeat(depth)),
        format!("a = {}", "{a = ".repeat(depth)),
        format!("{}a = 1", "a.".repeat(depth)),
        format!("[{}a]", "a.".repeat(depth)),
    ] {
        let error = load_str("damaged", &text)
            .expect_err("too deep")
            .to_string();
        assert_eq!(places(&error).len(), 1);
        assert!(error.len() < 2000, "{}", error.len());
    }
}

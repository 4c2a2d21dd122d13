//! What may be rendered: `prepare` refuses the rest, whoever asks.

use std::ops::Range;

use crate::common::scene_file;
use gpu_trace::error::Error;
use gpu_trace::job::prepare;
use gpu_trace::scene::Scene;
use gpu_trace::settings::{GeometryChoice, Integrator, Offset, Rect, Settings};
use gpu_trace::verify::settings;

type Change = fn(&mut Settings);

fn lamps() -> Scene {
    scene_file("scenes/lecture.toml")
}

fn crop(rect: [u32; 4]) -> Rect {
    let [x, y, width, height] = rect;
    Rect {
        x,
        y,
        width,
        height,
    }
}

#[test]
fn settings_out_of_range_are_refused_and_their_neighbours_are_not() {
    let scene = lamps();
    let base = settings(&scene, 16, 16, 256);
    // What is refused, a part of what is said, and the nearest that is not.
    let cases: &[(Change, &str, Change)] = &[
        (|s| s.width = 0, "--size", |s| s.width = 65_536),
        (|s| s.height = 65_537, "--size", |s| s.height = 65_536),
        (
            |s| s.crop = crop([8, 0, 9, 16]),
            "--crop 8,0,9x16 reaches beyond the image of 16x16 pixels",
            |s| s.crop = crop([8, 0, 8, 16]),
        ),
        (
            |s| s.crop = crop([0, u32::MAX, 1, 2]),
            "--crop",
            |s| s.crop = crop([0, 15, 1, 1]),
        ),
        (|s| s.crop.width = 0, "--crop", |s| s.crop.width = 1),
        (|s| s.samples = 5..5, "no sample", |s| s.samples = 5..6),
        (
            |s| s.samples = 0..(1 << 48) + 1,
            "2^48",
            |s| s.samples = 0..1 << 48,
        ),
        (
            |s| (s.adaptive, s.samples) = (true, 0..127),
            "--adaptive needs at least 128",
            |s| (s.adaptive, s.samples) = (true, 0..128),
        ),
        (
            |s| (s.adaptive, s.samples) = (true, 1..200),
            "--sample-range",
            |s| s.samples = 1..200,
        ),
        (
            |s| s.error = Some(0.0),
            "--error",
            |s| s.error = Some(1.0e-9),
        ),
        (|s| s.error = Some(f64::NAN), "--error", |s| s.error = None),
        (
            |s| s.max_bounces = 65_536,
            "--max-bounces 65536",
            |s| s.max_bounces = 65_535,
        ),
        (
            |s| s.integrator = Integrator::Lecture { termination: 1.0 },
            "--termination 1",
            |s| s.integrator = Integrator::Lecture { termination: 0.99 },
        ),
        (
            |s| {
                s.integrator = Integrator::Lecture {
                    termination: f64::NAN,
                }
            },
            "--termination NaN",
            |s| s.integrator = Integrator::Lecture { termination: 0.0 },
        ),
        (
            |s| s.offset = Offset::Out(-1.0),
            "--offset out:-1.0",
            |s| s.offset = Offset::Out(0.0),
        ),
        (
            |s| s.offset = Offset::Back(f64::NAN),
            "--offset",
            |s| s.offset = Offset::Back(1.0e-4),
        ),
    ];
    for (wrong, part, right) in cases {
        let with = |change: &Change| {
            let mut settings = base.clone();
            change(&mut settings);
            prepare(&scene, &settings)
        };
        match with(wrong) {
            Err(Error::Usage(text)) => assert!(text.contains(part), "{part}: {text}"),
            other => panic!("{part}: {other:?}"),
        }
        with(right).unwrap_or_else(|e| panic!("{part}: {e}"));
    }
}

#[test]
fn a_scene_too_large_to_bake_is_refused() {
    let mut scene = lamps();
    let sphere = scene.spheres[0];
    let fill = |scene: &mut Scene, range: Range<u32>| {
        for i in range {
            let mut sphere = sphere;
            sphere.center.x += f64::from(i);
            scene.spheres.push(sphere);
        }
    };
    let there = scene.spheres.len() as u32;
    fill(&mut scene, there..256);
    let mut settings = settings(&scene, 16, 16, 16);
    settings.geometry = GeometryChoice::Baked;
    assert!(prepare(&scene, &settings).is_ok());
    fill(&mut scene, 256..257);
    let error = prepare(&scene, &settings).expect_err("257 spheres");
    assert!(error.to_string().contains("has 257"), "{error}");
    settings.geometry = GeometryChoice::Auto;
    assert!(prepare(&scene, &settings).is_ok());
}

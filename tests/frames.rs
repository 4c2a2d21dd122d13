//! `--frames`: an image for each frame of a trajectory.
#![cfg(unix)]

use std::fmt::Write as _;

use serde_json::Value;

use crate::cli_support::{Background, Folder, GOOD, bits, holds};
use crate::common::images::assert_same;

/// Four balls that move apart, and a number of each that grows; five frames.
fn folder() -> Folder {
    let folder = Folder::new();
    let mut text = String::new();
    for frame in 0..5 {
        text += "4\nProperties=species:S:1:pos:R:3:v:R:1\n";
        for i in 0..4 {
            let x = f64::from((frame + 2) * (2 * i - 3));
            writeln!(text, "C {x} {} 0 {}", i % 2, i + 10 * frame).expect("to a string");
        }
    }
    folder.write("move.xyz", &text);
    folder.write("still.xyz", "1\n\nO 0 3 0\n");
    let table = |file: &str, keys: &str| {
        format!("\n[[particles]]\nfile = \"{file}.xyz\"\nradius = 0.5\n{keys}\n")
    };
    let scene = |keys: &str| {
        let of_element = "color_by = \"element\"";
        let still = table("still", of_element);
        format!("{GOOD}{still}{}", table("move", keys))
    };
    folder.write("free.toml", scene("color_by = \"element\""));
    folder.write("third.toml", scene("color_by = \"element\"\nframe = 3"));
    folder.write("by-v.toml", scene("color_by = \"v\""));
    folder.write("range.toml", scene("color_by = \"v\"\nrange = [0, 50]"));
    folder
}

const SMALL: &str = "--size 24x18 --spp 4";

#[test]
fn each_frame_is_the_image_of_that_frame() {
    let folder = folder();
    let said = folder.ok(&format!(
        "free.toml --frames 1..5..2 {SMALL} -o f{{frame:03}}.npy --stats s{{frame}}.json"
    ));
    holds(&said, &["f001.npy: 24x18, 4 spp", "f003.npy: 24x18, 4 spp"]);
    let images: Vec<String> = folder.names();
    let made: Vec<&String> = images
        .iter()
        .filter(|n| n.starts_with(['f', 's']) && !n.contains("toml") && !n.contains("xyz"))
        .collect();
    assert_eq!(made, ["f001.npy", "f003.npy", "s1.json", "s3.json"]);
    let (third, stats) = folder.render(&format!("third.toml {SMALL} -o t.npy"));
    assert_same("frame 3", &folder.npy("f003.npy"), &third);
    assert_eq!(stats["scene_hash"], folder.json("s3.json")["scene_hash"]);
    // Companion: another frame is another image.
    assert_ne!(bits(&third), bits(&folder.npy("f001.npy")));
}

#[test]
fn a_particle_file_alone_is_seen_from_one_place_in_one_range_of_colours() {
    let folder = folder();
    let hash = |frames: &str, color: &str| {
        folder.ok(&format!(
            "move.xyz --frames {frames} --color-by {color} {SMALL} -o a{{frame}}.npy --stats a{{frame}}.json"
        ));
        let stats: Value = folder.json("a0.json");
        stats["scene_hash"].as_str().expect("a hash").to_owned()
    };
    // What comes later is in the picture, and in the map.
    let [short, long] = ["0..1", "0..5"].map(|frames| hash(frames, "v"));
    assert_ne!(short, long);
    assert_ne!(hash("0..1", "element"), hash("0..5", "element"));
    // All frames alike: the first is that of the file.
    let alone = folder.render(&format!("move.xyz --color-by v {SMALL} -o b.npy"));
    assert_eq!(alone.1["scene_hash"], short);
    // The camera stands still: what is empty in the last frame was so in the first. The balls of the first are
    // nearer together than those of the last, which fill the picture.
    hash("0..5", "element");
    let covered = |name: &str| {
        let image = folder.npy(name);
        let columns = (0..24).filter(|x| (0..18).any(|y| image.pixels[y * 24 + x] != [1.0; 3]));
        let columns: Vec<usize> = columns.collect();
        columns[columns.len() - 1] - columns[0]
    };
    let [first, last] = ["a0.npy", "a4.npy"].map(covered);
    assert!(last > 18 && (5..12).contains(&first), "{first} {last}");
}

#[test]
fn colours_that_would_change_their_meaning_are_said_once() {
    let folder = folder();
    let render = |scene: &str| {
        let run = folder.run(&format!("{scene} --frames 0..3 {SMALL} -o a{{frame}}.npy"));
        assert_eq!(run.code, Some(0), "{run:?}");
        run.stderr
    };
    let said = render("by-v.toml");
    holds(
        &said,
        &["by-v.toml:", "each frame's own", "`range = [low, high]`"],
    );
    assert_eq!(said.matches("each frame's own").count(), 1, "{said}");
    assert_eq!(render("range.toml"), "");
}

#[test]
fn progress_is_that_of_the_whole() {
    let folder = folder();
    let run = folder.run(&format!(
        "move.xyz --frames 0..4 {SMALL} -o a{{frame}}.npy --progress json"
    ));
    let lines = run
        .stderr
        .lines()
        .map(|line| serde_json::from_str(line).expect("JSON"));
    let lines: Vec<Value> = lines.collect();
    let parts: Vec<&str> = lines
        .iter()
        .filter_map(|line| line["part"].as_str())
        .collect();
    for part in ["frame 0 (1/4)", "frame 3 (4/4)"] {
        assert!(parts.contains(&part), "{parts:?}");
    }
    let fractions: Vec<f64> = lines
        .iter()
        .filter_map(|l| l["fraction"].as_f64())
        .collect();
    assert!(
        fractions.is_sorted() && fractions[0] <= 0.25,
        "{fractions:?}"
    );
    assert_eq!(fractions.last(), Some(&1.0));
}

#[test]
fn a_signal_leaves_what_is_complete_and_says_how_to_go_on() {
    let folder = folder();
    let mut run = Background::start(
        &folder,
        "move.xyz --frames 0.. --size 24x18 --time 1h -o a{frame}.npy --progress json",
    );
    // Its first frame would take an hour; the file of it is what there is.
    run.wait_for("\"progress\"");
    run.signal("INT");
    let run = run.finish();
    assert_eq!(run.code, Some(130), "{run:?}");
    holds(
        &run.stderr,
        &["0 of 5 frames are complete; --frames 0.. goes on"],
    );
    assert!(!folder.names().contains(&"a1.npy".to_owned()));
}

#[test]
fn frames_before_the_first_particle_are_empty() {
    let folder = folder();
    let frame = |step: u32, atoms: &str| {
        let count = atoms.lines().count();
        format!(
            "ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF ATOMS\n{count}\nITEM: BOX BOUNDS pp pp pp\n0 9\n0 9\n0 9\n\
             ITEM: ATOMS id type radius x y z vz\n{atoms}"
        )
    };
    let two = "1 1 1.0 2 2 2 -1\n2 1 0.5 5 5 5 -2\n";
    folder.write("pour.dump", frame(0, "") + &frame(10, two));
    folder.write("nothing.dump", frame(0, "") + &frame(10, ""));
    folder.ok(&format!(
        "pour.dump --frames 0.. --color-by vz {SMALL} -o a{{frame}}.npy"
    ));
    let white = |name: &str| {
        folder
            .npy(name)
            .pixels
            .iter()
            .all(|pixel| *pixel == [1.0; 3])
    };
    assert!(white("a0.npy") && !white("a1.npy"));
    holds(
        &folder.refused(&["nothing.dump", "--frames", "0.."]),
        &["nothing.dump", "no frame"],
    );
    // Without a choice of frames, the first is what was asked for.
    holds(&folder.refused(&["pour.dump"]), &["no particles"]);
}

#[test]
fn what_cannot_be_is_refused() {
    let folder = folder();
    let before = folder.snapshot();
    for (arguments, says) in [
        (
            "move.xyz --frames 0.. -o a.png",
            &["'a.png'", "{frame:04}"][..],
        ),
        (
            "move.xyz --frames 0.. -o {frame}.png --stats s.json",
            &["'s.json'"],
        ),
        ("move.xyz --frames 0.. -o a{frame:4}.png", &["unknown form"]),
        ("move.xyz --frames 0.. -o a{frame}", &["no extension"]),
        (
            "move.xyz --frames 0.. -o none/{frame}.png",
            &["none", "cannot write"],
        ),
        (
            "move.xyz --frames 0..6 -o a{frame}.png",
            &["no frame 5", "has 5"],
        ),
        ("free.toml --frames 5.. -o a{frame}.png", &["frame", "5"]),
        (
            "free.toml --frames 0..9 -o a{frame}.png",
            &["no frame 8", "has 5"],
        ),
        ("third.toml --frames 0..2 -o a{frame}.png", &["leaves open"]),
        ("lecture --frames 0..2", &["leaves open"]),
        ("move.xyz --frames 3..3", &["no frame lies", "0..100..10"]),
        ("move.xyz --frames 0..3..0", &["no frame lies"]),
        ("move.xyz --frames 3", &["0..100..10"]),
        ("move.xyz --frames -1..3", &["0..100..10"]),
        (
            "move.xyz --frames 0.. --checkpoint a.film",
            &["--checkpoint"],
        ),
        ("effects move.xyz --frames 0..", &["--frames"]),
        ("missing.xyz --frames 0..", &["missing.xyz", "No such file"]),
    ] {
        let words: Vec<&str> = arguments.split(' ').collect();
        holds(&folder.refused(&words), says);
    }
    assert_eq!(folder.snapshot(), before);
}

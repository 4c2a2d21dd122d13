//! Film files: renders that are killed and go on, and parts that become one image.
#![cfg(unix)]

mod cli_support;

use std::io::Cursor;
use std::thread::sleep;
use std::time::Duration;

use cli_support::{Background, Folder, bits, holds};
use gpu_trace::film_file::{self, decode, encode};
use gpu_trace::image::Picture;
use serde_json::Value;

const SCENE: &str = "good.toml --backend cpu";

/// Whether all values are within one ulp of f32.
fn alike(a: &Picture, b: &Picture) -> bool {
    let mut pairs = bits(a).into_iter().zip(bits(b));
    pairs.all(|(a, b)| a.abs_diff(b) <= 1)
}

/// Renders parts that end at `ends` to the film files 0.film, 1.film, ...
fn parts(folder: &Folder, ends: &[u64]) {
    let mut start = 0;
    for (part, end) in ends.iter().enumerate() {
        let range = format!("--sample-range {start}..{end}");
        folder.ok(&format!(
            "{SCENE} {range} --checkpoint {part}.film -o part.npy"
        ));
        start = *end;
    }
}

fn error_of(stats: &Value) -> f64 {
    stats["estimated_error"].as_f64().expect("an error")
}

#[test]
fn parts_are_one_render_in_any_order() {
    let folder = Folder::with_scene();
    let (whole, stats) = folder.render(&format!("{SCENE} --spp 600"));
    parts(&folder, &[64, 512, 600]);
    let mut files = Vec::new();
    for order in ["0.film 1.film 2.film", "2.film 0.film 1.film"] {
        folder.ok(&format!(
            "merge {order} -o m.npy --stats m.json --checkpoint m.film"
        ));
        assert!(alike(&folder.npy("m.npy"), &whole), "{order}");
        let error = error_of(&folder.json("m.json")) as f32;
        let one = error_of(&stats) as f32;
        assert!(
            error.to_bits().abs_diff(one.to_bits()) <= 1,
            "{error}, {one}"
        );
        assert_eq!(folder.json("m.json")["spp"], stats["spp"]);
        let file = film_file::read(&folder.path("m.film")).expect("a film file");
        assert_eq!(file.about.ranges, [[0, 600]]);
        files.push((
            folder.read("m.npy"),
            file.film.half_sums().map(|h| h.map(<[_]>::to_vec)),
        ));
        std::fs::remove_file(folder.path("m.film")).expect("it was there");
    }
    assert!(files[0] == files[1], "the order of the parts matters");
    // Companion: without a part it is another image.
    folder.ok("merge 0.film 1.film -o m.npy");
    assert!(!alike(&folder.npy("m.npy"), &whole));
}

#[test]
fn parts_cut_anywhere_give_the_image() {
    let folder = Folder::with_scene();
    let (whole, stats) = folder.render(&format!("{SCENE} --spp 600"));
    parts(&folder, &[37, 301, 600]);
    folder.ok("merge 1.film 0.film 2.film -o m.npy --stats m.json");
    assert!(alike(&folder.npy("m.npy"), &whole));
    let ratio = error_of(&folder.json("m.json")) / error_of(&stats);
    // Of the same samples in other batches.
    assert!((0.8..1.25).contains(&ratio), "{ratio}");
}

#[test]
fn parts_that_are_no_parts_are_refused() {
    let folder = Folder::with_scene();
    parts(&folder, &[64, 128, 192]);
    let other = |name: &str, more: &str| {
        let range = "--sample-range 64..128 -o part.npy";
        folder.ok(&format!("{more} {range} --checkpoint {name}.film"));
    };
    other("seed", &format!("{SCENE} --seed 1"));
    other("size", &format!("{SCENE} --size 9x6"));
    folder.write(
        "other.toml",
        cli_support::GOOD.replace("fov = 36.0", "fov = 37.0"),
    );
    other("scene", "other.toml --backend cpu");
    let refused = |parts: &str, says: &[&str]| {
        let words = format!("merge {parts} -o m.npy");
        let words: Vec<&str> = words.split_whitespace().collect();
        holds(&folder.refused(&words), says);
    };
    refused(
        "0.film 2.film",
        &["no part has the samples 64..128", "--allow-gaps"],
    );
    refused("0.film 1.film 1.film", &["both have the samples 64..128"]);
    refused("0.film seed.film", &["different settings: seed is 0 and 1"]);
    refused("0.film size.film", &["different settings: crop is"]);
    refused("0.film scene.film", &["different scenes: good", "other"]);
    refused("0.film good.toml", &["cannot read good.toml", "film file"]);
    let run = folder.run("merge 0.film 2.film --allow-gaps -o m.npy");
    assert_eq!(run.code, Some(0), "{run:?}");
    holds(&run.stderr, &["warning: samples are missing"]);
    // Companion: the right parts.
    folder.ok("merge 0.film 1.film 2.film -o m.npy");
}

#[test]
fn a_film_file_is_not_begun_again() {
    let folder = Folder::with_scene();
    folder.ok(&format!("{SCENE} --spp 64 --checkpoint a.film -o a.npy"));
    let words = "good.toml --checkpoint a.film -o a.npy";
    let words: Vec<&str> = words.split_whitespace().collect();
    holds(&folder.refused(&words), &["gpu-trace resume a.film"]);
    let image = folder.read("a.npy");
    let run = folder.run("resume a.film");
    assert_eq!(run.code, Some(0), "{run:?}");
    holds(&run.stderr, &["a.film is complete"]);
    assert_eq!(folder.read("a.npy"), image);
    let (longer, stats) = folder.render(&format!("{SCENE} --spp 200"));
    folder.ok("resume a.film --spp 200 -o b.npy --stats b.json");
    assert_eq!(bits(&folder.npy("b.npy")), bits(&longer));
    assert_eq!(error_of(&folder.json("b.json")), error_of(&stats));
}

#[test]
fn a_kill_at_any_moment_costs_no_bit() {
    for more in ["", "--adaptive --aov direct,normal -o r.exr"] {
        let options = format!("{SCENE} --size 32x24 {more}");
        let folder = Folder::with_scene();
        let (whole, stats) = folder.render(&format!("{options} --spp 3000"));
        let checkpoint = "--checkpoint k.film --checkpoint-every 1ms --progress json";
        let mut command = format!("{options} --spp 3000 -o k.npy --stats k.json {checkpoint}");
        for pause in [40, 90, 150] {
            let mut run = Background::start(&folder, &command);
            run.wait_for("\"progress\"");
            sleep(Duration::from_millis(pause));
            run.signal("KILL");
            drop(run);
            if folder.path("k.film").exists() {
                film_file::read(&folder.path("k.film")).expect("a whole file");
                command = "resume k.film --checkpoint-every 1ms --progress json".into();
            }
        }
        assert!(command.starts_with("resume"), "it was never kept");
        let run = folder.run(&command);
        assert_eq!(run.code, Some(0), "{run:?}");
        assert_eq!(bits(&folder.npy("k.npy")), bits(&whole), "{more}");
        assert_eq!(error_of(&folder.json("k.json")), error_of(&stats), "{more}");
        assert_eq!(folder.json("k.json")["samples"], stats["samples"], "{more}");
    }
}

#[test]
fn a_damaged_file_is_an_error_or_the_same_film() {
    let folder = Folder::with_scene();
    let image = "--size 9x3 --spp 16 --aov direct -o r.exr --checkpoint a.film";
    folder.ok(&format!("{SCENE} {image}"));
    let bytes = folder.read("a.film");
    let file = decode(Cursor::new(&bytes)).expect("it is whole");
    assert_eq!(encode(&file.about, &file.film).expect("memory"), bytes);
    let sums = |file: &film_file::FilmFile| file.film.half_sums().map(|h| h.map(<[_]>::to_vec));
    for length in 0..bytes.len() {
        assert!(decode(Cursor::new(&bytes[..length])).is_err(), "{length}");
    }
    for at in 0..bytes.len() {
        let mut bytes = bytes.clone();
        bytes[at] ^= 1 << (at % 8);
        if let Ok(found) = decode(Cursor::new(&bytes)) {
            assert_eq!(found.about, file.about, "byte {at}");
            assert!(sums(&found) == sums(&file), "byte {at}");
            assert!(found.film.aov_sums() == file.film.aov_sums(), "byte {at}");
        }
    }
    folder.write("cut.film", &bytes[..bytes.len() / 2]);
    let said = folder.refused(&["resume", "cut.film"]);
    holds(&said, &["error: cannot read cut.film: ", "film file"]);
}

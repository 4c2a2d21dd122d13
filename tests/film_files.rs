//! Film files: renders that are killed and go on, and parts that become one image.
#![cfg(unix)]

use std::fs;
use std::io::Cursor;
use std::process::Command;
use std::thread::sleep;
use std::time::Duration;

use crate::cli_support::{Background, Folder, bits, holds};
use crate::common::images::{assert_alike, assert_same};
use gpu_trace::film::{AovSums, Film, Record};
use gpu_trace::film_file::{self, About, FilmFile, decode, encode};
use gpu_trace::image::Picture;
use gpu_trace::input::read;
use serde_json::{Value, json};

const SCENE: &str = "good.toml --backend cpu";

/// Whether all values are within one ulp of f32.
pub(crate) fn alike(a: &Picture, b: &Picture) -> bool {
    let pairs = bits(a).into_iter().zip(bits(b));
    pairs.into_iter().all(|(a, b)| a.abs_diff(b) <= 1)
}

/// Fails unless all values are within one ulp of f32.
#[track_caller]
pub(crate) fn assert_near(name: &str, found: &Picture, wanted: &Picture) {
    assert_alike(
        name,
        found,
        wanted,
        alike(found, wanted),
        "more than an ulp",
    );
}

/// Whether these are within one ulp of f32.
pub(crate) fn near(a: f64, b: f64) -> bool {
    (a as f32).to_bits().abs_diff((b as f32).to_bits()) <= 1
}

pub(crate) fn error_of(stats: &Value) -> f64 {
    stats["estimated_error"].as_f64().expect("an error")
}

/// The standard errors in an EXR file.
fn stderr_of(folder: &Folder, name: &str) -> Picture {
    let input = read(&folder.path(name)).expect("an image");
    input.stderr.expect("standard errors")
}

fn film_of(folder: &Folder, name: &str) -> FilmFile {
    film_file::read(&folder.path(name)).unwrap_or_else(|e| panic!("{e}"))
}

/// All sums of a film.
fn sums(film: &Film) -> Vec<u64> {
    let halves = film.half_sums().into_iter().flatten().flatten().flatten();
    let aovs = film.aov_sums().iter().flat_map(AovSums::to_numbers);
    halves.copied().chain(aovs).map(f64::to_bits).collect()
}

/// The same film with one more of a sum.
fn perturbed(film: &Film) -> Film {
    let [mut sum, variance] = film.half_sums().map(|halves| halves.map(<[_]>::to_vec));
    for half in &mut sum {
        half[0][1] *= 1.0 + 1e-5;
    }
    let record = Record {
        steps: film.tile_steps().to_vec(),
        counts: film.counts(),
        sum,
        variance,
        aovs: film.aov_sums().to_vec(),
    };
    Film::of_record(film.rect(), record).expect("a film")
}

/// The film file with another text about it.
fn retold(file: &FilmFile, tell: impl FnOnce(&mut Value)) -> Vec<u8> {
    let mut about = serde_json::to_value(&file.about).expect("names and numbers");
    tell(&mut about);
    let mut about: About = serde_json::from_value(about).expect("what it says");
    about.scene.text.clone_from(&file.about.scene.text);
    encode(&about, &file.film).expect("memory takes all")
}

/// Renders parts that end at `ends` to the film files 0.film, 1.film, ...
fn parts(folder: &Folder, ends: &[u64], more: &str) {
    let mut start = 0;
    for (part, end) in ends.iter().enumerate() {
        let range = format!("--sample-range {start}..{end}");
        // One that begins late may have no error of its own, which is said.
        let run = folder.run(&format!(
            "{SCENE} {more} {range} --checkpoint {part}.film -o part.npy"
        ));
        assert_eq!(run.code, Some(0), "{run:?}");
        start = *end;
    }
}

#[test]
fn parts_are_one_render_in_any_order() {
    let folder = Folder::with_scene();
    let layers = "--aov stderr,direct,normal -o r.exr";
    let (whole, stats) = folder.render(&format!("{SCENE} --spp 600 {layers} --checkpoint r.film"));
    let stderr = stderr_of(&folder, "r.exr");
    // The layers of a part go to a file of the same name.
    parts(&folder, &[64, 512, 600], layers);
    let mut films = Vec::new();
    for order in ["0.film 1.film 2.film", "2.film 0.film 1.film"] {
        folder.ok(&format!(
            "merge {order} -o m.npy -o m.exr --stats m.json --checkpoint m.film"
        ));
        assert_near(order, &folder.npy("m.npy"), &whole);
        let name = format!("stderr, {order}");
        assert_near(&name, &stderr_of(&folder, "m.exr"), &stderr);
        let merged = folder.json("m.json");
        assert!(near(error_of(&merged), error_of(&stats)), "{order}");
        for same in ["spp", "sample_range", "samples", "rays", "bounce_limit"] {
            assert_eq!(merged[same], stats[same], "{order}");
        }
        let file = film_of(&folder, "m.film");
        assert_eq!(file.about.ranges, [[0, 600]]);
        let one = film_of(&folder, "r.film").film;
        for (ours, all) in file.film.aov_sums().iter().zip(one.aov_sums()) {
            let pairs = ours.to_numbers().into_iter().zip(all.to_numbers());
            assert!(pairs.into_iter().all(|(a, b)| near(a, b)), "{order}");
        }
        films.push((sums(&file.film), folder.read("m.npy")));
        fs::remove_file(folder.path("m.film")).expect("it was there");
    }
    assert!(films[0] == films[1], "the order of the parts matters");

    // Companions: without a part, and with one that is off in one sum, it is another image.
    folder.ok("merge 0.film 1.film -o m.npy");
    assert!(!alike(&folder.npy("m.npy"), &whole));
    let part = film_of(&folder, "1.film");
    film_file::write(&folder.path("1.film"), &part.about, &perturbed(&part.film))
        .expect("a new file");
    folder.ok("merge 0.film 1.film 2.film -o m.npy");
    assert!(!alike(&folder.npy("m.npy"), &whole));
}

#[test]
fn parts_cut_anywhere_give_the_image() {
    let folder = Folder::with_scene();
    let (whole, stats) = folder.render(&format!("{SCENE} --spp 600"));
    parts(&folder, &[37, 301, 600], "");
    folder.ok("merge 1.film 0.film 2.film -o m.npy --stats m.json");
    assert_near("parts cut anywhere", &folder.npy("m.npy"), &whole);
    let error = error_of(&folder.json("m.json"));
    // Of the same samples in other batches; not the same, or the bound of one ulp above says nothing.
    let ratio = error / error_of(&stats);
    assert!((0.8..1.25).contains(&ratio), "{ratio}");
    assert!(!near(error, error_of(&stats)));
}

#[test]
fn parts_that_are_no_parts_are_refused() {
    let folder = Folder::with_scene();
    parts(&folder, &[64, 128, 192], "");
    let other = |name: &str, more: &str| {
        let range = "--sample-range 64..128 -o part.npy";
        folder.ok(&format!("{more} {range} --checkpoint {name}.film"));
    };
    other("seed", &format!("{SCENE} --seed 1"));
    other("size", &format!("{SCENE} --size 9x6"));
    folder.write(
        "other.toml",
        crate::cli_support::GOOD.replace("fov = 36.0", "fov = 37.0"),
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
    refused("0.film none.film", &["cannot read none.film"]);
    let run = folder.run("merge 0.film 2.film --allow-gaps -o m.npy --checkpoint gaps.film");
    assert_eq!(run.code, Some(0), "{run:?}");
    holds(&run.stderr, &["warning: the samples 64..128 are missing"]);
    holds(&folder.refused(&["resume", "gaps.film"]), &["has gaps"]);
    // Companion: the right parts; and what filled the gap fits later.
    folder.ok("merge 0.film 1.film 2.film -o m.npy");
    folder.ok("merge gaps.film 1.film -o n.npy --checkpoint all.film");
    assert_near("a gap filled", &folder.npy("n.npy"), &folder.npy("m.npy"));
    // And what is whole can go on, to the image of the merge.
    let (longer, _) = folder.render(&format!("{SCENE} --spp 256"));
    folder.ok("resume all.film --spp 256");
    assert_near("a merge that goes on", &folder.npy("n.npy"), &longer);
}

#[test]
fn a_render_goes_on_as_it_was_begun() {
    let folder = Folder::with_scene();
    folder.ok(&format!(
        "{SCENE} --spp 64 --max-bounces 1 --checkpoint a.film --checkpoint-every 0.25 -o a.npy"
    ));
    // The same command would replace it.
    let words = "good.toml --checkpoint a.film -o a.npy";
    let words: Vec<&str> = words.split_whitespace().collect();
    holds(&folder.refused(&words), &["gpu-trace resume a.film"]);
    let image = folder.read("a.npy");
    let before = folder.read("a.film");
    let run = folder.run("resume a.film");
    assert_eq!(run.code, Some(0), "{run:?}");
    holds(&run.stderr, &["a.film is complete"]);
    assert_eq!(folder.read("a.npy"), image);
    assert!(folder.read("a.film") == before);
    let (longer, stats) = folder.render(&format!("{SCENE} --spp 200 --max-bounces 1"));
    folder.ok("resume a.film --spp 200 --stats a.json");
    assert_same("a render that goes on", &folder.npy("a.npy"), &longer);
    let resumed = folder.json("a.json");
    for same in ["estimated_error", "bounce_limit", "ledger", "sample_range"] {
        assert_eq!(resumed[same], stats[same]);
    }
    let entries = stats["ledger"].as_array();
    assert_eq!(entries.map(Vec::len), Some(1), "the limit took nothing");
    let about = film_of(&folder, "a.film").about;
    assert_eq!(about.command.checkpoint_every, 0.25);
    // Merging has no device to measure with, and says so.
    let run = folder.run("merge a.film -o m.npy");
    holds(&run.stderr, &["what max-bounces 1 took is not measured"]);
    // A part begins where it begins.
    folder.ok(&format!(
        "{SCENE} --sample-range 64..100 --checkpoint p.film -o p.npy"
    ));
    folder.ok("resume p.film --spp 64");
    let (part, _) = folder.render(&format!("{SCENE} --sample-range 64..128"));
    assert_near("a part that goes on", &folder.npy("p.npy"), &part);
}

#[test]
fn an_interrupted_render_goes_on() {
    let folder = Folder::with_scene();
    let options = format!("{SCENE} --checkpoint i.film -o i.npy --progress json");
    let mut run = Background::start(&folder, &format!("{options} --spp 10000000"));
    run.wait_for("\"progress\"");
    sleep(Duration::from_millis(100));
    run.signal("INT");
    let run = run.finish();
    assert_eq!(run.code, Some(130));
    holds(&run.stderr, &["gpu-trace resume i.film goes on"]);
    let spp = film_of(&folder, "i.film").film.samples() + 100;
    folder.ok(&format!("resume i.film --spp {spp}"));
    let (whole, _) = folder.render(&format!("{SCENE} --spp {spp}"));
    assert_near("after an interrupt", &folder.npy("i.npy"), &whole);
}

#[test]
fn a_kill_at_any_moment_costs_no_bit() {
    for more in ["", "--adaptive --aov direct,normal,stderr -o r.exr"] {
        // On one thread, so that it takes longer than the pauses anywhere.
        let options = format!("{SCENE} --threads 1 --size 32x24 {more}");
        let folder = Folder::with_scene();
        let (whole, stats) = folder.render(&format!("{options} --spp 3000 --checkpoint r.film"));
        let checkpoint = "--checkpoint k.film --checkpoint-every 1ms --progress json";
        let mut command = format!("{options} --spp 3000 -o k.npy --stats k.json {checkpoint}");
        for pause in [40, 90, 0, 20] {
            let mut run = Background::start(&folder, &command);
            run.wait_for("\"progress\"");
            while !folder.path("k.film").exists() {
                assert!(run.runs(), "it was never kept");
                sleep(Duration::from_millis(1));
            }
            sleep(Duration::from_millis(pause));
            run.signal("KILL");
            drop(run);
            film_of(&folder, "k.film");
            command = "resume k.film --progress json".into();
        }
        let run = folder.run(&command);
        assert_eq!(run.code, Some(0), "{run:?}");
        assert_same(format!("killed {more}"), &folder.npy("k.npy"), &whole);
        let resumed = folder.json("k.json");
        for same in [
            "estimated_error",
            "samples",
            "rays",
            "spp_range",
            "bounce_limit",
        ] {
            assert_eq!(resumed[same], stats[same], "{more}");
        }
        let [ours, all] = ["k.film", "r.film"].map(|name| film_of(&folder, name).film);
        assert!(sums(&ours) == sums(&all), "{more}");
        assert_eq!(ours.counts(), all.counts(), "{more}");
        // Companion: the comparison sees a bit.
        assert!(sums(&perturbed(&ours)) != sums(&all));
    }
}

#[test]
fn scenes_are_found_again() {
    let folder = Folder::new();
    let atoms = "3\n\nC 0 0 0\nO 1.2 0 0\nN 0 1.3 0.2\n";
    folder.write("atoms.xyz", atoms);
    let scene = crate::cli_support::GOOD.to_owned()
        + "[[particles]]\nfile = \"atoms.xyz\"\nradius = 0.5\ncolor_by = \"element\"\n";
    folder.write("scene.toml", &scene);
    let small = "--backend cpu --size 12x9";
    let scenes = [
        "lecture",
        "scene.toml",
        "atoms.xyz --radius-by 0.7 --background 0.2,0.3,0.4",
    ];
    for (number, scene) in scenes.iter().enumerate() {
        let (whole, _) = folder.render(&format!("{scene} {small} --spp 32"));
        folder.ok(&format!(
            "{scene} {small} --spp 16 --checkpoint {number}.film -o x.npy"
        ));
        // What the film file holds goes before the scene file.
        if number == 1 {
            fs::remove_file(folder.path("scene.toml")).expect("it was there");
        }
        folder.ok(&format!("resume {number}.film --spp 32"));
        assert_same(format!("resumed {scene}"), &folder.npy("x.npy"), &whole);
    }
    // Elsewhere, with the film file beside.
    fs::create_dir(folder.path("away")).expect("a folder");
    for name in ["1.film", "2.film", "atoms.xyz"] {
        fs::rename(folder.path(name), folder.path("away").join(name)).expect("it is there");
    }
    let resume = |number: u32| format!("resume away/{number}.film --spp 48 -o y.npy");
    for number in [1, 2] {
        folder.ok(&resume(number));
    }
    let refused = |number: u32, says: &[&str]| {
        let command = resume(number).replace("48", "64");
        let words: Vec<&str> = command.split_whitespace().collect();
        holds(&folder.refused(&words), says);
        let film = format!("away/{number}.film");
        holds(&folder.refused(&["merge", &film, "-o", "y.npy"]), says);
    };
    let changed = atoms.replace("1.2", "1.3");
    folder.write("away/atoms.xyz", changed);
    for number in [1, 2] {
        refused(number, &["away/atoms.xyz has changed"]);
    }
    fs::remove_file(folder.path("away/atoms.xyz")).expect("it was there");
    for number in [1, 2] {
        refused(number, &["cannot read ", "atoms.xyz", "names", "folder"]);
    }
}

#[test]
fn other_makers_are_reported() {
    let folder = Folder::with_scene();
    parts(&folder, &[16, 32], "");
    let file = film_of(&folder, "1.film");
    let other = retold(&file, |about| {
        about["makers"][0]["version"] = json!("0.0.9");
        about["makers"][0]["kernel"] = json!("abc");
        about["makers"][0]["device"]["name"] = json!("a GPU");
    });
    folder.write("1.film", &other);
    folder.write("2.film", other);
    for (command, says) in [
        (
            "merge 1.film 0.film -o m.npy",
            "warning: a part is of another",
        ),
        (
            "resume 2.film --spp 20 -o n.npy",
            "warning: the render goes on with another",
        ),
    ] {
        let run = folder.run(command);
        assert_eq!(run.code, Some(0), "{run:?}");
        for (what, value) in [("version", "0.0.9"), ("kernel", "abc"), ("device", "a GPU")] {
            let line = run.stderr.lines().find(|line| line.contains(what));
            holds(line.unwrap_or_default(), &[says, value]);
        }
    }
    let names = film_of(&folder, "2.film").about.makers;
    assert_eq!(names.len(), 2);
    // Companion: the same maker is no news.
    folder.ok("resume 0.film --spp 20 -o n.npy");
}

#[test]
fn damaged_files_are_refused_or_the_same() {
    let folder = Folder::with_scene();
    let image = "--size 9x3 --spp 16 --aov direct -o r.exr --checkpoint a.film";
    folder.ok(&format!("{SCENE} {image}"));
    let bytes = folder.read("a.film");
    let file = decode(Cursor::new(&bytes)).expect("it is whole");
    assert_eq!(encode(&file.about, &file.film).expect("memory"), bytes);
    for length in 0..bytes.len() {
        assert!(decode(Cursor::new(&bytes[..length])).is_err(), "{length}");
    }
    let flipped = |at: usize| {
        let mut bytes = bytes.clone();
        bytes[at] ^= 1 << (at % 8);
        bytes
    };
    for at in 0..bytes.len() {
        if let Ok(found) = decode(Cursor::new(flipped(at))) {
            assert_eq!(found.about, file.about, "byte {at}");
            assert!(sums(&found.film) == sums(&file.film), "byte {at}");
        }
    }
    let of = |name: &[u8]| bytes.windows(name.len()).position(|part| part == name);
    let [text, sum] = [&b"film.json"[..], b"sum.npy"].map(|name| of(name).expect("it is there"));
    let told = |tell: fn(&mut Value)| retold(&file, tell);
    for (bytes, says) in [
        (bytes[..bytes.len() / 2].to_vec(), "damaged or cut"),
        (Vec::new(), "of 0 bytes"),
        (b"[camera]\nfov = 40".to_vec(), "it is no film file"),
        (flipped(text + 200), "film.json, from byte"),
        (flipped(sum + 300), "sum.npy, from byte"),
        (told(|about| about["format"] = json!(2)), "format 2"),
        (
            told(|about| about["ranges"] = json!([[0, 15], [15, 16]])),
            "in no order",
        ),
        (told(|about| about["samples"] = json!([15])), "counts"),
        (told(|about| about["ranges"] = json!([[1, 17]])), "goal"),
        (told(|about| about["seconds"] = json!(-1)), "no time"),
        (
            told(|about| about["settings"]["sampler"] = json!("x")),
            "sampler \"x\"",
        ),
        (
            told(|about| about["settings"]["crop"] = json!([0, 0, 9, 4])),
            "beyond its image",
        ),
        (
            told(|about| {
                about["settings"]["size"] = json!([9, 4]);
                about["settings"]["crop"] = json!([0, 0, 9, 4]);
            }),
            "wanted an array",
        ),
    ] {
        folder.write("b.film", bytes);
        for command in [
            &["resume", "b.film"][..],
            &["merge", "b.film", "-o", "m.npy"],
        ] {
            let said = folder.refused(command);
            holds(&said, &["error: ", "b.film", says]);
            assert_eq!(said.lines().count(), 1, "{said}");
        }
    }
    // A size that takes all memory is refused for that, and by the reader before it asks for any.
    let large = told(|about| {
        about["settings"]["size"] = json!([60000, 60000]);
        about["settings"]["crop"] = json!([0, 0, 60000, 60000]);
    });
    let error = decode(Cursor::new(&large)).expect_err("it has 27 pixels");
    holds(&error.to_string(), &["steps.npy", "wanted an array"]);
    folder.write("b.film", large);
    holds(&folder.refused(&["resume", "b.film"]), &["GiB of memory"]);
}

/// As the README has it.
const LINES: &str = r#"
import json, numpy
film = numpy.load("a.film"); about = json.loads(film["film.json"])
height, width = film["sum"].shape[1:3]
samples = numpy.array(about["samples"])[film["steps"].repeat(8, 0).repeat(8, 1)[:height, :width], None]
image = film["sum"].sum(0) / samples
"#;

#[test]
fn python_opens_it_in_five_lines() {
    let readme = fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/README.md"));
    let readme = readme.expect("the readme").replace("my.film", "a.film");
    holds(&readme, &[LINES]);
    assert_eq!(LINES.trim().lines().count(), 5);
    let python = |script: &str| Command::new("python3").args(["-c", script]).status();
    if !python("import numpy").is_ok_and(|status| status.success()) {
        eprintln!("skipped: there is no python3 with numpy here");
        return;
    }
    let folder = Folder::with_scene();
    folder.ok(&format!(
        "{SCENE} --size 19x13 --spp 300 --adaptive --checkpoint a.film -o a.npy"
    ));
    for (change, same) in [("", true), ("image[3, 4, 1] *= 1 + 1e-6", false)] {
        let script =
            format!("{LINES}{change}\nassert (image.astype('f4') == numpy.load('a.npy')).all()");
        let run = Command::new("python3")
            .args(["-c", &script])
            .current_dir(folder.path(""))
            .output()
            .expect("python3");
        assert_eq!(run.status.success(), same, "{run:?}");
    }
    let steps = film_of(&folder, "a.film").film.tile_steps().to_vec();
    assert!(steps.iter().any(|step| *step != steps[0]), "{steps:?}");
}

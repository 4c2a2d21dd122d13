//! Faults that are asked for: samples that are not finite, devices that fail.

use std::fs;

use serde_json::json;

use super::limited;
use crate::cli_support::{Folder, holds};
use crate::common::images::assert_same;

#[test]
fn samples_that_are_not_finite_are_an_error_unless_allowed() {
    for backend in ["gpu", "cpu"] {
        let folder = Folder::new();
        let render = |more: &str| {
            let arguments = "--size 4x4 --crop 1,2,3x2 --spp 128 -o r.npy --stats r.json";
            folder.run(&format!("{arguments} --backend {backend} {more}"))
        };
        let place = "pixel (1, 2), sample 16, after bounce 1";
        let failed = render("--inject-fault non-finite@1");
        assert_eq!(failed.code, Some(1), "{failed:?}");
        holds(&failed.stdout, &["128 spp", "3 samples not finite", place]);
        holds(&failed.stderr, &["error: 3 samples", place, "--allow-non"]);
        let stats = folder.json("r.json");
        assert_eq!(stats["non_finite"], json!(3));
        let first = json!({ "pixel": [1, 2], "sample": 16, "bounce": 1 });
        assert_eq!(stats["first_non_finite"], first);
        let image = folder.read("r.npy");

        let allowed = render("--inject-fault non-finite@1 --allow-non-finite");
        assert_eq!(allowed.code, Some(0), "{allowed:?}");
        holds(&allowed.stdout, &["3 samples not finite", place]);
        holds(&allowed.stderr, &["warning: 3 samples were not", place]);
        let stats = folder.json("r.json");
        assert_eq!(stats["first_non_finite"], first);
        let warning = stats["warnings"][0].as_str().expect("a text");
        holds(warning, &["3 samples were not finite", place]);
        assert_eq!(folder.read("r.npy"), image);

        // Permission alone changes nothing, nor does a fault after the end.
        for clean in ["--allow-non-finite", "--inject-fault non-finite@3"] {
            let run = render(clean);
            assert_eq!((run.code, run.stderr.as_str()), (Some(0), ""), "{run:?}");
            assert!(!run.stdout.contains("finite"), "{run:?}");
            let stats = folder.json("r.json");
            assert_eq!(stats["non_finite"], json!(0));
            assert!(stats["first_non_finite"].is_null(), "{stats}");
        }
    }
}

#[test]
fn a_device_that_fails_costs_no_sample_that_was_done() {
    for (fault, text) in [
        ("device-lost", "the device is lost"),
        ("out-of-memory", "the device is out of memory"),
    ] {
        let folder = Folder::new();
        let arguments = "--size 16x16 --spp 300 -o r.npy -o r.png --stats r.json";
        folder.write("r.npy", "old");
        let run = folder.run(&format!("{arguments} --inject-fault {fault}@2"));
        assert_eq!(run.code, Some(1), "{run:?}");
        holds(&run.stdout, &["r.npy, r.png: 16x16, 64 spp, failed"]);
        let saved = "the 64 samples a pixel done before are in r.npy, r.png";
        holds(&run.stderr, &["error: ", text, saved]);
        assert_eq!(run.stderr.lines().count(), 1, "{run:?}");
        assert_eq!(folder.names(), ["r.json", "r.npy", "r.png"]);
        let stats = folder.json("r.json");
        assert_eq!(stats["spp"], json!(64));
        assert_eq!(stats["samples"], json!(64 * 256));
        assert_eq!(stats["stopped_by"], json!("failure"));
        assert!(image::open(folder.path("r.png")).is_ok());
        let part = folder.npy("r.npy");
        let whole = folder.render("--size 16x16 --spp 64").0;
        assert_same(fault, &part, &whole);

        // Nothing was done: what there was is better.
        let before = folder.snapshot();
        let run = folder.run(&format!("{arguments} --inject-fault {fault}@0"));
        assert_eq!((run.code, run.stdout.as_str()), (Some(1), ""), "{run:?}");
        holds(&run.stderr, &["error: ", text, "no file was changed"]);
        assert_eq!(before, folder.snapshot());
    }
}

#[test]
fn a_device_and_a_disk_that_fail_are_both_reported() {
    let folder = Folder::new();
    fs::create_dir(folder.path("out")).expect("a folder");
    folder.write("out/r.npy", "old");
    // More than the limit lets through.
    let arguments =
        "--size 64x64 --spp 32 --inject-fault device-lost@1 -o out/r.npy --stats r.json";
    let run = limited(&folder, "ulimit -f 8", arguments);
    assert_eq!(run.code, Some(1), "{run:?}");
    holds(
        &run.stderr,
        &["the device is lost", "cannot write out/r.npy: File too"],
    );
    assert_eq!(folder.read("out/r.npy"), b"old");
    assert_eq!(folder.json("r.json")["spp"], json!(16));
}

#[test]
fn faults_are_for_those_who_know_them() {
    let folder = Folder::new();
    for wrong in ["", "lost@1", "device-lost", "device-lost@", "non-finite@-1"] {
        let text = folder.refused(&["--spp", "1", "--inject-fault", wrong]);
        holds(&text, &["KIND@WINDOW"]);
    }
    let text = folder.refused(&["--backend", "cpu", "--inject-fault", "device-lost@0"]);
    holds(&text, &["the CPU has no device"]);
    assert!(!folder.ok("--help").contains("inject"));
}

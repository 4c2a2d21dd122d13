//! The command: what it says, and what it refuses.

use super::near;
use crate::cli_support::{Folder, holds};
use gpu_trace::image::Picture;
use gpu_trace::input::decode;
use gpu_trace::output::{Layer, Metadata, exr, npy, png};
use serde_json::Value;

/// A folder with two images whose relRMSE is about 1 %.
fn folder() -> Folder {
    let folder = Folder::new();
    let reference = Picture::new(16, 12, vec![[0.5, 0.4, 0.3]; 192]);
    let image = Picture::new(16, 12, vec![[0.505, 0.404, 0.303]; 192]);
    let about = |hash: &str| {
        Metadata::new()
            .with("scene", "room")
            .with("scene_hash", hash)
    };
    let errors = [0.01; 576];
    let stderr = [Layer {
        name: "stderr",
        channels: &["R", "G", "B"],
        values: &errors,
    }];
    let write =
        |name: &str, bytes: std::io::Result<Vec<u8>>| folder.write(name, bytes.expect(name));
    write("a.exr", exr::encode(&image, &stderr, &about("0123")));
    write("b.exr", exr::encode(&reference, &[], &about("0123")));
    write("c.exr", exr::encode(&reference, &[], &about("4567")));
    write("b.png", png::encode(&reference, 0.0, &Metadata::new()));
    folder.write("b.npy", npy::encode(&reference));
    folder.write(
        "small.npy",
        npy::encode(&Picture::new(2, 1, vec![[1.0; 3]; 2])),
    );
    let mut broken = reference;
    broken.pixels[3][0] = f32::NAN;
    folder.write("nan.npy", npy::encode(&broken));
    folder.write("text.npy", "no image");
    folder
}

#[test]
fn the_command_reports_and_judges() {
    let folder = folder();
    let text = folder.ok("compare a.exr b.exr");
    for (name, value) in [
        ("relRMSE", "0.994"),
        ("MAPE", "0.994"),
        ("bias", "+1.00 %"),
        ("FLIP", "0.0"),
        ("SSIM", "1.0000"),
        ("z-test", "0."),
    ] {
        let row = text.lines().find(|line| line.starts_with(name));
        assert!(
            row.is_some_and(|row| row.contains(value)),
            "{name} {value}:\n{text}"
        );
    }
    holds(
        &text,
        &["scene room", "with standard errors", "B is taken as exact"],
    );
    assert!(
        text.lines().count() < 24 && text.lines().all(|line| line.len() < 100),
        "{text}"
    );

    for (arguments, code, said) in [
        ("a.exr b.exr --tolerance 1%", 0, "ok: relRMSE 0.994"),
        ("a.exr b.exr --tolerance 0.009", 3, "FAIL: relRMSE 0.994"),
        (
            "b.exr b.npy --tolerance 0",
            0,
            "ok: relRMSE 0 % is within 0 %",
        ),
        ("b.exr b.png --tolerance 1%", 0, "ok:"),
        (
            "a.exr b.exr --metric bias --tolerance 0.9%",
            3,
            "bias of the mean 1.00 % is above",
        ),
        ("a.exr b.exr --metric mape --tolerance 2%", 0, "MAPE"),
        ("a.exr b.exr --metric flip --tolerance 50%", 0, "FLIP"),
        ("a.exr b.exr --metric flip --tolerance 0", 3, "FLIP"),
        ("a.exr b.exr --metric ssim --tolerance 1%", 0, "1 - SSIM"),
        // Each value is within its error, but their mean is not.
        ("a.exr b.exr --metric z", 3, "do not explain"),
        ("b.exr a.exr --metric z", 3, "A is taken as exact"),
        (
            "nan.npy b.npy --tolerance 100%",
            3,
            "1 pixels are not finite",
        ),
        ("b.npy nan.npy --tolerance 100%", 3, "NOT FINITE"),
        ("nan.npy b.npy", 0, "1 of A and 0 of B"),
        ("b.exr c.exr --any-scene --tolerance 0", 0, "ok"),
        ("b.npy c.exr --tolerance 0", 0, "ok"),
    ] {
        let run = folder.run(&format!("compare {arguments}"));
        assert_eq!(run.code, Some(code), "{arguments}: {run:?}");
        holds(&(run.stdout + &run.stderr), &[said]);
        assert_eq!(
            run.stderr.is_empty(),
            code == 0,
            "{arguments}: {}",
            run.stderr
        );
    }
}

#[test]
fn what_cannot_be_compared_is_refused() {
    let folder = folder();
    for (arguments, said) in [
        (
            "a.exr small.npy",
            &["a.exr has 16x12 pixels", "small.npy 2x1"][..],
        ),
        (
            "b.exr c.exr",
            &[
                "b.exr shows room (0123)",
                "c.exr room (4567)",
                "--any-scene",
            ],
        ),
        ("a.exr none.exr", &["cannot read none.exr"]),
        ("text.npy b.exr", &["cannot read text.npy", "neither"]),
        ("a.exr .", &["cannot read ."]),
        ("a.exr", &["<B>"]),
        ("a.exr b.exr --tolerance 2", &["write 2%"]),
        ("a.exr b.exr --tolerance=-1", &["0 or more"]),
        ("a.exr b.exr --metric flip", &["--tolerance"]),
        ("a.exr b.exr --metric z --tolerance 1%", &["own limits"]),
        ("b.npy b.exr --metric z", &["stderr"]),
        ("a.exr b.exr --ppd 0", &["as in 67"]),
        ("a.exr b.exr --heat-map map.exr", &[".png"]),
        (
            "a.exr b.exr --heat-map no/map.png",
            &["no/map.png", "does not exist"],
        ),
        ("a.exr b.png --heat-map b.png", &["would replace the input"]),
    ] {
        let arguments = format!("compare {arguments}");
        let words: Vec<&str> = arguments.split_whitespace().collect();
        holds(&folder.refused(&words), said);
    }
}

#[test]
fn formats_that_cannot_hold_the_image_are_noted() {
    let folder = folder();
    let bright = Picture::new(16, 12, vec![[2.0, 0.4, 0.3]; 192]);
    folder.write("bright.npy", npy::encode(&bright));
    let note = "PNG holds nothing above 1, where 100 % of the other's pixels are";
    holds(&folder.ok("compare b.png bright.npy"), &[note]);
    holds(&folder.ok("compare bright.npy b.png"), &[note]);
    assert!(!folder.ok("compare b.png b.npy").contains("note:"));
}

#[test]
fn the_json_says_the_same() {
    let folder = folder();
    let run = folder.run("compare a.exr b.exr --json --tolerance 0.5% --heat-map map.png");
    assert_eq!(run.code, Some(3), "{run:?}");
    let all: Value = serde_json::from_str(&run.stdout).expect("JSON");
    let figures = &all["figures"];
    for name in [
        "relrmse",
        "mape",
        "mse",
        "flip",
        "ssim",
        "clipped",
        "worst",
        "reference_mean",
    ] {
        assert!(figures[name].is_f64(), "{name}: {figures}");
    }
    near(
        figures["bias"]["overall"].as_f64().expect("a number"),
        0.01,
        1.0e-6,
    );
    assert_eq!(figures["z"]["known"], "image");
    assert_eq!(figures["non_finite"]["either"], 0);
    assert_eq!(
        (&all["verdict"]["passed"], &all["verdict"]["metric"]),
        (&false.into(), &"relrmse".into())
    );
    assert_eq!(all["image"]["about"]["scene_hash"], "0123");
    assert_eq!(all["heat_map"]["range"], 0.01);
    // Constant: the same colour everywhere.
    let map = decode(&folder.read("map.png")).unwrap_or_else(|e| panic!("{e}"));
    assert!(
        map.picture
            .pixels
            .iter()
            .all(|p| *p == map.picture.pixels[0])
    );
    assert_eq!(map.about["pale_yellow"], "0.01");
}

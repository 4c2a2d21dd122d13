//! `gpu-trace compare`: figures known by hand or from others' code, and what they lead to.

use crate::cli_support::{Folder, holds};
use crate::common::images::mean;
use gpu_trace::compare::{HeatMap, Options, Report, Seen, compare, flip, heat_colour, ssim};
use gpu_trace::image::{Picture, linear};
use gpu_trace::input::{Input, decode};
use gpu_trace::output::{Layer, Metadata, exr, npy, png};
use gpu_trace::statistics::student_quantile;
use serde_json::Value;

/// A picture as any reader gives it.
fn input(width: u32, pixels: Vec<[f32; 3]>) -> Input {
    let height = pixels.len() as u32 / width;
    decode(&npy::encode(&Picture::new(width, height, pixels))).unwrap_or_else(|e| panic!("{e}"))
}

fn report(a: &Input, b: &Input) -> Report {
    compare(a, b, &Options::default())
}

/// Values without a pattern, in 0..1; the same for the same seed.
fn noise(count: usize, seed: u32) -> Vec<[f32; 3]> {
    let mut state = seed;
    let mut next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 24) as f32
    };
    (0..count).map(|_| [next(), next(), next()]).collect()
}

fn near(value: f64, wanted: f64, error: f64) {
    assert!((value - wanted).abs() <= error, "{value} is not {wanted}");
}

// ---- Errors of values ----

#[test]
fn figures_of_two_pixels_by_hand() {
    // M = 1: floor 0.01.
    let a = input(2, vec![[1.1, 1.0, 1.0], [0.0, 1.0, 2.5]]);
    let b = input(2, vec![[1.0, 1.0, 1.0], [0.0, 1.0, 2.0]]);
    let errors = report(&a, &b).errors.expect("finite pixels");
    let (first, last) = (0.01 / 1.01, 0.25 / 4.01);
    near(errors.reference_mean, 1.0, 1.0e-12);
    near(errors.relrmse, f64::sqrt((first + last) / 6.0), 1.0e-7);
    near(
        errors.mape,
        (f64::sqrt(first) + f64::sqrt(last)) / 6.0,
        1.0e-7,
    );
    near(errors.mse, (0.01 + 0.25) / 6.0, 1.0e-7);
    near(errors.worst, f64::sqrt(last / 3.0), 1.0e-7);
    assert_eq!(errors.worst_at, [1, 0]);
    near(errors.bias.overall.expect("light"), 0.1, 1.0e-7);
    near(errors.bias.red.expect("light"), 0.1, 1.0e-7);
    near(errors.bias.green.expect("light"), 0.0, 0.0);
    near(errors.bias.blue.expect("light"), 1.0 / 6.0, 1.0e-7);
    // The roles are not the same.
    let back = report(&b, &a).errors.expect("finite pixels");
    assert!((back.relrmse - errors.relrmse).abs() > 1.0e-3);
}

#[test]
fn relative_figures_do_not_depend_on_the_unit() {
    let (a, b) = (noise(400, 1), noise(400, 2));
    let scaled =
        |pixels: &[[f32; 3]], s: f32| input(20, pixels.iter().map(|p| p.map(|v| v * s)).collect());
    let one = report(&scaled(&a, 1.0), &scaled(&b, 1.0))
        .errors
        .expect("finite");
    let thousand = report(&scaled(&a, 1024.0), &scaled(&b, 1024.0))
        .errors
        .expect("finite");
    near(thousand.relrmse, one.relrmse, 1.0e-14);
    near(thousand.mape, one.mape, 1.0e-14);
    near(thousand.mse, one.mse * 1024.0 * 1024.0, 1.0e-6);
    // The companion: the scale of one alone is seen.
    let wrong = report(&scaled(&a, 1.01), &scaled(&b, 1.0))
        .errors
        .expect("finite");
    assert!((wrong.relrmse - one.relrmse).abs() > 1.0e-3);
    near(
        wrong.bias.overall.expect("light") - one.bias.overall.expect("light"),
        0.01,
        1.0e-3,
    );
}

#[test]
fn black_references_leave_no_relative_error() {
    let black = input(2, vec![[0.0; 3]; 4]);
    let same = report(&black, &black).errors.expect("finite");
    assert_eq!((same.relrmse, same.bias.overall), (0.0, None));
    let grey = input(2, vec![[0.5; 3]; 4]);
    assert_eq!(
        report(&grey, &black).errors.expect("finite").relrmse,
        f64::INFINITY
    );
    near(
        report(&black, &grey).errors.expect("finite").relrmse,
        1.01f64.sqrt().recip(),
        1.0e-12,
    );
}

#[test]
fn what_is_not_finite_is_counted_and_spoils_what_is_seen() {
    let mut pixels = noise(400, 1);
    pixels[7][1] = f32::NAN;
    pixels[9] = [f32::INFINITY; 3];
    let mut other = noise(400, 1);
    other[9][0] = f32::NEG_INFINITY;
    let r = report(&input(20, pixels), &input(20, other));
    assert_eq!(
        (
            r.non_finite.image,
            r.non_finite.reference,
            r.non_finite.either
        ),
        (2, 1, 2)
    );
    assert_eq!((r.flip, r.ssim), (None, None));
    let errors = r.errors.expect("finite pixels");
    assert_eq!((errors.relrmse, errors.pixels), (0.0, 398));
    let nothing = input(1, vec![[f32::NAN; 3]]);
    assert_eq!(report(&nothing, &nothing).errors, None);
}

// ---- What is seen ----

/// The display values of `references/perception.py` in 0..=1.
fn levels(shift: usize, noise: usize) -> Vec<[f64; 3]> {
    let pixel = |i: usize| {
        let (x, y) = (i % 40, i / 40);
        let red = 6 * x + noise * ((x * y) % 23);
        let green = 5 * y + 2 * x.saturating_sub(shift);
        let blue = if ((x + shift) / 6 + y / 5) % 2 == 1 {
            200
        } else {
            40
        };
        [red, green, blue].map(|level| level.min(255) as f64 / 255.0)
    };
    (0..40 * 32).map(pixel).collect()
}

fn seen(pixels: &[[f64; 3]]) -> Seen {
    Seen {
        width: 40,
        pixels: pixels.iter().map(|p| p.map(linear)).collect(),
    }
}

/// Of the authors' own code, in f32 (`references/perception.py`).
#[test]
fn flip_is_that_of_its_authors() {
    let (a, b) = (seen(&levels(2, 1)), seen(&levels(0, 0)));
    for (ppd, wanted, pixels) in [
        (67.0, 0.212_641, [0.208_74, 0.237_60, 0.153_64, 0.192_36]),
        (20.0, 0.365_665, [0.001_16, 0.231_87, 0.170_31, 0.264_21]),
    ] {
        let map = flip(&a, &b, ppd);
        near(mean(&map), wanted, 2.0e-5);
        for ((x, y), wanted) in [(0, 0), (39, 31), (13, 7), (20, 16)]
            .into_iter()
            .zip(pixels)
        {
            // Differences near 0 are raised to powers below 1, which shows f32's rounding.
            near(
                map[y * 40 + x],
                wanted,
                if wanted < 0.01 { 2.0e-3 } else { 2.0e-5 },
            );
        }
        assert!(map.iter().all(|e| (0.0..=1.0).contains(e)));
        near(mean(&flip(&b, &a, ppd)), mean(&map), 1.0e-12);
        assert_eq!(mean(&flip(&a, &a, ppd)), 0.0);
    }
    // The companion: another observer sees something else.
    assert!((mean(&flip(&a, &b, 60.0)) - 0.212_641).abs() > 1.0e-3);
}

/// Of scikit-image, in f64.
#[test]
fn ssim_is_that_of_others() {
    let luma = |pixels: &[[f64; 3]]| seen(pixels).luma();
    let (a, b) = (luma(&levels(2, 1)), luma(&levels(0, 0)));
    near(
        ssim(&a, &b, 40).expect("large enough"),
        0.788_577_089,
        1.0e-7,
    );
    near(
        ssim(&b, &a, 40).expect("large enough"),
        0.788_577_089,
        1.0e-7,
    );
    near(ssim(&a, &a, 40).expect("large enough"), 1.0, 1.0e-12);
    assert_eq!(ssim(&a[..400], &b[..400], 40), None);
    // Constant planes: only the means differ.
    let (x, y) = (vec![0.25; 121], vec![0.75; 121]);
    let wanted = (2.0 * 0.25 * 0.75 + 1.0e-4) / (0.0625 + 0.5625 + 1.0e-4);
    near(ssim(&x, &y, 11).expect("large enough"), wanted, 1.0e-12);
}

#[test]
fn exposure_decides_what_is_seen_and_nothing_else() {
    let bright = |v: f32| input(12, vec![[v; 3]; 144]);
    let at = |exposure| {
        let options = Options {
            exposure,
            ..Options::default()
        };
        compare(&bright(8.0), &bright(4.0), &options)
    };
    let (dark, light) = (at(-3.0), at(0.0));
    assert_eq!((light.flip, light.clipped), (Some(0.0), 1.0));
    assert!(dark.flip > Some(0.1) && dark.clipped == 0.0, "{dark:?}");
    assert_eq!(dark.errors, light.errors);
}

// ---- Noise ----

/// An image of the value 1 with noise of known size, as numbers of a normal distribution.
fn noisy(error: f32, seed: u32) -> Input {
    let sum = |rows: &[[f32; 3]]| {
        // Twelve uniform numbers: a variance of 1, and tails that end at 6.
        let total = [0, 1, 2].map(|c| rows.iter().map(|r| r[c]).sum::<f32>());
        total.map(|t| 1.0 + error * (t - 6.0))
    };
    let pixels: Vec<[f32; 3]> = noise(12 * 4096, seed).chunks(12).map(sum).collect();
    let mut image = input(64, pixels);
    image.stderr = Some(Picture::new(64, 64, vec![[error; 3]; 4096]));
    image
}

#[test]
fn noise_is_told_from_difference() {
    let (a, b) = (noisy(0.01, 1), noisy(0.02, 2));
    let test = report(&a, &b).z.expect("standard errors");
    assert!(test.passed, "{test:?}");
    near(test.rms, 1.0, 0.03);
    assert_eq!((test.values, test.untested, test.beyond), (3 * 4096, 0, 0));
    // A reference that is taken as exact: the same errors explain it, for it is.
    let exact = input(64, vec![[1.0; 3]; 4096]);
    assert!(report(&a, &exact).z.is_some_and(|z| z.passed));
    assert_eq!(report(&exact, &exact).z, None);
    // Companions: errors that are said to be half as large, a shift that only the mean shows, and
    // one pixel.
    let mut sure = a.clone();
    sure.stderr = Some(Picture::new(64, 64, vec![[0.005; 3]; 4096]));
    let test = report(&sure, &exact).z.expect("standard errors");
    assert!(!test.passed && test.rms > 1.9, "{test:?}");
    let mut shifted = a.clone();
    shifted
        .picture
        .pixels
        .iter_mut()
        .for_each(|p| p[2] += 0.001);
    let test = report(&shifted, &exact).z.expect("standard errors");
    assert!(
        !test.passed && test.beyond == 0 && test.pooled > test.pooled_limit,
        "{test:?}"
    );
    let mut spot = a.clone();
    spot.picture.pixels[130] = [1.2; 3];
    let test = report(&spot, &b).z.expect("standard errors");
    assert!(!test.passed && test.beyond == 1, "{test:?}");
    assert_eq!(test.worst_at, [2, 2]);
    // An unknown standard error is no pass.
    let mut unknown = a;
    unknown.stderr.as_mut().expect("it has one").pixels[0][0] = f32::NAN;
    let test = report(&unknown, &b).z.expect("standard errors");
    assert!(!test.passed && test.untested == 1, "{test:?}");
}

#[test]
fn few_degrees_of_freedom_are_taken_into_account() {
    // Values off by 6 standard errors in one place: rare for a normal deviate, not for Student's t.
    let exact = input(64, vec![[1.0; 3]; 4096]);
    let mut image = noisy(0.01, 1);
    image.picture.pixels[130] = [1.06; 3];
    let worst = |image: &Input| report(image, &exact).z.expect("standard errors").worst;
    near(worst(&image), 6.0, 1.0e-3);
    let with = |freedom: &str| {
        let mut image = image.clone();
        image
            .about
            .insert("degrees_of_freedom".into(), freedom.into());
        worst(&image)
    };
    // P(t > 6) for 10 degrees of freedom is 6.6054e-5, and P(z > 3.8225) too, by quadrature.
    near(with("10"), 3.8225, 2.0e-3);
    near(with("1e9"), 6.0, 1.0e-3);
    near(with("many"), 6.0, 1.0e-3);
    // Quantiles of Student's t as in any table.
    for (freedom, t) in [(1.0, 12.7062), (10.0, 2.2281), (30.0, 2.0423)] {
        near(student_quantile(freedom, 0.95), t, 1.0e-4);
    }
    near(student_quantile(f64::INFINITY, 0.95), 1.95996, 1.0e-4);
}

#[test]
fn renders_with_standard_errors_are_told_apart() {
    let folder = Folder::new();
    let base = "lecture --size 48x48 --aov stderr,samples";
    folder.ok(&format!("{base} --spp 256 -o a.exr --stats a.json"));
    folder.ok(&format!("{base} --spp 512 --seed 1 -o b.exr"));
    let a = gpu_trace::input::read(&folder.path("a.exr")).unwrap_or_else(|e| panic!("{e}"));
    let freedom = folder.json("a.json")["degrees_of_freedom"].as_f64();
    assert_eq!(a.about["degrees_of_freedom"].parse().ok(), freedom);
    // 4 and 12 batches of 4, 4 and 8 of 16: 256²/(16²/3 + 48²/11 + 64²/3 + 128²/7).
    near(freedom.expect("a number"), 16.3811, 1.0e-3);
    let text = folder.ok("compare a.exr b.exr --metric z");
    holds(&text, &["ok: the standard errors explain"]);
    // Companion: a lamp that is 5 % brighter.
    let scene = folder
        .ok("scene list lecture")
        .replace("emission = [2.0, 2.0, 2.0]", "emission = [2.1, 2.1, 2.1]");
    folder.write("bright.toml", scene);
    folder.ok("bright.toml --size 48x48 --aov stderr --spp 512 --seed 1 -o c.exr");
    let run = folder.run("compare a.exr c.exr --metric z --any-scene");
    assert_eq!(run.code, Some(3), "{run:?}");
    // The layers of the file.
    let channel = |name: &str| {
        let image = ::exr::prelude::read_first_flat_layer_from_file(folder.path("a.exr"));
        let channels = image.expect("an EXR file").layer_data.channel_data.list;
        let found = channels.into_iter().find(|c| c.name.eq(name));
        let data = found.expect("the channel").sample_data;
        data.values_as_f32().collect::<Vec<f32>>()
    };
    assert_eq!(channel("samples.N"), vec![256.0; 48 * 48]);
    let red = a.stderr.as_ref().expect("a layer").pixels.iter();
    assert_eq!(channel("stderr.R"), red.map(|p| p[0]).collect::<Vec<_>>());
    assert!(channel("stderr.G").iter().any(|e| *e > 0.0));
}

#[test]
fn layers_need_a_file_and_an_error_that_is_known() {
    let folder = Folder::new();
    for output in ["", "-o a.png", "-o a.npy"] {
        let arguments = format!("lecture --size 4x4 --spp 4 --aov stderr {output}");
        let words: Vec<&str> = arguments.split_whitespace().collect();
        holds(&folder.refused(&words), &["--aov", "-o image.exr"]);
    }
    let said = folder.refused(&["lecture", "--aov", "shade", "-o", "a.exr"]);
    holds(&said, &["stderr, samples"]);
    let run = folder.run("lecture --size 8x8 --spp 16 --aov stderr -o a.exr");
    assert_eq!(run.code, Some(0), "{run:?}");
    holds(&run.stderr, &["warning: the standard errors are unknown"]);
    let a = gpu_trace::input::read(&folder.path("a.exr")).unwrap_or_else(|e| panic!("{e}"));
    let stderr = a.stderr.expect("a layer").pixels;
    assert!(stderr.as_flattened().iter().all(|e| e.is_nan()));
    // Such a file passes no test.
    let run = folder.run("compare a.exr a.exr --metric z");
    assert_eq!(run.code, Some(3), "{run:?}");
}

// ---- The map ----

#[test]
fn the_map_shows_where_errors_are() {
    let mut pixels = vec![[1.0; 3]; 400];
    pixels[0] = [1.5; 3];
    pixels[1][0] = f32::NAN;
    for pixel in &mut pixels[20..40] {
        *pixel = [1.04; 3];
    }
    let (a, b) = (input(20, pixels), input(20, vec![[1.0; 3]; 400]));
    let map = HeatMap::of(&a.picture, &b.picture);
    // 0.04/sqrt(1.01) = 0.0398 is the largest of the lower 99 %.
    assert_eq!((map.range, map.beyond), (0.05, 1.0 / 400.0));
    let file = map.encode().expect("a PNG file");
    let shown = decode(&file).unwrap_or_else(|e| panic!("{e}"));
    let level = |i: usize| png::quantise(shown.picture.pixels[i], 1.0);
    assert_eq!(level(0), [252, 253, 191]);
    assert_eq!(level(1), [0, 255, 255]);
    assert_eq!(level(2), [0, 0, 4]);
    assert_eq!(level(25), heat_colour(0.04 / 1.01f64.sqrt() / 0.05));
    assert_eq!(shown.about["pale_yellow"], "0.05");
    // Brighter is more, at every step.
    let luma = |share: f64| {
        let [r, g, b] = heat_colour(share).map(f64::from);
        0.2126 * r + 0.7152 * g + 0.0722 * b
    };
    assert!((0..100).all(|i| luma(f64::from(i + 1) / 100.0) > luma(f64::from(i) / 100.0)));
}

// ---- The command ----

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

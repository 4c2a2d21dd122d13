//! Noise is told from difference.

use super::{input, near, noise, report};
use crate::cli_support::{Folder, holds};
use gpu_trace::image::Picture;
use gpu_trace::input::Input;
use gpu_trace::statistics::student_quantile;

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

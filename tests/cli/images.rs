//! Images: what is written, and which samples and pixels are in it.

use exr::meta::MetaData;
use exr::prelude::{AttributeValue, Text};
use serde_json::json;

use crate::cli_support::{Folder, bits, holds};
use crate::common::images::{Left, assert_same, cut};
use gpu_trace::settings::Rect;

#[test]
fn the_default_render_is_the_lecture_beside_the_user() {
    let folder = Folder::new();
    let summary = folder.ok("--size 24x16 --spp 16");
    assert!(
        summary.starts_with("lecture.png: 24x16, 16 spp, "),
        "{summary}"
    );
    assert_eq!(summary.matches('\n').count(), 1, "{summary}");
    assert_eq!(folder.names(), ["lecture.png"]);

    let image = image::open(folder.path("lecture.png"))
        .expect("a PNG")
        .into_rgb8();
    assert_eq!(image.dimensions(), (24, 16));
    // The lamp is the ceiling, the left wall is red, the right one blue.
    let sum = |x0: u32, y0: u32, x1: u32, y1: u32| {
        let inside = |x, y| (x0..x1).contains(&x) && (y0..y1).contains(&y);
        let pixels = image.enumerate_pixels().filter(|(x, y, _)| inside(*x, *y));
        pixels.fold([0; 3], |s, (_, _, p)| {
            [0, 1, 2].map(|c| s[c] + u32::from(p[c]))
        })
    };
    assert_eq!(sum(8, 0, 16, 1), [8 * 255; 3]);
    let ([r, g, b], [s, h, c]) = (sum(0, 4, 4, 12), sum(20, 4, 24, 12));
    assert!(r > 1000 && g == 0 && b == 0, "left {r} {g} {b}");
    assert!(s == 0 && h == 0 && c > 1000, "right {s} {h} {c}");
}

#[test]
fn one_render_writes_every_format_over_what_was_there() {
    let folder = Folder::new();
    folder.write("a.png", "old");
    let summary =
        folder.ok("render lecture --size 5x3 --spp 8 --seed 7 -o a.png -o b.EXR --output c.npy");
    assert!(
        summary.starts_with("a.png, b.EXR, c.npy: 5x3, 8 spp"),
        "{summary}"
    );
    assert_eq!(folder.names(), ["a.png", "b.EXR", "c.npy"]);
    let picture = folder.npy("c.npy");
    assert_eq!(
        (picture.width, picture.height, picture.pixels.len()),
        (5, 3, 15)
    );
    holds(
        &String::from_utf8_lossy(&folder.read("c.npy")),
        &["'<f4'", "(3, 5, 3)"],
    );
    let image = image::open(folder.path("a.png"))
        .expect("a PNG")
        .into_rgb8();
    assert_eq!(image.dimensions(), (5, 3));

    let exr = exr::prelude::read_first_rgba_layer_from_file(
        folder.path("b.EXR"),
        |size, _| vec![[0.0_f32; 3]; size.area()],
        |pixels, at, (r, g, b, _): (f32, f32, f32, f32)| pixels[at.y() * 5 + at.x()] = [r, g, b],
    );
    let exr = exr.expect("an EXR file").layer_data.channel_data.pixels;
    assert_eq!(exr, picture.pixels);
    let header = MetaData::read_from_file(folder.path("b.EXR"), true).expect("a header");
    let own = &header.headers[0].own_attributes;
    assert_eq!(
        own.software_name,
        Some(Text::from(concat!("gpu-trace ", env!("CARGO_PKG_VERSION"))))
    );
    let text = |text: &str| AttributeValue::Text(Text::from(text));
    for (name, value) in [
        ("scene", text("lecture")),
        ("sample_range", text("0..8")),
        ("integrator", text("path")),
        ("seed", AttributeValue::I32(7)),
        ("spp", AttributeValue::I32(8)),
    ] {
        let name = format!("gpu-trace:{name}");
        assert_eq!(
            own.other.get(&Text::from(name.as_str())),
            Some(&value),
            "{name}"
        );
    }
}

#[test]
fn exposure_brightens_the_png_alone() {
    let folder = Folder::new();
    folder.ok("--size 6x6 --spp 16 -o plain.png -o plain.npy");
    folder.ok("--size 6x6 --spp 16 -o bright.png -o bright.npy --exposure 2");
    folder.ok("--size 6x6 --spp 16 -o dark.png --exposure -20");
    assert_eq!(folder.read("plain.npy"), folder.read("bright.npy"));
    let sum = |name: &str| {
        let image = image::open(folder.path(name)).expect("a PNG").into_rgb8();
        image.as_raw().iter().map(|x| u64::from(*x)).sum::<u64>()
    };
    assert!(sum("bright.png") > sum("plain.png") + 500);
    assert_eq!(sum("dark.png"), 0);
}

#[test]
fn sample_ranges_average_to_the_whole() {
    let folder = Folder::new();
    for backend in ["cpu", "gpu"] {
        let base = format!("--size 16x9 --backend {backend}");
        let whole = folder.render(&format!("{base} --spp 64")).0;
        let ranges = [0..16_u64, 16..40, 40..64];
        let parts = ranges.clone().map(|range| {
            let (from, to) = (range.start, range.end);
            let (part, stats) = folder.render(&format!("{base} --sample-range {from}..{to}"));
            assert_eq!(stats["sample_range"], json!([from, to]));
            assert_eq!(stats["spp"], json!(to - from));
            part
        });
        assert_ne!(bits(&parts[1]), bits(&parts[2]));
        let _left = Left::alone(format!("of ranges, {backend}"), &whole);
        for (i, whole) in whole.pixels.as_flattened().iter().enumerate() {
            let values = parts.each_ref().map(|part| part.pixels.as_flattened()[i]);
            let weights = ranges.each_ref().map(|r| (r.end - r.start) as f64 / 64.0);
            let average: f64 = values
                .iter()
                .zip(weights)
                .map(|(v, w)| f64::from(*v) * w)
                .sum();
            let largest = values.iter().fold(*whole, |a, b| a.max(*b));
            let ulp = f64::from(largest.next_up()) - f64::from(largest);
            // Each part and the whole are rounded once.
            let distance = (average - f64::from(*whole)).abs() / ulp;
            assert!(distance <= 1.0, "{backend}, value {i}: {distance} ulp");
        }
    }
}

#[test]
fn a_crop_has_the_pixels_of_the_whole() {
    let folder = Folder::new();
    let whole = folder.render("glass --size 29x23 --spp 8").0;
    let (part, stats) = folder.render("glass --size 29x23 --spp 8 --crop 5,3,17x11");
    assert_eq!(
        (&stats["width"], &stats["height"]),
        (&json!(17), &json!(11))
    );
    let crop = Rect {
        x: 5,
        y: 3,
        width: 17,
        height: 11,
    };
    assert_same("a crop", &part, &cut(&whole, crop));
}

#[test]
fn the_seed_decides_the_bits() {
    let folder = Folder::new();
    let seeds = [0, 1, 1 << 32, u64::MAX];
    let images = seeds.map(|seed| {
        let (picture, stats) = folder.render(&format!("--size 9x9 --spp 4 --seed {seed}"));
        assert_eq!(stats["seed"], json!(seed));
        bits(&picture)
    });
    for (i, one) in images.iter().enumerate() {
        assert!(
            images[..i].iter().all(|other| other != one),
            "seed {}",
            seeds[i]
        );
    }
    // 0 is the default.
    let [default, zero] = ["", "--seed 0"].map(|seed| {
        let (picture, _) = folder.render(&format!("--size 9x9 --spp 4 {seed}"));
        picture
    });
    assert_same("the seed 0", &default, &zero);
}

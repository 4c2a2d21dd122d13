//! Files of images that scenes name.

use std::path::Path;

use glam::DVec3;
use gpu_trace::error::Error;
use gpu_trace::image::{Picture, linear};
use gpu_trace::input::texels;
use gpu_trace::output::{Metadata, exr};
use gpu_trace::scene::load::{Loaded, load_str_in};
use gpu_trace::scene::{Environment, Sky, summary};
use image::codecs::jpeg::JpegEncoder;
use image::{ExtendedColorType, ImageEncoder as _, ImageFormat};

use super::random_image;
use crate::cli_support::{Folder, GOOD};
use crate::common::images::assert_same;

fn exr_of(picture: &Picture) -> Vec<u8> {
    exr::encode(picture, &[], &Metadata::new()).expect("an EXR file")
}

fn encoded(format: ImageFormat, data: &[u8], size: [u32; 2], color: ExtendedColorType) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let [width, height] = size;
    image::write_buffer_with_format(&mut bytes, data, width, height, color, format)
        .unwrap_or_else(|e| panic!("{e}"));
    bytes.into_inner()
}

fn scene_of(environment: &str) -> String {
    GOOD.replace("radiance = [0.7, 0.8, 1.0]", environment)
}

fn load(folder: &Folder, environment: &str) -> Result<Loaded, Error> {
    load_str_in("sky", &scene_of(environment), &folder.path(""))
}

fn sky(folder: &Folder, environment: &str) -> Sky {
    let loaded = load(folder, environment).unwrap_or_else(|e| panic!("{e}"));
    let environment = loaded.scene.environment.expect("an environment");
    environment.sky().expect("an image").clone()
}

const MOST: u64 = 1 << 20;

#[test]
fn png_is_srgb_whatever_it_says_and_alpha_is_left_out() {
    let data: Vec<u8> = (0..4 * 6).map(|i| (i * 10) as u8).collect();
    let bytes = encoded(ImageFormat::Png, &data, [3, 2], ExtendedColorType::Rgba8);
    for (as_linear, decode) in [
        (false, linear as fn(f64) -> f64),
        (true, (|x| x) as fn(f64) -> f64),
    ] {
        let image = texels(&bytes, as_linear, MOST).expect("a PNG file");
        assert_eq!([image.width, image.height], [3, 2]);
        for (texel, bytes) in image.pixels.iter().zip(data.chunks(4)) {
            let wanted = [0, 1, 2].map(|c| decode(f64::from(bytes[c]) / 255.0) as f32);
            assert_eq!(*texel, wanted);
        }
    }
    // Grey with 16 bits; and one that says that it is linear.
    let words: Vec<u8> = [0u16, 1, 1000, 65_535].map(u16::to_ne_bytes).concat();
    let grey = encoded(ImageFormat::Png, &words, [4, 1], ExtendedColorType::L16);
    let image = texels(&grey, true, MOST).expect("a PNG file");
    let values = [0.0, 1.0, 1000.0, 65_535.0].map(|x: f32| [x / 65_535.0; 3]);
    assert_eq!(image.pixels, values);
    let mut says = Vec::new();
    let mut encoder = png::Encoder::new(&mut says, 1, 1);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_source_gamma(png::ScaledFloat::new(1.0));
    let mut writer = encoder.write_header().expect("a header");
    writer.write_image_data(&[128, 128, 128]).expect("a pixel");
    writer.finish().expect("an end");
    let image = texels(&says, false, MOST).expect("a PNG file");
    assert_eq!(image.pixels, [[linear(128.0 / 255.0) as f32; 3]]);
}

#[test]
fn jpeg_is_read_to_what_it_loses() {
    // A colour in blocks of 8 by 8, and grey.
    let colour = [180u8, 90, 30];
    let data: Vec<u8> = colour.repeat(24 * 16);
    let mut bytes = Vec::new();
    JpegEncoder::new_with_quality(&mut bytes, 95)
        .write_image(&data, 24, 16, ExtendedColorType::Rgb8)
        .expect("a JPEG file");
    for as_linear in [false, true] {
        let image = texels(&bytes, as_linear, MOST).expect("a JPEG file");
        assert_eq!([image.width, image.height], [24, 16]);
        for texel in &image.pixels {
            for (value, byte) in texel.iter().zip(colour) {
                // Quantisation and conversion of colours: some steps of 255.
                let decode = |x: f64| if as_linear { x } else { linear(x) };
                let near = |step: f64| decode((f64::from(byte) + step) / 255.0);
                let value = f64::from(*value);
                assert!((near(-3.0)..near(3.0)).contains(&value), "{texel:?}");
                assert!(!(near(3.0)..near(9.0)).contains(&value));
            }
        }
    }
    let grey: Vec<u8> = vec![77; 9 * 9];
    let mut bytes = Vec::new();
    JpegEncoder::new_with_quality(&mut bytes, 100)
        .write_image(&grey, 9, 9, ExtendedColorType::L8)
        .expect("a JPEG file");
    let image = texels(&bytes, true, MOST).expect("a JPEG file");
    let near = |x: &f32| (*x - 77.0 / 255.0).abs() < 2.0 / 255.0;
    assert!(image.pixels.iter().flatten().all(near));
    // A part of a file is none.
    for end in 0..bytes.len() - 2 {
        let part = texels(&bytes[..end], true, MOST);
        assert!(part.is_err(), "of {end} bytes of {}", bytes.len());
    }
}

#[test]
fn scenes_have_their_image() {
    let folder = Folder::new();
    let picture = random_image(6, 4, "a file", 1.0);
    folder.write("sky.exr", exr_of(&picture));
    let one = sky(&folder, "image = \"sky.exr\"");
    assert_eq!(one, Sky::new("sky.exr", picture.clone(), DVec3::ONE, 0.0));
    let keys = "image = \"sky.exr\"\nscale = 2\nrotation = -30";
    let two = sky(&folder, keys);
    assert_eq!(
        two,
        Sky::new("sky.exr", picture.clone(), DVec3::splat(2.0), 330.0)
    );
    let keys = "image = \"./sky.exr\"\nscale = [1, 0.5, 0]\nlinear = true";
    let three = sky(&folder, keys);
    assert_eq!(three.scale(), DVec3::new(1.0, 0.5, 0.0));
    assert_eq!(
        three.texel(1, 2),
        DVec3::new(1.0, 0.5, 0.0) * one.texel(1, 2)
    );
    // Each counts for the hash, and so does the image.
    let hash = |environment: &str| load(&folder, environment).expect("a scene").hash;
    let mut hashes = vec![
        hash("image = \"sky.exr\""),
        hash("image = \"sky.exr\"\nscale = 2"),
        hash("image = \"sky.exr\"\nrotation = 1"),
        hash("radiance = [1, 1, 1]"),
    ];
    assert_eq!(hashes[0], hash("image = \"./sky.exr\"\nrotation = 360"));
    let mut other = picture.clone();
    other.pixels[3][1] *= 1.001;
    folder.write("sky.exr", exr_of(&other));
    hashes.push(hash("image = \"sky.exr\""));
    hashes.sort();
    hashes.dedup();
    assert_eq!(hashes.len(), 5);
    // And it is a file of the scene.
    let loaded = load(&folder, "image = \"sky.exr\"").expect("a scene");
    assert_eq!(loaded.files, [folder.path("").join("sky.exr")]);
    assert_eq!(loaded.inputs(), [folder.path("").join("sky.exr")]);
    let words = summary(&load(&folder, keys).expect("a scene"));
    assert!(
        words.contains("environment ./sky.exr, 6 x 4 texels, times (1, 0.5, 0)"),
        "{words}"
    );
    // Black is no environment.
    let black = load(&folder, "image = \"sky.exr\"\nscale = 0").expect("a scene");
    assert_eq!(black.scene.environment, None);
    assert!(matches!(
        loaded.scene.environment,
        Some(Environment::Sky(_))
    ));
}

/// Part of what is said about a scene with this environment, which names its line.
fn refused(folder: &Folder, environment: &str, line: u32, says: &[&str]) {
    let text = match load(folder, environment) {
        Ok(_) => panic!("{environment} should be refused"),
        Err(error) => error.to_string(),
    };
    let place = format!("sky:{line}:");
    for part in says.iter().chain([&place.as_str()]) {
        assert!(text.contains(part), "{part:?} is not in {text}");
    }
}

#[test]
fn what_is_no_image_of_radiances_is_refused() {
    let folder = Folder::new();
    // `[environment]` is in line 10 of the scene.
    let file = |says: &[&str]| refused(&folder, "image = \"sky.exr\"", 11, says);
    file(&["cannot read", "sky.exr"]);
    std::fs::create_dir(folder.path("sky.exr")).expect("a folder");
    file(&["sky.exr is no regular file"]);
    std::fs::remove_dir(folder.path("sky.exr")).expect("a folder");
    for (bytes, says) in [
        (&b""[..], "neither an EXR, nor a PNG, nor a JPEG"),
        (b"GIF89a", "neither an EXR, nor a PNG, nor a JPEG"),
        (b"\x93NUMPY", "neither an EXR, nor a PNG, nor a JPEG"),
        (b"\xff\xd8\xff\xe0", "sky.exr: "),
        (b"\x89PNG\r\n\x1a\n", "ends early"),
    ] {
        folder.write("sky.exr", bytes);
        file(&[says]);
    }
    let good = random_image(5, 3, "good", 1.0);
    let bytes = exr_of(&good);
    folder.write("sky.exr", &bytes[..bytes.len() - 9]);
    file(&["sky.exr: "]);
    for (value, shown) in [
        (f32::NAN, "NaN"),
        (f32::INFINITY, "inf"),
        (f32::NEG_INFINITY, "-inf"),
        (-1.0e-30, "-1e-30"),
    ] {
        let mut image = good.clone();
        image.pixels[5 + 3][2] = value;
        folder.write("sky.exr", exr_of(&image));
        file(&[
            "its texel in column 3 of row 1 is",
            shown,
            "finite and not negative",
        ]);
    }
    let mut image = good.clone();
    image.pixels[2][0] = 1.0e10;
    folder.write("sky.exr", exr_of(&image));
    refused(
        &folder,
        "image = \"sky.exr\"\nscale = 1e11",
        11,
        &["its brightest value times `scale` is 1", "more than 1e20"],
    );
    sky(&folder, "image = \"sky.exr\"\nscale = 1e9");
    // A negative zero is zero.
    image.pixels[2][0] = -0.0;
    folder.write("sky.exr", exr_of(&image));
    assert_eq!(
        sky(&folder, "image = \"sky.exr\"").image().pixels[2][0].to_bits(),
        0
    );
    // More than is read, without a disk that has it.
    let huge = std::fs::File::create(folder.path("sky.exr")).expect("a file");
    huge.set_len(3 << 30).expect("a file with a hole");
    file(&["sky.exr is longer than 2147483648 bytes"]);
    // More than its bytes can hold; more than is allowed.
    let mut png = encoded(ImageFormat::Png, &[0; 12], [2, 2], ExtendedColorType::Rgb8);
    png[16..24].copy_from_slice(&[0, 1, 0, 0, 0, 1, 0, 0]);
    let crc = crc_of(&png[12..29]);
    png[29..33].copy_from_slice(&crc.to_be_bytes());
    folder.write("sky.exr", png);
    file(&["sky.exr: it has 65536x65536 pixels, more than 134217728"]);
}

/// CRC-32 of ISO 3309.
fn crc_of(bytes: &[u8]) -> u32 {
    let mut crc = u32::MAX;
    for byte in bytes {
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            crc = (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg());
        }
    }
    !crc
}

#[test]
fn keys_that_do_not_fit_are_refused() {
    let folder = Folder::new();
    let picture = random_image(2, 2, "keys", 1.0);
    folder.write("sky.exr", exr_of(&picture));
    let gradient = "gradient = { zenith = [1, 1, 1], horizon = [1, 1, 1], ground = [0, 0, 0] }";
    let image = "image = \"sky.exr\"";
    let cases: [(String, u32, &[&str]); 12] = [
        (
            String::new(),
            10,
            &["`radiance`, `gradient` or `image` is missing in `[environment]`"],
        ),
        (
            format!("radiance = [1, 1, 1]\n{image}"),
            12,
            &["`image` and `radiance` do not go together"],
        ),
        (
            format!("{gradient}\nradiance = [1, 1, 1]"),
            11,
            &["`gradient` and `radiance` do not"],
        ),
        (
            format!("{image}\n{gradient}"),
            11,
            &["`image` and `gradient` do not go together"],
        ),
        (
            "radiance = [1, 1, 1]\nscale = 2".into(),
            12,
            &["`scale` needs an `image`"],
        ),
        (
            format!("{gradient}\nrotation = 2"),
            12,
            &["`rotation` needs an `image`"],
        ),
        (
            format!("{gradient}\nlinear = false"),
            12,
            &["`linear` needs an `image`"],
        ),
        (
            format!("{image}\nscale = -1"),
            12,
            &["`scale` must be at least 0"],
        ),
        (
            format!("{image}\nscale = [1, 1]"),
            12,
            &["`scale` must have exactly 3 numbers"],
        ),
        (
            format!("{image}\nscale = \"1\""),
            12,
            &["`scale` must be a number"],
        ),
        (
            format!("{image}\nlinear = 1"),
            12,
            &["`linear` must be a boolean"],
        ),
        (
            gradient.replace("zenith", "zenit"),
            11,
            &["zenit", "zenith"],
        ),
    ];
    for (environment, line, says) in &cases {
        refused(&folder, environment, *line, says);
    }
    refused(
        &folder,
        &gradient.replace("[0, 0, 0]", "[0, -1, 0]"),
        11,
        &["`ground`", "at least 0"],
    );
    refused(
        &folder,
        &format!("{image}\nrotation = nan"),
        12,
        &["`rotation`", "finite"],
    );
}

#[test]
#[cfg(unix)]
fn no_scene_reads_a_device_or_a_pipe() {
    let folder = Folder::new();
    folder.write("pipe.toml", scene_of("image = \"pipe\""));
    let made = std::process::Command::new("mkfifo")
        .arg(folder.path("pipe"))
        .status();
    assert!(made.expect("mkfifo runs").success());
    let says = folder.refused(&["scene", "check", "pipe.toml"]);
    assert!(
        says.contains("pipe is no regular file") && says.contains("pipe.toml:11:"),
        "{says}"
    );
    folder.write("zero.toml", scene_of("image = \"/dev/zero\""));
    let says = folder.refused(&["zero.toml", "-o", "x.npy"]);
    assert!(says.contains("/dev/zero is no regular file"), "{says}");
    assert!(Path::new("/dev/zero").exists());
}

#[test]
fn an_image_is_an_input_and_goes_with_film_files() {
    let folder = Folder::new();
    folder.write("sky.exr", exr_of(&random_image(6, 4, "film", 1.0)));
    folder.write("scene.toml", scene_of("image = \"sky.exr\""));
    for output in ["sky.exr", "./sky.exr"] {
        let says = folder.refused(&["scene.toml", "-o", output]);
        assert!(says.contains("would replace the input"), "{says}");
    }
    let small = "scene.toml --backend cpu --size 8x6";
    let (whole, _) = folder.render(&format!("{small} --spp 32"));
    folder.ok(&format!("{small} --spp 16 --checkpoint a.film -o x.npy"));
    folder.ok("resume a.film --spp 32");
    assert_same("resumed with a sky", &folder.npy("x.npy"), &whole);
    folder.write("sky.exr", exr_of(&random_image(6, 4, "another", 1.0)));
    let says = folder.refused(&["resume", "a.film", "--spp", "64", "-o", "y.npy"]);
    assert!(says.contains("sky.exr has changed"), "{says}");
    std::fs::remove_file(folder.path("sky.exr")).expect("it is there");
    let says = folder.refused(&["resume", "a.film", "--spp", "64", "-o", "y.npy"]);
    assert!(
        says.contains("cannot read") && says.contains("sky.exr"),
        "{says}"
    );
}

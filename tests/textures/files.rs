//! Textures in scene files.

use std::path::Path;

use glam::DVec3;
use gpu_trace::error::Error;
use gpu_trace::image::{Picture, linear};
use gpu_trace::materials::Texture;
use gpu_trace::output::{Metadata, exr};
use gpu_trace::scene::load::{Loaded, load_str_in};
use gpu_trace::scene::summary;
use image::{ExtendedColorType, ImageFormat};

use super::random_picture;
use crate::cli_support::{Folder, GOOD};
use crate::common::images::assert_same;

fn exr_of(picture: &Picture) -> Vec<u8> {
    exr::encode(picture, &[], &Metadata::new()).expect("an EXR file")
}

/// A scene whose white material, in line 12 with its albedo in line 14, has another line there.
fn scene_of(albedo: &str) -> String {
    GOOD.replace("albedo = [0.9, 0.8, 0.7]", albedo)
}

fn load(folder: &Folder, albedo: &str) -> Result<Loaded, Error> {
    load_str_in("scene", &scene_of(albedo), &folder.path(""))
}

fn texture(folder: &Folder, line: &str) -> Texture {
    let loaded = load(folder, line).unwrap_or_else(|e| panic!("{line}: {e}"));
    let material = loaded.scene.materials.iter().find(|m| m.name == "white");
    material.expect("it is there").textures[0].texture.clone()
}

#[test]
fn tables_are_textures() {
    let folder = Folder::new();
    let white = DVec3::ONE;
    let black = DVec3::ZERO;
    assert_eq!(
        texture(&folder, "albedo = { checker = [[1, 1, 1], [0, 0, 0]] }"),
        Texture::Checker {
            values: [white, black],
            size: 0.5
        }
    );
    assert_eq!(
        texture(
            &folder,
            "albedo = { checker = [[1, 1, 1], [0, 0, 0]], size = 2 }"
        ),
        Texture::Checker {
            values: [white, black],
            size: 2.0
        }
    );
    assert_eq!(
        texture(&folder, "albedo = { noise = [[1, 1, 1], [0, 0, 0]] }"),
        Texture::Noise {
            values: [white, black],
            size: 0.5,
            octaves: 4
        }
    );
    assert_eq!(
        texture(
            &folder,
            "albedo = { noise = [[1, 1, 1], [0, 0, 0]], size = 0.1, octaves = 16 }"
        ),
        Texture::Noise {
            values: [white, black],
            size: 0.1,
            octaves: 16
        }
    );
    // A table of its own, and numbers.
    let own = "[material.white.albedo]\nchecker = [[1, 1, 1], [0, 0, 0]]";
    assert_eq!(
        texture(&folder, own),
        Texture::Checker {
            values: [white, black],
            size: 0.5
        }
    );
    let text = GOOD.replace(
        "reflectance = [0.9, 0.9, 0.9]",
        "reflectance = [1, 1, 1]\nemission = { noise = [[9, 9, 9], [0, 0, 0]] }",
    );
    let scene = load_str_in("scene", &text, Path::new(""))
        .expect("good")
        .scene;
    let chrome = scene
        .materials
        .iter()
        .find(|m| m.name == "chrome")
        .expect("it is there");
    assert_eq!(
        (chrome.emission, chrome.mean_emission()),
        (DVec3::splat(9.0), DVec3::splat(4.5))
    );
    let text = GOOD.replace(
        "ior = 1.5",
        "ior = 1.5\nroughness = { checker = [0, 0.25] }",
    );
    let scene = load_str_in("scene", &text, Path::new(""))
        .expect("good")
        .scene;
    let glass = scene
        .materials
        .iter()
        .find(|m| m.name == "glass")
        .expect("it is there");
    let forms: Vec<&str> = glass.forms().map(|form| form.name).collect();
    assert_eq!(forms, ["rough_dielectric", "dielectric"]);
}

#[test]
fn images_are_textures() {
    let folder = Folder::new();
    let data: Vec<u8> = (0..18).map(|i| 14 * i).collect();
    let mut png = std::io::Cursor::new(Vec::new());
    image::write_buffer_with_format(
        &mut png,
        &data,
        3,
        2,
        ExtendedColorType::Rgb8,
        ImageFormat::Png,
    )
    .unwrap_or_else(|e| panic!("{e}"));
    folder.write("a.png", png.into_inner());
    folder.write("a.exr", exr_of(&random_picture(6, 4, "a file")));
    let of = |line: &str| match texture(&folder, line) {
        Texture::Image(image) => image,
        other => panic!("{other:?}"),
    };
    // sRGB is decoded before anything else.
    let srgb = of("albedo = { image = \"a.png\" }");
    let as_is = of("albedo = { image = \"a.png\", linear = true }");
    for (i, byte) in data.iter().enumerate() {
        let (texel, channel) = (i / 3, i % 3);
        let [a, b] = [&srgb, &as_is].map(|image| image.image().pixels[texel][channel]);
        let value = f64::from(*byte) / 255.0;
        assert_eq!([a, b], [linear(value) as f32, value as f32]);
    }
    let exr = of("albedo = { image = \"a.exr\" }\naxis = [0, 0, 2]");
    assert_eq!((exr.axis(), exr.name()), (DVec3::Z, "a.exr"));
    let short = of("albedo = { image = \"a.exr\" }\naxis = [0, 0, 1e-200]");
    assert_eq!(short.axis(), DVec3::Z);
    assert_eq!(of("albedo = { image = \"./a.exr\" }").axis(), DVec3::Y);
    // All that counts is in the hash.
    let hash = |line: &str| load(&folder, line).expect("good").hash;
    let mut hashes = vec![
        hash("albedo = [0.9, 0.8, 0.7]"),
        hash("albedo = { image = \"a.png\" }"),
        hash("albedo = { image = \"a.png\", linear = true }"),
        hash("albedo = { image = \"a.exr\" }"),
        hash("albedo = { image = \"a.exr\" }\naxis = [1, 0, 0]"),
        hash("albedo = { checker = [[0, 0, 0], [1, 1, 1]] }"),
        hash("albedo = { checker = [[1, 1, 1], [0, 0, 0]] }"),
        hash("albedo = { checker = [[1, 1, 1], [0, 0, 0]], size = 1 }"),
        hash("albedo = { noise = [[1, 1, 1], [0, 0, 0]] }"),
        hash("albedo = { noise = [[1, 1, 1], [0, 0, 0]], octaves = 3 }"),
    ];
    assert_eq!(
        hashes[3],
        hash("albedo = { image = \"./a.exr\" }\naxis = [0, 3, 0]")
    );
    let mut other = random_picture(6, 4, "a file");
    other.pixels[7][1] *= 0.999;
    folder.write("a.exr", exr_of(&other));
    hashes.push(hash("albedo = { image = \"a.exr\" }"));
    let count = hashes.len();
    hashes.sort();
    hashes.dedup();
    assert_eq!(hashes.len(), count);
    // It is a file of the scene, read once for several keys, and said in words.
    let line = "albedo = { image = \"a.exr\" }\nemission = { image = \"a.exr\" }";
    let loaded = load(&folder, line).expect("good");
    assert_eq!(loaded.files, [folder.path("").join("a.exr")]);
    let white = loaded
        .scene
        .materials
        .iter()
        .find(|m| m.name == "white")
        .expect("it is there");
    let pictures: Vec<_> = white
        .textures
        .iter()
        .map(|t| match &t.texture {
            Texture::Image(image) => image.image(),
            other => panic!("{other:?}"),
        })
        .collect();
    assert!(std::sync::Arc::ptr_eq(pictures[0], pictures[1]));
    let words = summary(&loaded);
    for part in [
        "textures     2",
        "albedo of white: a.exr, 6 x 4 texels",
        "white with radiance up to (",
    ] {
        assert!(words.contains(part), "{part:?} is not in {words}");
    }
}

/// What is said of a scene with this line, and its place.
fn refused(folder: &Folder, albedo: &str, line: u32, says: &[&str]) {
    let text = match load(folder, albedo) {
        Ok(_) => panic!("{albedo} should be refused"),
        Err(error) => error.to_string(),
    };
    let place = format!("scene:{line}:");
    for part in says.iter().chain([&place.as_str()]) {
        assert!(text.contains(part), "{part:?} is not in {text}");
    }
}

#[test]
fn what_is_no_texture_is_refused() {
    let folder = Folder::new();
    folder.write("a.exr", exr_of(&random_picture(6, 4, "a file")));
    let two = "[[1, 1, 1], [0, 0, 0]]";
    for (albedo, says) in [
        (
            "albedo = {}".into(),
            &[
                "`image`, `checker` or `noise` is missing in the texture `albedo` of `[material.white]`",
            ][..],
        ),
        (
            format!("albedo = {{ checker = {two}, noise = {two} }}"),
            &["`noise` and `checker` do not go together"],
        ),
        (
            format!("albedo = {{ image = \"a.exr\", checker = {two} }}"),
            &["`checker` and `image` do not go together"],
        ),
        (
            format!("albedo = {{ checker = {two}, octaves = 2 }}"),
            &["`octaves` needs `noise`"],
        ),
        (
            format!("albedo = {{ noise = {two}, linear = true }}"),
            &["`linear` needs `image`"],
        ),
        (
            "albedo = { image = \"a.exr\", size = 2 }".into(),
            &["`size` needs `checker` or `noise`"],
        ),
        (
            format!("albedo = {{ cheker = {two} }}"),
            &["unknown key `cheker`", "did you mean `checker`?"],
        ),
        (
            "albedo = { checker = [[1, 1, 1]] }".into(),
            &["`checker` must have exactly 2 values"],
        ),
        (
            "albedo = { checker = [1, 0] }".into(),
            &["`checker` must be an array of 3 numbers"],
        ),
        (
            "albedo = { checker = [[1, 1, 1.5], [0, 0, 0]] }".into(),
            &["`checker` must be in [0, 1]", "too large"],
        ),
        (
            "albedo = { noise = [[1, 1, nan], [0, 0, 0]] }".into(),
            &["`noise`", "finite"],
        ),
        (
            format!("albedo = {{ checker = {two}, size = 0 }}"),
            &["`size`", "too small"],
        ),
        (
            format!("albedo = {{ checker = {two}, size = -1 }}"),
            &["`size`", "negative"],
        ),
        (
            format!("albedo = {{ noise = {two}, octaves = 0 }}"),
            &["`octaves` must be an integer in [1, 16]"],
        ),
        (
            format!("albedo = {{ noise = {two}, octaves = 17 }}"),
            &["`octaves` must be an integer in [1, 16]"],
        ),
        (
            "albedo = \"a.exr\"".into(),
            &["`albedo` must be an array of 3 numbers"],
        ),
        (
            "albedo = 0.5".into(),
            &["`albedo` must be an array of 3 numbers", "[0.5, 0.5, 0.5]"],
        ),
        (
            "albedo = { image = \"b.exr\" }".into(),
            &["cannot read", "b.exr"],
        ),
        ("albedo = { image = \".\" }".into(), &["is no regular file"]),
    ] {
        refused(&folder, &albedo, 14, says);
    }
    refused(
        &folder,
        "albedo = { image = \"a.exr\" }\naxis = [0, 0, 0]",
        15,
        &["`axis` has no direction"],
    );
    // Keys that are no colours and no roughness.
    let text = GOOD.replace("ior = 1.5", "ior = { checker = [1.5, 1.6] }");
    let error = load_str_in("scene", &text, Path::new("")).expect_err("an index is none");
    assert!(
        error.to_string().contains("`ior` must be a number"),
        "{error}"
    );
}

#[test]
fn texels_are_within_the_limits_of_their_key() {
    let folder = Folder::new();
    let mut picture = random_picture(6, 4, "limits");
    picture.pixels[2 * 6 + 3][1] = 1.5;
    folder.write("a.exr", exr_of(&picture));
    let albedo = "albedo = { image = \"a.exr\" }";
    refused(
        &folder,
        albedo,
        14,
        &[
            "a.exr: its texel in column 3 of row 2 is [",
            "1.5",
            "outside of [0, 1], the limits of `albedo`",
        ],
    );
    // What emits may be brighter, and a number reads the red channel alone.
    texture(
        &folder,
        "albedo = [0, 0, 0]\nemission = { image = \"a.exr\" }",
    );
    let rough = |kind: &str| {
        let text = GOOD.replace("type = \"diffuse\"\nalbedo = [0.9, 0.8, 0.7]", kind);
        load_str_in("scene", &text, &folder.path(""))
    };
    let metal = "type = \"conductor\"\npreset = \"gold\"\nroughness = { image = \"a.exr\" }";
    rough(metal).unwrap_or_else(|e| panic!("{e}"));
    let cloth = "type = \"sheen\"\ncolor = [1, 1, 1]\nroughness = { image = \"a.exr\" }";
    picture.pixels.fill([0.5, 0.0, 0.0]);
    picture.pixels[9][0] = 0.04;
    folder.write("a.exr", exr_of(&picture));
    let error = rough(cloth).expect_err("below the least").to_string();
    assert!(
        error.contains("its red value in column 3 of row 1 is 0.04, outside of [0.05, 1]"),
        "{error}"
    );
    assert!(error.contains("scene:15:"), "{error}");
    for (value, shown) in [(f32::NAN, "NaN"), (f32::INFINITY, "inf"), (-0.5, "-0.5")] {
        picture.pixels[9] = [0.5, value, 0.5];
        folder.write("a.exr", exr_of(&picture));
        refused(
            &folder,
            albedo,
            14,
            &["its texel in column 3 of row 1 is", shown],
        );
    }
}

#[test]
fn wrong_scenes_exit_with_2_and_images_go_with_film_files() {
    let folder = Folder::new();
    folder.write("bad.toml", scene_of("albedo = { image = \"none.png\" }"));
    let says = folder.refused(&["scene", "check", "bad.toml"]);
    assert!(
        says.contains("bad.toml:14:") && says.contains("none.png"),
        "{says}"
    );
    #[cfg(unix)]
    {
        folder.write(
            "device.toml",
            scene_of("albedo = { image = \"/dev/zero\" }"),
        );
        let says = folder.refused(&["device.toml", "-o", "x.npy"]);
        assert!(says.contains("/dev/zero is no regular file"), "{says}");
    }
    folder.write("a.exr", exr_of(&random_picture(6, 4, "film")));
    folder.write("scene.toml", scene_of("albedo = { image = \"a.exr\" }"));
    let says = folder.refused(&["scene.toml", "-o", "a.exr"]);
    assert!(says.contains("would replace the input"), "{says}");
    let small = "scene.toml --backend cpu --size 8x6";
    let (whole, _) = folder.render(&format!("{small} --spp 32"));
    folder.ok(&format!("{small} --spp 16 --checkpoint a.film -o x.npy"));
    folder.ok("resume a.film --spp 32");
    assert_same("resumed with textures", &folder.npy("x.npy"), &whole);
    folder.write("a.exr", exr_of(&random_picture(6, 4, "another")));
    let says = folder.refused(&["resume", "a.film", "--spp", "64", "-o", "y.npy"]);
    assert!(says.contains("a.exr has changed"), "{says}");
}

#[test]
fn long_files_have_textures_too() {
    let folder = Folder::new();
    folder.write("a.exr", exr_of(&random_picture(6, 4, "long")));
    let mut text = scene_of("albedo = { image = \"a.exr\" }");
    // More than a mebibyte of spheres is parsed by pieces.
    for i in 0..20_000 {
        text += &format!(
            "[[sphere]]\ncenter = [{i}.0, 50.0, 9.0]\nradius = 0.25\nmaterial = \"white\"\n"
        );
    }
    assert!(text.len() > 1 << 20);
    let loaded = load_str_in("scene", &text, &folder.path("")).unwrap_or_else(|e| panic!("{e}"));
    let white = loaded
        .scene
        .materials
        .iter()
        .find(|m| m.name == "white")
        .expect("it is there");
    assert_eq!(white.textures.len(), 1);
    assert_eq!(loaded.files.len(), 1);
}

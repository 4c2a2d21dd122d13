//! Images of any origin are read as the linear values that they mean, and damaged ones refused.

use std::io::Cursor;

use exr::prelude::*;
use gpu_trace::input::{Encoding, Input, decode, linear};
use gpu_trace::output::png::srgb;
use gpu_trace::output::{
    Layer as OwnLayer, Metadata, Picture, exr as own_exr, npy, png as own_png,
};
use image::{DynamicImage, ImageFormat};

const WIDTH: usize = 7;
const HEIGHT: usize = 5;

/// Values that halves hold exactly, and of which no two are the same.
fn value(x: usize, y: usize, channel: usize) -> f32 {
    (1 + x + 8 * y + 64 * channel) as f32 / 64.0
}

fn picture() -> Picture {
    let pixel = |i: usize| [0, 1, 2].map(|c| value(i % WIDTH, i / WIDTH, c));
    Picture::new(
        WIDTH as u32,
        HEIGHT as u32,
        (0..WIDTH * HEIGHT).map(pixel).collect(),
    )
}

fn metadata() -> Metadata {
    Metadata::new()
        .with("scene", "a: b")
        .with("scene_hash", "0123abcd")
        .with("spp", 64_u32)
}

fn read(bytes: &[u8]) -> Input {
    decode(bytes).unwrap_or_else(|e| panic!("{e}"))
}

fn refused(bytes: &[u8]) -> String {
    let text = decode(bytes)
        .expect_err("this should be refused")
        .to_string();
    assert!(!text.contains(char::is_control), "{text:?}");
    text
}

/// No part of a file is taken for a whole one, and none upsets the reader.
fn truncated_is_refused(name: &str, bytes: &[u8]) {
    read(bytes);
    for end in 0..bytes.len() {
        assert!(decode(&bytes[..end]).is_err(), "{name} of {end} bytes");
    }
}

// ---- EXR ----

fn write(image: &Image<Layers<AnyChannels<FlatSamples>>>) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image
        .write()
        .non_parallel()
        .to_buffered(&mut bytes)
        .unwrap_or_else(|e| panic!("{e}"));
    bytes.into_inner()
}

/// An EXR layer whose channels hold the picture's values, the channels in order.
fn layer(
    name: &str,
    channels: &[&str],
    half: bool,
    encoding: Encoding_,
) -> Layer<AnyChannels<FlatSamples>> {
    let channel = |(c, name): (usize, &&str)| {
        let values = (0..WIDTH * HEIGHT).map(|i| value(i % WIDTH, i / WIDTH, c % 3));
        let samples = match half {
            true => FlatSamples::F16(values.map(f16::from_f32).collect()),
            false => FlatSamples::F32(values.collect()),
        };
        AnyChannel::new(*name, samples)
    };
    let list = channels.iter().enumerate().map(channel).collect();
    Layer::new(
        Vec2(WIDTH, HEIGHT),
        LayerAttributes::named(name),
        encoding,
        AnyChannels::sort(list),
    )
}

type Encoding_ = exr::image::Encoding;

fn file(layers: Vec<Layer<AnyChannels<FlatSamples>>>) -> Vec<u8> {
    let size = IntegerBounds::from_dimensions(Vec2(WIDTH, HEIGHT));
    write(&Image::from_layers(ImageAttributes::new(size), layers))
}

#[test]
fn exr_of_every_lossless_compression_and_both_layouts() {
    for compression in [
        Compression::Uncompressed,
        Compression::RLE,
        Compression::ZIP1,
        Compression::ZIP16,
        Compression::PIZ,
    ] {
        for blocks in [Blocks::ScanLines, Blocks::Tiles(Vec2(3, 2))] {
            for half in [false, true] {
                let encoding = Encoding_ {
                    compression,
                    blocks,
                    line_order: LineOrder::Increasing,
                };
                let bytes = file(vec![layer("", &["R", "G", "B"], half, encoding)]);
                let input = read(&bytes);
                assert_eq!(
                    input.picture,
                    picture(),
                    "{compression:?} {blocks:?} {half}"
                );
                assert_eq!((input.encoding, input.stderr), (Encoding::Linear, None));
            }
        }
    }
}

#[test]
fn exr_of_lossy_compressions() {
    // Halves pass PXR24 whole. The others' errors are below the step from row to row, 1/8.
    for (compression, error) in [
        (Compression::PXR24, 0.0),
        (Compression::B44, 0.05),
        (Compression::B44A, 0.05),
        (Compression::DWAA(None), 0.05),
        (Compression::DWAB(None), 0.05),
    ] {
        let encoding = Encoding_ {
            compression,
            blocks: Blocks::ScanLines,
            line_order: LineOrder::Increasing,
        };
        let read = read(&file(vec![layer("", &["R", "G", "B"], true, encoding)])).picture;
        for (a, b) in std::iter::zip(read.pixels.as_flattened(), picture().pixels.as_flattened()) {
            assert!((a - b).abs() <= error, "{compression:?}: {a} {b}");
        }
    }
}

#[test]
fn exr_of_this_program_says_what_it_shows() {
    let stderr: Vec<[f32; 3]> = picture()
        .pixels
        .iter()
        .map(|p| p.map(|v| v / 8.0))
        .collect();
    let layers = [
        OwnLayer {
            name: "stderr",
            channels: &["R", "G", "B"],
            values: stderr.as_flattened(),
        },
        OwnLayer {
            name: "",
            channels: &["Z"],
            values: &[1.0; WIDTH * HEIGHT],
        },
    ];
    let bytes = own_exr::encode(&picture(), &layers, &metadata()).expect("an EXR file");
    let input = read(&bytes);
    assert_eq!(input.picture, picture());
    assert_eq!(input.stderr.map(|s| s.pixels), Some(stderr));
    assert_eq!(
        (input.about["scene"].as_str(), input.about["spp"].as_str()),
        ("a: b", "64")
    );
    assert_eq!(input.about["scene_hash"], "0123abcd");
    assert_eq!(input.notes, ["1 further channels are left out"]);
    truncated_is_refused("EXR", &bytes);
}

#[test]
fn exr_layers_are_chosen_or_refused() {
    let plain = Encoding_::UNCOMPRESSED;
    let of = |channels: &[&str]| file(vec![layer("", channels, false, plain)]);
    // A layer alone; grey; alpha is no colour; channels without a layer come first.
    assert_eq!(read(&of(&["v.R", "v.G", "v.B"])).picture, picture());
    let grey = read(&of(&["Y"])).picture;
    assert_eq!(grey.pixels[9], [value(2, 1, 0); 3]);
    assert_eq!(read(&of(&["R", "G", "B", "A"])).notes, [""; 0]);
    assert_eq!(
        read(&of(&["R", "G", "B", "v.R", "v.G", "v.B"])).picture,
        picture()
    );

    let two = refused(&of(&["v.R", "v.G", "v.B", "w.R", "w.G", "w.B"]));
    assert!(two.contains("several images: v, w"), "{two}");
    for channels in [&["R", "G"][..], &["Y", "RY", "BY"], &["depth.Z"]] {
        let text = refused(&of(channels));
        assert!(
            text.contains("neither the channels R, G and B nor Y"),
            "{text}"
        );
    }
    let parts = ["left", "right"].map(|name| layer(name, &["R", "G", "B"], false, plain));
    let text = refused(&file(parts.to_vec()));
    assert!(text.contains("several images: left, right"), "{text}");
    let parts = vec![
        layer("depth", &["Z"], false, plain),
        layer("view", &["R", "G", "B"], false, plain),
    ];
    assert_eq!(read(&file(parts)).picture, picture());
}

#[test]
fn exr_windows_are_cropped_or_refused() {
    let with = |display: IntegerBounds, position: Vec2<i32>| {
        let mut layer = layer("", &["R", "G", "B"], false, Encoding_::FAST_LOSSLESS);
        layer.attributes.layer_position = position;
        write(&Image::from_layers(
            ImageAttributes::new(display),
            vec![layer],
        ))
    };
    // The data reach beyond what is shown: 2 columns left, 1 row above.
    let display = IntegerBounds::new(Vec2(10, 20), Vec2(4, 3));
    let input = read(&with(display, Vec2(8, 19)));
    assert_eq!((input.picture.width, input.picture.height), (4, 3));
    assert_eq!(input.picture.pixels[0], [0, 1, 2].map(|c| value(2, 1, c)));
    assert_eq!(input.picture.pixels[11], [0, 1, 2].map(|c| value(5, 3, c)));
    assert_eq!(
        input.notes,
        ["pixels outside its display window are left out"]
    );
    // They do not cover it.
    let display = IntegerBounds::new(Vec2(0, 0), Vec2(9, 5));
    let text = refused(&with(display, Vec2(1, 0)));
    assert!(
        text.contains("7x5 pixels at 1,0") && text.contains("9x5 at 0,0"),
        "{text}"
    );
}

// ---- PNG ----

fn encode_png(image: DynamicImage) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image
        .write_to(&mut bytes, ImageFormat::Png)
        .expect("a PNG file");
    bytes.into_inner()
}

/// A grey PNG of one pixel, with a chunk before the pixels.
fn with_chunk(level: u8, set: impl Fn(&mut png::Info<'_>)) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut info = png::Info::with_size(1, 1);
    info.color_type = png::ColorType::Grayscale;
    info.bit_depth = png::BitDepth::Eight;
    set(&mut info);
    let encoder = png::Encoder::with_info(&mut bytes, info).expect("a header");
    let mut writer = encoder.write_header().expect("a header");
    writer.write_image_data(&[level]).expect("a pixel");
    writer.finish().expect("an end");
    bytes
}

#[test]
fn the_transfer_function_and_its_inverse() {
    for i in 0..=4096 {
        let value = f64::from(i) / 4096.0;
        assert!((linear(srgb(value)) - value).abs() < 1.0e-7, "{value}");
        assert!((srgb(linear(value)) - value).abs() < 1.0e-6, "{value}");
    }
    // IEC 61966-2-1: half of full scale.
    assert!((linear(0.5) - 0.214_041_140).abs() < 1.0e-8);
    // Every level that this program writes is read as what gives this level again.
    for level in 0..=255_u8 {
        let value = linear(f64::from(level) / 255.0) as f32;
        assert_eq!(own_png::quantise([value; 3], 1.0), [level; 3]);
    }
}

#[test]
fn png_of_every_kind() {
    let near = |input: &Input, index: usize, wanted: [f64; 3]| {
        for (value, wanted) in input.picture.pixels[index].iter().zip(wanted) {
            assert!(
                (f64::from(*value) - wanted).abs() < 1.0e-6,
                "{value} {wanted}"
            );
        }
    };
    let [a, b, c] = [200_u8, 100, 3].map(|level| linear(f64::from(level) / 255.0));
    let rgb = image::RgbImage::from_raw(2, 1, vec![200, 100, 3, 3, 200, 100]).expect("2 pixels");
    let rgb = DynamicImage::from(rgb);
    let input = read(&encode_png(rgb.clone()));
    near(&input, 0, [a, b, c]);
    near(&input, 1, [c, a, b]);
    assert_eq!(input.encoding, Encoding::Srgb);
    assert!(
        input.notes[0].contains("taken as sRGB"),
        "{:?}",
        input.notes
    );
    near(&read(&encode_png(rgb.to_rgba8().into())), 1, [c, a, b]);
    near(&read(&encode_png(rgb.to_rgb16().into())), 1, [c, a, b]);
    near(&read(&encode_png(rgb.to_rgba16().into())), 0, [a, b, c]);
    let grey = image::GrayImage::from_raw(2, 1, vec![200, 3]).expect("2 pixels");
    let grey = DynamicImage::from(grey);
    near(&read(&encode_png(grey.clone())), 1, [c; 3]);
    near(&read(&encode_png(grey.to_luma16().into())), 0, [a; 3]);
    near(&read(&encode_png(grey.to_luma_alpha8().into())), 0, [a; 3]);
    let clear = image::RgbaImage::from_raw(1, 1, vec![200, 100, 3, 51]).expect("a pixel");
    let input = read(&encode_png(clear.into()));
    near(&input, 0, [0.2 * a, 0.2 * b, 0.2 * c]);
    assert!(
        input.notes.iter().any(|n| n.contains("over black")),
        "{:?}",
        input.notes
    );
    // 16 bits are not cut to 8.
    let fine = image::ImageBuffer::<image::Luma<u16>, _>::from_raw(1, 1, vec![300]);
    let input = read(&encode_png(DynamicImage::from(fine.expect("a pixel"))));
    near(&input, 0, [linear(300.0 / 65535.0); 3]);
    // A palette.
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 2, 1);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(png::BitDepth::One);
    encoder.set_palette(vec![200, 100, 3, 3, 200, 100]);
    let mut writer = encoder.write_header().expect("a header");
    writer.write_image_data(&[0b0100_0000]).expect("2 pixels");
    writer.finish().expect("an end");
    near(&read(&bytes), 0, [a, b, c]);
    near(&read(&bytes), 1, [c, a, b]);
}

#[test]
fn png_is_decoded_by_what_it_says() {
    let value = |bytes: &[u8]| f64::from(read(bytes).picture.pixels[0][0]);
    let level = 128.0 / 255.0;
    let gamma =
        |gamma: f32| with_chunk(128, |i| i.source_gamma = Some(png::ScaledFloat::new(gamma)));
    assert!((value(&gamma(1.0)) - level).abs() < 1.0e-6);
    assert!((value(&gamma(0.5)) - level * level).abs() < 1.0e-4);
    assert_eq!(read(&gamma(1.0)).encoding, Encoding::Linear);
    let intent = png::SrgbRenderingIntent::Perceptual;
    // sRGB wins over gAMA.
    let both = with_chunk(128, |i| {
        i.srgb = Some(intent);
        i.source_gamma = Some(png::ScaledFloat::new(1.0));
    });
    assert!((value(&both) - linear(level)).abs() < 1.0e-6);
    assert_eq!(read(&both).notes, [""; 0]);
}

#[test]
fn png_of_this_program_says_what_it_shows() {
    let bytes = own_png::encode(&picture(), 0.0, &metadata()).expect("a PNG file");
    let input = read(&bytes);
    assert_eq!((input.encoding, input.notes.len()), (Encoding::Srgb, 0));
    assert_eq!(
        (input.about["scene"].as_str(), input.about["spp"].as_str()),
        ("a: b", "64")
    );
    let again = own_png::encode(&input.picture, 0.0, &metadata()).expect("a PNG file");
    assert_eq!(read(&again).picture, input.picture);
    truncated_is_refused("PNG", &bytes);
}

// ---- NPY ----

/// An NPY file as NumPy writes it.
fn array(descr: &str, fortran: &str, shape: &str, data: Vec<u8>) -> Vec<u8> {
    let header =
        format!("{{'descr': '{descr}', 'fortran_order': {fortran}, 'shape': {shape}, }}\n");
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.bytes());
    bytes.extend(data);
    bytes
}

#[test]
fn npy_of_every_kind() {
    assert_eq!(read(&npy::encode(&picture())).picture, picture());
    let all: Vec<f32> = picture().pixels.as_flattened().to_vec();
    let shape = "(5, 7, 3)";
    let of = |bytes: fn(f32) -> Vec<u8>| all.iter().copied().flat_map(bytes).collect::<Vec<u8>>();
    for (descr, data) in [
        ("<f2", of(|v| f16::from_f32(v).to_le_bytes().into())),
        (">f2", of(|v| f16::from_f32(v).to_be_bytes().into())),
        (">f4", of(|v| v.to_be_bytes().into())),
        ("<f8", of(|v| f64::from(v).to_le_bytes().into())),
        (">f8", of(|v| f64::from(v).to_be_bytes().into())),
    ] {
        let bytes = array(descr, "False", shape, data);
        assert_eq!(read(&bytes).picture, picture(), "{descr}");
        truncated_is_refused(descr, &bytes);
    }
    // Fortran order: rows run fastest, then columns.
    let mut data = Vec::new();
    for channel in 0..3 {
        for x in 0..WIDTH {
            data.extend((0..HEIGHT).flat_map(|y| value(x, y, channel).to_le_bytes()));
        }
    }
    assert_eq!(read(&array("<f4", "True", shape, data)).picture, picture());
    let grey: Vec<u8> = [0.25_f32, 4.0]
        .into_iter()
        .flat_map(f32::to_le_bytes)
        .collect();
    for shape in ["(1, 2)", "(1, 2, 1)"] {
        let input = read(&array("<f4", "False", shape, grey.clone()));
        assert_eq!(input.picture.pixels, [[0.25; 3], [4.0; 3]]);
    }
    let four: Vec<u8> = [1.0_f32, 2.0, 3.0, 0.5]
        .into_iter()
        .flat_map(f32::to_le_bytes)
        .collect();
    let input = read(&array("<f4", "False", "(1, 1, 4)", four));
    assert_eq!(input.picture.pixels, [[1.0, 2.0, 3.0]]);
    assert!(
        input.notes[0].contains("fourth channel"),
        "{:?}",
        input.notes
    );

    for (descr, shape, said) in [
        ("|u1", "(1, 2, 3)", "floats of 2, 4 or 8 bytes"),
        ("<c8", "(1, 2, 3)", "floats of 2, 4 or 8 bytes"),
        ("<f4", "(1, 2, 2)", "shape (1, 2, 2)"),
        ("<f4", "(6,)", "shape (6,)"),
        ("<f4", "(0, 2, 3)", "shape (0, 2, 3)"),
        ("<f4", "(1, 3, 3)", "ends early"),
        ("<f4", "(4294967295, 4294967295)", "ends early"),
    ] {
        let text = refused(&array(descr, "False", shape, vec![0; 24]));
        assert!(text.contains(said), "{text}");
    }
}

// ---- Damage ----

#[test]
fn what_is_no_image_is_refused() {
    for bytes in [&b""[..], b"GIF89a", b"\x89PNG", b"v/1", b"<svg/>"] {
        assert!(refused(bytes).contains("neither an EXR, nor a PNG, nor an NPY"));
    }
}

#[test]
fn sizes_that_no_file_can_hold_take_no_memory() {
    let mut bytes = own_png::encode(&picture(), 0.0, &metadata()).expect("a PNG file");
    bytes[16..24].copy_from_slice(&[0x7f, 0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff]);
    // The header's checksum, CRC-32 of ISO 3309.
    let mut crc = u32::MAX;
    for byte in &bytes[12..29] {
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            crc = (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg());
        }
    }
    bytes[29..33].copy_from_slice(&(!crc).to_be_bytes());
    let text = refused(&bytes);
    assert!(text.contains("2147483647x2147483647"), "{text}");
}

//! PNG as others write it.

use std::io::Cursor;

use ::image::{DynamicImage, ImageFormat};
use gpu_trace::image::{linear, srgb};
use gpu_trace::input::{Encoding, Input};
use gpu_trace::output::png as own_png;

use super::{metadata, picture, read, truncated_is_refused};

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

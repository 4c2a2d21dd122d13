//! EXR as others write it.

use std::io::Cursor;

use ::exr::prelude::*;
use gpu_trace::input::Encoding;
use gpu_trace::output::{Layer as OwnLayer, exr as own_exr};

use super::{HEIGHT, WIDTH, metadata, picture, read, refused, truncated_is_refused, value};

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

//! What image files hold.

use std::io::{self, Cursor};

use exr::prelude::{AttributeValue, ReadChannels, ReadLayers, Text};
use gpu_trace::image::{Format, Picture};
use gpu_trace::input::{decode, read};
use gpu_trace::output::{Contents, Layer, Metadata, atomic, npy, png};
use proptest::prelude::*;
use tempfile::TempDir;

use super::{bits, contents, picture};

// ---- PNG ----

#[test]
fn srgb_has_its_known_values() {
    for (linear, level) in [
        (-1.0, 0),
        (0.0, 0),
        (0.003_130_8, 10),
        (0.18, 118),
        (0.215_860_5, 128),
        (0.5, 188),
        (1.0, 255),
        (1.5, 255),
        (f32::MAX, 255),
    ] {
        assert_eq!(png::quantise([linear; 3], 1.0), [level; 3], "{linear}");
    }
    // Every level is the nearest to its own linear value, by the inverse function.
    for level in 0..=255_u8 {
        let display = f64::from(level) / 255.0;
        let linear = if display <= 0.040_45 {
            display / 12.92
        } else {
            ((display + 0.055) / 1.055).powf(2.4)
        };
        assert_eq!(png::quantise([linear as f32; 3], 1.0), [level; 3]);
    }
}

#[test]
fn values_that_are_no_numbers_are_seen() {
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        assert_eq!(png::quantise([0.5, bad, 0.5], 1.0), [255, 0, 255]);
    }
}

#[test]
fn png_reads_back() {
    let picture = Picture::new(
        2,
        2,
        vec![[0.0; 3], [0.25; 3], [1.0, 0.125, 0.0], [f32::NAN; 3]],
    );
    for (scene, is_ascii) in [("room.toml", true), ("räume/部屋.toml", false)] {
        let metadata = Metadata::new().with("scene", scene).with("seed", u64::MAX);
        let bytes = png::encode(&picture, 1.0, &metadata).expect("a small picture");
        let decoder = ::png::Decoder::new(Cursor::new(bytes));
        let mut reader = decoder.read_info().expect("a header");
        let mut levels = [0; 12];
        reader.next_frame(&mut levels).expect("the image");
        reader.finish().expect("the end");
        assert_eq!(levels, [0, 0, 0, 188, 188, 188, 255, 137, 0, 255, 0, 255]);
        let info = reader.info();
        assert_eq!((info.width, info.height), (2, 2));
        assert!(info.srgb.is_some());
        let software = &info.uncompressed_latin1_text[0];
        assert_eq!(
            (software.keyword.as_str(), software.text.as_str()),
            ("Software", Metadata::SOFTWARE)
        );
        let comment = if is_ascii {
            info.uncompressed_latin1_text[1].text.clone()
        } else {
            info.utf8_text[0].get_text().expect("text")
        };
        assert_eq!(
            comment,
            format!("scene: {scene}\nseed: 18446744073709551615")
        );
    }
}

// ---- EXR ----

#[test]
fn exr_reads_back_bit_for_bit() {
    let picture = picture();
    let depth: Vec<f32> = (0..7 * 19).map(|index| index as f32 * 0.1).collect();
    let error: Vec<f32> = picture
        .pixels
        .as_flattened()
        .iter()
        .map(|value| value * 0.5)
        .collect();
    let layers = [
        Layer {
            name: "stderr",
            channels: &["R", "G", "B"],
            values: &error,
        },
        Layer {
            name: "depth",
            channels: &["Z"],
            values: &depth,
        },
    ];
    let metadata = Metadata::new()
        .with("scene", "部屋.toml")
        .with("seed", u64::MAX)
        .with("spp", 256_u64)
        .with("seconds", 12.5);
    let contents = Contents {
        layers: &layers,
        ..contents(&picture, &metadata)
    };
    let bytes = contents.encode(Format::Exr).expect("a small picture");

    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .expect("a valid file");
    let [layer] = image.layer_data.as_slice() else {
        panic!("one part")
    };
    assert_eq!((layer.size.0, layer.size.1), (7, 19));
    let channel = |name: &str| -> Vec<u32> {
        let found = layer
            .channel_data
            .list
            .iter()
            .find(|channel| channel.name.eq(name));
        let exr::prelude::FlatSamples::F32(values) = &found.expect(name).sample_data else {
            panic!("{name} is not f32")
        };
        values.iter().map(|value| value.to_bits()).collect()
    };
    let every_third = |values: &[f32], first: usize| -> Vec<u32> {
        values
            .iter()
            .skip(first)
            .step_by(3)
            .map(|value| value.to_bits())
            .collect()
    };
    let names: Vec<String> = layer
        .channel_data
        .list
        .iter()
        .map(|channel| channel.name.to_string())
        .collect();
    assert_eq!(
        names,
        ["B", "G", "R", "depth.Z", "stderr.B", "stderr.G", "stderr.R"]
    );
    for (index, name) in ["R", "G", "B"].into_iter().enumerate() {
        assert_eq!(
            channel(name),
            every_third(picture.pixels.as_flattened(), index)
        );
        assert_eq!(
            channel(&format!("stderr.{name}")),
            every_third(&error, index)
        );
    }
    assert_eq!(
        channel("depth.Z"),
        depth
            .iter()
            .map(|value| value.to_bits())
            .collect::<Vec<_>>()
    );

    let software = layer
        .attributes
        .software_name
        .as_ref()
        .expect("the attribute");
    assert_eq!(software.as_slice(), Metadata::SOFTWARE.as_bytes());
    assert!(image.attributes.chromaticities.is_some());
    let utf8 = |text: &str| AttributeValue::Text(Text::from_slice_unchecked(text.as_bytes()));
    for (name, value) in [
        ("gpu-trace:scene", utf8("部屋.toml")),
        ("gpu-trace:seed", utf8("18446744073709551615")),
        ("gpu-trace:spp", AttributeValue::I32(256)),
        ("gpu-trace:seconds", AttributeValue::F64(12.5)),
    ] {
        assert_eq!(
            layer.attributes.other.get(&Text::from(name)),
            Some(&value),
            "{name}"
        );
    }
}

#[test]
fn exr_refuses_layers_that_do_not_fit() {
    let picture = picture();
    let values = vec![0.0; 7 * 19];
    for layer in [
        Layer {
            name: "depth",
            channels: &["Z"],
            values: &values[1..],
        },
        Layer {
            name: "",
            channels: &["R"],
            values: &values,
        },
        Layer {
            name: "depth",
            channels: &[""],
            values: &values,
        },
    ] {
        let metadata = Metadata::new();
        let contents = Contents {
            layers: &[layer],
            ..contents(&picture, &metadata)
        };
        let error = contents.encode(Format::Exr).expect_err("it does not fit");
        assert_eq!(error.kind(), io::ErrorKind::InvalidInput, "{error}");
    }
}

// ---- NPY ----

#[test]
fn npy_reads_back_bit_for_bit() {
    let directory = TempDir::new().expect("a directory");
    let path = directory.path().join("a.npy");
    let picture = picture();
    atomic::write(&path, &npy::encode(&picture)).expect("it can be written");
    let read = read(&path).expect("a valid file").picture;
    assert_eq!((read.width, read.height), (7, 19));
    assert_eq!(bits(&read.pixels), bits(&picture.pixels));
}

#[test]
fn npy_has_the_form_that_numpy_writes() {
    let bytes = npy::encode(&Picture::new(2, 1, vec![[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]));
    let dictionary = "{'descr': '<f4', 'fortran_order': False, 'shape': (1, 2, 3), }";
    let expected = format!("{dictionary:117}\n");
    let mut header = b"\x93NUMPY\x01\x00\x76\x00".to_vec();
    header.extend(expected.bytes());
    assert_eq!(&bytes[..128], header);
    assert_eq!(bytes[128..132], 1.0_f32.to_le_bytes());
    assert_eq!(bytes.len(), 128 + 24);
}

proptest! {
    #[test]
    fn npy_keeps_all_bits(width in 1_u32..9, height in 1_u32..9, seed in any::<u32>()) {
        let values: Vec<[f32; 3]> = (0..width * height)
            .map(|i| [1, 2, 3].map(|c| f32::from_bits((seed ^ (3 * i + c)).wrapping_mul(0x9e37_79b9))))
            .collect();
        let picture = Picture::new(width, height, values);
        let read = decode(&npy::encode(&picture)).expect("a valid file").picture;
        prop_assert_eq!((read.width, read.height), (width, height));
        prop_assert_eq!(bits(&read.pixels), bits(&picture.pixels));
    }
}

//! Images, of every format that is read.

use std::io::Cursor;

use ::exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, LayerAttributes,
    LineOrder, Vec2, WritableImage as _, f16,
};
use gpu_trace::image::Picture;
use gpu_trace::input::{decode, read, texels};
use gpu_trace::output::{Layer, Metadata, exr, npy, png};

use super::{fuzz, numbers};

#[test]
fn no_bytes_upset_the_npy_reader() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("fuzz.npy");
    let mut seeds: Vec<Vec<u8>> = [(1, 1), (2, 1), (3, 5), (64, 64)]
        .map(|(width, height)| {
            Picture::new(width, height, vec![[0.5; 3]; (width * height) as usize])
        })
        .iter()
        .map(npy::encode)
        .collect();
    for (version, header) in [
        (
            2,
            "{'descr': '<f8', 'fortran_order': False, 'shape': (1, 1, 3)}\n",
        ),
        (
            3,
            "{\"shape\":(2,1,3,),\"descr\":\"<f4\",\"fortran_order\":False,}\n",
        ),
        (
            1,
            "{'descr': '<f4', 'fortran_order': True, 'shape': (4294967295, 4294967295, 3)}\n",
        ),
    ] {
        let mut bytes = b"\x93NUMPY".to_vec();
        bytes.extend([version, 0]);
        let length = header.len() as u32;
        let length = length.to_le_bytes();
        bytes.extend(&length[..if version == 1 { 2 } else { 4 }]);
        bytes.extend(header.bytes());
        bytes.extend([0; 24]);
        seeds.push(bytes);
    }
    let tried = fuzz("npy", numbers(20_000), &seeds, |index, bytes| {
        let result = decode(bytes).map(|input| input.picture);
        if index % 64 == 0 {
            std::fs::write(&path, bytes).expect("it can be written");
            let read = read(&path);
            assert_eq!(read.is_ok(), result.is_ok());
        }
        match result {
            Ok(picture) => {
                let Picture {
                    width,
                    height,
                    pixels,
                } = &picture;
                assert_eq!(pixels.len() as u64, u64::from(*width) * u64::from(*height));
                assert!(2 * pixels.len() < bytes.len());
                true
            }
            Err(error) => {
                let text = error.to_string();
                assert!(!text.is_empty() && text.len() < 1000, "{text}");
                assert!(!text.contains(char::is_control), "{text:?}");
                false
            }
        }
    });
    assert!(tried.accepted > 0 && tried.refused > 0, "{tried:?}");
}

/// Small files of every kind, as other programs write them.
fn image_files() -> Vec<Vec<u8>> {
    let picture = Picture::new(5, 3, vec![[0.5, 0.25, 2.0]; 15]);
    let metadata = Metadata::new().with("scene", "a").with("scene_hash", "0");
    let values = [0.5; 45];
    let stderr = [Layer {
        name: "stderr",
        channels: &["R", "G", "B"],
        values: &values,
    }];
    let mut files = vec![
        npy::encode(&picture),
        png::encode(&picture, 0.0, &metadata).expect("a PNG file"),
        exr::encode(&picture, &stderr, &metadata).expect("an EXR file"),
    ];
    for compression in [
        Compression::Uncompressed,
        Compression::RLE,
        Compression::PIZ,
        Compression::PXR24,
        Compression::B44,
        Compression::B44A,
        Compression::ZIP1,
        Compression::DWAA(None),
    ] {
        for blocks in [Blocks::ScanLines, Blocks::Tiles(Vec2(2, 2))] {
            let channel = |name| AnyChannel::new(name, FlatSamples::F16(vec![f16::ONE; 15]));
            let layer = ::exr::prelude::Layer::new(
                Vec2(5, 3),
                LayerAttributes::named("a"),
                Encoding {
                    compression,
                    blocks,
                    line_order: LineOrder::Increasing,
                },
                AnyChannels::sort(["R", "G", "B"].map(channel).into_iter().collect()),
            );
            let mut bytes = Cursor::new(Vec::new());
            let image = Image::from_layer(layer);
            image.write().to_buffered(&mut bytes).expect("an EXR file");
            files.push(bytes.into_inner());
        }
    }
    files
}

#[test]
fn no_bytes_upset_the_image_readers() {
    let seeds = image_files();
    assert!(seeds.iter().all(|bytes| decode(bytes).is_ok()));
    let tried = fuzz("images", numbers(20_000), &seeds, |_, bytes| {
        match decode(bytes) {
            Ok(input) => {
                let size = input.picture.width as usize * input.picture.height as usize;
                assert_eq!(input.picture.pixels.len(), size);
                true
            }
            Err(error) => {
                let text = error.to_string();
                assert!(!text.is_empty() && text.len() < 2000, "{text}");
                assert!(!text.contains(char::is_control), "{text:?}");
                false
            }
        }
    });
    assert!(tried.accepted > 0 && tried.refused > 0, "{tried:?}");
}

/// Files that a scene may name as images.
fn texel_files() -> Vec<Vec<u8>> {
    let data: Vec<u8> = (0..3 * 17 * 9).map(|i| (i * 5) as u8).collect();
    let jpeg = |color: image::ExtendedColorType, channels: usize| {
        let mut bytes = Vec::new();
        image::codecs::jpeg::JpegEncoder::new(&mut bytes)
            .encode(&data[..channels * 17 * 9], 17, 9, color)
            .expect("a JPEG file");
        bytes
    };
    let mut files = image_files();
    files.push(jpeg(image::ExtendedColorType::Rgb8, 3));
    files.push(jpeg(image::ExtendedColorType::L8, 1));
    files
}

#[test]
fn no_bytes_upset_the_readers_of_texels() {
    let seeds = texel_files();
    let tried = fuzz(
        "texels",
        numbers(20_000),
        &seeds,
        |index, bytes| match texels(bytes, index % 2 == 0, 1 << 20) {
            Ok(image) => {
                let size = image.width as usize * image.height as usize;
                assert_eq!(image.pixels.len(), size);
                true
            }
            Err(error) => {
                let text = error.to_string();
                assert!(!text.is_empty() && text.len() < 2000, "{text}");
                assert!(!text.contains(char::is_control), "{text:?}");
                false
            }
        },
    );
    assert!(tried.accepted > 0 && tried.refused > 0, "{tried:?}");
}

//! Images of any origin are read as the linear values that they mean, and damaged ones refused.

mod exr;
mod npy;
mod png;

use gpu_trace::image::Picture;
use gpu_trace::input::{Input, decode};
use gpu_trace::output::{Metadata, png as own_png};

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

//! The files that a render leaves behind, through the public interface. No test relies on file
//! permissions to make a write fail: tests may run as root, whom they do not stop.

mod formats;
mod records;
mod targets;

use std::fs;
use std::path::Path;

use gpu_trace::error::Error;
use gpu_trace::image::Picture;
use gpu_trace::output::{Contents, Metadata};

/// Values whose bits are easily lost: negative zero, subnormals, extremes, NaNs with a payload.
const DELICATE: [f32; 12] = [
    0.0,
    -0.0,
    1e-45,
    -1.1754942e-38,
    f32::MIN_POSITIVE,
    f32::MAX,
    f32::MIN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::from_bits(0x7fc1_2345),
    1.0 / 3.0,
    16_777_217.0,
];

/// A picture of an odd size, higher than a block of EXR lines, that starts with the values above.
fn picture() -> Picture {
    let (width, height) = (7_u32, 19_u32);
    let mut values: Vec<f32> = (0..width * height * 3)
        .map(|i| (i as f32).sin() * 1e3)
        .collect();
    values[..DELICATE.len()].copy_from_slice(&DELICATE);
    Picture::new(width, height, values.as_chunks().0.to_vec())
}

fn bits(pixels: &[[f32; 3]]) -> Vec<u32> {
    pixels
        .as_flattened()
        .iter()
        .map(|value| value.to_bits())
        .collect()
}

fn contents<'a>(picture: &'a Picture, metadata: &'a Metadata) -> Contents<'a> {
    Contents {
        picture,
        layers: &[],
        metadata,
        exposure: 0.0,
    }
}

fn file_names(directory: &Path) -> Vec<String> {
    let entries = fs::read_dir(directory).expect("the directory can be listed");
    let mut names: Vec<String> = entries
        .map(|entry| {
            entry
                .expect("an entry")
                .file_name()
                .to_string_lossy()
                .into_owned()
        })
        .collect();
    names.sort();
    names
}

/// The text of a usage error, and that it is one.
fn usage<T: std::fmt::Debug>(result: Result<T, Error>) -> String {
    let error = result.expect_err("this should be refused");
    assert!(matches!(error, Error::Usage(_)), "{error:?}");
    assert_eq!(error.exit_code(), 2);
    error.to_string()
}

//! NPY of any origin: floats of 2, 4 or 8 bytes, either byte order, C or Fortran order, with shape
//! (height, width), (height, width, 1), (height, width, 3) or (height, width, 4).

use std::cmp::Ordering;
use std::io;

use exr::prelude::f16;

use super::{Encoding, Input};
use crate::error::{invalid, shown};
use crate::image::{Format, Picture};
use crate::numpy::Header;

/// Reads the array as linear values; NumPy has no way to say anything else. A fourth channel is left
/// out, which is noted unless it is 1 everywhere.
pub(super) fn decode(bytes: &[u8]) -> io::Result<Input> {
    let mut bytes = &bytes[Format::Npy.magic().len()..];
    let header = Header::read(&mut bytes)?;
    let (value_bytes, value) = kind(&header)?;
    let (height, width, channels) = match header.sizes()[..] {
        [height, width] => (height, width, 1),
        [height, width, channels @ (1 | 3 | 4)] => (height, width, channels as usize),
        _ => return Err(shape(&header)),
    };
    if width == 0 || height == 0 {
        return Err(shape(&header));
    }
    check_data(bytes, width, height, (channels * value_bytes) as u64)?;
    let pixels = width as usize * height as usize;
    // Where the value of a pixel and a channel stands.
    let at = |pixel: usize, channel: usize| match header.fortran_order {
        false => pixel * channels + channel,
        true => {
            let (row, column) = (pixel / width as usize, pixel % width as usize);
            row + height as usize * (column + width as usize * channel)
        }
    };
    let get = |pixel, channel| {
        let start = at(pixel, channel) * value_bytes;
        value(&bytes[start..start + value_bytes])
    };
    let colour = |pixel| match channels {
        1 => [get(pixel, 0); 3],
        _ => [0, 1, 2].map(|channel| get(pixel, channel)),
    };
    let picture = Picture::new(width, height, (0..pixels).map(colour).collect());
    let mut input = Input::new(Format::Npy, Encoding::Linear, picture);
    if channels == 4 && (0..pixels).any(|pixel| get(pixel, 3) != 1.0) {
        input
            .notes
            .push("its fourth channel is not 1 everywhere, and is left out".into());
    }
    if value_bytes == 8 {
        input.notes.push("its values are rounded to f32".into());
    }
    Ok(input)
}

/// Reads one value.
type Value = fn(&[u8]) -> f32;

/// The bytes of a value and how to read it.
fn kind(header: &Header) -> io::Result<(usize, Value)> {
    // The slices have the right length: a value that is none would be seen at once.
    let kinds: [(&str, usize, Value); 6] = [
        ("<f2", 2, |b| {
            b.try_into()
                .map_or(f32::NAN, |b| f16::from_le_bytes(b).to_f32())
        }),
        (">f2", 2, |b| {
            b.try_into()
                .map_or(f32::NAN, |b| f16::from_be_bytes(b).to_f32())
        }),
        ("<f4", 4, |b| {
            b.try_into().map_or(f32::NAN, f32::from_le_bytes)
        }),
        (">f4", 4, |b| {
            b.try_into().map_or(f32::NAN, f32::from_be_bytes)
        }),
        ("<f8", 8, |b| {
            b.try_into()
                .map_or(f32::NAN, |b| f64::from_le_bytes(b) as f32)
        }),
        (">f8", 8, |b| {
            b.try_into()
                .map_or(f32::NAN, |b| f64::from_be_bytes(b) as f32)
        }),
    ];
    let known = header
        .descr()
        .and_then(|descr| kinds.into_iter().find(|(name, ..)| *name == descr));
    known
        .map(|(_, bytes, value)| (bytes, value))
        .ok_or_else(|| {
            invalid(format!(
                "values of type {}; wanted floats of 2, 4 or 8 bytes, in linear units",
                shown(&header.descr)
            ))
        })
}

fn shape(header: &Header) -> io::Error {
    invalid(format!(
        "an array of shape {}; wanted (height, width) with 1, 3, 4 or no channels, none of them 0",
        shown(&header.shape)
    ))
}

/// Refuses fewer or more bytes than the array takes.
fn check_data(bytes: &[u8], width: u32, height: u32, pixel_bytes: u64) -> io::Result<()> {
    // Sizes whose product overflows saturate, which is more than any file holds.
    let wanted = (u64::from(width) * u64::from(height)).saturating_mul(pixel_bytes);
    let fault = match (bytes.len() as u64).cmp(&wanted) {
        Ordering::Equal => return Ok(()),
        Ordering::Less => "ends early",
        Ordering::Greater => "goes on",
    };
    Err(invalid(format!(
        "the data {fault}: {height} rows of {width} pixels take {wanted} bytes"
    )))
}

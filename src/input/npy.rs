//! NPY of any origin: floats of 2, 4 or 8 bytes, either byte order, C or Fortran order, with shape
//! (height, width), (height, width, 1), (height, width, 3) or (height, width, 4).

use std::cmp::Ordering;
use std::io::{self, Read};

use exr::prelude::f16;

use super::{Encoding, Input, invalid, shown};
use crate::image::{Format, Picture};

/// The longest header that is read. Ours take 128 bytes; one of a plain array never comes near
/// this, and a corrupt length must not decide how much memory is taken.
const LONGEST_HEADER: usize = 1 << 16;

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

/// What the header says of the array; whether that is acceptable is the caller's question.
pub(crate) struct Header {
    /// The literal of the type, as in `'<f4'`, quotes and all.
    descr: String,
    /// Whether the first index runs fastest.
    pub(crate) fortran_order: bool,
    /// The literal of the shape, as in `(480, 640, 3)`.
    shape: String,
}

impl Header {
    /// Reads what stands between the first bytes and the data.
    pub(crate) fn read(source: &mut impl Read) -> io::Result<Self> {
        let length = match read_array(source)? {
            [1, _] => usize::from(u16::from_le_bytes(read_array(source)?)),
            // Later versions only lift limits that arrays of numbers do not meet.
            [2 | 3, _] => u32::from_le_bytes(read_array(source)?) as usize,
            [major, minor] => {
                return Err(invalid(format!(
                    "version {major}.{minor} of NPY is not known"
                )));
            }
        };
        if length > LONGEST_HEADER {
            return Err(invalid(format!("a header of {length} bytes is too long")));
        }
        let mut header = vec![0; length];
        source.read_exact(&mut header).map_err(ended_early)?;
        let header = std::str::from_utf8(&header).map_err(|_| invalid("the header is no text"))?;
        Self::parse(header)
    }

    /// Reads the literal of a Python dictionary with the keys `descr`, `fortran_order` and `shape`
    /// in any order.
    fn parse(header: &str) -> io::Result<Self> {
        let mut descr = None;
        let mut fortran_order = None;
        let mut shape = None;
        let body = header
            .trim()
            .strip_prefix('{')
            .and_then(|rest| rest.strip_suffix('}'));
        let mut rest = body.ok_or_else(|| malformed(header))?.trim();
        while !rest.is_empty() {
            let (key, after) = quoted(rest).ok_or_else(|| malformed(header))?;
            let after = after
                .trim_start()
                .strip_prefix(':')
                .ok_or_else(|| malformed(header))?;
            let after = after.trim_start();
            let value;
            (value, rest) = after.split_at(value_length(after));
            let known = match key {
                "descr" => &mut descr,
                "fortran_order" => &mut fortran_order,
                "shape" => &mut shape,
                _ => return Err(malformed(header)),
            };
            if known.replace(value.trim()).is_some() {
                return Err(malformed(header));
            }
            rest = rest.strip_prefix(',').unwrap_or(rest).trim_start();
        }
        let (Some(descr), Some(fortran_order), Some(shape)) = (descr, fortran_order, shape) else {
            return Err(malformed(header));
        };

        let fortran_order = match fortran_order {
            "False" => false,
            "True" => true,
            _ => return Err(malformed(header)),
        };
        Ok(Self {
            descr: descr.to_owned(),
            fortran_order,
            shape: shape.to_owned(),
        })
    }

    /// The type's name if it is a plain one, as in `<f4`.
    pub(crate) fn descr(&self) -> Option<&str> {
        quoted(&self.descr)
            .filter(|(_, rest)| rest.is_empty())
            .map(|(name, _)| name)
    }

    /// The array's sizes; empty if the shape is no tuple of them.
    pub(crate) fn sizes(&self) -> Vec<u32> {
        let inner = self
            .shape
            .strip_prefix('(')
            .and_then(|rest| rest.strip_suffix(')'))
            .unwrap_or_default()
            .trim();
        let inner = inner.strip_suffix(',').unwrap_or(inner);
        let sizes: Option<Vec<u32>> = inner
            .split(',')
            .map(|size| size.trim().parse().ok())
            .collect();
        sizes.unwrap_or_default()
    }
}

/// The content of the quotes that `text` starts with, and what follows them.
fn quoted(text: &str) -> Option<(&str, &str)> {
    let quote = text
        .chars()
        .next()
        .filter(|first| matches!(first, '\'' | '"'))?;
    text[1..].split_once(quote)
}

/// The length of the value that `text` starts with: up to a comma outside brackets and quotes.
fn value_length(text: &str) -> usize {
    let mut depth = 0_i64;
    let mut quote = None;
    for (index, character) in text.char_indices() {
        match (quote, character) {
            (Some(open), _) if character == open => quote = None,
            (Some(_), _) => {}
            (None, '\'' | '"') => quote = Some(character),
            (None, '(' | '[' | '{') => depth += 1,
            (None, ')' | ']' | '}') => depth -= 1,
            (None, ',') if depth == 0 => return index,
            _ => {}
        }
    }
    text.len()
}

fn read_array<const N: usize>(source: &mut impl Read) -> io::Result<[u8; N]> {
    let mut bytes = [0; N];
    source.read_exact(&mut bytes).map_err(ended_early)?;
    Ok(bytes)
}

fn ended_early(error: io::Error) -> io::Error {
    match error.kind() {
        io::ErrorKind::UnexpectedEof => invalid("the file ends within its header"),
        _ => error,
    }
}

fn malformed(header: &str) -> io::Error {
    invalid(format!("the header is malformed: {}", shown(header)))
}

//! NPY, the array format of NumPy: linear 32-bit floats of shape (height, width, 3), to compute
//! with. The format is specified in NumPy's NEP 1.

use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::Path;

use super::Picture;
use crate::error::{Error, Result};

pub(crate) const MAGIC: &[u8; 6] = b"\x93NUMPY";

/// Headers are padded to a multiple of this, so that the data can be mapped into memory.
const ALIGNMENT: usize = 64;

/// The longest header that is read. Ours take 128 bytes; one of a plain array never comes near
/// this, and a corrupt length must not decide how much memory is taken.
const LONGEST_HEADER: usize = 1 << 16;

/// The bytes of an NPY file: version 1.0, `<f4`, C order, shape (height, width, 3), rows from the
/// top. All values are kept bit for bit, NaNs too.
#[must_use]
pub fn encode(picture: &Picture) -> Vec<u8> {
    let Picture {
        width,
        height,
        pixels,
    } = picture;
    let mut header =
        format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({height}, {width}, 3), }}");
    // Magic, two bytes of version, two of length; then the header, which ends with a line feed.
    let preamble = MAGIC.len() + 4;
    let total = (preamble + header.len() + 1).next_multiple_of(ALIGNMENT);
    header.push_str(&" ".repeat(total - preamble - header.len() - 1));
    header.push('\n');

    let mut bytes = Vec::with_capacity(total + 12 * pixels.len());
    bytes.extend_from_slice(MAGIC);
    bytes.extend_from_slice(&[1, 0]);
    // At most two ten-digit numbers beside fixed text: far below the two bytes' range.
    bytes.extend_from_slice(&((total - preamble) as u16).to_le_bytes());
    bytes.extend_from_slice(header.as_bytes());
    bytes.extend(
        pixels
            .as_flattened()
            .iter()
            .flat_map(|value| value.to_le_bytes()),
    );
    bytes
}

/// Reads a file that [`encode`] or NumPy wrote: `<f4` or `<f8` (rounded to f32), C order, shape
/// (height, width, 3).
///
/// # Errors
/// [`Error::File`] if the file cannot be read, is corrupt, or holds an array of another kind.
pub fn read_npy(path: &Path) -> Result<Picture> {
    File::open(path)
        .and_then(|file| decode(BufReader::new(file)))
        .map_err(|source| Error::File {
            action: "cannot read",
            path: path.to_path_buf(),
            source,
        })
}

/// As [`read_npy`], from any source. Takes no more memory than the source has bytes, whatever its
/// header claims.
///
/// # Errors
/// What the source reports, or [`io::ErrorKind::InvalidData`] with what is wrong.
pub fn decode(mut source: impl Read) -> io::Result<Picture> {
    let header = Header::read(&mut source)?;
    let value_bytes = match header.descr() {
        Some("<f4") => 4,
        Some("<f8") => 8,
        _ => {
            return Err(invalid(format!(
                "values of type {}; wanted '<f4' or '<f8'",
                shown(&header.descr)
            )));
        }
    };
    if header.fortran_order {
        return Err(invalid(
            "the array is in Fortran order; save numpy.ascontiguousarray(array)",
        ));
    }
    let (width, height) = match header.sizes()[..] {
        [height, width, 3] if height > 0 && width > 0 => (width, height),
        _ => {
            return Err(invalid(format!(
                "an array of shape {}; wanted (height, width, 3), none of them 0",
                shown(&header.shape)
            )));
        }
    };
    let data = read_data(source, width, height, 3 * value_bytes)?;
    let values: Vec<f32> = match value_bytes {
        4 => data
            .as_chunks()
            .0
            .iter()
            .map(|&bytes| f32::from_le_bytes(bytes))
            .collect(),
        _ => data
            .as_chunks()
            .0
            .iter()
            .map(|&bytes| f64::from_le_bytes(bytes) as f32)
            .collect(),
    };
    Ok(Picture::new(width, height, values.as_chunks().0.to_vec()))
}

/// The bytes after the header, which are those of the array and no more. Takes no more memory than
/// the source has bytes.
///
/// # Errors
/// What the source reports, or [`io::ErrorKind::InvalidData`] if there are fewer or more.
pub(crate) fn read_data(
    source: impl Read,
    width: u32,
    height: u32,
    pixel_bytes: u64,
) -> io::Result<Vec<u8>> {
    // Sizes whose product overflows saturate, which is more than any source holds.
    let data_bytes = (u64::from(width) * u64::from(height)).saturating_mul(pixel_bytes);
    let mut data = Vec::new();
    // One byte more than expected, to see whether the file goes on. The vector grows with what is
    // there.
    source
        .take(data_bytes.saturating_add(1))
        .read_to_end(&mut data)?;
    if data.len() as u64 == data_bytes {
        return Ok(data);
    }
    let fault = if (data.len() as u64) < data_bytes {
        "ends early"
    } else {
        "goes on"
    };
    Err(invalid(format!(
        "the data {fault}: {height} rows of {width} pixels take {data_bytes} bytes"
    )))
}

/// What the header says of the array; whether that is acceptable is the caller's question.
pub(crate) struct Header {
    /// The literal of the type, as in `'<f4'`, quotes and all.
    pub(crate) descr: String,
    /// Whether the first index runs fastest.
    pub(crate) fortran_order: bool,
    /// The literal of the shape, as in `(480, 640, 3)`.
    pub(crate) shape: String,
}

impl Header {
    /// Reads up to the data.
    ///
    /// # Errors
    /// What the source reports, or [`io::ErrorKind::InvalidData`] if this is no header of an array.
    pub(crate) fn read(source: &mut impl Read) -> io::Result<Self> {
        let magic: [u8; 6] = read_array(source)?;
        if magic != *MAGIC {
            return Err(invalid("this is not an NPY file"));
        }
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

/// A part of the header as a message may show it: what is corrupt can be long and hold control
/// characters.
pub(crate) fn shown(text: &str) -> String {
    let visible = |c: char| match c {
        '\'' | '"' => vec![c],
        _ => c.escape_debug().collect(),
    };
    text.trim().chars().take(80).flat_map(visible).collect()
}

pub(crate) fn invalid(text: impl Into<String>) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, text.into())
}

//! The header of NPY files, for images and particles alike.
//!
//! Source: <https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html>.

use std::io::{self, Read};

use crate::error::{invalid, shown};

/// The longest header that is read. Ours take 128 bytes; one of a plain array never comes near
/// this, and a corrupt length must not decide how much memory is taken.
const LONGEST_HEADER: usize = 1 << 16;

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

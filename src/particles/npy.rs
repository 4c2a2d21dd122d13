//! NPY: an array of shape (n, 3), that is x, y and z, or (n, 4), with a radius behind; floats or integers of 4 or
//! 8 bytes, either byte order, C or Fortran order.
//!
//! Source: <https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html>.

use super::Particles;
use super::mistake::{Mistake, word as shown};
use super::table::{Kind, Table};
use crate::numpy::Header;

const MAGIC: &[u8] = b"\x93NUMPY";
/// The columns, of which the last may be missing.
const COLUMNS: [(&str, Kind); 4] = [
    ("x", Kind::Coordinate),
    ("y", Kind::Coordinate),
    ("z", Kind::Coordinate),
    ("radius", Kind::Number),
];

/// Reads one value from its bytes; they have the right number.
type Value = fn(&[u8]) -> f64;

/// The types of values: their bytes and how to read them.
const VALUES: [(&str, usize, Value); 8] = [
    ("<f4", 4, |b| {
        b.try_into()
            .map_or(f64::NAN, |b| f32::from_le_bytes(b).into())
    }),
    (">f4", 4, |b| {
        b.try_into()
            .map_or(f64::NAN, |b| f32::from_be_bytes(b).into())
    }),
    ("<f8", 8, |b| {
        b.try_into().map_or(f64::NAN, f64::from_le_bytes)
    }),
    (">f8", 8, |b| {
        b.try_into().map_or(f64::NAN, f64::from_be_bytes)
    }),
    ("<i4", 4, |b| {
        b.try_into()
            .map_or(f64::NAN, |b| i32::from_le_bytes(b).into())
    }),
    (">i4", 4, |b| {
        b.try_into()
            .map_or(f64::NAN, |b| i32::from_be_bytes(b).into())
    }),
    ("<i8", 8, |b| {
        b.try_into()
            .map_or(f64::NAN, |b| i64::from_le_bytes(b) as f64)
    }),
    (">i8", 8, |b| {
        b.try_into()
            .map_or(f64::NAN, |b| i64::from_be_bytes(b) as f64)
    }),
];

pub(super) fn parse(bytes: &[u8]) -> Result<Particles, Mistake> {
    let mut data = bytes.strip_prefix(MAGIC).ok_or_else(|| {
        Mistake::at_byte(
            0,
            "an NPY file begins with the byte 147 and `NUMPY`; this does not",
        )
    })?;
    let header = Header::read(&mut data)
        .map_err(|error| Mistake::at_byte(MAGIC.len(), error.to_string()))?;
    let at_header = |message: String| Mistake::at_byte(MAGIC.len(), message);
    let (_, size, value) = header
        .descr()
        .and_then(|descr| VALUES.into_iter().find(|(name, ..)| *name == descr))
        .ok_or_else(|| {
            at_header(format!(
                "values of type {}; wanted floats or integers of 4 or 8 bytes",
                shown(header.descr.as_bytes())
            ))
        })?;
    let [rows, width @ (3 | 4)] = header.sizes()[..] else {
        return Err(at_header(format!(
            "an array of shape {}; wanted (n, 3), positions, or (n, 4), positions and radii",
            shown(header.shape.as_bytes())
        )));
    };
    let (rows, width) = (rows as usize, width as usize);
    let wanted = (rows as u64).saturating_mul((width * size) as u64);
    if data.len() as u64 != wanted {
        return Err(Mistake::at_byte(
            bytes.len(),
            format!(
                "the data end here and have {} bytes; {rows} rows of {width} values take {wanted}",
                data.len()
            ),
        ));
    }
    let columns = COLUMNS[..width].iter();
    let columns = columns.map(|(name, kind)| ((*name).to_owned(), *kind));
    let mut table = Table::new(columns.collect()).map_err(at_header)?;
    let start = bytes.len() - data.len();
    let strides = match header.fortran_order {
        false => (width, 1),
        true => (1, rows),
    };
    for row in 0..rows {
        for column in 0..width {
            let at = (row * strides.0 + column * strides.1) * size;
            table
                .push_number(column, value(&data[at..at + size]))
                .map_err(|fault| {
                    Mistake::at_byte(
                        start + at,
                        format!("{fault}, in row {row} (0 is the first)"),
                    )
                })?;
        }
    }
    Ok(table.finish(false))
}

#[cfg(test)]
pub(super) mod tests;

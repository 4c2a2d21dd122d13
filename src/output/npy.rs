//! NPY, the array format of NumPy: linear 32-bit floats of shape (height, width, 3), to compute
//! with. The format is specified in NumPy's NEP 1.

use crate::image::{Format, Picture};

/// Headers are padded to a multiple of this, so that the data can be mapped into memory.
const ALIGNMENT: usize = 64;

/// The bytes of an NPY file: version 1.0, `<f4`, C order, shape (height, width, 3), rows from the
/// top. All values are kept bit for bit, NaNs too.
#[must_use]
pub fn encode(picture: &Picture) -> Vec<u8> {
    let Picture {
        width,
        height,
        pixels,
    } = picture;
    let mut bytes = header("<f4", &[height, width, &3]);
    bytes.reserve_exact(12 * pixels.len());
    bytes.extend(
        pixels
            .as_flattened()
            .iter()
            .flat_map(|value| value.to_le_bytes()),
    );
    bytes
}

/// What stands before the data of an array: version 1.0, C order.
pub(crate) fn header<N: std::fmt::Display>(descr: &str, shape: &[N]) -> Vec<u8> {
    let shape: String = shape.iter().map(|size| format!("{size}, ")).collect();
    let shape = shape.trim_end_matches(' ').trim_end_matches(',');
    let mut header =
        format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ({shape}), }}");
    let magic = Format::Npy.magic();
    // Magic, two bytes of version, two of length; then the header, which ends with a line feed.
    let preamble = magic.len() + 4;
    let total = (preamble + header.len() + 1).next_multiple_of(ALIGNMENT);
    header.push_str(&" ".repeat(total - preamble - header.len() - 1));
    header.push('\n');

    let mut bytes = Vec::with_capacity(total);
    bytes.extend_from_slice(magic);
    bytes.extend_from_slice(&[1, 0]);
    // A few ten-digit numbers beside fixed text: far below the two bytes' range.
    bytes.extend_from_slice(&((total - preamble) as u16).to_le_bytes());
    bytes.extend_from_slice(header.as_bytes());
    bytes
}

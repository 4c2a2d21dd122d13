//! JPEG, baseline or progressive, in grey or colour.

use std::io;

use zune_jpeg::JpegDecoder;
use zune_jpeg::errors::DecodeErrors;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use super::check_size;
use crate::error::{invalid, shown};
use crate::image::{Picture, linear};

/// The first bytes of every such file.
pub(super) const MAGIC: &[u8] = b"\xff\xd8\xff";
/// Bytes that a pixel takes while it is decoded.
const PIXEL: u64 = 24;
/// What it packs by, at most: a block of 64 pixels takes a bit.
const RATIO: u64 = PIXEL * 64 * 8;

/// Reads the image, of at most `most` pixels; values are sRGB unless they are `linear_` already.
pub(super) fn texels(bytes: &[u8], linear_: bool, most: u64) -> io::Result<Picture> {
    // Strict: what is missing is not made up.
    let options = DecoderOptions::default()
        .set_strict_mode(true)
        .set_max_width(usize::from(u16::MAX))
        .set_max_height(usize::from(u16::MAX))
        .jpeg_set_out_colorspace(ColorSpace::RGB);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    decoder.decode_headers().map_err(corrupt)?;
    let (width, height) = decoder
        .dimensions()
        .ok_or_else(|| invalid("it has no size"))?;
    let size = [width as u64, height as u64];
    check_size(size[0], size[1], PIXEL, RATIO, bytes.len(), most)?;
    let data = decoder.decode().map_err(corrupt)?;
    if data.len() != 3 * width * height || data.is_empty() {
        return Err(invalid("its pixels are not whole"));
    }
    let value = |byte: u8| match linear_ {
        true => f64::from(byte) / 255.0,
        false => linear(f64::from(byte) / 255.0),
    };
    let pixels = data.chunks_exact(3);
    let pixels = pixels.map(|p| [p[0], p[1], p[2]].map(|byte| value(byte) as f32));
    Ok(Picture::new(width as u32, height as u32, pixels.collect()))
}

fn corrupt(error: DecodeErrors) -> io::Error {
    invalid(shown(&error.to_string()))
}

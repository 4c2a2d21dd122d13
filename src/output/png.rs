//! PNG: 8-bit sRGB, to look at.
//!
//! This is the only place where values are clipped: below 0 to black, above 1 to full. A pixel with
//! a NaN or an infinity in any channel is magenta (255, 0, 255), so that it is seen rather than
//! taken for black or white.

use std::io;

use png::{BitDepth, ColorType, Encoder, EncodingError, SrgbRenderingIntent};

use super::Metadata;
use crate::image::{Picture, srgb};

/// The colour of pixels that hold no number.
const NON_FINITE: [u8; 3] = [255, 0, 255];

/// The bytes of a PNG file. Linear values are multiplied by `2^exposure`, clipped to `0..=1`, taken
/// through the transfer function of sRGB and rounded to the nearest of 256 levels. The file is
/// marked as sRGB and holds the metadata as the texts `Software` and `Comment`.
///
/// # Errors
/// If the size is beyond what PNG can hold.
pub fn encode(picture: &Picture, exposure: f64, metadata: &Metadata) -> io::Result<Vec<u8>> {
    let gain = exposure.exp2();
    let levels: Vec<[u8; 3]> = picture
        .pixels
        .iter()
        .map(|&pixel| quantise(pixel, gain))
        .collect();
    write(picture, levels.as_flattened(), metadata).map_err(|error| match error {
        EncodingError::IoError(error) => error,
        other => io::Error::other(other),
    })
}

/// The 256 levels of one pixel of linear values, after a multiplication by `gain`.
#[must_use]
pub fn quantise(pixel: [f32; 3], gain: f64) -> [u8; 3] {
    if !pixel.iter().all(|value| value.is_finite()) {
        return NON_FINITE;
    }
    // The conversion to u8 saturates, which clips what is above 1.
    pixel.map(|value| (255.0 * srgb(f64::from(value) * gain)).round() as u8)
}

fn write(picture: &Picture, levels: &[u8], metadata: &Metadata) -> Result<Vec<u8>, EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, picture.width, picture.height);
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_source_srgb(SrgbRenderingIntent::RelativeColorimetric);
    encoder.add_text_chunk("Software".into(), Metadata::SOFTWARE.into())?;
    let comment = metadata.to_string();
    if comment.is_ascii() {
        encoder.add_text_chunk("Comment".into(), comment)?;
    } else {
        // Only the international form is UTF-8.
        encoder.add_itxt_chunk("Comment".into(), comment)?;
    }
    let mut writer = encoder.write_header()?;
    writer.write_image_data(levels)?;
    writer.finish()?;
    Ok(bytes)
}

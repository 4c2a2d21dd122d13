//! PNG of any origin: grey, colour or palette, of up to 16 bits, decoded to linear values by what
//! the file says of its encoding, in the order of the PNG specification (third edition, section
//! 4.3): `cICP`, `iCCP`, `sRGB`, `gAMA`; sRGB if it says nothing.

use std::collections::BTreeMap;
use std::io::{self, Cursor};

use png::{BitDepth, ColorType, Decoder, DecodingError, Info, Limits, Transformations};

use super::{Encoding, Input, check_size};
use crate::error::{invalid, shown};
use crate::image::{Format, Picture, linear};

/// Deflate packs by at most this.
const RATIO: u64 = 1032;
/// Memory for everything but the pixels, in bytes.
const CHUNK_BYTES: usize = 16 << 20;

/// Reads the image (the first, if it is animated). Colours that are not opaque are multiplied by
/// their alpha, as over black, which is noted.
pub(super) fn decode(bytes: &[u8]) -> io::Result<Input> {
    let raster = Raster::read(bytes, u64::MAX)?;
    let mut notes = Vec::new();
    let encoding = encoding(&raster.info, &mut notes)?;
    let colour = |pixel: usize| {
        let opacity = raster.opacity(pixel);
        let colour = raster.colour(pixel);
        colour.map(|value| (encoding.decode(value) * opacity) as f32)
    };
    if (0..raster.count()).any(|pixel| raster.opacity(pixel) < 1.0) {
        notes.push("it is not opaque everywhere: taken as over black".into());
    }
    let mut input = Input::new(Format::Png, encoding, raster.picture(colour));
    input.about = about(&raster.info);
    input.notes = notes;
    Ok(input)
}

/// Reads the colours alone, of at most `most` pixels: as sRGB, or `linear` ones.
pub(super) fn texels(bytes: &[u8], linear: bool, most: u64) -> io::Result<Picture> {
    let raster = Raster::read(bytes, most)?;
    let encoding = match linear {
        true => Encoding::Linear,
        false => Encoding::Srgb,
    };
    let colour = |pixel: usize| {
        raster
            .colour(pixel)
            .map(|value| encoding.decode(value) as f32)
    };
    Ok(raster.picture(colour))
}

/// The pixels of a file, as it holds them.
struct Raster {
    width: u32,
    height: u32,
    channels: usize,
    alpha: bool,
    wide: bool,
    data: Vec<u8>,
    info: Info<'static>,
}

impl Raster {
    fn read(bytes: &[u8], most: u64) -> io::Result<Self> {
        let mut decoder =
            Decoder::new_with_limits(Cursor::new(bytes), Limits { bytes: CHUNK_BYTES });
        decoder.set_transformations(Transformations::EXPAND);
        let header = decoder.read_header_info().map_err(corrupt)?;
        // Expanded to at most four channels of 16 bits, and as much again for the filter's lines.
        let (width, height) = (header.width.into(), header.height.into());
        check_size(width, height, 8, 8 * RATIO, bytes.len(), most)?;
        let mut reader = decoder.read_info().map_err(corrupt)?;
        let size = reader
            .output_buffer_size()
            .ok_or_else(|| invalid("the image is too large for memory"))?;
        let mut data = vec![0; size];
        let frame = reader.next_frame(&mut data).map_err(corrupt)?;
        // Reads to the end: texts may stand behind the pixels, and what is cut off shows here.
        reader.finish().map_err(corrupt)?;
        let (channels, alpha) = match frame.color_type {
            ColorType::Grayscale => (1, false),
            ColorType::GrayscaleAlpha => (2, true),
            ColorType::Rgb => (3, false),
            ColorType::Rgba => (4, true),
            ColorType::Indexed => return Err(invalid("its palette is missing")),
        };
        Ok(Self {
            width: frame.width,
            height: frame.height,
            channels,
            alpha,
            wide: frame.bit_depth == BitDepth::Sixteen,
            data,
            info: reader.info().clone(),
        })
    }

    fn count(&self) -> usize {
        self.width as usize * self.height as usize
    }

    fn value(&self, index: usize) -> f64 {
        let data = &self.data;
        match self.wide {
            true => f64::from(u16::from_be_bytes([data[2 * index], data[2 * index + 1]])) / 65535.0,
            false => f64::from(data[index]) / 255.0,
        }
    }

    fn opacity(&self, pixel: usize) -> f64 {
        match self.alpha {
            true => self.value(pixel * self.channels + self.channels - 1),
            false => 1.0,
        }
    }

    fn colour(&self, pixel: usize) -> [f64; 3] {
        let first = pixel * self.channels;
        let grey = self.channels < 3;
        [0, 1, 2].map(|channel| self.value(if grey { first } else { first + channel }))
    }

    fn picture(&self, colour: impl Fn(usize) -> [f32; 3]) -> Picture {
        let pixels = (0..self.count()).map(colour);
        Picture::new(self.width, self.height, pixels.collect())
    }
}

impl Encoding {
    /// The linear value of one that a file holds.
    #[must_use]
    pub fn decode(self, value: f64) -> f64 {
        match self {
            Self::Linear => value,
            Self::Srgb => linear(value),
            Self::Power(exponent) => value.powf(exponent),
        }
    }
}

fn encoding(info: &Info<'_>, notes: &mut Vec<String>) -> io::Result<Encoding> {
    if let Some(points) = info.coding_independent_code_points {
        // ITU-T H.273, tables 2 and 3.
        if points.color_primaries != 1 {
            notes.push("its primaries are not those of sRGB: compared channel by channel".into());
        }
        return match points.transfer_function {
            8 => Ok(Encoding::Linear),
            13 => Ok(Encoding::Srgb),
            other => Err(invalid(format!(
                "its cICP chunk names the transfer function {other} of ITU-T H.273; only 8 (linear) \
                 and 13 (sRGB) are known"
            ))),
        };
    }
    if info.icc_profile.is_some() {
        notes.push("its colour profile is not applied: taken as sRGB".into());
        return Ok(Encoding::Srgb);
    }
    if info.srgb.is_some() {
        return Ok(Encoding::Srgb);
    }
    if info.chrm_chunk.is_some_and(|c| {
        let (x, y) = (c.red.0.into_value(), c.red.1.into_value());
        (x - 0.64).abs() > 0.005 || (y - 0.33).abs() > 0.005
    }) {
        notes.push("its primaries are not those of sRGB: compared channel by channel".into());
    }
    match info.gama_chunk.map(|gamma| f64::from(gamma.into_value())) {
        Some(1.0) => Ok(Encoding::Linear),
        Some(gamma) => Ok(Encoding::Power(gamma.recip())),
        None => {
            notes.push("it does not say how its values are encoded: taken as sRGB".into());
            Ok(Encoding::Srgb)
        }
    }
}

/// The lines `name: value` of the comment that this program writes.
fn about(info: &Info<'_>) -> BTreeMap<String, String> {
    let latin = info.uncompressed_latin1_text.iter();
    let mut texts: Vec<(&str, String)> = latin
        .map(|text| (text.keyword.as_str(), text.text.clone()))
        .collect();
    let utf8 = info.utf8_text.iter();
    texts.extend(utf8.filter_map(|text| Some((text.keyword.as_str(), text.get_text().ok()?))));
    let find = |key| texts.iter().find(|(name, _)| *name == key);
    if !find("Software").is_some_and(|(_, text)| text.starts_with("gpu-trace ")) {
        return BTreeMap::new();
    }
    let lines = find("Comment").map_or("", |(_, text)| text).lines();
    lines
        .filter_map(|line| line.split_once(": "))
        .map(|(name, value)| (name.to_owned(), value.to_owned()))
        .collect()
}

fn corrupt(error: DecodingError) -> io::Error {
    match error {
        DecodingError::IoError(error) if error.kind() != io::ErrorKind::UnexpectedEof => error,
        DecodingError::IoError(_) => invalid("the file ends early"),
        other => invalid(shown(&other.to_string())),
    }
}

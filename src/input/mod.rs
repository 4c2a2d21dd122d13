//! Images of any origin: EXR, NPY and PNG, told apart by their first bytes, as linear RGB; and EXR, PNG and JPEG as
//! what scenes look up.
//!
//! What a file cannot say, or says in a way that could be read as two things, is refused or noted;
//! nothing is guessed in silence.

mod exr;
mod jpeg;
mod npy;
mod png;

use std::collections::BTreeMap;
use std::fmt;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use crate::error::{Action, Error, Result, invalid};
use crate::image::{Format, Picture};

/// An image and what its file says about it.
#[derive(Clone, Debug, PartialEq)]
pub struct Input {
    /// As it was typed; empty if it came from no file.
    pub path: PathBuf,
    /// What kind of file it was.
    pub format: Format,
    /// How the file holds its values; `picture` is linear in any case.
    pub encoding: Encoding,
    /// The image. May hold values that are not finite.
    pub picture: Picture,
    /// The standard error of each value of the picture, from the layer `stderr` of an EXR file.
    pub stderr: Option<Picture>,
    /// What files of this program say about themselves: `scene`, `scene_hash`, `spp`, ...
    pub about: BTreeMap<String, String>,
    /// What the user should know of how the file was read.
    pub notes: Vec<String>,
}

/// How a file holds its values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Encoding {
    /// Proportional to radiance.
    Linear,
    /// The transfer function of sRGB.
    Srgb,
    /// A power: linear values are the file's to this exponent, as in 2.2.
    Power(f64),
}

impl fmt::Display for Encoding {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Linear => formatter.write_str("linear"),
            Self::Srgb => formatter.write_str("sRGB"),
            Self::Power(exponent) => write!(formatter, "gamma {exponent:.2}"),
        }
    }
}

impl Input {
    fn new(format: Format, encoding: Encoding, picture: Picture) -> Self {
        Self {
            path: PathBuf::new(),
            format,
            encoding,
            picture,
            stderr: None,
            about: BTreeMap::new(),
            notes: Vec::new(),
        }
    }
}

/// Reads an image file. Its first bytes say what it is, whatever its extension.
///
/// # Errors
/// [`Error::File`] if it cannot be read, is none of the three kinds, is corrupt, or holds something
/// that is no single image in RGB or grey.
pub fn read(path: &Path) -> Result<Input> {
    File::open(path)
        .and_then(read_all)
        .and_then(|bytes| decode(&bytes))
        .map(|input| Input {
            path: path.to_path_buf(),
            ..input
        })
        .map_err(|source| Error::File {
            action: Action::Read,
            path: path.to_path_buf(),
            source,
        })
}

/// All bytes, if the first few are those of an image: anything else may have no end.
fn read_all(mut file: File) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let longest = Format::ALL.map(|format| format.magic().len());
    let first = longest.into_iter().max().unwrap_or(0);
    (&mut file).take(first as u64).read_to_end(&mut bytes)?;
    kind(&bytes)?;
    file.read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// As [`read`], from the bytes of a file.
///
/// # Errors
/// [`io::ErrorKind::InvalidData`] with what is wrong.
pub fn decode(bytes: &[u8]) -> io::Result<Input> {
    match kind(bytes)? {
        Format::Png => png::decode(bytes),
        Format::Exr => exr::decode(bytes, u64::MAX),
        Format::Npy => npy::decode(bytes),
    }
}

/// The bytes of an EXR, PNG or JPEG file as texels, of which there may be `most`. EXR is linear; values of PNG and JPEG
/// are sRGB, or `linear` as well, whatever the file says of it. Alpha is left out.
///
/// # Errors
/// [`io::ErrorKind::InvalidData`] with what is wrong.
pub fn texels(bytes: &[u8], linear: bool, most: u64) -> io::Result<Picture> {
    if bytes.starts_with(Format::Exr.magic()) {
        exr::decode(bytes, most).map(|input| input.picture)
    } else if bytes.starts_with(Format::Png.magic()) {
        png::texels(bytes, linear, most)
    } else if bytes.starts_with(jpeg::MAGIC) {
        jpeg::texels(bytes, linear, most)
    } else {
        Err(invalid(
            "this is neither an EXR, nor a PNG, nor a JPEG file",
        ))
    }
}

fn kind(bytes: &[u8]) -> io::Result<Format> {
    Format::ALL
        .into_iter()
        .find(|format| bytes.starts_with(format.magic()))
        .ok_or_else(|| invalid("this is neither an EXR, nor a PNG, nor an NPY file"))
}

/// Memory that any file may ask for, in bytes of its pixels.
const PIXEL_BYTES: u64 = 16 << 20;

/// Refuses a size that `bytes` cannot hold, before memory is taken for it: `pixel_bytes` for each
/// pixel, packed by a factor of `ratio` at most; and one of more than `most_pixels`.
fn check_size(
    width: u64,
    height: u64,
    pixel_bytes: u64,
    ratio: u64,
    bytes: usize,
    most_pixels: u64,
) -> io::Result<()> {
    if width.saturating_mul(height) > most_pixels {
        return Err(invalid(format!(
            "it has {width}x{height} pixels, more than {most_pixels}, the limit"
        )));
    }
    let most = PIXEL_BYTES.max((bytes as u64).saturating_mul(ratio));
    let wanted = width.saturating_mul(height).saturating_mul(pixel_bytes);
    if wanted <= most && u32::try_from(width).is_ok() && u32::try_from(height).is_ok() {
        return Ok(());
    }
    Err(invalid(format!(
        "its header promises {width}x{height} pixels, more than its {bytes} bytes can hold"
    )))
}

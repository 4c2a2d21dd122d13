//! Images that a scene names: files of EXR, PNG or JPEG as linear RGB.

use std::path::Path;

use super::{MAX_SIDE, named};
use crate::image::Picture;
use crate::input;

/// The longest file that is read, in bytes.
const MOST_BYTES: u64 = 2 << 30;
/// The most texels of an image: 16384 x 8192.
const MOST_TEXELS: u64 = 1 << 27;

/// The texels of a file, finite and not negative. EXR is linear; PNG and JPEG are sRGB, or `linear` as well. Alpha
/// is left out.
///
/// # Errors
/// What is wrong with the file, which the text names.
pub(super) fn load(path: &Path, linear: bool) -> Result<Picture, String> {
    let shown = path.display().to_string();
    let shown = shown.escape_debug();
    let bytes = named::read(path, MOST_BYTES)?;
    let image = input::texels(&bytes, linear, MOST_TEXELS);
    let mut image = image.map_err(|error| format!("{shown}: {error}"))?;
    if image.width.max(image.height) > MAX_SIDE {
        return Err(format!(
            "{shown}: it has {} x {} texels; a side has at most {MAX_SIDE}",
            image.width, image.height
        ));
    }
    for (place, texel) in (0..).zip(&mut image.pixels) {
        if !texel.iter().all(|x| x.is_finite() && *x >= 0.0) {
            let (column, row) = (place % image.width, place / image.width);
            return Err(format!(
                "{shown}: its texel in column {column} of row {row} is {texel:?}; what is looked up is finite and \
                 not negative"
            ));
        }
        // Without negative zeros: the two zeros are equal and must hash alike.
        *texel = texel.map(|x| x + 0.0);
    }
    Ok(image)
}

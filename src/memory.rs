//! What a render takes of this program's memory: asked before it is taken, by every renderer that is made.

use crate::error::{Error, Result};
use crate::film::{self, AovSums, PixelSums};
use crate::numbers::significant;
use crate::settings::{Rect, Settings};

/// Bytes of a pixel of a window, as renderers hand it over.
pub(crate) fn window_bytes(settings: &Settings) -> usize {
    size_of::<PixelSums>() + aov_bytes(settings)
}

/// Bytes that a pixel takes in a render, at most: in the film, and in a window with the `own` ones of what renders, or
/// in the files.
#[must_use]
pub fn render_pixel_bytes(settings: &Settings, own: usize) -> usize {
    // The pilot has a film of its own.
    let films = if settings.adaptive { 2 } else { 1 };
    let film = films * (film::PIXEL_BYTES + aov_bytes(settings));
    film + (window_bytes(settings) + own).max(file_bytes(layers(settings)))
}

/// Bytes that a pixel takes while films are joined: the sum, and either another film or
/// the image files.
#[must_use]
pub fn joined_pixel_bytes(settings: &Settings) -> usize {
    let film = film::PIXEL_BYTES + aov_bytes(settings);
    film + film.max(file_bytes(layers(settings)))
}

/// Bytes of what a pixel keeps beside its light.
pub(crate) fn aov_bytes(settings: &Settings) -> usize {
    match settings.has_aovs() {
        true => size_of::<AovSums>(),
        false => 0,
    }
}

/// Values of a pixel in layers, at most.
fn layers(settings: &Settings) -> usize {
    match settings.has_aovs() {
        true => MOST_LAYERS,
        false => FEWEST_LAYERS,
    }
}

/// Values of a pixel in layers that take no sums of their own: `stderr` and `samples`.
const FEWEST_LAYERS: usize = 4;
/// The same of all layers: five kinds of light, normal, albedo and depth as well.
const MOST_LAYERS: usize = FEWEST_LAYERS + 5 * 3 + 3 + 3 + 1;

/// What a pixel takes while files are written, one by one: picture and layers; in the EXR encoder the
/// same by channels; and the file, whose bytes grow by doubling and may not compress.
const fn file_bytes(layers: usize) -> usize {
    4 * (3 + layers) * (1 + 1 + 2)
}

/// What a pixel takes on any device: in the film, and in the files.
pub const LEAST_PIXEL_BYTES: usize = film::PIXEL_BYTES + file_bytes(FEWEST_LAYERS);

/// What a render takes whatever its size: the stacks of the threads that compress EXR files, one a core,
/// and what all small things come to.
fn fixed_bytes() -> usize {
    const STACK: usize = (2 << 20) + (1 << 16);
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    (16 << 20) + cores * STACK
}

/// Refuses an image that would end the program in the middle for want of memory.
///
/// # Errors
/// [`Error::Usage`] if there is less than `pixel_bytes` for each pixel of `crop`, and what any image takes.
pub fn check_memory(crop: &Rect, pixel_bytes: usize) -> Result<()> {
    let bytes = crop.pixels().saturating_mul(pixel_bytes);
    let bytes = bytes.saturating_add(fixed_bytes());
    let mut room: Vec<u8> = Vec::new();
    let there = room.try_reserve_exact(bytes).is_ok();
    // Without this, the compiler may leave the allocation out and assume that it works.
    std::hint::black_box(&room);
    if there {
        return Ok(());
    }
    Err(Error::Usage(format!(
        "{}x{} pixels need {} GiB of memory, more than there is: choose a smaller --size, or \
         render parts of the image with --crop",
        crop.width,
        crop.height,
        significant(bytes as f64 / f64::from(1 << 30)),
    )))
}

//! Regions, the unit of memory: the textures that the kernel writes for one, and what they say.

use std::ops::Range;

use crate::error::{Error, Result};
use crate::film::TILE;
use crate::film::{NonFinite, PixelSums, Tally};
use crate::gpu::engine::{Engine, Reading, Readings, Recording};
use crate::records::layout::{ChosenTiles, CountersRecord};
use crate::settings::Rect;

/// Longest side of a region: images beyond it are rendered in pieces. A multiple of the tile's, and of no
/// more tiles than `ChosenTiles` can hold.
const REGION: u32 = 1024;

/// The textures of a region, as `shaders/path.wesl` calls them: sums and rays; what rounding took from
/// these, and throughput that the bounce limit cut; squared deviations, and paths that it cut.
const TEXTURES: [&str; 3] = ["sum_high", "sum_low", "deviations"];

/// Longest side of a region: a multiple of the tile's, such that one buffer can hold its partial sums.
pub(super) fn side(limits: &wgpu::Limits, partial_size: u32) -> u32 {
    let pixels = (largest_buffer(limits) / u64::from(partial_size)).isqrt();
    let most = u64::from(REGION.min(limits.max_texture_dimension_2d)).min(pixels);
    (most as u32 / TILE * TILE).max(TILE)
}

/// Whether the device takes `bytes` of partial sums: a tile's may be too much.
///
/// # Errors
/// [`Error::DeviceLimit`] if one buffer cannot hold them.
pub(super) fn check(limits: &wgpu::Limits, bytes: u64) -> Result<()> {
    let most = largest_buffer(limits);
    if bytes > most {
        return Err(Error::DeviceLimit(format!(
            "the partial sums need {bytes} bytes, more than the device's limit of {most} for one buffer; \
             --backend cpu has no such limit"
        )));
    }
    Ok(())
}

/// Bytes of the largest storage buffer.
fn largest_buffer(limits: &wgpu::Limits) -> u64 {
    let binding = limits.max_storage_buffer_binding_size;
    binding.min(limits.max_buffer_size)
}

/// Tiles of a region.
pub(super) fn tiles_of(region: Rect) -> u32 {
    region.width.div_ceil(TILE) * region.height.div_ceil(TILE)
}

/// The tile that the pixel at `place` of a region is in.
pub(super) fn tile_at(region: Rect, [x, y]: [u32; 2]) -> u32 {
    y / TILE * region.width.div_ceil(TILE) + x / TILE
}

/// Of a region's pixels about as many as are in chosen tiles: those at its edge may be smaller.
pub(super) fn chosen_pixels(region: Rect, chosen: Option<&ChosenTiles>) -> f64 {
    let tiles = tiles_of(region);
    let is_chosen = |tile: &u32| chosen.is_none_or(|c| c.has(*tile));
    let count = (0..tiles).filter(is_chosen).count();
    region.pixels() as f64 * count as f64 / f64::from(tiles)
}

/// Makes the textures for regions up to this size, and room to read them.
///
/// # Errors
/// None but those of [`Engine::stage`].
pub(super) fn create(engine: &mut Engine, width: u32, height: u32) -> Result<()> {
    for name in TEXTURES {
        engine.texture(name, width, height);
        engine.stage(name)?;
    }
    Ok(())
}

/// Records that the textures are read.
pub(super) fn record(recording: &mut Recording<'_>, region: Rect) {
    for name in TEXTURES {
        recording.read_part(name, [region.width, region.height]);
    }
}

/// The sums of a region's pixels, and what its samples of this window add to the tally but for the
/// counters. `radiance_scale` is kernel radiance per radiance.
pub(super) fn sums(
    readings: &Readings,
    region: Rect,
    chosen: Option<&ChosenTiles>,
    radiance_scale: f64,
) -> (Vec<PixelSums>, Tally) {
    let [high, low, deviations] = TEXTURES.map(|name| texels(&readings[name]));
    let mut tally = Tally::default();
    let places = (0..region.height).flat_map(|y| (0..region.width).map(move |x| [x, y]));
    let pixels = places.zip(high.zip(low).zip(deviations));
    let pixels = pixels.map(|(place, ((high, low), deviation))| {
        let mut pixel = PixelSums::default();
        // Elsewhere the textures hold what was before.
        if !chosen.is_none_or(|c| c.has(tile_at(region, place))) {
            return pixel;
        }
        for c in 0..3 {
            let sum = f64::from(high[c]) + f64::from(low[c]);
            pixel.sum[c] = sum / radiance_scale;
            pixel.m2[c] = f64::from(deviation[c]) / radiance_scale.powi(2);
        }
        tally.rays += high[3] as u64;
        tally.cut_throughput += f64::from(low[3]);
        tally.cut_paths += deviation[3] as u64;
        pixel
    });
    (pixels.collect(), tally)
}

fn texels(reading: &Reading) -> impl Iterator<Item = [f32; 4]> {
    let texels = |row| bytemuck::cast_slice::<u8, [f32; 4]>(row).iter().copied();
    reading.rows().flat_map(texels)
}

/// Adds to the tally what the kernel counted beside the sums.
pub(super) fn count(
    tally: &mut Tally,
    counters: &CountersRecord,
    region: Rect,
    samples: &Range<u64>,
) {
    if counters.non_finite == 0 {
        return;
    }
    let number = u32::MAX - counters.first_pixel;
    tally.non_finite = u64::from(counters.non_finite);
    tally.first_non_finite = Some(NonFinite {
        pixel: [
            region.x + number % region.width,
            region.y + number / region.width,
        ],
        sample: (samples.start >> 32 << 32) + u64::from(counters.sample_low),
        bounce: counters.bounce,
    });
}

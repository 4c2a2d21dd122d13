//! How much one dispatch does, from the time that the last one took.

use std::ops::Range;
use std::time::Duration;

use crate::film::BLOCK;
use crate::film::TILE;

/// What a dispatch should take: short enough for every watchdog and for a smooth progress bar.
const DISPATCH: Duration = Duration::from_millis(75);
/// What all dispatches between two looks at the stop rules should take.
const SLAB: Duration = Duration::from_millis(3000);
/// Tiles that keep a GPU busy: below that a dispatch takes fewer samples instead.
const BUSY_TILES: u32 = 64;

/// The most that one dispatch may do, whatever the time it would take. No bit of an image depends on
/// it; it is for tests of just that, and for drivers with a short watchdog.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DispatchLimits {
    /// Tiles of 8 x 8 pixels; at least 1.
    pub tiles: u32,
    /// Samples a pixel; rounded up to whole blocks.
    pub samples: u64,
}

impl Default for DispatchLimits {
    fn default() -> Self {
        Self {
            tiles: u32::MAX,
            samples: u64::MAX,
        }
    }
}

/// How fast the device is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pace {
    /// Paths a second, from the last dispatch.
    rate: f64,
    pub(super) limits: DispatchLimits,
}

impl Pace {
    /// That of a device that has done nothing yet.
    pub(super) fn unknown() -> Self {
        Self {
            rate: 1.0e6,
            limits: DispatchLimits::default(),
        }
    }

    /// Takes note that a dispatch of `paths` took so long.
    pub(super) fn took(&mut self, paths: f64, time: Duration) {
        self.rate = paths / time.as_secs_f64().max(1.0e-6);
    }

    /// Where a slab that starts with `samples` of `pixels` ends: equal parts of what is left, by time.
    pub(super) fn slab_end(&self, samples: Range<u64>, pixels: f64) -> u64 {
        let left = samples.end - samples.start;
        let fit = self.rate * SLAB.as_secs_f64() / pixels;
        let busy = self.rate * DISPATCH.as_secs_f64() / f64::from(BUSY_TILES * TILE * TILE);
        let parts = (left as f64 / fit.min(busy.max(BLOCK as f64)))
            .ceil()
            .max(1.0);
        let length = ((left as f64 / parts).ceil() as u64).min(self.limits.samples);
        // Slabs end where blocks do.
        (samples.start + length)
            .checked_next_multiple_of(BLOCK)
            .map_or(samples.end, |end| end.min(samples.end))
    }

    /// Tiles of a dispatch with so many samples a pixel.
    pub(super) fn tile_count(&self, samples: u64) -> u32 {
        let paths = self.rate * DISPATCH.as_secs_f64();
        let count = paths / (f64::from(TILE * TILE) * samples as f64);
        (count as u32).min(self.limits.tiles).max(1)
    }
}

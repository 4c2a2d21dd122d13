//! Windows: what a renderer sums up by itself, where they end, and what it counts.

use std::ops::Range;

use super::aov::AovSums;
use crate::sampler::PILOT;
use crate::settings::Rect;

/// Samples a block: f32 sums run over one block, and every batch, whose spread gives the error
/// estimate, is some of them. The kernel's `BLOCK`.
pub const BLOCK: u64 = 4;

/// The largest window: what a renderer sums up by itself before the film gets it.
pub const WINDOW: u64 = 256;

/// The end of the window that starts at `start`, in a range that ends at `end`. Boundaries are at
/// fixed sample indices (16, 64, 128, 256 and then every 256), so that no timing changes any sum.
#[must_use]
pub fn window_end(start: u64, end: u64) -> u64 {
    let boundary = [16, 64, 128].into_iter().find(|b| start < *b);
    let boundary = boundary.unwrap_or((start / WINDOW + 1).saturating_mul(WINDOW));
    // A window's samples share the high word of the sample index.
    boundary.min(end)
}

/// A range of samples as at most `count` ranges of about one length, one after the other, that end where
/// windows do: so the films of all of them add up to that of the whole. Fewer where windows are too few.
#[must_use]
pub fn cut(samples: Range<u64>, count: u32) -> Vec<Range<u64>> {
    let Range { start, end } = samples;
    let length = u128::from(end.saturating_sub(start));
    let mut parts = Vec::new();
    let mut from = start;
    for part in 1..=u128::from(count) {
        // Below `end`, for it is at most the length.
        let aim = start + (length * part / u128::from(count)) as u64;
        let (below, above) = (window_start(aim), window_end(aim, end));
        let to = match aim {
            aim if aim == end => end,
            aim if aim - below <= above - aim => below,
            _ => above,
        };
        if to > from {
            parts.push(from..to);
            from = to;
        }
    }
    parts
}

/// Where the window begins that has the sample `at`.
fn window_start(at: u64) -> u64 {
    let boundary = [128, 64, 16].into_iter().find(|b| at >= *b).unwrap_or(0);
    boundary.max(at / WINDOW * WINDOW)
}

/// Which of the two halves of the jackknife ([`Film::relative_variance`](super::Film::relative_variance)) a
/// window belongs to that starts at `start`: every other of the windows that [`window_end`] ends, whichever of
/// them are there, and in whatever order they come. A pilot's count like those from sample 0 on.
#[must_use]
pub fn half_of(start: u64) -> usize {
    let start = start.checked_sub(PILOT).unwrap_or(start);
    let number = match start {
        0..16 => 0,
        16..64 => 1,
        64..128 => 2,
        _ => 3 + start / WINDOW,
    };
    (number % 2) as usize
}

/// Samples below which no render stops by its error.
pub const LEAST_SAMPLES: u64 = 64;

/// The number of samples at which the error is looked at next, after a look at `samples`: an
/// eighth more. Every look is a chance to stop by luck, so that there should be few; what that costs is a
/// render that is a sixteenth too long on average, and more below 2048 samples, where windows are long.
#[must_use]
pub fn next_look(samples: u64) -> u64 {
    LEAST_SAMPLES.max(samples.saturating_add(samples / 8))
}

/// One pixel's share of a window.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PixelSums {
    /// Sum of the radiance of all samples, W/(sr m²) per channel.
    pub sum: [f64; 3],
    /// Sum of the squared deviations of the full batches' sums from their mean.
    pub m2: [f64; 3],
}

/// What a renderer returns: sums over a range of samples for every pixel of a rectangle.
#[derive(Clone, Debug)]
pub struct Window {
    /// The pixels, by rows.
    pub rect: Rect,
    /// The samples.
    pub samples: Range<u64>,
    /// Samples of a batch: all batches of a window are of one length.
    pub batch: u64,
    /// One entry a pixel, rows from the top; zeros where a tile was not asked for.
    pub pixels: Vec<PixelSums>,
    /// Where pixels of a batch are not independent of each other, for each full batch the sum over all pixels; else empty.
    pub image: Vec<[f64; 3]>,
    /// The same of what was asked for beside the image; empty if that is nothing.
    pub aovs: Vec<AovSums>,
    /// What else happened.
    pub tally: Tally,
}

impl Window {
    /// The number of batches that lie in the window as a whole.
    #[must_use]
    pub fn full_batches(&self) -> u64 {
        full_batches(&self.samples, self.batch)
    }
}

/// The number of batches of length `batch` that lie in a range of samples as a whole.
#[must_use]
pub fn full_batches(samples: &Range<u64>, batch: u64) -> u64 {
    (samples.end / batch).saturating_sub(samples.start.div_ceil(batch))
}

/// Counts over any set of samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Tally {
    /// Rays traced.
    pub rays: u64,
    /// Paths that the bounce limit cut while they still carried light.
    pub cut_paths: u64,
    /// The throughput of these, averaged over the channels, summed.
    pub cut_throughput: f64,
    /// Samples that were no finite number; they are in no sum.
    pub non_finite: u64,
    /// The first of these.
    pub first_non_finite: Option<NonFinite>,
}

impl Tally {
    /// Adds the counts of further samples.
    pub fn add(&mut self, other: &Self) {
        self.rays += other.rays;
        self.cut_paths += other.cut_paths;
        self.cut_throughput += other.cut_throughput;
        self.non_finite += other.non_finite;
        self.first_non_finite = self.first_non_finite.or(other.first_non_finite);
    }
}

/// Where a sample was no finite number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct NonFinite {
    /// The pixel, in the whole image.
    pub pixel: [u32; 2],
    /// The sample index.
    pub sample: u64,
    /// The bounce after which it was seen.
    pub bounce: u32,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Windows in the order of one render from sample `start` on: that is how halves were chosen before
    /// parts could come in any order.
    fn by_the_lesser_so_far(start: u64) -> Vec<(usize, usize)> {
        let (mut start, end, mut halves) = (start, 20_000, [0; 2]);
        let mut chosen = Vec::new();
        while start < end {
            let next = window_end(start, end);
            let lesser = usize::from(halves[1] < halves[0]);
            halves[lesser] += next - start;
            chosen.push((lesser, half_of(start)));
            start = next;
        }
        chosen
    }

    #[test]
    fn halves_are_those_of_one_render() {
        for begin in [0, PILOT] {
            let (mut start, mut halves) = (0, Vec::new());
            while start < 20_000 {
                halves.push(half_of(begin + start));
                start = window_end(start, 20_000);
            }
            let before = by_the_lesser_so_far(0);
            let before: Vec<usize> = before.iter().map(|(lesser, _)| *lesser).collect();
            assert_eq!(halves, before);
        }
        // Companion: a render that begins elsewhere had others.
        let elsewhere = by_the_lesser_so_far(16);
        assert!(elsewhere.iter().any(|(lesser, ours)| lesser != ours));
    }

    #[test]
    fn cuts_are_window_ends_and_about_even() {
        let is_end = |at: u64, end| at == end || (0..at).any(|start| window_end(start, end) == at);
        for (samples, count) in [
            (0..4096, 8),
            (0..1000, 3),
            (0..1 << 20, 7),
            (512..4096, 5),
            (37..5000, 4),
            (0..256, 3),
            (0..256, 100),
            (0..5, 2),
            (300..400, 2),
            (0..8000, 1),
        ] {
            let parts = cut(samples.clone(), count);
            let shown = format!("{samples:?} in {count}: {parts:?}");
            assert!(parts.len() <= count as usize, "{shown}");
            assert_eq!(parts[0].start, samples.start, "{shown}");
            assert_eq!(parts[parts.len() - 1].end, samples.end, "{shown}");
            for pair in parts.windows(2) {
                assert_eq!(pair[0].end, pair[1].start, "{shown}");
            }
            let even = (samples.end - samples.start).div_ceil(u64::from(count));
            for part in &parts {
                let end = part.end.min(samples.end);
                assert!(end > 100_000 || is_end(end, samples.end), "{shown}");
                assert!(
                    end % WINDOW == 0 || end < WINDOW || end == samples.end,
                    "{shown}"
                );
                // As near as windows let it.
                assert!(part.end - part.start < even + WINDOW, "{shown}");
            }
        }
        assert_eq!(cut(0..1024, 4), [0..256, 256..512, 512..768, 768..1024]);
        assert_eq!(cut(0..256, 9), [0..16, 16..64, 64..128, 128..256]);
        assert_eq!(cut(0..1 << 48, 2)[0], 0..1 << 47);
        // Companion: cuts at even lengths are no window ends.
        assert!(!is_end(1000 / 3, 1000));
    }

    #[test]
    fn all_parts_of_a_window_are_in_one_half() {
        for (start, end) in [
            (0, 16),
            (16, 64),
            (64, 128),
            (128, 256),
            (256, 512),
            (512, 768),
        ] {
            assert!((start..end).all(|at| half_of(at) == half_of(start)));
            assert_ne!(half_of(start), half_of(end), "{end}");
        }
    }
}

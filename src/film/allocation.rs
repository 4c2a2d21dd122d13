//! How samples are shared out: how many each tile of the image gets.

use crate::settings::Rect;

/// Pixels along the side of a tile: the kernel's workgroup.
pub const TILE: u32 = 8;

/// Tiles of a rectangle of pixels, some of them chosen.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tiles {
    across: u32,
    chosen: Vec<bool>,
}

impl Tiles {
    /// Whether the tile at a column and a row of tiles is chosen.
    #[must_use]
    pub fn has(&self, column: u32, row: u32) -> bool {
        self.chosen[(row * self.across + column) as usize]
    }

    /// Whether the tile of a pixel, counted from the rectangle's corner, is chosen.
    #[must_use]
    pub fn has_pixel(&self, x: u32, y: u32) -> bool {
        self.has(x / TILE, y / TILE)
    }
}

/// A step for every tile of a rectangle. It is fixed before the first sample of the image is taken, and
/// by other samples: the mean of a pixel has then no bias, whatever the steps are.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Allocation {
    rect: Rect,
    pub(super) across: u32,
    /// By rows of tiles.
    pub(super) steps: Vec<u8>,
}

impl Allocation {
    /// The same for every tile.
    #[must_use]
    pub fn uniform(rect: Rect) -> Self {
        let across = rect.width.div_ceil(TILE);
        Self {
            rect,
            across,
            steps: vec![0; (across * rect.height.div_ceil(TILE)) as usize],
        }
    }

    /// The pixels.
    #[must_use]
    pub fn rect(&self) -> Rect {
        self.rect
    }

    /// The step of pixel `i`.
    #[must_use]
    pub fn step(&self, i: usize) -> u8 {
        self.steps[self.tile(i)]
    }

    /// Pixels of each step, from 0 on.
    #[must_use]
    pub fn counts(&self) -> Vec<u64> {
        let last = self.steps.iter().copied().max().unwrap_or(0);
        let mut counts = vec![0; usize::from(last) + 1];
        for (step, pixels) in self.steps.iter().zip(self.pixels()) {
            counts[usize::from(*step)] += pixels as u64;
        }
        counts
    }

    /// Samples of a pixel on average, in those of step 0.
    #[must_use]
    pub fn mean_weight(&self) -> f64 {
        let counts = self.counts().into_iter().enumerate();
        let work: f64 = counts.map(|(s, n)| n as f64 * f64::exp2(s as f64)).sum();
        work / self.rect.pixels() as f64
    }

    /// The tiles of a step; `None` if that is all of them.
    #[must_use]
    pub fn tiles(&self, step: u8) -> Option<Tiles> {
        let chosen: Vec<bool> = self.steps.iter().map(|s| *s == step).collect();
        (!chosen.iter().all(|c| *c)).then_some(Tiles {
            across: self.across,
            chosen,
        })
    }

    /// The tile of pixel `i`.
    pub(super) fn tile(&self, i: usize) -> usize {
        let (width, side) = (self.rect.width as usize, TILE as usize);
        i / width / side * self.across as usize + i % width / side
    }

    /// The pixels of each tile.
    pub(super) fn pixels(&self) -> Vec<f64> {
        let tiles = self.rect.pieces(TILE);
        tiles.map(|tile| tile.pixels() as f64).collect()
    }
}

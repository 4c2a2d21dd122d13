//! Geometry form `bvh`: a tree of boxes over the spheres about their centres, as it lies in the texture that
//! `shaders/scene/bvh.wesl` reads.
//!
//! A node has four boxes, so that few nodes lie between the root and a sphere, and is read as seven texels; a leaf
//! has up to four spheres, whose numbers and themselves are five, and where any moves their ways four more. Boxes hold
//! exactly what the kernel tests: spheres in f32, all along their ways. What rounding does to a test of a box is in [`SLACK`], what it does to a ray in the kernel.
//!
//! A builder of our own: sizes go up to 1e20, whose areas are infinite in the f32 of `obvhs` and its like; no
//! number of coincident spheres may make a tree deeper than the kernel's stack; and the four-wide node comes from
//! it at once. The same spheres give the same tree, bit for bit, on any number of threads.

mod build;
mod layout;

use glam::Vec3;

pub use build::MOST_SAH_LEVELS;

/// Texels in a row of the texture.
pub const WIDTH: u32 = 2048;

/// Spheres of a leaf, and boxes of a node.
pub const WIDE: usize = 4;

/// The word of no child: see `shaders/scene/bvh.wesl`.
pub const NOTHING: u32 = u32::MAX;

/// What a box is larger by, as a share of its largest half extent: 256 units of f32's rounding, as is derived in
/// `docs/reasons.md`.
pub const SLACK: f64 = 256.0 * (1.0 / 16_777_216.0);

/// A sphere about its centre, as the kernel has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    /// In kernel units, in the middle of its way.
    pub center: Vec3,
    /// Its way.
    pub motion: Vec3,
    /// Positive.
    pub radius: f32,
    /// Whether it is kept beside the tree, and tested by every ray: a sphere that paths are known to be in,
    /// wherever f32 has put them.
    pub apart: bool,
}

/// How a tree is made; but for `moves`, for tests of what happens to one that is made wrongly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Boxes are as large as they must be, times this.
    pub scale: f64,
    /// What they are larger by beyond that; see [`SLACK`].
    pub slack: f64,
    /// Whether leaves hold ways.
    pub moves: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            scale: 1.0,
            slack: SLACK,
            moves: false,
        }
    }
}

/// A tree as the kernel reads it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tree {
    /// Rows of [`WIDTH`] texels.
    pub texels: Vec<[u32; 4]>,
    /// The word of the root, or [`NOTHING`].
    pub root: u32,
    /// Nodes on the longest way from the root to a leaf.
    pub levels: u32,
    /// Leaves beside the tree, the first ones of the texture.
    pub apart: u32,
    /// By ball: the texel where it is.
    pub places: Vec<u32>,
    /// Texels in use.
    pub used: usize,
}

impl Tree {
    /// A tree over `balls` at rest, the first of which has the number `first` in the kernel.
    #[must_use]
    pub fn new(balls: &[Ball], first: u32) -> Self {
        Self::with(balls, first, Options::default())
    }

    /// The same, made otherwise.
    #[must_use]
    pub fn with(balls: &[Ball], first: u32, options: Options) -> Self {
        let root = build::root(balls, options);
        let mut writer = layout::Writer::new(balls, first, options.moves);
        let apart: Vec<u32> = (0..balls.len() as u32)
            .filter(|i| balls[*i as usize].apart)
            .collect();
        for some in apart.chunks(WIDE) {
            writer.leaf(some);
        }
        let word = root.as_ref().map_or(NOTHING, |node| writer.node(node));
        let levels = root.as_ref().map_or(0, build::Node::levels);
        writer.finish(word, levels, apart.len().div_ceil(WIDE) as u32)
    }

    /// Entries that the kernel's stack needs: of each node on the way down three boxes wait at most.
    #[must_use]
    pub fn stack(&self) -> u32 {
        (WIDE as u32 - 1) * self.levels + 1
    }

    /// Rows of the texture.
    #[must_use]
    pub fn rows(&self) -> u32 {
        (self.texels.len() / WIDTH as usize) as u32
    }
}

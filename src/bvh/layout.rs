//! How a tree lies in its texture.

use super::build::{Extent, Node};
use super::{Ball, NOTHING, Tree, WIDE, WIDTH};

/// Marks the word of a leaf; the rest is its first texel.
const LEAF: u32 = 1 << 31;

/// Texels of a node: the boxes' centres by coordinate, their half extents, the words of what is in them.
const NODE: usize = 7;

/// Writes parts of a tree, each after its parent.
#[derive(Debug)]
pub(super) struct Writer<'a> {
    balls: &'a [Ball],
    first: u32,
    /// Whether leaves hold ways.
    moves: bool,
    texels: Vec<[u32; 4]>,
    places: Vec<u32>,
}

impl<'a> Writer<'a> {
    /// A writer for trees over `balls`, the first of which has the number `first` in the kernel.
    pub(super) fn new(balls: &'a [Ball], first: u32, moves: bool) -> Self {
        Self {
            balls,
            first,
            moves,
            texels: Vec::new(),
            places: vec![0; balls.len()],
        }
    }

    /// Writes a part; returns its word.
    pub(super) fn node(&mut self, node: &Node) -> u32 {
        let parts = match node {
            Node::Leaf(balls) => return self.leaf(balls),
            Node::Inner(parts) => parts,
        };
        let at = self.texels.len();
        self.texels.resize(at + NODE, [0; 4]);
        let mut words = [NOTHING; WIDE];
        for (i, (Extent { center, half }, part)) in parts.iter().enumerate() {
            words[i] = self.node(part);
            for axis in 0..3 {
                self.texels[at + axis][i] = center[axis].to_bits();
                self.texels[at + 3 + axis][i] = half[axis].to_bits();
            }
        }
        self.texels[at + NODE - 1] = words;
        at as u32
    }

    /// Writes a leaf; returns its word. What it lacks to four balls is the last one again.
    pub(super) fn leaf(&mut self, balls: &[u32]) -> u32 {
        let at = self.texels.len() as u32;
        let whole: [u32; WIDE] = std::array::from_fn(|i| balls[i.min(balls.len() - 1)]);
        self.texels.push(whole.map(|ball| self.first + ball));
        for (place, ball) in (at + 1..).zip(whole) {
            let Ball { center, radius, .. } = self.balls[ball as usize];
            self.texels
                .push(center.extend(radius).to_array().map(f32::to_bits));
            self.places[ball as usize] = place;
        }
        if self.moves {
            let ways = whole.map(|ball| self.balls[ball as usize].motion.extend(0.0));
            self.texels
                .extend(ways.map(|way| way.to_array().map(f32::to_bits)));
        }
        at | LEAF
    }

    /// The tree, in whole rows.
    pub(super) fn finish(mut self, root: u32, levels: u32, apart: u32) -> Tree {
        let used = self.texels.len();
        let whole = used.max(1).next_multiple_of(WIDTH as usize);
        self.texels.resize(whole, [0; 4]);
        Tree {
            texels: self.texels,
            root,
            levels,
            apart,
            places: self.places,
            used,
        }
    }
}

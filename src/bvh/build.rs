//! Which spheres are together: the surface area heuristic over bins (Wald 2007, "On fast Construction of SAH-based
//! Bounding Volume Hierarchies"), four parts at once.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::{Ball, Options, WIDE};

/// Bins of each axis.
const BINS: usize = 16;

/// Levels of nodes that the heuristic may have; below them parts are halved, so that no arrangement of spheres makes
/// a tree deeper than this and the logarithm of their number.
pub const MOST_SAH_LEVELS: u32 = 20;

/// Spheres from which on the parts of a node are built side by side.
const PARALLEL: usize = 4096;

/// A box, its half extents with what a test of it may need.
#[derive(Clone, Copy, Debug)]
pub(super) struct Extent {
    pub(super) center: Vec3,
    pub(super) half: Vec3,
}

/// A part of the tree.
#[derive(Debug)]
pub(super) enum Node {
    /// The numbers of up to four balls.
    Leaf(Vec<u32>),
    /// Up to four parts in their boxes.
    Inner(Vec<(Extent, Self)>),
}

impl Node {
    /// Nodes with boxes on the longest way down.
    pub(super) fn levels(&self) -> u32 {
        match self {
            Self::Leaf(_) => 0,
            Self::Inner(parts) => 1 + parts.iter().map(|(_, n)| n.levels()).max().unwrap_or(0),
        }
    }
}

/// Least and greatest coordinates.
#[derive(Clone, Copy, Debug)]
struct Bounds {
    low: Vec3,
    high: Vec3,
}

impl Bounds {
    const NONE: Self = Self {
        low: Vec3::INFINITY,
        high: Vec3::NEG_INFINITY,
    };

    fn with(self, other: Self) -> Self {
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
        }
    }

    /// In f64: f32 has no room for the squares of large sizes.
    fn area(&self) -> f64 {
        let d = (self.high.as_dvec3() - self.low.as_dvec3()).max(DVec3::ZERO);
        d.x * d.y + d.y * d.z + d.z * d.x
    }
}

/// What is known of a ball while it is sorted.
#[derive(Clone, Copy, Debug)]
struct Item {
    center: Vec3,
    radius: f32,
    /// Half of its way, by coordinate.
    way: Vec3,
    index: u32,
}

impl Item {
    /// As good as the choice of parts needs; the boxes are found from the balls themselves.
    fn bounds(&self) -> Bounds {
        Bounds {
            low: self.center - self.way - self.radius,
            high: self.center + self.way + self.radius,
        }
    }
}

/// The tree over all balls that are in it; `None` if none is.
pub(super) fn root(balls: &[Ball], options: Options) -> Option<Node> {
    let mut items: Vec<Item> = (0..)
        .zip(balls)
        .filter(|(_, ball)| !ball.apart)
        .map(|(index, ball)| Item {
            center: ball.center,
            radius: ball.radius,
            way: 0.5 * ball.motion.abs(),
            index,
        })
        .collect();
    (!items.is_empty()).then(|| node(&mut items, 0, options))
}

fn node(items: &mut [Item], level: u32, options: Options) -> Node {
    if items.len() <= WIDE {
        // In the order of the balls, whatever order they were sorted into.
        let mut leaf: Vec<u32> = items.iter().map(|item| item.index).collect();
        leaf.sort_unstable();
        return Node::Leaf(leaf);
    }
    let many = items.len() > PARALLEL;
    let mut parts = vec![(bounds_of(items).area(), items)];
    while parts.len() < WIDE {
        // The largest that can still be split.
        let split = (0..parts.len()).filter(|i| parts[*i].1.len() > WIDE);
        let Some(largest) = split.max_by(|a, b| parts[*a].0.total_cmp(&parts[*b].0)) else {
            break;
        };
        let (_, items) = parts.remove(largest);
        let at = if level < MOST_SAH_LEVELS {
            divide(items)
        } else {
            halve(items)
        };
        let (left, right) = items.split_at_mut(at);
        parts.insert(largest, (bounds_of(right).area(), right));
        parts.insert(largest, (bounds_of(left).area(), left));
    }
    let part = |items: &mut [Item]| {
        let extent = extent(items, options);
        (extent, node(items, level + 1, options))
    };
    Node::Inner(if many {
        parts
            .into_par_iter()
            .map(|(_, items)| part(items))
            .collect()
    } else {
        parts.into_iter().map(|(_, items)| part(items)).collect()
    })
}

fn bounds_of(items: &[Item]) -> Bounds {
    let bounds = items.iter().map(Item::bounds);
    bounds.fold(Bounds::NONE, Bounds::with)
}

/// The box of some balls: about a centre in f32, as far as any of them reaches from there, and the slack.
fn extent(items: &[Item], options: Options) -> Extent {
    let bounds = bounds_of(items);
    let center = (0.5 * (bounds.low.as_dvec3() + bounds.high.as_dvec3())).as_vec3();
    let farthest = |item: &Item| {
        let aside = (item.center.as_dvec3() - center.as_dvec3()).abs();
        aside + item.way.as_dvec3() + f64::from(item.radius)
    };
    let half = items.iter().map(farthest).fold(DVec3::ZERO, DVec3::max) * options.scale;
    let half = half + options.slack * half.max_element();
    Extent {
        center,
        half: Vec3::from_array(half.to_array().map(up)),
    }
}

/// The least f32 that is not less than `x`, positive.
fn up(x: f64) -> f32 {
    let near = x as f32;
    if f64::from(near) < x {
        near.next_up()
    } else {
        near
    }
}

/// Sorts the items into two parts that cost least by the heuristic, leaves being what costs; returns where the second
/// begins.
fn divide(items: &mut [Item]) -> usize {
    let centers = items.iter().fold(Bounds::NONE, |all, item| {
        all.with(Bounds {
            low: item.center,
            high: item.center,
        })
    });
    let size = centers.high.as_dvec3() - centers.low.as_dvec3();
    let scale = BINS as f64 / size;
    // Bins of no width, or too narrow for an f64 to count them, are none.
    let usable = [0, 1, 2].map(|axis| size[axis] > 0.0 && scale[axis].is_finite());
    let (low, scale) = (centers.low, scale.as_vec3());
    let bin = move |center: Vec3, axis: usize| {
        (((center[axis] - low[axis]) * scale[axis]) as usize).min(BINS - 1)
    };
    let mut bins = [[(Bounds::NONE, 0usize); BINS]; 3];
    for item in items.iter() {
        let bounds = item.bounds();
        for axis in 0..3 {
            let bin = &mut bins[axis][bin(item.center, axis)];
            *bin = (bin.0.with(bounds), bin.1 + 1);
        }
    }
    let mut best: Option<(f64, usize, usize)> = None;
    for axis in (0..3).filter(|axis| usable[*axis]) {
        let mut beyond = [(0.0, 0); BINS];
        let mut all = (Bounds::NONE, 0);
        for (bin, beyond) in bins[axis].iter().zip(&mut beyond).rev() {
            all = (all.0.with(bin.0), all.1 + bin.1);
            *beyond = (all.0.area(), all.1);
        }
        let mut all = (Bounds::NONE, 0);
        for (i, bin) in bins[axis][..BINS - 1].iter().enumerate() {
            all = (all.0.with(bin.0), all.1 + bin.1);
            let (area, count) = beyond[i + 1];
            if all.1 == 0 || count == 0 {
                continue;
            }
            let leaves = |count: usize| count.div_ceil(WIDE) as f64;
            let cost = all.0.area() * leaves(all.1) + area * leaves(count);
            if best.is_none_or(|(least, ..)| cost < least) {
                best = Some((cost, axis, i));
            }
        }
    }
    match best {
        Some((_, axis, last)) => partition(items, |item| bin(item.center, axis) <= last),
        None => halve(items),
    }
}

/// Brings those that are `first` to the front; returns how many.
fn partition(items: &mut [Item], first: impl Fn(&Item) -> bool) -> usize {
    let mut count = 0;
    for i in 0..items.len() {
        if first(&items[i]) {
            items.swap(i, count);
            count += 1;
        }
    }
    count
}

/// Sorts the items into two halves by their places along the widest axis, or where these are all the same by radius.
fn halve(items: &mut [Item]) -> usize {
    let mut low = items[0]
        .center
        .as_dvec3()
        .extend(f64::from(items[0].radius));
    let mut high = low;
    for item in items.iter() {
        let place = item.center.as_dvec3().extend(f64::from(item.radius));
        (low, high) = (low.min(place), high.max(place));
    }
    let axis = (high - low).max_position();
    let key = |item: &Item| item.center.extend(item.radius)[axis];
    let half = (items.len() / 2).next_multiple_of(WIDE);
    let half = if half < items.len() {
        half
    } else {
        items.len() / 2
    };
    items.select_nth_unstable_by(half, |a, b| {
        key(a).total_cmp(&key(b)).then(a.index.cmp(&b.index))
    });
    half
}

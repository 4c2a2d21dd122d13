//! Balls in a tree, so that a question to all of them looks at a few.
//!
//! No answer may depend on the tree: each is that of asking every ball in turn, bit for bit. What a box of
//! balls can answer at most is computed by the very operations that its balls are asked with, and these
//! (differences, products, sums, square roots) are monotone in f64: a bound needs no margin for rounding. Balls that
//! move are asked with others, and are taken for boxes that hold their ways with such a margin.
//!
//! A question takes the time of a logarithm of all and of what comes near: balls that a box cannot rule out, such as
//! many large surfaces that just miss one small ball, are asked one by one. Of dielectrics such a crowd is refused
//! anyway: large balls that nearly touch one point share points with each other, all but a few, and need as many
//! levels of priority.
//!
//! A tree of our own, since those of others know neither marks that rise while it is in use nor an order
//! among balls, and these keep questions short where most balls share points.

use glam::DVec3;

use crate::scene::Sphere;

/// Balls in one leaf.
const LEAF: usize = 8;

/// Balls from which on the halves of a node are built side by side.
const PARALLEL: usize = 16384;

/// By how much more than half of its way a moving ball is taken to move to either side, as a share of it; and by how
/// much less or more distances from it are taken to be. Both are far above the roundings of f64.
const MARGIN: f64 = 1.0 / 1_048_576.0;

/// A ball, at rest or on a straight way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ball {
    /// In the middle of the way.
    center: DVec3,
    radius: f64,
    /// How far it gets from there, by coordinate; 0 at rest, else with the margin.
    half_way: DVec3,
}

impl Ball {
    pub(super) fn of(sphere: &Sphere) -> Self {
        Self::new(sphere.center, sphere.radius, sphere.motion)
    }

    pub(super) fn new(center: DVec3, radius: f64, motion: DVec3) -> Self {
        Self {
            center,
            radius,
            half_way: 0.5 * (1.0 + MARGIN) * motion.abs(),
        }
    }
}

/// What is known of some balls together.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    /// Least coordinates of the centres.
    low: DVec3,
    /// Greatest coordinates of the centres.
    high: DVec3,
    /// Whether any moves.
    moves: bool,
    /// The least radius.
    pub(super) least: f64,
    /// The greatest radius.
    pub(super) most: f64,
    /// The first ball, in the order in which the tree got them.
    pub(super) first: usize,
    /// The highest mark, 0 for none.
    pub(super) mark: u32,
}

impl Bounds {
    fn of(balls: &[Ball], items: &[usize]) -> Self {
        let nothing = Self {
            low: DVec3::INFINITY,
            high: DVec3::NEG_INFINITY,
            moves: false,
            least: f64::INFINITY,
            most: 0.0,
            first: usize::MAX,
            mark: 0,
        };
        items.iter().fold(nothing, |all, &i| {
            let Ball {
                center,
                radius,
                half_way,
            } = balls[i];
            Self {
                low: all.low.min(center - half_way),
                high: all.high.max(center + half_way),
                moves: all.moves || half_way != DVec3::ZERO,
                least: all.least.min(radius),
                most: all.most.max(radius),
                first: all.first.min(i),
                mark: 0,
            }
        })
    }

    /// No centre's distance from that of `ball` is less, at any time.
    pub(super) fn nearest(&self, ball: &Ball) -> f64 {
        let (low, high) = (ball.center - ball.half_way, ball.center + ball.half_way);
        let gap = (self.low - high).max(low - self.high);
        gap.max(DVec3::ZERO).length() * (1.0 - self.margin(ball))
    }

    /// No centre's distance from that of `ball` is greater, at any time.
    pub(super) fn farthest(&self, ball: &Ball) -> f64 {
        let (low, high) = (ball.center - ball.half_way, ball.center + ball.half_way);
        let gap = (self.low - high).abs().max((self.high - low).abs());
        gap.length() * (1.0 + self.margin(ball))
    }

    /// For distances from `ball`.
    fn margin(&self, ball: &Ball) -> f64 {
        if self.moves || ball.half_way != DVec3::ZERO {
            MARGIN
        } else {
            0.0
        }
    }
}

#[derive(Debug)]
struct Node {
    bounds: Bounds,
    parent: Option<usize>,
    /// Where its balls are among the items.
    from: usize,
    to: usize,
    /// The second of its two halves, the first being the next node; `None` for a leaf.
    second: Option<usize>,
}

impl Node {
    /// The same with all indices of nodes larger by `shift`.
    fn shifted(self, shift: usize) -> Self {
        Self {
            parent: self.parent.map(|node| node + shift),
            second: self.second.map(|node| node + shift),
            ..self
        }
    }
}

/// Adds the node of `items`, which are those from `from` on, and all below it to `nodes`.
fn build(nodes: &mut Vec<Node>, balls: &[Ball], items: &mut [usize], from: usize) {
    let node = nodes.len();
    let bounds = Bounds::of(balls, items);
    nodes.push(Node {
        bounds,
        parent: None,
        from,
        to: from + items.len(),
        second: None,
    });
    if items.len() <= LEAF {
        return;
    }
    let wide = (bounds.high - bounds.low).extend(bounds.most - bounds.least);
    let axis = wide.max_position();
    let key = |ball: &usize| {
        let Ball { center, radius, .. } = balls[*ball];
        center.extend(radius)[axis]
    };
    let half = items.len() / 2;
    items.select_nth_unstable_by(half, |a, b| key(a).total_cmp(&key(b)));
    let many = items.len() >= PARALLEL;
    let (lower, upper) = items.split_at_mut(half);
    let second = if many {
        let half_of = |items: &mut [usize], from: usize| {
            let mut nodes = Vec::new();
            build(&mut nodes, balls, items, from);
            nodes
        };
        let (lower, upper) = rayon::join(|| half_of(lower, from), || half_of(upper, from + half));
        let second = node + 1 + lower.len();
        nodes.extend(lower.into_iter().map(|n| n.shifted(node + 1)));
        nodes.extend(upper.into_iter().map(|n| n.shifted(second)));
        second
    } else {
        build(nodes, balls, lower, from);
        let second = nodes.len();
        build(nodes, balls, upper, from + half);
        second
    };
    for half in [node + 1, second] {
        nodes[half].parent = Some(node);
    }
    nodes[node].second = Some(second);
}

/// Balls, halved again and again along the widest of x, y, z and radius.
#[derive(Debug, Default)]
pub(super) struct Tree {
    nodes: Vec<Node>,
    items: Vec<usize>,
    /// By ball: its leaf.
    leaves: Vec<usize>,
}

impl Tree {
    /// A tree of balls.
    pub(super) fn new(balls: &[Ball]) -> Self {
        let mut items: Vec<usize> = (0..balls.len()).collect();
        let mut nodes = Vec::new();
        if !items.is_empty() {
            build(&mut nodes, balls, &mut items, 0);
        }
        let mut leaves = vec![0; balls.len()];
        for (i, node) in nodes.iter().enumerate() {
            if node.second.is_none() {
                for ball in &items[node.from..node.to] {
                    leaves[*ball] = i;
                }
            }
        }
        Self {
            nodes,
            items,
            leaves,
        }
    }

    /// Raises the mark of `ball` to at least `mark`.
    pub(super) fn mark(&mut self, ball: usize, mark: u32) {
        let mut next = Some(self.leaves[ball]);
        while let Some(node) = next
            && self.nodes[node].bounds.mark < mark
        {
            self.nodes[node].bounds.mark = mark;
            next = self.nodes[node].parent;
        }
    }

    /// Looks at all balls but those in boxes whose balls cannot change the answer any more, given what is
    /// known of it: these promise `None`. Of two boxes the one that promises more comes first.
    pub(super) fn search<A>(
        &self,
        answer: &mut A,
        promise: impl Fn(&A, &Bounds) -> Option<f64>,
        mut look: impl FnMut(&mut A, usize),
    ) {
        let mut waiting = Vec::new();
        if !self.nodes.is_empty() {
            waiting.push(0);
        }
        while let Some(next) = waiting.pop() {
            let node = &self.nodes[next];
            // The answer may have changed since it was put there.
            if promise(answer, &node.bounds).is_none() {
                continue;
            }
            let Some(second) = node.second else {
                for &ball in &self.items[node.from..node.to] {
                    look(answer, ball);
                }
                continue;
            };
            let first = next + 1;
            let [a, b] = [first, second].map(|half| promise(answer, &self.nodes[half].bounds));
            let halves = if a < b {
                [(a, first), (b, second)]
            } else {
                [(b, second), (a, first)]
            };
            waiting.extend(
                halves
                    .iter()
                    .filter(|(p, _)| p.is_some())
                    .map(|(_, half)| half),
            );
        }
    }

    /// Whether any ball `is`; boxes that promise `None` hold no such ball.
    pub(super) fn any(
        &self,
        promise: impl Fn(&Bounds) -> Option<f64>,
        is: impl Fn(usize) -> bool,
    ) -> bool {
        let mut found = false;
        self.search(
            &mut found,
            |found, bounds| if *found { None } else { promise(bounds) },
            |found, ball| *found |= is(ball),
        );
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::verify::Random;

    fn balls(count: usize) -> Vec<Ball> {
        let mut random = Random::new("balls in a tree of the placement");
        let mut ball = || {
            let [x, y, z, r] = random.unit4().map(f64::from);
            at(DVec3::new(x, y, z), r)
        };
        (0..count).map(|_| ball()).collect()
    }

    fn at(center: DVec3, radius: f64) -> Ball {
        Ball::new(center, radius, DVec3::ZERO)
    }

    /// The nearest of the balls to a point, by the tree.
    fn nearest(tree: &Tree, balls: &[Ball], point: DVec3) -> usize {
        let mut answer = (f64::INFINITY, 0);
        tree.search(
            &mut answer,
            |(best, _), bounds| Some(-bounds.nearest(&at(point, 0.0))).filter(|near| -near < *best),
            |answer, ball| {
                let distance = balls[ball].center.distance(point);
                if distance < answer.0 {
                    *answer = (distance, ball);
                }
            },
        );
        answer.1
    }

    #[test]
    fn trees_built_side_by_side_are_one_tree() {
        let balls = balls(5 * PARALLEL);
        let mut tree = Tree::new(&balls);
        for (i, node) in tree.nodes.iter().enumerate() {
            let Some(second) = node.second else {
                continue;
            };
            let halves = [&tree.nodes[i + 1], &tree.nodes[second]];
            assert!(halves.iter().all(|half| half.parent == Some(i)));
            assert_eq!(
                [halves[0].from, halves[0].to, halves[1].from, halves[1].to],
                [node.from, halves[1].from, halves[0].to, node.to]
            );
        }
        assert!((0..balls.len()).all(|ball| {
            let leaf = &tree.nodes[tree.leaves[ball]];
            leaf.second.is_none() && tree.items[leaf.from..leaf.to].contains(&ball)
        }));
        let points: Vec<DVec3> = balls
            .iter()
            .step_by(4001)
            .map(|b| b.center * 1.1 - 0.05)
            .collect();
        for point in &points {
            let distance = |ball: &usize| balls[*ball].center.distance(*point);
            let brute = (0..balls.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)));
            assert_eq!(Some(nearest(&tree, &balls, *point)), brute);
        }
        tree.mark(77, 5);
        assert_eq!((tree.nodes[0].bounds.mark, mark_at(&tree, 77)), (5, 5));
        // Companion: with the second half of the root taken for a part of the first, answers are missed.
        tree.nodes[0].second = Some(1);
        let missed = points.iter().filter(|point| {
            let distance = |ball: usize| balls[ball].center.distance(**point);
            let found = distance(nearest(&tree, &balls, **point));
            (0..balls.len()).any(|ball| distance(ball) < found)
        });
        assert!(missed.count() > points.len() / 4);
    }

    /// The mark of the leaf of a ball.
    fn mark_at(tree: &Tree, ball: usize) -> u32 {
        tree.nodes[tree.leaves[ball]].bounds.mark
    }
}

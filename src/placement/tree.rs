//! Balls in a tree, so that a question to all of them looks at a few.
//!
//! No answer may depend on the tree: each is that of asking every ball in turn, bit for bit. What a box of
//! balls can answer at most is computed by the very operations that its balls are asked with, and these
//! (differences, products, sums, square roots) are monotone in f64: a bound needs no margin for rounding.
//!
//! A question takes the time of a logarithm of all and of what comes near: balls that a box cannot rule out, such as
//! many large surfaces that just miss one small ball, are asked one by one. Of dielectrics such a crowd is refused
//! anyway: large balls that nearly touch one point share points with each other, all but a few, and need as many
//! levels of priority.
//!
//! A tree of our own, since those of others know neither marks that rise while it is in use nor an order
//! among balls, and these keep questions short where most balls share points.

use glam::DVec3;

/// Balls in one leaf.
const LEAF: usize = 8;

/// What is known of some balls together.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    /// Least coordinates of the centres.
    low: DVec3,
    /// Greatest coordinates of the centres.
    high: DVec3,
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
    fn of(balls: &[(DVec3, f64)], items: &[usize]) -> Self {
        let nothing = Self {
            low: DVec3::INFINITY,
            high: DVec3::NEG_INFINITY,
            least: f64::INFINITY,
            most: 0.0,
            first: usize::MAX,
            mark: 0,
        };
        items.iter().fold(nothing, |all, &i| {
            let (center, radius) = balls[i];
            Self {
                low: all.low.min(center),
                high: all.high.max(center),
                least: all.least.min(radius),
                most: all.most.max(radius),
                first: all.first.min(i),
                mark: 0,
            }
        })
    }

    /// No centre's distance from `point` is less.
    pub(super) fn nearest(&self, point: DVec3) -> f64 {
        let gap = (self.low - point).max(point - self.high);
        gap.max(DVec3::ZERO).length()
    }

    /// No centre's distance from `point` is greater.
    pub(super) fn farthest(&self, point: DVec3) -> f64 {
        let gap = (self.low - point).abs().max((self.high - point).abs());
        gap.length()
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

/// Balls, halved again and again along the widest of x, y, z and radius.
#[derive(Debug, Default)]
pub(super) struct Tree {
    nodes: Vec<Node>,
    items: Vec<usize>,
    /// By ball: its leaf.
    leaves: Vec<usize>,
}

impl Tree {
    /// A tree of balls, as centre and radius.
    pub(super) fn new(balls: &[(DVec3, f64)]) -> Self {
        let mut tree = Self {
            nodes: Vec::new(),
            items: (0..balls.len()).collect(),
            leaves: vec![0; balls.len()],
        };
        if !balls.is_empty() {
            tree.build(balls, None, 0, balls.len());
        }
        tree
    }

    fn build(
        &mut self,
        balls: &[(DVec3, f64)],
        parent: Option<usize>,
        from: usize,
        to: usize,
    ) -> usize {
        let node = self.nodes.len();
        let items = &mut self.items[from..to];
        let bounds = Bounds::of(balls, items);
        self.nodes.push(Node {
            bounds,
            parent,
            from,
            to,
            second: None,
        });
        if items.len() <= LEAF {
            for ball in items {
                self.leaves[*ball] = node;
            }
            return node;
        }
        let wide = (bounds.high - bounds.low).extend(bounds.most - bounds.least);
        let axis = wide.max_position();
        let key = |ball: &usize| {
            let (center, radius) = balls[*ball];
            center.extend(radius)[axis]
        };
        let half = items.len() / 2;
        items.select_nth_unstable_by(half, |a, b| key(a).total_cmp(&key(b)));
        self.build(balls, Some(node), from, from + half);
        let second = self.build(balls, Some(node), from + half, to);
        self.nodes[node].second = Some(second);
        node
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

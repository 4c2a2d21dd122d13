//! Dielectrics that share points: which of them fills the space there.
//!
//! Part of the placement: geometry in f64, decided once.

use std::cmp::Ordering;

use glam::DVec3;

use super::sphere::ROUNDING;
use super::tree::{self, Bounds, Tree};
use crate::scene::Scene;
use crate::scene::motion::Distances;

/// The most levels: the kernel keeps the set of media a path is in as the bits of a word.
pub const MAX_LEVELS: u32 = 32;

/// The precedence of a scene's dielectrics, as far as any of them touch, nest or overlap.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Media {
    /// How many levels there are; 0 if no two dielectrics share a point.
    pub levels: u32,
    /// Level of each sphere of the scene; two dielectrics that share a point differ, and the higher
    /// one fills it. 0 for what is no dielectric.
    pub level: Vec<u32>,
    /// The dielectrics that the camera is in, `sphere` being the scene's index.
    pub camera: Vec<Medium>,
    /// The first two spheres found to share a point.
    pub example: Option<[usize; 2]>,
}

/// A dielectric that a path is in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Medium {
    /// Its precedence.
    pub level: u32,
    /// Its refractive index.
    pub ior: f64,
    /// Its sphere.
    pub sphere: usize,
}

struct Ball {
    source: usize,
    /// From the camera.
    center: DVec3,
    motion: DVec3,
    radius: f64,
    ior: f64,
}

impl Ball {
    /// Whether the two share a point at any time. (Where they just touch beside each other along x, rounding decides
    /// twice.)
    fn meets(&self, other: &Self) -> bool {
        let distances = Distances::of(self.center - other.center, self.motion - other.motion);
        distances.least <= self.radius + other.radius
            && self.left() <= other.right()
            && other.left() <= self.right()
    }

    /// Whether a ball within the bounds may meet it.
    fn may_meet(&self, bounds: &Bounds) -> bool {
        bounds.nearest(&self.as_asked()) <= self.radius + bounds.most
    }

    fn as_asked(&self) -> tree::Ball {
        tree::Ball::new(self.center, self.radius, self.motion)
    }

    fn left(&self) -> f64 {
        self.center.x - 0.5 * self.motion.x.abs() - self.radius
    }

    fn right(&self) -> f64 {
        self.center.x + 0.5 * self.motion.x.abs() + self.radius
    }
}

impl Media {
    /// The precedence of the dielectrics of `scene`: the higher `priority` (0 if there is none),
    /// then the smaller radius, then the lower index; those that are not `reachable` are not there.
    #[must_use]
    pub fn new(scene: &Scene, reachable: &[bool]) -> Self {
        let mut balls: Vec<Ball> = scene
            .spheres
            .iter()
            .enumerate()
            .filter(|(source, _)| reachable[*source])
            .map(|(source, s)| (source, s, &scene.materials[s.material].kind))
            .filter(|(_, _, kind)| kind.transmits())
            .map(|(source, s, kind)| Ball {
                source,
                center: s.center - scene.camera.position,
                motion: s.motion,
                radius: s.radius,
                ior: kind.ior(),
            })
            .collect();
        // From low to high precedence.
        balls.sort_by(|a, b| precedence(scene, a.source, b.source));
        let places: Vec<tree::Ball> = balls.iter().map(Ball::as_asked).collect();
        // A ball's mark is one above its level; balls of higher precedence have none yet.
        let mut tree = Tree::new(&places);
        let mut media = Self {
            level: vec![0; scene.spheres.len()],
            ..Self::default()
        };
        for (i, ball) in balls.iter().enumerate() {
            // One above all that it meets and takes precedence over.
            let mut level = 0;
            tree.search(
                &mut level,
                |level, bounds| {
                    (bounds.mark > *level && ball.may_meet(bounds)).then(|| bounds.mark.into())
                },
                |level, j| {
                    if j < i && balls[j].meets(ball) {
                        *level = (*level).max(media.level[balls[j].source] + 1);
                    }
                },
            );
            tree.mark(i, level + 1);
            media.level[ball.source] = level;
            if level > 0 {
                media.levels = media.levels.max(level + 1);
            }
            // It is at all times or at none.
            if Distances::of(ball.center, ball.motion).least < ball.radius * (1.0 - ROUNDING) {
                media.camera.push(Medium {
                    level,
                    ior: ball.ior,
                    sphere: ball.source,
                });
            }
        }
        if media.levels > 0 {
            media.example = example(&balls, &tree);
        }
        media
    }
}

/// The first ball that meets another, and of those that it meets the one that begins first along x.
fn example(balls: &[Ball], tree: &Tree) -> Option<[usize; 2]> {
    let meets_another = |i: usize| {
        let may = |bounds: &Bounds| balls[i].may_meet(bounds).then_some(0.0);
        tree.any(may, |j| j != i && balls[j].meets(&balls[i]))
    };
    let i = (0..balls.len()).find(|i| meets_another(*i))?;
    let others = (0..balls.len()).filter(|j| *j != i && balls[*j].meets(&balls[i]));
    let first = others.min_by(|a, b| balls[*a].left().total_cmp(&balls[*b].left()))?;
    Some([balls[i].source, balls[first].source])
}

/// The order of two dielectrics of `scene`, from low to high precedence.
fn precedence(scene: &Scene, a: usize, b: usize) -> Ordering {
    let (first, second) = (&scene.spheres[a], &scene.spheres[b]);
    let priority = first
        .priority
        .unwrap_or(0)
        .cmp(&second.priority.unwrap_or(0));
    let order = priority.then(second.radius.total_cmp(&first.radius));
    order.then(b.cmp(&a))
}

/// Whether dielectric `a` of `scene` fills the space that it shares with dielectric `b`.
#[must_use]
pub fn precedes(scene: &Scene, a: usize, b: usize) -> bool {
    precedence(scene, a, b) == Ordering::Greater
}

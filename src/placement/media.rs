//! Dielectrics that share points: which of them fills the space there.
//!
//! Part of the placement: geometry in f64, decided once.

use std::cmp::Ordering;

use glam::DVec3;

use super::containment::ROUNDING;
use crate::scene::Scene;

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
    center: DVec3,
    radius: f64,
    ior: f64,
}

impl Ball {
    fn meets(&self, other: &Self) -> bool {
        self.center.distance(other.center) <= self.radius + other.radius
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
                radius: s.radius,
                ior: kind.ior(),
            })
            .collect();
        // From low to high precedence.
        balls.sort_by(|a, b| precedence(scene, a.source, b.source));
        let neighbours = neighbours(&balls);
        let mut media = Self {
            level: vec![0; scene.spheres.len()],
            ..Self::default()
        };
        for (i, ball) in balls.iter().enumerate() {
            // One above all that it meets and takes precedence over.
            let below = neighbours[i].iter().filter(|j| **j < i);
            let level = below
                .map(|j| media.level[balls[*j].source] + 1)
                .max()
                .unwrap_or(0);
            media.level[ball.source] = level;
            if let Some(j) = neighbours[i].first() {
                media.levels = media.levels.max(level + 1);
                media.example.get_or_insert([ball.source, balls[*j].source]);
            }
            if ball.center.length() < ball.radius * (1.0 - ROUNDING) {
                media.camera.push(Medium {
                    level,
                    ior: ball.ior,
                    sphere: ball.source,
                });
            }
        }
        media
    }
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

/// For each ball the others that share a point with it: a sweep along x.
fn neighbours(balls: &[Ball]) -> Vec<Vec<usize>> {
    let mut found = vec![Vec::new(); balls.len()];
    let mut order: Vec<usize> = (0..balls.len()).collect();
    let left = |i: usize| balls[i].center.x - balls[i].radius;
    order.sort_by(|a, b| left(*a).total_cmp(&left(*b)));
    let mut open: Vec<usize> = Vec::new();
    for i in order {
        open.retain(|j| balls[*j].center.x + balls[*j].radius >= left(i));
        for &j in open.iter().filter(|j| balls[**j].meets(&balls[i])) {
            found[i].push(j);
            found[j].push(i);
        }
        open.push(i);
    }
    found
}

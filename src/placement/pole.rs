//! Pole frames: spheres much larger than what is near them get an anchor on their surface.

use glam::DVec3;

use super::tree::{Ball, Tree};
use crate::scene::Scene;
use crate::scene::motion::Distances;

/// A sphere gets a pole frame if something that matters is nearer to its surface than this share
/// of its radius ...
const POLE_NEAR: f64 = 1.0 / 16.0;
/// ... and nothing is farther from it than this many radii, where a pole frame would lose digits.
const POLE_FAR: f64 = 64.0;

/// By sphere of the scene the pole's outward normal, for those of the spheres `all`, in ascending order, that
/// need a pole frame; `centers` are those of the scene's spheres, from the placement's origin. What is near a surface
/// at any time counts, with its place in the middle of the time for which the shutter is open.
///
/// A sphere takes the time of what is near its surface and smaller than [`POLE_NEAR`] times its size, which is
/// summed in order, and a logarithm of all.
pub(super) fn pole_normals(scene: &Scene, centers: &[DVec3], all: &[usize]) -> Vec<Option<DVec3>> {
    let sphere = |i: usize| &scene.spheres[i];
    let balls = all
        .iter()
        .map(|&i| Ball::new(centers[i], sphere(i).radius, sphere(i).motion));
    let poles = Poles {
        scene,
        centers,
        all,
        tree: Tree::new(&balls.collect::<Vec<_>>()),
        least: all
            .iter()
            .map(|i| scene.spheres[*i].radius)
            .fold(f64::INFINITY, f64::min),
    };
    let mut normals = vec![None; centers.len()];
    for &i in all {
        normals[i] = poles.normal(i);
    }
    normals
}

/// The pole: the centre is the large number here, and what is left of it the small one.
pub(super) fn pole_point(center: DVec3, radius: f64, normal: DVec3) -> DVec3 {
    center + radius * normal
}

struct Poles<'a> {
    scene: &'a Scene,
    centers: &'a [DVec3],
    all: &'a [usize],
    /// Of the spheres `all`, in that order.
    tree: Tree,
    /// The least radius of all.
    least: f64,
}

impl Poles<'_> {
    /// The pole's outward normal, if sphere `i` needs a pole frame: there are the camera or much
    /// smaller spheres close to its surface. The pole is the surface point nearest to the middle of
    /// these.
    fn normal(&self, i: usize) -> Option<DVec3> {
        let (center, radius) = (self.centers[i], self.scene.spheres[i].radius);
        let small = POLE_NEAR * radius;
        if self.least >= small && self.is_alone(i) {
            return None;
        }
        let eye = self.scene.camera.position;
        let eye = eye - (self.scene.spheres[i].center - center);
        let distances = Distances::of(center - eye, self.scene.spheres[i].motion);
        if distances.farthest_gap(radius) > POLE_FAR * radius || self.is_far(i) {
            return None;
        }
        let mut near = self.near(i);
        if distances.gap(radius) < POLE_NEAR * radius {
            near.push(eye);
        }
        if near.is_empty() {
            return None;
        }
        // Offsets are summed rather than points, so that the scene's place does not matter.
        let middle = near.iter().map(|p| *p - center).sum::<DVec3>() / near.len() as f64;
        middle.try_normalize()
    }

    /// Whether the camera is not near the surface of sphere `i`.
    fn is_alone(&self, i: usize) -> bool {
        let sphere = &self.scene.spheres[i];
        let distances = sphere.distances_from(self.scene.camera.position);
        distances.gap(sphere.radius) >= POLE_NEAR * sphere.radius
    }

    /// Sphere `i` as it is asked about.
    fn ball(&self, i: usize) -> Ball {
        let sphere = &self.scene.spheres[i];
        Ball::new(self.centers[i], sphere.radius, sphere.motion)
    }

    /// The distances of the centres of two spheres.
    fn distances(&self, i: usize, j: usize) -> Distances {
        let spheres = &self.scene.spheres;
        let motion = spheres[j].motion - spheres[i].motion;
        Distances::of(self.centers[j] - self.centers[i], motion)
    }

    /// Whether one of the small spheres is too far from the surface of sphere `i`.
    fn is_far(&self, i: usize) -> bool {
        let (own, radius) = (self.ball(i), self.scene.spheres[i].radius);
        // A distance below the radius is none that is far.
        let is_far = |distance: f64| distance - radius > POLE_FAR * radius;
        self.tree.any(
            |bounds| {
                let farthest = bounds.farthest(&own);
                (bounds.least < POLE_NEAR * radius && is_far(farthest)).then_some(farthest)
            },
            |ball| {
                let j = self.all[ball];
                self.scene.spheres[j].radius < POLE_NEAR * radius
                    && is_far(self.distances(i, j).most)
            },
        )
    }

    /// The centres of the small spheres near the surface of sphere `i`, in scene order.
    fn near(&self, i: usize) -> Vec<DVec3> {
        let (own, radius) = (self.ball(i), self.scene.spheres[i].radius);
        let is_near = |gap: f64, size: f64| gap - size < POLE_NEAR * radius;
        let mut found = Vec::new();
        self.tree.search(
            &mut found,
            |_, bounds| {
                let (from, to) = (
                    bounds.nearest(&own) - radius,
                    bounds.farthest(&own) - radius,
                );
                let gap = from.max(-to).max(0.0);
                (bounds.least < POLE_NEAR * radius && is_near(gap, bounds.most)).then_some(0.0)
            },
            |found, ball| {
                let j = self.all[ball];
                let size = self.scene.spheres[j].radius;
                let gap = self.distances(i, j).gap(radius);
                if size < POLE_NEAR * radius && is_near(gap, size) {
                    found.push(ball);
                }
            },
        );
        found.sort_unstable();
        found
            .iter()
            .map(|ball| self.centers[self.all[*ball]])
            .collect()
    }
}

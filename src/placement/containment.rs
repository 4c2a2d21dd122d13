//! What lies in what: spheres that no path can reach, and spheres just within another one.
//!
//! Part of the placement: geometry in f64, decided once, so that f32 is never asked.

use std::collections::HashMap;
use std::hash::BuildHasherDefault;

use fnv::FnvHasher;
use rayon::prelude::*;

use super::media::precedes;
use super::sphere::{ROUNDING, Side};
use super::tree::{Ball, Bounds, Tree};
use crate::scene::{Scene, Sphere};

/// Opaque spheres of either side that are looked at as containers: walls and shells are few and large,
/// and a scene of millions must not take the square of its size.
const CONTAINERS: usize = 64;

/// The most spheres just within one and the same dielectric, none within another of them.
pub const MOST_CORES: usize = 4;

/// A sphere lies just within another if their surfaces are nowhere farther apart than this share of the
/// outer radius: f32 may get the order of such surfaces wrong.
const CLOSE: f64 = 1.0 / 1024.0;

/// Which spheres can be reached by a path at all: not those that equal another one, nor those that
/// an opaque surface hides from the side on which the camera is.
///
/// `coincident` gets each sphere that equals another one, with that. Of equal spheres the first stays, of equal dielectrics the one of higher precedence.
#[must_use]
pub fn reachable(scene: &Scene, sides: &[Side], coincident: &mut Vec<[usize; 2]>) -> Vec<bool> {
    let mut reachable = vec![true; scene.spheres.len()];
    let mut places: HashMap<[u64; 7], usize, BuildHasherDefault<FnvHasher>> = HashMap::default();
    for (i, sphere) in scene.spheres.iter().enumerate() {
        let key = [
            sphere.center.x,
            sphere.center.y,
            sphere.center.z,
            sphere.radius,
            sphere.motion.x,
            sphere.motion.y,
            sphere.motion.z,
        ];
        // -0 is 0.
        let first = *places.entry(key.map(|x| (x + 0.0).to_bits())).or_insert(i);
        if first == i {
            continue;
        }
        if is_dielectric(scene, i) && is_dielectric(scene, first) && precedes(scene, i, first) {
            reachable[first] = false;
            coincident.push([first, i]);
            places.insert(key.map(|x| (x + 0.0).to_bits()), i);
        } else {
            reachable[i] = false;
            coincident.push([i, first]);
        }
    }
    for wall in walls(scene, sides) {
        // A hidden wall hides nothing that what hides it does not: so nothing hides its hider.
        if !reachable[wall] {
            continue;
        }
        let all = reachable.par_iter_mut().enumerate();
        all.for_each(|(i, reachable)| {
            *reachable &= i == wall || !hides(scene, wall, sides[wall], i);
        });
    }
    reachable
}

/// Opaque spheres that may hide others, those first that may hide each other: rooms around the camera,
/// the tightest first, then others, the largest first.
fn walls(scene: &Scene, sides: &[Side]) -> Vec<usize> {
    let radius = |i: &usize| scene.spheres[*i].radius;
    let on = |side: Side| (0..sides.len()).filter(move |i| sides[*i] == side);
    let mut rooms: Vec<usize> = on(Side::Inside).collect();
    let mut solids: Vec<usize> = on(Side::Outside).collect();
    rooms.sort_by(|a, b| radius(a).total_cmp(&radius(b)));
    solids.sort_by(|a, b| radius(b).total_cmp(&radius(a)));
    rooms.truncate(CONTAINERS);
    solids.truncate(CONTAINERS);
    rooms.into_iter().chain(solids).collect()
}

/// Whether the opaque sphere `wall`, of which paths are on `side`, hides all of sphere `i` at all times.
fn hides(scene: &Scene, wall: usize, side: Side, i: usize) -> bool {
    let (outer, inner) = (&scene.spheres[wall], &scene.spheres[i]);
    let distances = outer.distances(inner);
    match side {
        Side::Outside => distances.most + inner.radius <= outer.radius * (1.0 + ROUNDING),
        Side::Inside => {
            let around = distances.most + outer.radius <= inner.radius * (1.0 + ROUNDING);
            // A dielectric around a room fills it.
            (around && !is_dielectric(scene, i))
                || distances.least >= (outer.radius + inner.radius) * (1.0 - ROUNDING)
        }
        Side::Tracked | Side::Sign => false,
    }
}

/// For each sphere the dielectric that it lies just within, if there is one: the tightest. A dielectric
/// has at most [`MOST_CORES`] of them.
#[must_use]
pub fn containers(scene: &Scene, sides: &[Side], reachable: &[bool]) -> Vec<Option<usize>> {
    let mut containers = vec![None; scene.spheres.len()];
    let sphere = |i: usize| &scene.spheres[i];
    let placed = || (0..scene.spheres.len()).filter(|i| reachable[*i]);
    let mut outers: Vec<usize> = placed().filter(|i| sides[*i] == Side::Tracked).collect();
    // The tightest first, and of equal ones the first along x.
    outers.sort_by(|a, b| {
        let radius = sphere(*a).radius.total_cmp(&sphere(*b).radius);
        radius.then(sphere(*a).center.x.total_cmp(&sphere(*b).center.x))
    });
    let balls = outers.iter().map(|i| Ball::of(sphere(*i)));
    let tree = Tree::new(&balls.collect::<Vec<_>>());
    for inner in placed().filter(|i| sides[*i] != Side::Sign) {
        let mut tightest = usize::MAX;
        tree.search(
            &mut tightest,
            |tightest, bounds| {
                (bounds.first < *tightest && may_hold(bounds, sphere(inner)))
                    .then_some(-(bounds.first as f64))
            },
            |tightest, outer| {
                if outer < *tightest && just_within(sphere(outers[outer]), sphere(inner)) {
                    *tightest = outer;
                }
            },
        );
        containers[inner] = outers.get(tightest).copied();
    }
    // The order of surfaces is kept for all of a container's spheres or, if it is too crowded for the
    // kernel, for none: half of it would let paths out that cannot come back.
    let mut counts: HashMap<usize, usize> = HashMap::new();
    for container in containers.iter().flatten() {
        *counts.entry(*container).or_default() += 1;
    }
    for container in &mut containers {
        *container = container.filter(|c| counts[c] <= MOST_CORES);
    }
    containers
}

/// Whether `inner` lies within `outer` at all times, and their surfaces are close all around at one.
fn just_within(outer: &Sphere, inner: &Sphere) -> bool {
    let distances = outer.distances(inner);
    let difference = outer.radius - inner.radius;
    let rounding = ROUNDING * outer.radius;
    let close = CLOSE * outer.radius;
    // Where roundings tie, as always.
    let aside = 0.5 * (inner.motion.x - outer.motion.x).abs() + close;
    difference > 0.0
        && difference - distances.most >= -rounding
        && difference + distances.least <= close
        && inner.center.x >= outer.center.x - aside
        && inner.center.x <= outer.center.x + aside
}

/// Whether `inner` may lie just within a sphere within the bounds.
fn may_hold(outers: &Bounds, inner: &Sphere) -> bool {
    let distance = outers.nearest(&Ball::of(inner));
    let [least, most] = [outers.least, outers.most].map(|radius| radius - inner.radius);
    most > 0.0
        && most - distance >= -(ROUNDING * outers.most)
        && least.max(0.0) + distance <= CLOSE * outers.most
}

fn is_dielectric(scene: &Scene, i: usize) -> bool {
    scene.materials[scene.spheres[i].material].kind.transmits()
}

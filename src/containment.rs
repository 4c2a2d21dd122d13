//! What lies in what: spheres that no path can reach, and spheres just within another one.
//!
//! Part of the placement: geometry in f64, decided once, so that f32 is never asked.

use std::collections::HashMap;

use crate::media::precedes;
use crate::placement::Side;
use crate::scene::{MaterialKind, Scene};

/// Opaque spheres, the largest first, that are looked at as containers: walls and shells are few
/// and large, and a scene of millions must not take the square of its size.
const CONTAINERS: usize = 64;

/// Rounding of the sum of a distance and a radius in f64, as a share of it.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// A gap below this share of the outer radius is one that f32 may get wrong.
const CLOSE: f64 = 1.0 / 1024.0;

/// Which spheres can be reached by a path at all: not those that equal another one, nor those that
/// an opaque surface hides from the side on which the camera is.
///
/// Of equal spheres the first stays, of equal dielectrics the one of higher precedence.
#[must_use]
pub fn reachable(scene: &Scene, sides: &[Side]) -> Vec<bool> {
    let mut reachable = vec![true; scene.spheres.len()];
    let mut places: HashMap<[u64; 4], usize> = HashMap::new();
    for (i, sphere) in scene.spheres.iter().enumerate() {
        let key = [
            sphere.center.x,
            sphere.center.y,
            sphere.center.z,
            sphere.radius,
        ];
        // -0 is 0.
        let first = *places.entry(key.map(|x| (x + 0.0).to_bits())).or_insert(i);
        if first == i {
            continue;
        }
        if is_dielectric(scene, i) && is_dielectric(scene, first) && precedes(scene, i, first) {
            reachable[first] = false;
            places.insert(key.map(|x| (x + 0.0).to_bits()), i);
        } else {
            reachable[i] = false;
        }
    }
    let mut walls: Vec<usize> = (0..scene.spheres.len())
        .filter(|i| reachable[*i] && matches!(sides[*i], Side::Outside | Side::Inside))
        .collect();
    walls.sort_by(|a, b| {
        scene.spheres[*b]
            .radius
            .total_cmp(&scene.spheres[*a].radius)
    });
    walls.truncate(CONTAINERS);
    for (i, reachable) in reachable.iter_mut().enumerate() {
        *reachable &= !walls
            .iter()
            .any(|w| *w != i && hides(scene, *w, sides[*w], i));
    }
    reachable
}

/// Whether the opaque sphere `wall`, of which paths are on `side`, hides all of sphere `i`.
fn hides(scene: &Scene, wall: usize, side: Side, i: usize) -> bool {
    let (outer, inner) = (&scene.spheres[wall], &scene.spheres[i]);
    let distance = outer.center.distance(inner.center);
    match side {
        Side::Outside => distance + inner.radius <= outer.radius * (1.0 + ROUNDING),
        Side::Inside => {
            let around = distance + outer.radius <= inner.radius * (1.0 + ROUNDING);
            // A dielectric around a room fills it.
            (around && !is_dielectric(scene, i))
                || distance >= (outer.radius + inner.radius) * (1.0 - ROUNDING)
        }
        Side::Tracked | Side::Sign => false,
    }
}

/// For each sphere the dielectric that it lies just within, if there is one: the tightest.
#[must_use]
pub fn containers(scene: &Scene, sides: &[Side], reachable: &[bool]) -> Vec<Option<usize>> {
    let mut containers = vec![None; scene.spheres.len()];
    let mut order: Vec<usize> = (0..scene.spheres.len()).filter(|i| reachable[*i]).collect();
    let x = |i: usize| scene.spheres[i].center.x;
    order.sort_by(|a, b| x(*a).total_cmp(&x(*b)));
    for &outer in &order {
        if sides[outer] != Side::Tracked {
            continue;
        }
        // A sphere just within another has nearly its radius: their centres are close.
        let reach = CLOSE * scene.spheres[outer].radius;
        let from = order.partition_point(|i| x(*i) < x(outer) - reach);
        let near = order[from..]
            .iter()
            .take_while(|i| x(**i) <= x(outer) + reach);
        for &inner in near.filter(|i| **i != outer && sides[**i] != Side::Sign) {
            let is_in = gap(scene, outer, inner)
                .is_some_and(|gap| gap <= CLOSE * scene.spheres[outer].radius);
            let tighter = |known: usize| scene.spheres[outer].radius < scene.spheres[known].radius;
            if is_in && containers[inner].is_none_or(tighter) {
                containers[inner] = Some(outer);
            }
        }
    }
    containers
}

/// The least distance between the surfaces, if `inner` lies within `outer`.
fn gap(scene: &Scene, outer: usize, inner: usize) -> Option<f64> {
    let (outer, inner) = (&scene.spheres[outer], &scene.spheres[inner]);
    let gap = outer.radius - inner.radius - outer.center.distance(inner.center);
    let rounding = ROUNDING * outer.radius;
    (inner.radius < outer.radius && gap >= -rounding).then_some(gap)
}

fn is_dielectric(scene: &Scene, i: usize) -> bool {
    let material = &scene.materials[scene.spheres[i].material];
    matches!(material.kind, MaterialKind::Dielectric { .. })
}

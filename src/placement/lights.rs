//! Which spheres light sampling chooses from, and how likely each is.
//!
//! Part of the placement: decided once, for both renderers.

use std::collections::HashSet;

use super::sphere::{PlacedSphere, Side};
use super::tree::{Ball, Bounds, Tree};
use crate::materials::luminance;
use crate::scene::{Scene, Sphere};
use crate::settings::{LightSampling, Offset};

/// A sphere that light sampling can choose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Index into the placement's spheres.
    pub sphere: usize,
    /// Luminance of its radiance, where that is a texture of its mean.
    pub luminance: f64,
    /// Of being drawn from the table: its share of the power of all, of walls what is near the picture.
    pub probability: f64,
    /// In the alias table: the entry is this light below the threshold, else `alias`.
    pub threshold: f64,
    /// Index of another light.
    pub alias: usize,
}

/// All lights that are sampled.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Lights {
    /// All of them, as an alias table.
    pub table: Vec<Light>,
    /// By sphere of the placement: its place in the table.
    places: Vec<Option<usize>>,
}

/// Lights up to which each is weighed at each vertex. A choice between 3, where it gains much, and 23, where
/// it gains nothing (`benches/RESULTS.md`); where the gain ends was not measured.
pub const MOST_WEIGHED: usize = 8;

/// The spheres that light sampling finds from outside. Walls (with a pole frame) fill so much of the view
/// that BSDF sampling finds them as well, and the rest of the scene hides most of them: that both look for them
/// still costs less for the same error, but a tenth more in the lecture's scene (`benches/RESULTS.md`). Lamps
/// that only glass can see are left to BSDF sampling.
fn sampled(scene: &Scene, spheres: &[PlacedSphere]) -> Vec<usize> {
    let emits = |s: &PlacedSphere| luminance(scene.materials[s.material].emission) > 0.0;
    let is_lamp = |i: &usize| spheres[*i].side != Side::Inside && emits(&spheres[*i]);
    let lamps: Vec<usize> = (0..spheres.len()).filter(is_lamp).collect();
    let sources: Vec<usize> = lamps.iter().map(|i| spheres[*i].source).collect();
    let sealed = sealed(scene, &sources);
    let lamps = lamps.into_iter().zip(sealed);
    lamps
        .filter(|(_, sealed)| !sealed)
        .map(|(i, _)| i)
        .collect()
}

/// For each of the scene's spheres `lamps`, whether a dielectric is all around it, and nothing in that scatters
/// light but in delta lobes: to every vertex that looks for lights, its surface hides the lamp.
fn sealed(scene: &Scene, lamps: &[usize]) -> Vec<bool> {
    let sphere = |i: usize| &scene.spheres[i];
    let kind = |i: &usize| &scene.materials[sphere(*i).material].kind;
    let tree = |some: &[usize]| {
        let balls = some.iter().map(|i| Ball::of(sphere(*i)));
        Tree::new(&balls.collect::<Vec<_>>())
    };
    if lamps.is_empty() {
        return Vec::new();
    }
    let all = 0..scene.spheres.len();
    let rough: Vec<usize> = all.clone().filter(|i| !kind(i).is_delta()).collect();
    let rough_tree = tree(&rough);
    // Dielectrics with nothing in them that scatters, and lamps that are alone in one.
    let mut clear = Vec::new();
    let mut alone = HashSet::new();
    for glass in all.filter(|i| kind(i).transmits() && kind(i).is_delta()) {
        // If there are two, one is left beside any lamp.
        let mut inside = Vec::new();
        rough_tree.search(
            &mut inside,
            |inside: &Vec<usize>, bounds| {
                (inside.len() < 2 && may_reach_into(sphere(glass), bounds)).then_some(0.0)
            },
            |inside, ball| {
                let i = rough[ball];
                if inside.len() < 2 && i != glass && reaches_into(sphere(glass), sphere(i)) {
                    inside.push(i);
                }
            },
        );
        match inside[..] {
            [] => clear.push(glass),
            [lamp] if holds(sphere(glass), sphere(lamp)) => _ = alone.insert(lamp),
            _ => {}
        }
    }
    let clear_tree = tree(&clear);
    let is_sealed = |lamp: &usize| {
        let inner = sphere(*lamp);
        let may_hold = |bounds: &Bounds| {
            (bounds.nearest(&Ball::of(inner)) + inner.radius <= bounds.most).then_some(bounds.most)
        };
        alone.contains(lamp)
            || clear_tree.any(may_hold, |ball| {
                clear[ball] != *lamp && holds(sphere(clear[ball]), inner)
            })
    };
    lamps.iter().map(is_sealed).collect()
}

/// Whether all of `inner` is in `outer` at all times.
fn holds(outer: &Sphere, inner: &Sphere) -> bool {
    inner.distances(outer).most + inner.radius <= outer.radius
}

/// Whether some of the surface of `other` is in `glass` at any time.
fn reaches_into(glass: &Sphere, other: &Sphere) -> bool {
    let distances = other.distances(glass);
    let apart = distances.least >= glass.radius + other.radius;
    let around = distances.most + glass.radius <= other.radius;
    !apart && !around
}

/// Whether a sphere within the bounds may reach into `glass`.
fn may_reach_into(glass: &Sphere, bounds: &Bounds) -> bool {
    let ball = Ball::of(glass);
    let apart = bounds.nearest(&ball) >= glass.radius + bounds.most;
    let around = bounds.farthest(&ball) + glass.radius <= bounds.least;
    !apart && !around
}

/// How far the spheres without a pole frame reach. A wall sends no more than a lamp of this radius at this
/// distance would; what is beyond sends nothing into the picture.
fn extent(spheres: &[PlacedSphere]) -> f64 {
    let centered = spheres.iter().filter(|s| s.pole.is_none());
    let distances = centered.map(|s| s.anchor.length() + s.radius + 0.5 * s.motion.length());
    let farthest = distances.fold(0.0, f64::max);
    // Of walls alone none is larger than another, in whatever unit.
    if farthest > 0.0 { farthest } else { 1.0 }
}

impl Lights {
    /// The lights among `spheres`, those of `scene` as they are placed, for paths that leave surfaces by `offset`;
    /// none if the lens straddles a lamp: what is sampled and what is not must be known when a ray hits it.
    #[must_use]
    pub fn new(scene: &Scene, spheres: &[PlacedSphere], offset: Offset) -> Self {
        let unknown = |s: &PlacedSphere| {
            s.side == Side::Sign && scene.materials[s.material].emission.max_element() > 0.0
        };
        if offset == Offset::Exact && spheres.iter().any(unknown) {
            return Self::default();
        }
        let emitted = |i: usize| luminance(scene.materials[spheres[i].material].mean_emission());
        let picture = extent(spheres);
        let size = |s: &PlacedSphere| match s.pole {
            Some(_) => s.radius.min(picture),
            None => s.radius,
        };
        let chosen: Vec<(usize, f64)> = sampled(scene, spheres)
            .into_iter()
            .map(|i| (i, size(&spheres[i]).powi(2) * emitted(i)))
            .collect();
        let total: f64 = chosen.iter().map(|(_, power)| power).sum();
        if chosen.is_empty() || !(total > 0.0 && total.is_finite()) {
            return Self::default();
        }
        let probabilities: Vec<f64> = chosen.iter().map(|(_, power)| power / total).collect();
        let entries = alias_table(&probabilities).into_iter().enumerate();
        let table: Vec<Light> = entries
            .map(|(i, (threshold, alias))| Light {
                sphere: chosen[i].0,
                luminance: emitted(chosen[i].0),
                probability: probabilities[i],
                threshold,
                alias,
            })
            .collect();
        let mut places = vec![None; spheres.len()];
        for (place, light) in table.iter().enumerate() {
            places[light.sphere] = Some(place);
        }
        Self { table, places }
    }

    /// The light that the placement's sphere `index` is, if it is sampled.
    #[must_use]
    pub fn of_sphere(&self, index: usize) -> Option<&Light> {
        self.places.get(index)?.map(|place| &self.table[place])
    }

    /// Whether lights are drawn from the table, rather than weighed at each vertex.
    #[must_use]
    pub fn from_table(&self, sampling: LightSampling) -> bool {
        sampling == LightSampling::Cone || self.table.len() > MOST_WEIGHED
    }
}

/// Threshold and alias of each entry: Vose, "A Linear Algorithm for Generating Random Numbers with a
/// Given Distribution" (IEEE Trans. Software Eng. 17(9), 1991).
pub(super) fn alias_table(probabilities: &[f64]) -> Vec<(f64, usize)> {
    let count = probabilities.len();
    let mut scaled: Vec<f64> = probabilities.iter().map(|p| p * count as f64).collect();
    let mut table: Vec<(f64, usize)> = (0..count).map(|i| (1.0, i)).collect();
    let (mut small, mut large): (Vec<usize>, Vec<usize>) =
        (0..count).partition(|i| scaled[*i] < 1.0);
    while !large.is_empty()
        && let Some(less) = small.pop()
        && let Some(&more) = large.last()
    {
        table[less] = (scaled[less], more);
        scaled[more] -= 1.0 - scaled[less];
        if scaled[more] < 1.0 {
            large.pop();
            small.push(more);
        }
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_alias_table_has_the_probabilities() {
        for count in [1usize, 2, 3, 17, 1000] {
            let raw: Vec<f64> = (0..count).map(|i| ((i * 7919) % 101 + 1) as f64).collect();
            let total: f64 = raw.iter().sum();
            let wanted: Vec<f64> = raw.iter().map(|x| x / total).collect();
            let mut found = vec![0.0; count];
            for (i, (threshold, alias)) in alias_table(&wanted).into_iter().enumerate() {
                found[i] += threshold / count as f64;
                found[alias] += (1.0 - threshold) / count as f64;
            }
            for (a, b) in wanted.iter().zip(&found) {
                assert!((a - b).abs() < 1.0e-12, "{count}: {a} {b}");
            }
        }
    }
}

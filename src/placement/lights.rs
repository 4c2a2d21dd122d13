//! Which spheres light sampling chooses from, and how likely each is.
//!
//! Part of the placement: decided once, for both renderers.

use super::{PlacedSphere, Placement, Side};
use crate::scene::{Scene, Sphere, luminance};
use crate::settings::{LightSampling, Offset};

/// A sphere that light sampling can choose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Index into the placement's spheres.
    pub sphere: usize,
    /// Luminance of its radiance.
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

/// Whether light sampling finds this sphere from outside. Walls (with a pole frame) fill so much of the view
/// that BSDF sampling finds them as well, and the rest of the scene hides most of them: that both look for them
/// still costs less for the same error, but a tenth more in the lecture's scene (`benches/RESULTS.md`). Lamps
/// that only glass can see are left to BSDF sampling.
fn is_sampled(scene: &Scene, sphere: &PlacedSphere) -> bool {
    let emission = scene.materials[sphere.material].emission;
    sphere.side != Side::Inside && luminance(emission) > 0.0 && !is_sealed(scene, sphere.source)
}

/// Whether a dielectric is all around `scene.spheres[lamp]`, and nothing in it scatters light but in
/// delta lobes: to every vertex that looks for lights, its surface hides the lamp.
fn is_sealed(scene: &Scene, lamp: usize) -> bool {
    let kind = |sphere: &Sphere| scene.materials[sphere.material].kind;
    let smooth = |sphere: &Sphere| kind(sphere).is_delta();
    let inner = &scene.spheres[lamp];
    scene.spheres.iter().enumerate().any(|(glass, outer)| {
        let distance = |other: &Sphere| other.center.distance(outer.center);
        let reaches = |other: &Sphere| {
            let apart = distance(other) >= outer.radius + other.radius;
            let around = distance(other) + outer.radius <= other.radius;
            !apart && !around
        };
        glass != lamp
            && kind(outer).transmits()
            && distance(inner) + inner.radius <= outer.radius
            && !scene
                .spheres
                .iter()
                .enumerate()
                .any(|(i, other)| i != lamp && i != glass && !smooth(other) && reaches(other))
    })
}

/// How far the spheres without a pole frame reach. A wall sends no more than a lamp of this radius at this
/// distance would; what is beyond sends nothing into the picture.
fn extent(placement: &Placement) -> f64 {
    let centered = placement.spheres.iter().filter(|s| s.pole.is_none());
    let reach = centered.map(|s| s.anchor.length() + s.radius);
    let farthest = reach.fold(0.0, f64::max);
    // Of walls alone none is larger than another, in whatever unit.
    if farthest > 0.0 { farthest } else { 1.0 }
}

impl Lights {
    /// The lights of `scene`; none if the lens straddles a lamp: what is sampled and what is not must
    /// be known when a ray hits it.
    #[must_use]
    pub fn new(scene: &Scene, placement: &Placement) -> Self {
        let unknown = |s: &PlacedSphere| {
            s.side == Side::Sign && scene.materials[s.material].emission.max_element() > 0.0
        };
        if placement.offset == Offset::Exact && placement.spheres.iter().any(unknown) {
            return Self::default();
        }
        let emitted = |i: usize| luminance(scene.materials[placement.spheres[i].material].emission);
        let picture = extent(placement);
        let size = |s: &PlacedSphere| match s.pole {
            Some(_) => s.radius.min(picture),
            None => s.radius,
        };
        let spheres = placement.spheres.iter().enumerate();
        let chosen: Vec<(usize, f64)> = spheres
            .filter(|(_, s)| is_sampled(scene, s))
            .map(|(i, s)| (i, size(s).powi(2) * emitted(i)))
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
        let mut places = vec![None; placement.spheres.len()];
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
fn alias_table(probabilities: &[f64]) -> Vec<(f64, usize)> {
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

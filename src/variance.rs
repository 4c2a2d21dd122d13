//! What the materials of a scene say about an estimate: whether samples can show its variance, and what
//! the bounce limit can have cost.

use std::collections::BTreeSet;

use crate::film::{Estimate, Film};
use crate::materials::{Form, Material};
use crate::placement::{PlacedSphere, Placement, Side};
use crate::scene::{Environment, Scene};
use crate::settings::{Integrator, Settings};

/// A bound on the share of the image's energy that the bounce limit removed, a fraction; 0 if it cut
/// no path, `None` where no bound is known: some material keeps all light, or adds to it.
///
/// A cut path could still have brought its throughput times the largest radiance that a surface can
/// send, E/(1 - rho) with E the largest emission or environment and rho the largest albedo.
#[must_use]
pub fn energy_cut_at_most(scene: &Scene, film: &Film) -> Option<f64> {
    let tally = film.tally();
    if tally.cut_paths == 0 {
        return Some(0.0);
    }
    let places: BTreeSet<usize> = scene.spheres.iter().map(|s| s.material).collect();
    let used = || places.iter().map(|place| &scene.materials[*place]);
    let albedo = used()
        .map(|material| material.albedo().max_element())
        .fold(0.0, f64::max);
    let emitted = used()
        .map(|material| material.emission.max_element())
        .chain(scene.environment.as_ref().map(Environment::brightest))
        .fold(0.0, f64::max);
    let estimate = Estimate::of(film);
    // Paths of unequal weight have no such sum.
    let uneven = film.steps() > 1;
    if albedo >= 1.0 || uneven || estimate.is_black() {
        return None;
    }
    let removed = tally.cut_throughput / film.paths() as f64 * albedo * emitted / (1.0 - albedo);
    Some(removed / estimate.mean)
}

/// What is known of a sample's variance before anything is rendered.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum VarianceClass {
    /// It is finite, and so is that of its estimate.
    #[default]
    Finite,
    /// It is finite; its estimate from samples may have no finite variance, and is too small as a rule.
    HeavyTailed,
    /// It may be infinite: any estimate from samples is without meaning.
    Infinite,
}

/// How large a sample can be, and why.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VarianceReport {
    /// The class.
    pub class: VarianceClass,
    /// What the user should know; `None` where all is well.
    pub warning: Option<String>,
}

/// Judges the variance of the estimator that `settings` choose.
///
/// The lecture's estimator goes on with the constant probability 1 - p and divides by it, so that the
/// k-th moment of a path's weight changes at every event by a factor, `moment_factor`, which may be
/// more than 1. If the geometric mean of these factors is less than 1 along every path, the k-th
/// moment of a sample is finite: k = 2 is the variance, k = 4 the variance of its estimate. In a
/// closed sphere that is necessary too; elsewhere light may get away before it matters, which is not
/// looked at. Radiance that roulette keeps in bounds has no such trouble.
#[must_use]
pub fn variance_class(scene: &Scene, placement: &Placement, settings: &Settings) -> VarianceReport {
    let Integrator::Lecture { termination } = settings.integrator else {
        return VarianceReport::default();
    };
    [
        (2, VarianceClass::Infinite),
        (4, VarianceClass::HeavyTailed),
    ]
    .into_iter()
    .filter(|(k, _)| settings.max_bounces > harmless_bounces(*k, termination))
    .find_map(|(k, class)| {
        let cycle = worst_cycle(scene, placement, k, termination)?;
        (cycle.factor >= 1.0).then(|| VarianceReport {
            class,
            warning: Some(cycle.warning(scene, class, k, termination)),
        })
    })
    .unwrap_or_default()
}

/// The most events of a path whose k-th moment samples still see: with a limit on bounces all moments
/// are finite on paper, but those of long paths rest on paths that no render meets.
///
/// Seeing a mean under another distribution takes about exp(D) samples, D being the divergence of the
/// two (Chatterjee and Diaconis 2018). The paths on which the k-th moment rests go on at every
/// event, and their cosines have the density (k + 1) c^k instead of 1: D = ln(k + 1) - k/(k + 1) -
/// ln(1 - p) an event. No error is estimated from fewer than 64 samples.
fn harmless_bounces(k: i32, termination: f64) -> u32 {
    let k = f64::from(k);
    let divergence = (k + 1.0).ln() - k / (k + 1.0) - (-termination).ln_1p();
    (64f64.ln() / divergence) as u32
}

/// The factor by which an event at a material changes the k-th moment of a path's weight in a colour
/// channel, at most: the survivors, 1 - p of all, are divided by 1 - p.
fn moment_factor(material: &Material, channel: usize, k: i32, termination: f64) -> f64 {
    material.moment(channel, k) / (1.0 - termination).powi(k - 1)
}

/// Surfaces between which the moments of weights grow most.
#[derive(Debug)]
struct Cycle {
    /// The geometric mean of an event's factor.
    factor: f64,
    /// Indices of one or two materials.
    materials: Vec<usize>,
    /// The colour channel.
    channel: usize,
}

/// What an event at one sphere does to a moment.
struct Factor {
    factor: f64,
    material: usize,
    /// Whether it can be hit twice in a row.
    sees_itself: bool,
    /// Weights of at most 1, always: no cycle of such spheres alone counts.
    bounded: bool,
}

/// The cycle with the largest factor. A sphere that paths are only outside of is not hit twice in a
/// row: then the two largest factors alternate at best.
fn worst_cycle(scene: &Scene, placement: &Placement, k: i32, termination: f64) -> Option<Cycle> {
    let cycle = |channel| {
        let factor = |sphere: &PlacedSphere| {
            let material = &scene.materials[sphere.material];
            let hemispherical = material.forms().any(Form::is_hemispherical);
            Factor {
                factor: moment_factor(material, channel, k, termination),
                material: sphere.material,
                sees_itself: sphere.side != Side::Outside,
                bounded: !hemispherical && termination == 0.0,
            }
        };
        let factors: Vec<Factor> = placement.spheres.iter().map(factor).collect();
        let mut cycles: Vec<Cycle> = Vec::new();
        let sees_itself = |f: &&Factor| f.sees_itself && !f.bounded;
        for factor in factors.iter().filter(sees_itself) {
            cycles.push(Cycle {
                factor: factor.factor,
                materials: vec![factor.material],
                channel,
            });
        }
        // The largest factor that can grow, with the largest of all others.
        let largest = |skip: Option<usize>, all: bool| {
            let those = factors.iter().enumerate();
            let those = those.filter(|(i, f)| Some(*i) != skip && (all || !f.bounded));
            those.max_by(|(_, a), (_, b)| a.factor.total_cmp(&b.factor))
        };
        if let Some((i, first)) = largest(None, false)
            && let Some((_, second)) = largest(Some(i), true)
        {
            let mut materials = vec![first.material, second.material];
            materials.dedup();
            // A surface that takes all ends every path, whatever the other one does.
            let ended = second.factor == 0.0;
            cycles.push(Cycle {
                factor: if ended {
                    0.0
                } else {
                    (first.factor * second.factor).sqrt()
                },
                materials,
                channel,
            });
        }
        cycles
    };
    (0..3)
        .flat_map(cycle)
        .max_by(|a, b| a.factor.total_cmp(&b.factor))
}

impl Cycle {
    /// Why, and what to do about it.
    fn warning(&self, scene: &Scene, class: VarianceClass, k: i32, termination: f64) -> String {
        let of = |m: &usize| {
            let material = &scene.materials[*m];
            let name = material.name.escape_debug();
            let albedo = material.albedo()[self.channel];
            format!("\"{name}\" (albedo {albedo:.3})")
        };
        let names: Vec<String> = self.materials.iter().map(of).collect();
        let between = names.join(" and ");
        let (says, square) = match class {
            VarianceClass::Infinite => (
                "the variance may be infinite, and the error is unknown",
                "square",
            ),
            _ => (
                "the samples' distribution has a heavy tail, and the estimated error may be too small",
                "fourth power",
            ),
        };
        // The factor is that without termination over (1 - p)^(k - 1).
        let kept = (1.0 - termination) * self.factor.powf(1.0 / f64::from(k - 1));
        let safe = ((1.0 - kept) * 100.0).floor() / 100.0;
        let lower = if safe >= 0.01 {
            format!("use --termination {safe:.2} or less, or --integrator bsdf")
        } else {
            "no --termination is low enough: use --integrator bsdf".into()
        };
        let growth = if self.factor.is_finite() {
            format!("by a factor of up to {:.3}", self.factor)
        } else {
            "without bound".into()
        };
        format!(
            "{says}: with --integrator lecture and a probability of termination of {termination}, \
             the mean {square} of a path's weight grows {growth} at every event \
             between surfaces of {between}; {lower}",
        )
    }
}

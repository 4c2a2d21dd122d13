//! Images of a study: at equal time, at chosen numbers of samples, and f32 against f64.

use serde::Serialize;

use super::analysis::Analysis;
use super::series::{Series, Subject, labels};
use super::store::Store;
use crate::compare::{Errors, HeatMap};
use crate::image::Picture;

/// An image with what the report says of it.
#[derive(Clone, Debug)]
pub struct Shot {
    /// The series.
    pub label: String,
    /// What it took.
    pub caption: String,
    /// The image.
    pub picture: Picture,
    /// Its difference from another.
    pub difference: HeatMap,
}

/// A series against the same samples in f64 without a nudge.
#[derive(Clone, Debug, Serialize)]
pub struct Pair {
    /// The series.
    pub label: String,
    /// At growing numbers of samples.
    pub levels: Vec<PairLevel>,
    /// Name of the last image, among those that were kept.
    #[serde(skip)]
    pub last: Option<(String, String)>,
}

/// Two images of the same samples.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct PairLevel {
    /// Samples a pixel.
    pub spp: u64,
    /// relRMSE against f64.
    pub relrmse: f64,
    /// Relative difference of the means.
    pub mean: f64,
}

/// Name of the image of a run after `spp` samples. All that decides the image within a directory is in
/// the name: what was kept for another run is never taken for it.
#[must_use]
pub fn sample_image(series: &Series, seed: u64, spp: u64) -> String {
    format!("{}-seed{seed}-{spp}spp", series.slug())
}

/// Name of the image of `spp` samples, as many as fit into the time that all series have.
#[must_use]
pub fn equal_time_image(series: &Series, seed: u64, spp: u64) -> String {
    format!("equal-time-{}", sample_image(series, seed, spp))
}

/// Whether images of a series are kept at all marks: it is one of a pair.
#[must_use]
pub fn is_of_pair(subjects: &[Subject], subject: &Subject) -> bool {
    let truth = subject.series.truth();
    let has = |s: &dyn Fn(&Subject) -> bool| subjects.iter().any(s);
    has(&|s| s.series == truth) && has(&|s| s.series.truth() == truth && s.series != truth)
}

/// All pairs with an image of `seed` on either side.
#[must_use]
pub fn pairs(store: &Store, subjects: &[Subject], seed: u64, analysis: &Analysis) -> Vec<Pair> {
    let all: Vec<_> = subjects.iter().map(|s| s.series).collect();
    let names = labels(&all);
    let mut pairs = Vec::new();
    for (subject, label) in subjects.iter().zip(names) {
        let (series, truth) = (subject.series, subject.series.truth());
        if series == truth || !is_of_pair(subjects, subject) {
            continue;
        }
        let summary = analysis.series.iter().find(|s| s.series == series.key());
        let mut pair = Pair {
            label,
            levels: Vec::new(),
            last: None,
        };
        for level in summary.iter().flat_map(|s| &s.levels) {
            let images = [series, truth].map(|s| sample_image(&s, seed, level.spp));
            let [Some(image), Some(exact)] = images.each_ref().map(|name| store.image(name)) else {
                continue;
            };
            if let Some(errors) = Errors::of(&image, &exact) {
                pair.levels.push(PairLevel {
                    spp: level.spp,
                    relrmse: errors.relrmse,
                    mean: errors.bias.overall.unwrap_or_default(),
                });
                let [image, exact] = images;
                pair.last = Some((image, exact));
            }
        }
        if !pair.levels.is_empty() {
            pairs.push(pair);
        }
    }
    pairs
}

/// Lets all difference maps have one scale, the largest: colours then mean the same in all of them.
pub fn align(shots: &mut [Shot]) {
    let range = shots.iter().map(|s| s.difference.range).fold(0.0, f64::max);
    for shot in shots {
        let map = &mut shot.difference;
        map.range = range;
        let beyond = map.errors.iter().filter(|e| **e > range).count();
        map.beyond = beyond as f64 / map.errors.len() as f64;
    }
}

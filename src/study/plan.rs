//! All that decides a study, before anything is rendered.

use super::identity::Identity;
use super::pictures::{is_of_pair, sample_image};
use super::run::Length;
use super::series::{Series, Subject};
use super::store::Store;
use crate::input::Input;
use crate::scene::Loaded;
use crate::settings::Settings;

/// All that decides a study.
#[derive(Debug)]
pub struct Study {
    /// What the report is called.
    pub title: String,
    /// The scene.
    pub loaded: Loaded,
    /// What is compared.
    pub subjects: Vec<Subject>,
    /// The size, and what no series decides.
    pub base: Settings,
    /// A run of each series for each of these.
    pub seeds: std::ops::Range<u64>,
    /// How far each run goes.
    pub length: Length,
    /// What errors are measured against.
    pub reference: ReferenceChoice,
    /// Numbers of samples whose images the report shows.
    pub shown: Vec<u64>,
    /// EV steps that brighten the report's images.
    pub exposure: f64,
    /// The command that makes it again.
    pub command: String,
    /// What all runs share.
    pub identity: Identity,
}

impl Study {
    /// Whether a run is done: it came to its end, and the images that it should keep are there.
    #[must_use]
    pub fn is_done(&self, store: &Store, index: usize, seed: u64) -> bool {
        let series = self.subjects[index].series;
        let key = series.key();
        let has = |spp: u64| store.image(&sample_image(&series, seed, spp)).is_some();
        let run = store
            .runs
            .iter()
            .find(|r| r.seed == seed && r.series == key);
        run.is_some_and(|run| {
            let mut marks = run.points.iter().map(|p| p.spp);
            run.complete && marks.all(|spp| !self.keeps(index, seed, spp) || has(spp))
        })
    }

    /// Whether a run keeps its image of `spp` samples: those of the first seed are shown, and compared
    /// with those of the same samples in f64.
    pub(super) fn keeps(&self, index: usize, seed: u64, spp: u64) -> bool {
        seed == self.seeds.start
            && (self.shown.contains(&spp) || is_of_pair(&self.subjects, &self.subjects[index]))
    }
}

/// What errors are measured against.
#[derive(Debug)]
pub enum ReferenceChoice {
    /// An image from a file.
    File(Box<Input>),
    /// A long render.
    Own {
        /// How it is rendered.
        series: Series,
        /// Samples a pixel.
        spp: u64,
        /// No run has it.
        seed: u64,
    },
}

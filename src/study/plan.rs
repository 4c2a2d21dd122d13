//! All that decides a study, before anything is rendered.

use std::ops::Range;

use super::identity::Identity;
use super::pictures::{is_of_pair, sample_image};
use super::run::Length;
use super::series::{Series, Subject};
use super::store::Store;
use crate::error::{Error, Result};
use crate::image::Format;
use crate::input::Input;
use crate::job::{Job, prepare};
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
    pub seeds: Range<u64>,
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

/// Refuses a reference that is of another scene or size, with both facts, that has not what errors are measured
/// against, or that shares samples with the runs.
///
/// # Errors
/// [`Error::Usage`].
pub fn check_reference(
    input: &Input,
    loaded: &Loaded,
    base: &Settings,
    seeds: &Range<u64>,
) -> Result<()> {
    let (shown, picture) = (input.path.display(), &input.picture);
    if (picture.width, picture.height) != (base.width, base.height) {
        let there = format!("{}x{}", picture.width, picture.height);
        return Err(Error::Usage(format!(
            "the sizes differ: {shown} has {there} pixels, the study {}x{}; if it shows the whole image, \
             add --size {there}",
            base.width, base.height
        )));
    }
    if input.format == Format::Png {
        return Err(Error::Usage(format!(
            "{shown} is a PNG file, which holds nothing above 1 and rounds the rest: use EXR or NPY"
        )));
    }
    let about = |name: &str| input.about.get(name).map(String::as_str);
    if let Some(there) = about("scene_hash").filter(|there| *there != loaded.hash) {
        let scene = about("scene").unwrap_or("?").escape_debug().to_string();
        return Err(Error::Usage(format!(
            "the scenes differ: {shown} shows {scene} ({}), the study is of {} ({})",
            there.escape_debug(),
            loaded.name,
            loaded.hash
        )));
    }
    let seed = about("seed").and_then(|seed| seed.parse().ok());
    seed.map_or(Ok(()), |seed| check_seed(&shown.to_string(), seed, seeds))
}

/// Refuses a reference of that seed, if it is one of the runs'.
fn check_seed(reference: &str, seed: u64, seeds: &Range<u64>) -> Result<()> {
    if !seeds.contains(&seed) {
        return Ok(());
    }
    Err(Error::Usage(format!(
        "{reference} was rendered with seed {seed}, and the study has seeds {} to {}: both would share \
         samples; choose others with --seed, as in --seed {}",
        seeds.start,
        seeds.end - 1,
        seed.wrapping_add(1)
    )))
}

/// Refuses a series with a radiance cache where there can be none: it would be the same without.
///
/// # Errors
/// [`Error::Usage`] with the reason.
pub fn check_cache(loaded: &Loaded, job: &Job) -> Result<()> {
    job.cache_obstacle().map_or(Ok(()), |why| {
        Err(Error::Usage(format!(
            "--radiance-cache on: {} cannot have one: {why}",
            loaded.name
        )))
    })
}

impl Study {
    /// Checks what no single run shows.
    ///
    /// # Errors
    /// Those of [`check_reference`] and [`check_cache`].
    pub fn check(&self) -> Result<()> {
        match &self.reference {
            ReferenceChoice::File(input) => {
                check_reference(input, &self.loaded, &self.base, &self.seeds)?;
            }
            ReferenceChoice::Own { seed, .. } => {
                check_seed("the reference", *seed, &self.seeds)?;
            }
        }
        for Subject { series, .. } in &self.subjects {
            if series.radiance_cache {
                let settings = series.settings(&self.base, self.seeds.start);
                check_cache(&self.loaded, &prepare(&self.loaded.scene, &settings)?)?;
            }
        }
        Ok(())
    }

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

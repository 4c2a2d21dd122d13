//! A study from its reference to its last run.

use super::analysis::{Analysis, Subject, analyse};
use super::measure::{Noise, Reference};
use super::pictures::{equal_time_image, is_of_pair, sample_image};
use super::run::{Length, Observer, Run, advance, execute};
use super::series::{Series, labels};
use super::store::{Identity, REFERENCE, Store};
use super::timetable::{Part, Timetable};
use crate::error::{Error, Result};
use crate::film::Film;
use crate::input::{Input, read};
use crate::output::{Contents, Format, Layer, Metadata, Picture, Snapshot};
use crate::render::Renderer;
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

/// A renderer that is ready, and what that took.
pub struct Opened {
    /// The renderer.
    pub renderer: Box<dyn Renderer>,
    /// Seconds of opening the device and placing the scene.
    pub setup: f64,
    /// Seconds of linking and compiling.
    pub compile: f64,
}

/// What a study needs from outside.
pub trait Host {
    /// Makes a renderer, from the device on: its time is part of what is measured.
    ///
    /// # Errors
    /// If the device cannot be had.
    fn open(&mut self, series: &Series, settings: &Settings) -> Result<Opened>;
    /// Another part of the study begins.
    fn begin(&mut self, part: &str);
    /// How far the study is.
    fn progress(&mut self, snapshot: &Snapshot);
    /// Whether a signal asked to stop.
    fn interrupted(&self) -> bool;
}

/// What a study comes to.
#[derive(Debug)]
pub struct Outcome {
    /// The reference.
    pub reference: Reference,
    /// The same as an image.
    pub picture: Picture,
    /// What it adds to measured errors.
    pub noise: Option<Noise>,
    /// What the runs say.
    pub analysis: Analysis,
    /// Whether every run is done.
    pub complete: bool,
    /// Series, samples and name of each image at equal time, if that came to be.
    pub equal_time: Vec<(usize, u64, String)>,
    /// What ended it early, beside a signal.
    pub failure: Option<Error>,
}

/// What a run shows to the timetable and keeps in the store.
struct Keeper<'a, 'b> {
    timetable: &'a mut Timetable<'b>,
    store: &'a Store,
    slug: String,
    /// Numbers of samples whose images are kept; `None` for all.
    kept: Option<&'a [u64]>,
}

impl Observer for Keeper<'_, '_> {
    fn proceed(&mut self, paths: u64) -> bool {
        self.timetable.report(paths);
        !self.timetable.host.interrupted()
    }

    fn point(&mut self, spp: u64, film: &Film) -> Result<()> {
        if self.kept.is_none_or(|kept| kept.contains(&spp)) {
            self.store
                .keep_image(&sample_image(&self.slug, spp), film)?;
        }
        Ok(())
    }
}

/// Conducts a study; `None` if it was stopped before there was a reference.
///
/// # Errors
/// If there is no reference for another reason. What fails later is in the outcome.
pub fn conduct(study: &Study, store: &mut Store, host: &mut dyn Host) -> Result<Option<Outcome>> {
    let key = |index: usize| study.subjects[index].series.key();
    let is_done = |store: &Store, index: usize, seed: u64| {
        let of = |r: &&Run| r.seed == seed && r.series == key(index);
        store.runs.iter().find(of).is_some_and(|r| r.complete)
    };
    // Series take turns: what disturbs the machine for a while disturbs all of them.
    let turns: Vec<(u64, usize)> = study
        .seeds
        .clone()
        .flat_map(|seed| (0..study.subjects.len()).map(move |i| (seed, i)))
        .collect();
    let count = turns.len();
    let mut timetable = Timetable::new(host, study);
    timetable.pending = turns
        .iter()
        .filter(|(seed, i)| !is_done(store, *i, *seed))
        .map(|(_, series)| Part {
            series: *series,
            samples: study.length.spp,
        })
        .collect();
    let Some(input) = reference(study, store, &mut timetable)? else {
        return Ok(None);
    };
    let reference = Reference::new(&input)?;
    let names = labels(&study.subjects.iter().map(|s| s.series).collect::<Vec<_>>());

    let mut failure = None;
    for (number, (seed, index)) in turns.into_iter().enumerate() {
        if is_done(store, index, seed) {
            continue;
        }
        if timetable.host.interrupted() {
            break;
        }
        let part = Part {
            series: index,
            samples: study.length.spp,
        };
        let name = &names[index];
        timetable.start(
            &format!("run {}/{count}, {name}, seed {seed}", number + 1),
            part,
        );
        if let Err(error) = run(study, store, &mut timetable, &reference, index, seed) {
            failure = Some(error);
            break;
        }
    }
    let noise = reference.noise();
    let mine: Vec<Run> = store
        .runs
        .iter()
        .filter(|r| study.seeds.contains(&r.seed))
        .cloned()
        .collect();
    let analysis = analyse(&study.subjects, &mine, noise, reference.mean);
    let complete = study
        .seeds
        .clone()
        .all(|seed| (0..study.subjects.len()).all(|i| is_done(store, i, seed)));
    let mut equal_time = Vec::new();
    if complete && failure.is_none() {
        match images_at_equal_time(study, store, &mut timetable, &analysis) {
            Ok(images) => equal_time = images,
            Err(error) => failure = Some(error),
        }
    }
    Ok(Some(Outcome {
        reference,
        picture: input.picture,
        noise,
        analysis,
        complete,
        equal_time,
        failure,
    }))
}

fn run(
    study: &Study,
    store: &mut Store,
    timetable: &mut Timetable<'_>,
    reference: &Reference,
    index: usize,
    seed: u64,
) -> Result<()> {
    let subject = &study.subjects[index];
    let series = subject.series;
    let settings = series.settings(&study.base, seed);
    let mut opened = timetable.host.open(&series, &settings)?;
    // Its images are those of the first seed.
    let kept: Option<&[u64]> = match seed == study.seeds.start {
        true if is_of_pair(&study.subjects, subject) => None,
        true => Some(&study.shown),
        false => Some(&[]),
    };
    let mut keeper = Keeper {
        timetable,
        store,
        slug: series.slug(),
        kept,
    };
    let (points, complete, film) = execute(
        opened.renderer.as_mut(),
        settings.crop,
        opened.setup + opened.compile,
        study.length,
        reference,
        &mut keeper,
    )?;
    store.add(Run {
        series: series.key(),
        seed,
        complete,
        device: opened.renderer.device().0,
        setup: opened.setup,
        compile: opened.compile,
        non_finite: film.tally().non_finite,
        points,
    })
}

/// The reference: from its file, or from the study's directory, or rendered and put there.
fn reference(study: &Study, store: &Store, timetable: &mut Timetable<'_>) -> Result<Option<Input>> {
    let (series, spp, seed) = match &study.reference {
        ReferenceChoice::File(input) => return Ok(Some(Input::clone(input))),
        ReferenceChoice::Own { series, spp, seed } => (*series, *spp, *seed),
    };
    let path = store.path(REFERENCE);
    let about = |name: &str, value: &str, input: &Input| {
        input.about.get(name).is_some_and(|there| there == value)
    };
    // The directory's identity says that it is of this scene, and how it was rendered.
    if let Ok(input) = read(&path)
        && about("seed", &seed.to_string(), &input)
        && about("spp", &spp.to_string(), &input)
        && about("scene_hash", &study.loaded.hash, &input)
        && about("backend", series.backend.name(), &input)
    {
        return Ok(Some(input));
    }
    let part = Part {
        series: study.subjects.len(),
        samples: spp,
    };
    timetable.pending.insert(0, part);
    timetable.start("reference", part);
    let settings = series.settings(&study.base, seed);
    let mut opened = timetable.host.open(&series, &settings)?;
    let mut film = Film::new(settings.crop);
    let mut keeper = Keeper {
        timetable,
        store,
        slug: String::new(),
        kept: Some(&[]),
    };
    let (done, _) = advance(opened.renderer.as_mut(), &mut film, 0..spp, &mut keeper)?;
    if !done {
        return Ok(None);
    }
    let rect = film.rect();
    let picture = Picture::new(rect.width, rect.height, film.pixels());
    let errors = (0..rect.pixels()).map(|i| film.variance_of_mean(i));
    let errors: Option<Vec<[f32; 3]>> = errors
        .map(|v| v.map(|v| v.map(|v| v.sqrt() as f32)))
        .collect();
    let layers: Vec<Layer<'_>> = errors
        .iter()
        .map(|values| Layer {
            name: "stderr",
            channels: &["R", "G", "B"],
            values: values.as_flattened(),
        })
        .collect();
    let metadata = Metadata::new()
        .with("version", env!("CARGO_PKG_VERSION"))
        .with("scene", study.loaded.name.as_str())
        .with("scene_hash", study.loaded.hash.as_str())
        .with("seed", seed)
        .with("spp", spp)
        .with("integrator", series.integrator.name())
        .with("sampler", series.sampler.name())
        .with("max_bounces", series.max_bounces)
        .with("backend", series.backend.name())
        .with("device", opened.renderer.device().0);
    let metadata = match film.freedom() {
        Some(freedom) => metadata.with("degrees_of_freedom", freedom),
        None => metadata,
    };
    let contents = Contents {
        picture: &picture,
        layers: &layers,
        metadata: &metadata,
        exposure: 0.0,
    };
    let bytes = contents.encode(Format::Exr).map_err(|source| Error::File {
        action: "cannot write",
        path: path.clone(),
        source,
    })?;
    store.write(REFERENCE, &bytes)?;
    read(&path).map(Some)
}

/// Renders with each series just the samples that fit into the time that all of them have; none if it
/// is stopped before the last.
fn images_at_equal_time(
    study: &Study,
    store: &Store,
    timetable: &mut Timetable<'_>,
    analysis: &Analysis,
) -> Result<Vec<(usize, u64, String)>> {
    let Some(time) = analysis.equal_time.last() else {
        return Ok(Vec::new());
    };
    let mut wanted = Vec::new();
    for (index, subject) in study.subjects.iter().enumerate() {
        let key = subject.series.key();
        let summary = analysis.series.iter().find(|s| s.series == key);
        let Some(spp) = summary.and_then(|s| s.spp_at(time.seconds)) else {
            continue;
        };
        let spp = (spp as u64).max(1);
        let name = equal_time_image(&subject.series.slug(), spp);
        wanted.push((index, spp, name));
    }
    let missing = |w: &&(usize, u64, String)| store.image(&w.2).is_none();
    let missing: Vec<_> = wanted.iter().filter(missing).cloned().collect();
    let part = |w: &(usize, u64, String)| Part {
        series: w.0,
        samples: w.1,
    };
    timetable.pending = missing.iter().map(part).collect();
    for image in &missing {
        timetable.start("images at equal time", part(image));
        let (index, spp, name) = image;
        let series = study.subjects[*index].series;
        let settings = series.settings(&study.base, study.seeds.start);
        let mut opened = timetable.host.open(&series, &settings)?;
        let mut film = Film::new(settings.crop);
        let mut keeper = Keeper {
            timetable,
            store,
            slug: String::new(),
            kept: Some(&[]),
        };
        let (done, _) = advance(opened.renderer.as_mut(), &mut film, 0..*spp, &mut keeper)?;
        if !done {
            return Ok(Vec::new());
        }
        store.keep_image(name, &film)?;
    }
    Ok(wanted)
}

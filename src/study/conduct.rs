//! A study from its reference to its last run.

use super::analysis::{Analysis, analyse};
use super::host::Host;
use super::keeper::Keeper;
use super::measure::{Noise, Reference};
use super::pictures::equal_time_image;
use super::plan::Study;
use super::reference::reference;
use super::run::{Run, advance, execute};
use super::series::labels;
use super::store::Store;
use super::timetable::{Part, Timetable};
use crate::error::{Error, Result};
use crate::film::Film;
use crate::image::Picture;

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

/// Conducts a study; `None` if it was stopped before there was a reference.
///
/// # Errors
/// Those of [`Study::check`], and if there is no reference for another reason. What fails later is in the outcome.
pub fn conduct(study: &Study, store: &mut Store, host: &mut dyn Host) -> Result<Option<Outcome>> {
    study.check()?;
    // Series take turns: what disturbs the machine for a while disturbs all of them.
    let turns: Vec<(u64, usize)> = study
        .seeds
        .clone()
        .flat_map(|seed| (0..study.subjects.len()).map(move |i| (seed, i)))
        .collect();
    let mut done: Vec<bool> = turns
        .iter()
        .map(|(seed, i)| study.is_done(store, *i, *seed))
        .collect();
    let count = turns.len();
    let mut timetable = Timetable::new(host, study);
    timetable.pending = turns
        .iter()
        .zip(&done)
        .filter(|(_, done)| !**done)
        .map(|((_, series), _)| Part {
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
        if done[number] {
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
        match run(study, store, &mut timetable, &reference, index, seed) {
            Ok(complete) => done[number] = complete,
            Err(error) => {
                failure = Some(error);
                break;
            }
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
    let complete = done.iter().all(|done| *done);
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

/// A run; returns whether it came to its end.
fn run(
    study: &Study,
    store: &mut Store,
    timetable: &mut Timetable<'_>,
    reference: &Reference,
    index: usize,
    seed: u64,
) -> Result<bool> {
    let series = study.subjects[index].series;
    let settings = series.settings(&study.base, seed);
    let mut opened = timetable.host.open(&series, &settings)?;
    let mut keeper = Keeper {
        timetable,
        store,
        run: Some((study, index, seed)),
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
    })?;
    Ok(complete)
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
        let name = equal_time_image(&subject.series, study.seeds.start, spp);
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
            run: None,
        };
        let (done, _) = advance(opened.renderer.as_mut(), &mut film, 0..*spp, &mut keeper)?;
        if !done {
            return Ok(Vec::new());
        }
        store.keep_image(name, &film)?;
    }
    Ok(wanted)
}

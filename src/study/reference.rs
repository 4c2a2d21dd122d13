//! The image that a study measures errors against: a file, or a long render of its own.

use super::keeper::Keeper;
use super::plan::{ReferenceChoice, Study};
use super::run::advance;
use super::series::Series;
use super::store::{REFERENCE, Store};
use super::timetable::{Part, Timetable};
use crate::error::{Action, Error, Result};
use crate::film::Film;
use crate::image::exr::{RGB, STDERR};
use crate::image::{Format, Picture};
use crate::input::{Input, read};
use crate::output::{Contents, Layer, Metadata, Value};

/// The reference: from its file, or from the study's directory, or rendered and put there; `None` if
/// it was stopped before the end.
pub(super) fn reference(
    study: &Study,
    store: &Store,
    timetable: &mut Timetable<'_>,
) -> Result<Option<Input>> {
    let (series, spp, seed) = match &study.reference {
        ReferenceChoice::File(input) => return Ok(Some(Input::clone(input))),
        ReferenceChoice::Own { series, spp, seed } => (*series, *spp, *seed),
    };
    let path = store.path(REFERENCE);
    let made = made(study, &series, spp, seed);
    if let Ok(input) = read(&path)
        && serves(&input, study, &made)
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
        run: None,
    };
    let (done, _) = advance(opened.renderer.as_mut(), &mut film, 0..spp, &mut keeper)?;
    if !done {
        return Ok(None);
    }
    let metadata = made
        .with("scene", study.loaded.name.as_str())
        .with("device", opened.renderer.device().0);
    let bytes = encode(&film, metadata).map_err(|source| Error::File {
        action: Action::Write,
        path: path.clone(),
        source,
    })?;
    store.write(REFERENCE, &bytes)?;
    read(&path).map(Some)
}

/// All that decides its pixels but the size and the device.
fn made(study: &Study, series: &Series, spp: u64, seed: u64) -> Metadata {
    Metadata::new()
        .with("version", env!("CARGO_PKG_VERSION"))
        .with("scene_hash", study.loaded.hash.as_str())
        .with("seed", seed)
        .with("spp", spp)
        .with("integrator", series.integrator.name())
        .with("sampler", series.sampler.name())
        .with("max_bounces", series.max_bounces)
        .with("backend", series.backend.name())
}

/// Whether an image is the reference that would be rendered.
fn serves(input: &Input, study: &Study, made: &Metadata) -> bool {
    let (picture, rect) = (&input.picture, study.base.crop);
    let says = |(name, value): &(String, Value)| {
        let there = input.about.get(name);
        there.is_some_and(|there| *there == value.to_string())
    };
    (picture.width, picture.height) == (rect.width, rect.height) && made.entries().iter().all(says)
}

/// An EXR file with the standard errors, where these are known.
fn encode(film: &Film, metadata: Metadata) -> std::io::Result<Vec<u8>> {
    let rect = film.rect();
    let picture = Picture::new(rect.width, rect.height, film.pixels());
    let errors = (0..rect.pixels()).map(|i| film.variance_of_mean(i));
    let errors: Option<Vec<[f32; 3]>> = errors
        .map(|v| v.map(|v| v.map(|v| v.sqrt() as f32)))
        .collect();
    let layers: Vec<Layer<'_>> = errors
        .iter()
        .map(|values| Layer {
            name: STDERR,
            channels: RGB,
            values: values.as_flattened(),
        })
        .collect();
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
    contents.encode(Format::Exr)
}

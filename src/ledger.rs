//! The bias ledger: how much light each setting that is not exact has taken from an image.
//!
//! Measured, not bounded: a few samples are rendered again with the setting and without it, from the same
//! random numbers, so that nearly all noise is in both and falls out of the difference.

use serde::Serialize;

use crate::backend::Backend;
use crate::effects::Effects;
use crate::error::Result;
use crate::film::{Film, Tally};
use crate::placement::Placement;
use crate::render::{Status, StoppedBy, Watch, render};
use crate::scene::{MAX_BOUNCES, Scene};
use crate::settings::{Offset, Settings};

/// What a setting did to the light of an image.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Entry {
    /// The option's name: `max-bounces` or `offset`.
    pub setting: &'static str,
    /// What it was set to.
    pub value: String,
    /// The share of the light that it removed, a fraction; negative if it added some.
    pub removed: f64,
    /// The standard error of `removed`.
    pub standard_error: f64,
    /// What it was compared with: more bounces, or exact ray origins.
    pub against: String,
}

/// Paths of each side of a comparison, about.
const PATHS: u64 = 1 << 20;
/// The least share of all throughput that is worth a look: what it could bring is noise in any image.
const NEGLIGIBLE: f64 = 1.0e-6;

/// Settings of which one is without what removes light.
struct Neutral {
    setting: &'static str,
    value: String,
    against: String,
    settings: Settings,
}

/// The settings that may have removed light in a render that left `tally` after `paths` paths.
fn suspects(settings: &Settings, tally: &Tally, paths: u64) -> Vec<Neutral> {
    let mut all = Vec::new();
    // Light that nothing absorbs has no last bounce: it is looked for only so far.
    let more = (4 * settings.max_bounces + 64).min(MAX_BOUNCES);
    if tally.cut_throughput > NEGLIGIBLE * paths as f64 && more > settings.max_bounces {
        all.push(Neutral {
            setting: "max-bounces",
            value: settings.max_bounces.to_string(),
            against: format!("{more} bounces"),
            settings: Settings {
                max_bounces: more,
                ..settings.clone()
            },
        });
    }
    if settings.offset != Offset::Exact {
        all.push(Neutral {
            setting: "offset",
            value: settings.offset.to_string(),
            against: "exact".into(),
            settings: Settings {
                offset: Offset::Exact,
                ..settings.clone()
            },
        });
    }
    all
}

/// Measures what each inexact setting of a finished render, which left `film`, removed. Entries are missing where `go_on` said
/// to stop.
///
/// # Errors
/// If the device fails.
pub fn audit(
    backend: &Backend,
    scene: &Scene,
    settings: &Settings,
    film: &Film,
    go_on: &dyn Fn() -> bool,
) -> Result<Vec<Entry>> {
    let paths = film.samples() * settings.crop.pixels() as u64;
    let suspects = suspects(settings, film.tally(), paths);
    let mut entries = Vec::new();
    if suspects.is_empty() {
        return Ok(entries);
    }
    let Some(with) = sample(backend, scene, settings, go_on)? else {
        return Ok(entries);
    };
    for neutral in suspects {
        let Some(without) = sample(backend, scene, &neutral.settings, go_on)? else {
            break;
        };
        let (removed, standard_error) = difference(&with, &without);
        entries.push(Entry {
            setting: neutral.setting,
            value: neutral.value,
            removed,
            standard_error,
            against: neutral.against,
        });
    }
    Ok(entries)
}

/// Few samples of the render's first; none if it was stopped.
fn sample(
    backend: &Backend,
    scene: &Scene,
    settings: &Settings,
    go_on: &dyn Fn() -> bool,
) -> Result<Option<Film>> {
    struct Ask<'a>(&'a dyn Fn() -> bool);
    impl Watch for Ask<'_> {
        fn update(&mut self, _: &Status) {}
        fn interrupted(&self) -> bool {
            !(self.0)()
        }
    }
    let spp = PATHS.div_ceil(settings.crop.pixels() as u64).clamp(4, 256);
    let start = settings.samples.start;
    let settings = Settings {
        samples: start..start.saturating_add(spp).min(settings.samples.end),
        error: None,
        time: None,
        ..settings.clone()
    };
    let placement = Placement::with_offset(scene, settings.width, settings.height, settings.offset);
    let effects = Effects::derive(scene, &placement, &settings);
    let mut renderer = backend.renderer(scene, &placement, &effects, &settings)?;
    let mut outcome = render(renderer.as_mut(), &settings, &mut Ask(go_on));
    match outcome.failure.take() {
        Some(error) => Err(error),
        None => Ok((outcome.stopped_by == StoppedBy::Spp).then_some(outcome.film)),
    }
}

/// The relative difference of the light in two images of the same paths, and its standard error, since
/// pixels are independent.
fn difference(with: &Film, without: &Film) -> (f64, f64) {
    let count = with.rect().pixels();
    let light = |film: &Film, i: usize| film.mean(i).iter().sum::<f64>();
    let total: f64 = (0..count).map(|i| light(without, i)).sum();
    let each = |i: usize| light(without, i) - light(with, i);
    let removed: f64 = (0..count).map(each).sum();
    let mean = removed / count as f64;
    let squares: f64 = (0..count).map(|i| (each(i) - mean).powi(2)).sum();
    (removed / total, squares.sqrt() / total)
}

//! The bias ledger: how much light each setting that is not exact has taken from an image.
//!
//! Measured, not bounded: a few samples are rendered again with the setting and without it, from the same
//! random numbers, so that nearly all noise is in both and falls out of the difference.

use std::ops::Range;

use serde::Serialize;

use crate::backend::Backend;
use crate::error::{Error, Result};
use crate::film::{BLOCK, Film, Tally, WINDOW, window_end};
use crate::forecast::squares;
use crate::job::{Job, prepare};
use crate::render::Control;
use crate::scene::MAX_BOUNCES;
use crate::settings::{Offset, Rect, Settings};

/// What a setting did to the light of an image.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Entry {
    /// The option's name: `max-bounces` or `offset`.
    pub setting: &'static str,
    /// What it was set to.
    pub value: String,
    /// The share of the light that it removed, a fraction; negative if it added some; not a number (`null`
    /// in JSON) where that is unknown.
    pub removed: f64,
    /// The standard error of `removed`; `null` in JSON where it is unknown.
    pub standard_error: f64,
    /// What it was compared with: more bounces, or exact ray origins.
    pub against: String,
    /// Why `removed` is unknown: the scene cannot be rendered without the setting.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unknown: Option<String>,
}

impl Entry {
    /// What to warn of; `None` where all is known.
    #[must_use]
    pub fn warning(&self) -> Option<String> {
        let Self { setting, value, .. } = self;
        let why = self.unknown.as_ref()?;
        Some(format!("what {setting} {value} took is unknown: {why}"))
    }
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

/// The settings that may have removed light from a film, as options with their values: what [`audit`] would measure.
#[must_use]
pub fn suspected(settings: &Settings, film: &Film) -> Vec<String> {
    let suspects = suspects(settings, film.tally(), film.paths());
    let option = |neutral: Neutral| format!("{} {}", neutral.setting, neutral.value);
    suspects.into_iter().map(option).collect()
}

/// Measures what each inexact setting of a finished job, which left `film`, removed; `None` if `go_on`
/// said to stop. A scene that only the setting lets be rendered has nothing to compare with, which its
/// entry says.
///
/// # Errors
/// If the device fails.
pub fn audit(
    backend: &Backend,
    job: &Job,
    film: &Film,
    go_on: &dyn Fn() -> bool,
) -> Result<Option<Vec<Entry>>> {
    let settings = job.settings();
    let suspects = suspects(settings, film.tally(), film.paths());
    let mut entries = Vec::new();
    if suspects.is_empty() {
        return Ok(Some(entries));
    }
    let plan = Plan::new(settings, film.paths());
    let plain = |settings: &Settings| prepare(job.scene(), &plan.settings(settings));
    let Some(with) = sample(backend, &plain(settings)?, &plan, go_on)? else {
        return Ok(None);
    };
    for neutral in suspects {
        let ((removed, standard_error), unknown) = match plain(&neutral.settings) {
            Ok(neutral) => match sample(backend, &neutral, &plan, go_on)? {
                Some(without) => (difference(&with, &without), None),
                None => return Ok(None),
            },
            Err(Error::Placement(why)) => ((f64::NAN, f64::NAN), Some(why)),
            Err(other) => return Err(other),
        };
        entries.push(Entry {
            setting: neutral.setting,
            value: neutral.value,
            removed,
            standard_error,
            against: neutral.against,
            unknown,
        });
    }
    Ok(Some(entries))
}

/// What the paths of one side of a comparison brought, by parts of the image that are alike by chance
/// alone: the squares, or its pixels.
fn sample(
    backend: &Backend,
    job: &Job,
    plan: &Plan,
    go_on: &dyn Fn() -> bool,
) -> Result<Option<Vec<f64>>> {
    struct Ask<'a>(&'a dyn Fn() -> bool);
    impl Control for Ask<'_> {
        fn proceed(&mut self, _: u64) -> bool {
            (self.0)()
        }
    }
    let mut renderer = backend.renderer(job)?;
    let mut light = Vec::new();
    for square in &plan.squares {
        renderer.show(*square);
        let mut pixels = vec![0.0; square.pixels()];
        let mut start = plan.samples.start;
        while start < plan.samples.end {
            if !go_on() {
                return Ok(None);
            }
            let samples = start..window_end(start, plan.samples.end);
            let window = renderer.render(samples, &mut Ask(go_on))?;
            start = window.samples.end;
            for (sum, pixel) in pixels.iter_mut().zip(&window.pixels) {
                *sum += pixel.sum.iter().sum::<f64>();
            }
        }
        match plan.squares.len() {
            1 => light = pixels,
            _ => light.push(pixels.iter().sum()),
        }
    }
    Ok(Some(light))
}

/// Where a comparison looks.
struct Plan {
    squares: Vec<Rect>,
    samples: Range<u64>,
}

impl Plan {
    /// [`PATHS`] paths or, of a large image, a block of every pixel; but no more than a sixteenth of the
    /// render's `paths`, if these are many: in squares of the image if that is less than a block each.
    fn new(settings: &Settings, paths: u64) -> Self {
        let pixels = settings.crop.pixels() as u64;
        let most = (paths / 16).max(PATHS / 16);
        let wanted = PATHS.max(BLOCK * pixels).min(most) as f64;
        let squares = squares(settings.crop, wanted / (BLOCK * pixels) as f64);
        let seen: usize = squares.iter().map(Rect::pixels).sum();
        let spp = ((wanted / seen as f64) as u64).clamp(BLOCK, WINDOW);
        let Range { start, end } = settings.samples;
        Self {
            squares,
            samples: start..start.saturating_add(spp).min(end),
        }
    }

    /// The same, of what is looked at here alone.
    fn settings(&self, settings: &Settings) -> Settings {
        Settings {
            adaptive: false,
            classes: false,
            features: false,
            crop: self.squares[0],
            ..settings.clone()
        }
    }
}

/// The fewest parts whose spread tells an error.
const LEAST_PARTS: usize = 16;

/// The relative difference of the light of the same parts, and its standard error: that of a ratio
/// (Cochran, "Sampling Techniques", 1977, 6.4); not a number where there are too few parts.
fn difference(with: &[f64], without: &[f64]) -> (f64, f64) {
    let n = with.len();
    let total: f64 = without.iter().sum();
    let removed = (total - with.iter().sum::<f64>()) / total;
    let residual = |(a, b): (&f64, &f64)| ((b - a) - removed * b).powi(2);
    let squares: f64 = with.iter().zip(without).map(residual).sum();
    let error = (squares * n as f64 / (n as f64 - 1.0)).sqrt() / total.abs();
    (removed, if n < LEAST_PARTS { f64::NAN } else { error })
}

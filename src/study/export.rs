//! The figures as CSV and JSON.

use std::io;

use serde::Serialize;

use super::analysis::Analysis;
use super::identity::Identity;
use super::measure::Noise;
use super::pictures::Pair;
use super::run::{Point, Run};

/// All of `converge.json`. The names are those of the JSON, which users' scripts rely on: add members,
/// but rename and remove none.
#[derive(Debug, Serialize)]
pub struct Document<'a> {
    /// The command that makes it again.
    pub command: &'a str,
    /// What all runs share.
    pub study: &'a Identity,
    /// The reference's mean, W/(sr m²).
    pub reference_mean: f64,
    /// What the reference's noise adds to measured errors; `null` if its file does not say.
    pub reference_noise: Option<Noise>,
    /// Whether all runs are done.
    pub complete: bool,
    /// The exposure of the report's images in EV.
    pub exposure: f64,
    /// What the runs say.
    #[serde(flatten)]
    pub analysis: &'a Analysis,
    /// f32 and nudges against the same samples in f64.
    pub pairs: &'a [Pair],
    /// The runs themselves.
    pub runs: &'a [Run],
    /// What the user was warned of.
    pub warnings: &'a [String],
}

impl Document<'_> {
    /// Indented JSON.
    ///
    /// # Panics
    /// Never: no member can fail to serialise.
    #[must_use]
    pub fn json(&self) -> String {
        serde_json::to_string_pretty(self).expect("names and numbers") + "\n"
    }
}

/// The columns of `converge.csv`.
const COLUMNS: [&str; 21] = [
    "series",
    "integrator",
    "termination",
    "sampler",
    "backend",
    "offset",
    "max_bounces",
    "seed",
    "device",
    "spp",
    "seconds",
    "setup",
    "compile",
    "render",
    "relrmse",
    "relrmse_measured",
    "mse",
    "mse_measured",
    "mean_error",
    "estimated",
    "radiance_cache",
];

/// A row for each point of each run. Errors named `measured` have the reference's noise in them, the
/// others do not, and are empty where that leaves nothing.
///
/// # Errors
/// None that are known: memory takes every row.
pub fn csv(analysis: &Analysis, runs: &[Run], noise: Option<Noise>) -> io::Result<Vec<u8>> {
    let noise = noise.unwrap_or_default();
    let mut table = csv::Writer::from_writer(Vec::new());
    table.write_record(COLUMNS)?;
    for summary in &analysis.series {
        for run in runs.iter().filter(|r| r.series == summary.series) {
            for point in &run.points {
                table.write_record(row(&summary.label, run, point, noise))?;
            }
        }
    }
    table.into_inner().map_err(|error| error.into_error())
}

/// The cells of one point, in the order of [`COLUMNS`].
fn row(label: &str, run: &Run, point: &Point, noise: Noise) -> [String; 21] {
    let key = &run.series;
    let square = point.relmse - noise.relmse;
    let scientific = |x: f64| format!("{x:e}");
    let seconds = |x: f64| format!("{x:.6}");
    let or_empty = |x: Option<String>| x.unwrap_or_default();
    [
        label.to_owned(),
        key.integrator.clone(),
        or_empty(key.termination.map(|p| p.to_string())),
        key.sampler.clone(),
        key.backend.name().to_owned(),
        key.offset.clone(),
        key.max_bounces.to_string(),
        run.seed.to_string(),
        run.device.clone(),
        point.spp.to_string(),
        seconds(run.setup + run.compile + point.seconds),
        seconds(run.setup),
        seconds(run.compile),
        seconds(point.seconds),
        or_empty((square > 0.0).then(|| scientific(square.sqrt()))),
        scientific(point.relmse.sqrt()),
        scientific(point.mse - noise.mse),
        scientific(point.mse),
        scientific(point.bias),
        or_empty(point.estimated.map(scientific)),
        if key.radiance_cache { "on" } else { "off" }.to_owned(),
    ]
}

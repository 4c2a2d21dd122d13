//! The figures as CSV and JSON.

use std::fmt::Write as _;

use serde::Serialize;

use super::analysis::Analysis;
use super::identity::Identity;
use super::measure::Noise;
use super::pictures::Pair;
use super::run::Run;
use super::series::Key;

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

/// A row for each point of each run. Errors named `measured` have the reference's noise in them, the
/// others do not, and are empty where that leaves nothing.
#[must_use]
pub fn csv(analysis: &Analysis, runs: &[Run], noise: Option<Noise>) -> String {
    let noise = noise.unwrap_or_default();
    let mut text = String::from(
        "series,integrator,termination,sampler,backend,offset,max_bounces,seed,device,spp,seconds,setup,\
         compile,render,relrmse,relrmse_measured,mse,mse_measured,mean_error,estimated\n",
    );
    for summary in &analysis.series {
        for run in runs.iter().filter(|r| r.series == summary.series) {
            let Key {
                integrator,
                termination,
                sampler,
                backend,
                offset,
                max_bounces,
            } = &run.series;
            let termination = termination.map_or_else(String::new, |p| p.to_string());
            for p in &run.points {
                let square = p.relmse - noise.relmse;
                let relrmse = if square > 0.0 {
                    format!("{:e}", square.sqrt())
                } else {
                    String::new()
                };
                let estimated = p.estimated.map_or_else(String::new, |e| format!("{e:e}"));
                let _ = writeln!(
                    text,
                    "{},{integrator},{termination},{sampler},{},{offset},{max_bounces},{},{},{},{:.6},{:.6},\
                     {:.6},{:.6},{relrmse},{:e},{:e},{:e},{:e},{estimated}",
                    quoted(&summary.label),
                    backend.name(),
                    run.seed,
                    quoted(&run.device),
                    p.spp,
                    run.setup + run.compile + p.seconds,
                    run.setup,
                    run.compile,
                    p.seconds,
                    p.relmse.sqrt(),
                    p.mse - noise.mse,
                    p.mse,
                    p.bias,
                );
            }
        }
    }
    text
}

/// A field as RFC 4180 has it.
fn quoted(field: &str) -> String {
    if field.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", field.replace('"', "\"\""))
    } else {
        field.to_owned()
    }
}

//! The hazard suite: hard cases of path tracing spheres in f32, run on a device with the kernel's own
//! functions and renders, and measured against f64 or what is known exactly.
//!
//! A case is a function that returns a [`Measure`]: trials, failures, the worst error and the limit
//! that it must keep. With [`Options::disturb`] every case is given a slightly wrong truth, and must
//! fail: a case that cannot fail shows nothing.

mod context;
mod driver;
mod exits;
mod film;
mod furnaces;
mod integrator;
mod intersection;
mod lights;
mod materials;
mod placing;
mod sampled;
mod sampling;
mod tree;

pub use crate::verify::Measure;
pub use context::Context;
pub use driver::{DriverReport, probe_driver};
pub use exits::{Exits, exits};

use crate::error::Result;
use crate::settings::Offset;

/// How the suite is run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Options {
    /// How paths leave surfaces.
    pub offset: Offset,
    /// Fewer trials, radii and samples.
    pub quick: bool,
    /// Give every case a slightly wrong truth.
    pub disturb: bool,
}

/// One hard case.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// Its number in the catalogue, `docs/numerics.md`.
    pub id: u32,
    /// A few words.
    pub name: &'static str,
    /// What is set up, and what is measured.
    pub setup: &'static str,
    /// How it is run.
    pub run: Run,
}

/// How a case is run.
#[derive(Clone, Copy, Debug)]
pub enum Run {
    /// By this function.
    On(fn(&Context) -> Result<Measure>),
    /// Not at all: the program has nothing that the case concerns.
    NotApplicable(&'static str),
}

/// All cases, by number.
#[must_use]
pub fn cases() -> Vec<Case> {
    let groups: [&[Case]; 9] = [
        intersection::CASES,
        placing::CASES,
        lights::CASES,
        materials::CASES,
        furnaces::CASES,
        sampling::CASES,
        integrator::CASES,
        film::CASES,
        tree::CASES,
    ];
    let mut all = groups.concat();
    all.sort_by_key(|case| case.id);
    all
}

/// What became of a case.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// Every trial kept the limit.
    Pass,
    /// Some did not.
    Fail,
    /// The program has nothing that the case concerns.
    NotApplicable,
}

/// A case's result.
#[derive(Clone, Debug, serde::Serialize)]
pub struct CaseReport {
    /// Its number in the catalogue.
    pub id: u32,
    /// A few words.
    pub name: &'static str,
    /// What was set up, and what was measured.
    pub setup: &'static str,
    /// Trials.
    pub trials: u64,
    /// Those beyond the limit.
    pub failures: u64,
    /// Their share; `None` without trials.
    pub failure_rate: Option<f64>,
    /// The largest error, in `unit`; `None` without trials, or if it is no number.
    pub worst: Option<f64>,
    /// The largest error that passes, in `unit`.
    pub limit: Option<f64>,
    /// What errors are measured in.
    pub unit: &'static str,
    /// The result.
    pub verdict: Verdict,
    /// Where the worst error is, or why the case does not apply.
    pub why: String,
}

impl Case {
    /// Runs the case.
    ///
    /// # Errors
    /// If the device fails: no case can be judged then.
    pub fn report(&self, context: &Context) -> Result<CaseReport> {
        let mut report = CaseReport {
            id: self.id,
            name: self.name,
            setup: self.setup,
            trials: 0,
            failures: 0,
            failure_rate: None,
            worst: None,
            limit: None,
            unit: "",
            verdict: Verdict::NotApplicable,
            why: String::new(),
        };
        match self.run {
            Run::NotApplicable(why) => report.why = why.into(),
            Run::On(run) => {
                let measure = run(context)?;
                report.verdict = if measure.passes() {
                    Verdict::Pass
                } else {
                    Verdict::Fail
                };
                report.trials = measure.trials();
                report.failures = measure.failures();
                report.failure_rate = (measure.trials() > 0)
                    .then(|| measure.failures() as f64 / measure.trials() as f64);
                report.worst = Some(measure.worst()).filter(|x| x.is_finite());
                report.limit = Some(measure.limit());
                report.unit = measure.unit();
                report.why = measure.place().to_owned();
            }
        }
        Ok(report)
    }
}

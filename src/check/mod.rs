//! The hazard suite: hard cases of path tracing spheres in f32, run on a device with the kernel's own
//! functions and renders, and measured against f64 or what is known exactly.
//!
//! A case is a function that returns a [`Measure`]: trials, failures, the worst error and the limit
//! that it must keep. With [`Options::disturb`] every case is given a slightly wrong truth, and must
//! fail: a case that cannot fail shows nothing.

mod context;
mod dispersion;
mod driver;
mod exits;
mod film;
mod furnaces;
mod integrator;
mod intersection;
mod leaving;
mod lights;
mod materials;
mod motion;
mod placing;
mod random;
mod sampled;
mod sampling;
mod textures;
mod tree;
mod variance;

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
    /// Runs it.
    pub run: fn(&Context) -> Result<Measure>,
}

/// All cases, by number.
#[must_use]
pub fn cases() -> Vec<Case> {
    let groups: [&[Case]; 15] = [
        intersection::CASES,
        leaving::CASES,
        placing::CASES,
        lights::CASES,
        materials::CASES,
        furnaces::CASES,
        sampling::CASES,
        integrator::CASES,
        film::CASES,
        random::CASES,
        tree::CASES,
        motion::CASES,
        variance::CASES,
        textures::CASES,
        dispersion::CASES,
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
    /// The largest error, in `unit`; `None` if it is no number.
    pub worst: Option<f64>,
    /// The largest error that passes, in `unit`.
    pub limit: f64,
    /// What errors are measured in.
    pub unit: &'static str,
    /// The result.
    pub verdict: Verdict,
    /// Where the worst error is.
    pub why: String,
}

impl Case {
    /// Runs the case.
    ///
    /// # Errors
    /// If the device fails: no case can be judged then.
    pub fn report(&self, context: &Context) -> Result<CaseReport> {
        let measure = (self.run)(context)?;
        let (trials, failures) = (measure.trials(), measure.failures());
        Ok(CaseReport {
            id: self.id,
            name: self.name,
            setup: self.setup,
            trials,
            failures,
            failure_rate: (trials > 0).then(|| failures as f64 / trials as f64),
            worst: Some(measure.worst()).filter(|x| x.is_finite()),
            limit: measure.limit(),
            unit: measure.unit(),
            verdict: if measure.passes() {
                Verdict::Pass
            } else {
                Verdict::Fail
            },
            why: measure.place().to_owned(),
        })
    }
}

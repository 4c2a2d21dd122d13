//! What all runs say: each series by itself, and all at equal time and equal error.

use serde::Serialize;

use super::equal::{EqualError, EqualTime, equal_error, equal_time};
use super::measure::Noise;
use super::run::Run;
use super::series::{Series, Subject, labels};
use super::summary::{Group, Summary};

/// What all runs of a study say. The names are those of `converge.json`, which users' scripts rely on:
/// add members, but rename and remove none.
#[derive(Clone, Debug, Serialize)]
pub struct Analysis {
    /// One for each series with a run, in the order of the study.
    pub series: Vec<Summary>,
    /// Seconds to errors that were reached, the largest error first.
    pub equal_error: Vec<EqualError>,
    /// Errors after times that all series have, the shortest time first.
    pub equal_time: Vec<EqualTime>,
}

/// Analyses the runs of `subjects`; `noise` is what the reference adds to all errors, and `mean` its
/// mean. Runs of no subject are left aside.
#[must_use]
pub fn analyse(subjects: &[Subject], runs: &[Run], noise: Option<Noise>, mean: f64) -> Analysis {
    let all: Vec<Series> = subjects.iter().map(|s| s.series).collect();
    let noise = noise.unwrap_or_default();
    let groups = subjects
        .iter()
        .zip(labels(&all))
        .filter_map(|(subject, label)| {
            let key = subject.series.key();
            let of_key = |r: &&Run| r.series == key && !r.points.is_empty();
            let group = Group {
                subject: *subject,
                runs: runs.iter().filter(of_key).collect(),
                noise,
            };
            (!group.runs.is_empty()).then(|| group.summary(label, mean))
        });
    let series: Vec<Summary> = groups.collect();
    Analysis {
        equal_error: equal_error(&series),
        equal_time: equal_time(&series),
        series,
    }
}

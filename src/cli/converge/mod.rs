//! `gpu-trace converge`: error against time for any set of ways to render.

mod args;
mod host;
mod plan;

use std::path::PathBuf;

pub(super) use args::{ConvergeArgs, after_help};

use self::host::Machine;
use super::print;
use super::signals::Signals;
use crate::error::{Error, Result};
use crate::output::Progress;
use crate::study::conduct::{Outcome, conduct};
use crate::study::files::{self, lead};
use crate::study::store::{RUNS, Store};
use crate::study::tables;

/// Runs `converge`.
pub(super) fn run(args: &ConvergeArgs) -> Result<()> {
    let mut warnings = Vec::new();
    let plan = plan::plan(args, &mut warnings)?;
    let (study, directory) = (&plan.study, &plan.directory);
    let signals = Signals::listen()?;
    let progress = Progress::new(args.progress, args.quiet);
    let mut store = Store::open(directory, &study.identity, args.fresh)?;
    for warning in &warnings {
        progress.warning(warning);
    }
    let there = plan.already_there(&store);
    if there > 0 {
        progress.message(&format!(
            "{there} of {} runs are done already, in {}",
            plan.count(),
            store.path(RUNS).display()
        ));
    }
    let mut machine = Machine::new(args, &study.loaded.scene, &progress, &signals);
    let outcome = conduct(study, &mut store, &mut machine);
    progress.finish();
    let Some(outcome) = outcome? else {
        print(
            "stopped before the reference was done: there is nothing to report yet, and it will start again\n",
        )?;
        return Err(Error::Interrupted(signals.code().unwrap_or(1)));
    };
    for notice in files::notices(&outcome) {
        progress.warning(&notice);
    }
    let written = files::write(study, &store, &outcome, &warnings);
    if let Some(failure) = outcome.failure {
        return Err(failed(failure, directory.clone()));
    }
    written?;
    if !args.quiet {
        print(&text(&outcome, &store))?;
    }
    signals
        .code()
        .map_or(Ok(()), |code| Err(Error::Interrupted(code)))
}

/// A failure in the middle, with what became of the runs before it.
fn failed(failure: Error, directory: PathBuf) -> Error {
    let kept = format!(
        "the runs done before are in {}: the same command goes on",
        directory.display()
    );
    match failure {
        Error::Gpu(text) => Error::Gpu(format!("{text}; {kept}")),
        Error::DeviceLimit(text) => Error::DeviceLimit(format!("{text}; {kept}")),
        Error::NonFinite(text) => Error::NonFinite(format!("{text}; {kept}")),
        other => other,
    }
}

/// What is printed at the end.
fn text(outcome: &Outcome, store: &Store) -> String {
    let analysis = &outcome.analysis;
    let mut text = format!("{}\n\n{}", lead(outcome), tables::overview(analysis).text());
    let times = tables::equal_error(analysis);
    if times.head.len() > 1 {
        text += &format!("\n{}\n{}", times.title, times.text());
    }
    text + &format!("\n{}\n", store.path("report.html").display())
}

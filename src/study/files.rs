//! What a study leaves: CSV, JSON, plots and the report.

use super::conduct::Outcome;
use super::export::{Document, csv};
use super::galleries::galleries;
use super::pictures::{Pair, pairs};
use super::plan::{ReferenceChoice, Study};
use super::plot::{Axis, Curve, Plot};
use super::report::Report;
use super::run::Run;
use super::store::{FILES, Store};
use super::summary::{Level, Summary};
use super::tables;
use crate::error::{Action, Error, Result};
use crate::numbers::{percent, significant};
use crate::variance::VarianceClass;

/// Writes all files of a study.
///
/// # Errors
/// [`Error::File`]
pub fn write(study: &Study, store: &Store, outcome: &Outcome, warnings: &[String]) -> Result<()> {
    let analysis = &outcome.analysis;
    let runs: Vec<Run> = store
        .runs
        .iter()
        .filter(|r| study.seeds.contains(&r.seed))
        .filter(|r| analysis.series.iter().any(|s| s.series == r.series))
        .cloned()
        .collect();
    let pairs = pairs(store, &study.subjects, study.seeds.start, analysis);
    let plots = [Axis::Seconds, Axis::Samples].map(|axis| plot(study, outcome, axis));
    let document = Document {
        command: &study.command,
        study: &study.identity,
        reference_mean: outcome.reference.mean,
        reference_noise: outcome.noise,
        complete: outcome.complete,
        exposure: study.exposure,
        analysis,
        pairs: &pairs,
        runs: &runs,
        warnings,
    };
    let report = report(study, store, outcome, &pairs, &plots, warnings)?;
    let [time, spp] = &plots;
    let csv = csv(analysis, &runs, outcome.noise).map_err(|source| Error::File {
        action: Action::Write,
        path: store.path(FILES[0]),
        source,
    })?;
    let contents = [
        csv,
        document.json().into_bytes(),
        time.file().into_bytes(),
        spp.file().into_bytes(),
        report.into_bytes(),
    ];
    for (name, bytes) in FILES.iter().zip(contents) {
        store.write(name, &bytes)?;
    }
    Ok(())
}

/// The best series at equal time, in a sentence.
#[must_use]
pub fn lead(outcome: &Outcome) -> String {
    let series = &outcome.analysis.series;
    let Some(time) = outcome.analysis.equal_time.last() else {
        return "There are no errors yet.".into();
    };
    let mut ranks: Vec<(f64, &Summary)> = time
        .errors
        .iter()
        .zip(series)
        .filter_map(|(error, s)| Some(((*error)?, s)))
        .collect();
    ranks.sort_by(|a, b| a.0.total_cmp(&b.0));
    let after = tables::seconds(time.seconds);
    match ranks.as_slice() {
        [] => "No error is known at equal time: all of them are below the reference's own noise."
            .into(),
        [(error, only)] if series.len() == 1 => {
            let spp = only.levels.last().map_or(0, |l| l.spp);
            format!(
                "After {after}, at {spp} samples a pixel, the error is {}.",
                percent(*error)
            )
        }
        [(error, best)] => format!(
            "After {after} only {} has come to an error yet: {}.",
            best.label,
            percent(*error)
        ),
        [(low, best), .., (high, worst)] => format!(
            "After {after}, {} has the smallest error, {}; {} has the largest, {}, {} times that.",
            best.label,
            percent(*low),
            worst.label,
            percent(*high),
            significant(high / low)
        ),
    }
}

fn plot(study: &Study, outcome: &Outcome, axis: Axis) -> Plot {
    let rect = study.base.crop;
    let runs = outcome
        .analysis
        .series
        .iter()
        .map(|s| s.runs)
        .max()
        .unwrap_or(0);
    let x = |l: &Level| match axis {
        Axis::Seconds => l.seconds,
        Axis::Samples => l.spp as f64,
    };
    let curve = |s: &Summary| Curve {
        label: s.label.clone(),
        points: s
            .levels
            .iter()
            .filter_map(|l| Some((x(l), l.error?)))
            .collect(),
        band: s
            .levels
            .iter()
            .filter(|l| l.runs > 1)
            .filter_map(|l| Some((x(l), l.low?, l.high?)))
            .collect(),
    };
    let against = match axis {
        Axis::Seconds => "time",
        Axis::Samples => "samples",
    };
    let device = study
        .identity
        .gpu
        .as_deref()
        .map_or(String::new(), |gpu| format!(", {}", short(gpu)));
    Plot {
        title: format!("Error against {against}"),
        subtitle: format!(
            "{}, {}x{}, relRMSE of {runs} seed{}{device}",
            study.loaded.name,
            rect.width,
            rect.height,
            if runs == 1 { "" } else { "s" },
        ),
        x: axis,
        curves: outcome.analysis.series.iter().map(curve).collect(),
    }
}

/// A device's name without what stands in parentheses.
fn short(name: &str) -> &str {
    name.split(" (").next().unwrap_or(name)
}

fn report(
    study: &Study,
    store: &Store,
    outcome: &Outcome,
    pairs: &[Pair],
    plots: &[Plot],
    warnings: &[String],
) -> Result<String> {
    let analysis = &outcome.analysis;
    let mut tables = vec![
        tables::overview(analysis),
        tables::equal_time(analysis),
        tables::equal_error(analysis),
        tables::laws(analysis),
        tables::biases(analysis),
    ];
    tables.extend(tables::precision(pairs));
    let galleries = galleries(study, store, outcome, pairs);
    let report = Report {
        title: format!("{}: {}", study.title, study.loaded.name),
        lead: lead(outcome),
        notices: notices(outcome)
            .into_iter()
            .chain(warnings.iter().cloned())
            .collect(),
        facts: facts(study, outcome),
        plots,
        tables: &tables,
        galleries: &galleries,
        reference: &outcome.picture,
        exposure: study.exposure,
        command: study.command.clone(),
    };
    report.html().map_err(|source| Error::File {
        action: Action::Write,
        path: store.path("report.html"),
        source,
    })
}

/// What reading the figures must not miss.
#[must_use]
pub fn notices(outcome: &Outcome) -> Vec<String> {
    let mut said = Vec::new();
    if !outcome.complete {
        said.push(
            "The study is not complete: the same command goes on. Images at equal time come at its end."
                .to_owned(),
        );
    }
    if outcome.complete && outcome.equal_time.is_empty() {
        said.push(
            "The images at equal time are not there: the same command renders them.".to_owned(),
        );
    }
    if outcome.noise.is_none() {
        said.push(
            "The reference's own noise is unknown (its file has no standard errors): it is in all errors, \
             curves flatten towards it, and b holds it."
                .to_owned(),
        );
    }
    let of = |class: VarianceClass| {
        let series = outcome.analysis.series.iter();
        let labels = series
            .filter(|s| s.variance == class)
            .map(|s| s.label.as_str());
        Some(labels.collect::<Vec<_>>().join(", ")).filter(|text| !text.is_empty())
    };
    if let Some(labels) = of(VarianceClass::Infinite) {
        said.push(format!(
            "The variance may be infinite: {labels}. These errors are medians and quantiles over the runs; a mean \
             over runs or a fit of variance would say nothing."
        ));
    }
    if let Some(labels) = of(VarianceClass::HeavyTailed) {
        said.push(format!(
            "The samples have a heavy tail: {labels}. Few runs see its rarest values, and intervals may be too narrow."
        ));
    }
    for s in outcome.analysis.series.iter().filter(|s| s.non_finite > 0) {
        said.push(format!(
            "{}: {} samples were no finite number; they are in no sum.",
            s.label, s.non_finite
        ));
    }
    said
}

fn facts(study: &Study, outcome: &Outcome) -> Vec<(&'static str, String)> {
    let identity = &study.identity;
    let rect = study.base.crop;
    let noise = match outcome.noise {
        Some(noise) => format!(
            "its own error of {} is subtracted",
            percent(noise.relmse.sqrt())
        ),
        None => "its own error is unknown".into(),
    };
    let reference = match &study.reference {
        ReferenceChoice::File(input) => format!("{}; {noise}", input.path.display()),
        ReferenceChoice::Own { series, spp, seed } => format!(
            "{} {} on the {}, {spp} samples a pixel, at most {} bounces, seed {seed}; {noise}",
            series.integrator.name(),
            series.sampler.name(),
            series.backend.name().to_uppercase(),
            series.max_bounces
        ),
    };
    let mut facts = vec![
        (
            "Scene",
            format!("{} ({})", study.loaded.name, study.loaded.hash),
        ),
        ("Image", format!("{}x{} pixels", rect.width, rect.height)),
        ("Reference", reference),
        (
            "Seeds",
            format!(
                "{} to {}",
                study.seeds.start,
                study.seeds.end.saturating_sub(1)
            ),
        ),
    ];
    if let Some(gpu) = &identity.gpu {
        facts.push(("GPU", gpu.clone()));
    }
    facts.push((
        "CPU threads",
        match identity.threads {
            0 => "one a core".into(),
            n => n.to_string(),
        },
    ));
    facts.push(("Program", format!("gpu-trace {}", identity.version)));
    facts
}

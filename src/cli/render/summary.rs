//! What is said of a render: the line at its end, and what to warn of.

use crate::cli::args::RenderArgs;
use crate::cli::format::{percent, significant};
use crate::film::NonFinite;
use crate::job::Job;
use crate::ledger::Entry;
use crate::output::{Aov, Plane, Stats};
use crate::placement::Placement;
use crate::render::{Outcome, StoppedBy};
use crate::settings::Settings;
use crate::variance::VarianceClass;

/// The line about a render at its end; `files` names its images, and `shown` says what they show if that is no
/// light.
pub(super) fn summary(files: &str, stats: &Stats, shown: Option<&str>) -> String {
    let error = match stats.estimated_error {
        Some(error) => {
            let trust = stats.trust.as_ref();
            let trust = trust.map_or_else(String::new, |verdict| format!(", trust: {verdict}"));
            format!("error {}{trust}", percent(error))
        }
        None if stats.black => "black".into(),
        None if stats.variance == VarianceClass::Infinite => {
            "error unknown (infinite variance)".into()
        }
        None if stats.spp < 64 => "error unknown below 64 spp".into(),
        None => "error unknown".into(),
    };
    let stopped = match stats.stopped_by {
        StoppedBy::Spp => "",
        StoppedBy::Error => ", error reached",
        StoppedBy::Time => ", time is up",
        StoppedBy::Interrupt => ", interrupted",
        StoppedBy::Failure => ", failed",
    };
    let shown = shown.map_or_else(String::new, |text| format!("{text}, "));
    let [least, most] = stats.spp_range;
    let range = if least < most {
        format!(" ({least} to {most})")
    } else {
        String::new()
    };
    let entries = || stats.ledger.iter().flatten();
    let cut = match stats.bounce_limit.paths {
        0 => String::new(),
        _ if entries().any(|e| e.setting == "max-bounces") => String::new(),
        paths => format!(", max-bounces cut {paths} paths"),
    };
    let taken: String = entries().map(taken).collect();
    let lost = stats.first_non_finite.map_or_else(String::new, |first| {
        format!(
            ", {} samples not finite ({})",
            stats.non_finite,
            place(first)
        )
    });
    format!(
        "{}: {}x{}, {} spp{range}{stopped}, {shown}{error}{cut}{taken}{lost}, {:.2} s, {} Mpaths/s on {}\n",
        files,
        stats.width,
        stats.height,
        stats.spp,
        stats.seconds.total,
        significant(stats.paths_per_second * 1.0e-6),
        stats.device.name,
    )
}

/// What the summary says of a setting that is not exact.
fn taken(entry: &Entry) -> String {
    let Entry { setting, value, .. } = entry;
    let (removed, error) = (entry.removed, entry.standard_error);
    if !removed.is_finite() {
        return format!(", what {setting} {value} took is unknown");
    }
    if removed == 0.0 {
        return format!(", {setting} {value} took no light that shows");
    }
    if removed.abs() <= 2.0 * error {
        let most = percent(removed.abs() + 2.0 * error);
        return format!(", {setting} {value} took less than {most} of the light");
    }
    let verb = if removed > 0.0 { "took" } else { "added" };
    let spread = match error < 0.01 * removed.abs() {
        true => String::new(),
        false if error.is_nan() => " (by few pixels)".into(),
        false => format!(" ± {}", percent(error)),
    };
    format!(
        ", {setting} {value} {verb} {}{spread} of the light",
        percent(removed.abs())
    )
}

/// Spheres of the scene that are not rendered, though nothing is wrong with them.
pub(super) fn left_out(placement: &Placement) -> Option<String> {
    let [gone, other] = placement.coincident.first()?.map(|i| i + 1);
    Some(match placement.coincident.len() {
        1 => format!("sphere {gone} coincides with sphere {other}, and is left out"),
        count => format!(
            "{count} spheres coincide with others and are left out; the first: sphere {gone}, \
             which is where sphere {other} is"
        ),
    })
}

/// Why there is no radiance cache, and why no images of lamps, where they are asked for.
pub(super) fn without_effect(job: &Job) -> Vec<String> {
    let asked = [
        ("radiance-cache", job.cache_obstacle()),
        ("lamp-images", job.image_obstacle()),
    ];
    let said = |(option, why)| Some(format!("--{option} on is without effect: {}", why?));
    asked.into_iter().filter_map(said).collect()
}

/// What the user should know about the outcome.
pub(super) fn observations(outcome: &Outcome, settings: &Settings) -> Vec<String> {
    let mut said = Vec::new();
    if outcome.film.samples() > 0 && outcome.estimate.is_black() {
        said.push("the image is black: no path has found any light".to_owned());
    }
    let pixels = outcome.film.pixels();
    let beyond = pixels.iter().flatten().filter(|x| x.is_infinite()).count();
    if beyond > 0 {
        said.push(format!(
            "{beyond} values are beyond {:.1e}, the largest of f32: they are infinite in the files",
            f32::MAX
        ));
    }
    if let Some(limit) = settings.error
        && outcome.stopped_by == StoppedBy::Spp
    {
        let spp = settings.samples.end - settings.samples.start;
        let unknown = match outcome.estimate.error {
            Some(_) => "",
            None => "; it is unknown",
        };
        said.push(format!(
            "the error of {} was not reached within {spp} samples a pixel{unknown}",
            percent(limit)
        ));
    }
    said
}

/// What to say where standard errors were asked for and are unknown.
pub(super) fn no_stderr(args: &RenderArgs, outcome: &Outcome) -> Option<String> {
    let asked = args.aov.contains(&Aov::Stderr) && outcome.film.samples() > 0;
    let unknown = asked && Plane::stderr_unknown(&outcome.film, &outcome.estimate);
    unknown.then(|| "the standard errors are unknown: the layer stderr holds no numbers".to_owned())
}

/// What to say of samples that were not finite; `None` without any.
pub(super) fn not_finite(outcome: &Outcome) -> Option<String> {
    let tally = outcome.film.tally();
    (tally.non_finite > 0).then(|| {
        let first = tally.first_non_finite.map_or_else(String::new, place);
        format!(
            "{} samples were not finite and are in no sum; {first}",
            tally.non_finite
        )
    })
}

fn place(first: NonFinite) -> String {
    let [x, y] = first.pixel;
    format!(
        "the first: pixel ({x}, {y}), sample {}, after bounce {}",
        first.sample, first.bounce
    )
}

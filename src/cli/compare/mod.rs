//! `gpu-trace compare`: how far an image is from a reference.

mod text;

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use serde::Serialize;
use serde_json::json;

use self::text::{figures, heading, legend};
use super::format::percent;
use super::{print, values};
use crate::compare::{DEFAULT_PPD, HeatMap, Options, Report, check_same, compare};
use crate::error::{Action, Error, Result};
use crate::image::Format;
use crate::input::{Input, read};
use crate::output::{Target, atomic, check_all};

pub(super) const AFTER_HELP: &str = "\
Examples:
  gpu-trace compare render.exr reference.exr                     all figures
  gpu-trace compare render.npy reference.npy --tolerance 1%      exit 3 if relRMSE is above 1 %
  gpu-trace compare a.png b.png --metric flip --tolerance 0.05   as it is seen
  gpu-trace compare a.exr b.exr --metric z                       exit 3 if noise cannot explain it
  gpu-trace compare a.exr b.exr --heat-map where.png             where the errors are

relRMSE is sqrt of the mean over pixels and channels of (a - b)^2/(b^2 + (0.1 M)^2), where M is the
mean of B. All measures but FLIP and SSIM are of linear values: PNG files are decoded by what they
say of their encoding, sRGB if nothing.";

/// The options of `compare`.
#[derive(Clone, Debug, Args)]
pub(super) struct CompareArgs {
    /// The image: EXR, PNG or NPY of any origin.
    #[arg(value_name = "A")]
    image: PathBuf,
    /// The reference, of the same size.
    #[arg(value_name = "B")]
    reference: PathBuf,
    /// Exit with 3 if the metric is above this: 1% or 0.01.
    #[arg(long, value_name = "P", value_parser = values::tolerance, allow_hyphen_values = true)]
    tolerance: Option<f64>,
    /// What is judged: relrmse, mape, bias, flip, ssim (1 - SSIM), or z (needs no tolerance) [default: relrmse].
    #[arg(
        long,
        value_name = "NAME",
        value_enum,
        default_value = "relrmse",
        hide_possible_values = true,
        hide_default_value = true
    )]
    metric: Metric,
    /// Brighten both images by a factor of 2^EV before FLIP and SSIM.
    #[arg(
        long, value_name = "EV", value_parser = values::exposure, default_value = "0",
        allow_hyphen_values = true, hide_default_value = true
    )]
    exposure: f64,
    /// Pixels per degree of the observer of FLIP [default: 67].
    #[arg(
        long, value_name = "N", value_parser = values::pixels_per_degree, default_value_t = DEFAULT_PPD,
        allow_hyphen_values = true, hide_default_value = true
    )]
    ppd: f64,
    /// Write the relative error of each pixel as colours.
    #[arg(long, value_name = "FILE.png")]
    heat_map: Option<PathBuf>,
    /// Compare images of different scenes, too.
    #[arg(long)]
    any_scene: bool,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// `--metric`
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "lowercase")]
enum Metric {
    Relrmse,
    Mape,
    Bias,
    Flip,
    Ssim,
    Z,
}

/// What was asked, and the answer.
#[derive(Clone, Debug, Serialize)]
struct Verdict {
    metric: Metric,
    /// What was measured; `None` where it is unknown, which is no pass.
    value: Option<f64>,
    limit: f64,
    passed: bool,
    /// As a sentence.
    text: String,
}

/// Runs `compare`.
pub(super) fn run(args: &CompareArgs) -> Result<()> {
    let target = args.check()?;
    let (mut image, mut reference) = (read(&args.image)?, read(&args.reference)?);
    check_same(&image, &reference, args.any_scene)?;
    note_range(&mut image, &reference);
    note_range(&mut reference, &image);
    let options = Options {
        exposure: args.exposure,
        pixels_per_degree: args.ppd,
    };
    let report = compare(&image, &reference, &options);
    let verdict = args.verdict(&report)?;
    let heat = target.map(|target| (target, HeatMap::of(&image.picture, &reference.picture)));
    if let Some((target, map)) = &heat {
        let bytes = map.encode().map_err(|source| Error::File {
            action: Action::Write,
            path: target.path.clone(),
            source,
        })?;
        atomic::write(&target.path, &bytes)?;
    }
    if args.json {
        let map = heat.as_ref().map(
            |(target, map)| json!({"path": target.path, "range": map.range, "beyond": map.beyond}),
        );
        let all = json!({
            "image": about(&image), "reference": about(&reference), "figures": report,
            "heat_map": map, "verdict": verdict,
        });
        print(&format!("{all:#}\n"))?;
    } else {
        let mut text = heading('A', &image) + &heading('B', &reference) + "\n" + &figures(&report);
        if let Some((target, map)) = &heat {
            text += &legend(target, map);
        }
        if let Some(verdict) = &verdict {
            let word = if verdict.passed { "ok" } else { "FAIL" };
            let _ = writeln!(text, "\n{word}: {}", verdict.text);
        }
        print(&text)?;
    }
    match verdict {
        Some(verdict) if !verdict.passed => Err(Error::Check(verdict.text)),
        _ => Ok(()),
    }
}

/// Notes where a file could not hold what the other does: that is an error of the format.
fn note_range(input: &mut Input, other: &Input) {
    let pixels = &other.picture.pixels;
    let bright = pixels.iter().filter(|p| p.iter().any(|v| *v > 1.0)).count();
    if input.format == Format::Png && bright > 0 {
        let share = bright as f64 / pixels.len() as f64;
        let text = format!(
            "PNG holds nothing above 1, where {} of the other's pixels are",
            percent(share)
        );
        input.notes.push(text);
    }
}

impl CompareArgs {
    /// Refuses options that contradict each other, and a heat map that cannot be written.
    fn check(&self) -> Result<Option<Target>> {
        match (self.metric, self.tolerance) {
            (Metric::Z, Some(_)) => {
                return Err(Error::Usage(
                    "--metric z has its own limits: leave --tolerance out".into(),
                ));
            }
            (Metric::Z | Metric::Relrmse, _) | (_, Some(_)) => {}
            _ => {
                return Err(Error::Usage(
                    "--metric says what --tolerance judges: add --tolerance, as in --tolerance 5%"
                        .into(),
                ));
            }
        }
        let Some(path) = &self.heat_map else {
            return Ok(None);
        };
        let target = Target::parse(path)?;
        if target.format != Format::Png {
            return Err(Error::Usage(format!(
                "--heat-map {}: colours need a .png file",
                path.display()
            )));
        }
        check_all(&[path], &[&self.image, &self.reference])?;
        Ok(Some(target))
    }

    /// What `--tolerance` or `--metric z` asks; `None` if neither is given.
    fn verdict(&self, report: &Report) -> Result<Option<Verdict>> {
        let z = self.metric == Metric::Z;
        let Some(limit) = self.tolerance.or_else(|| z.then(|| z_limit(report))) else {
            return Ok(None);
        };
        if z && report.z.is_none() {
            return Err(Error::Usage(
                "--metric z: neither file holds standard errors, an EXR layer stderr".into(),
            ));
        }
        let value = self.metric.value(report);
        let mut passed = value.is_some_and(|value| value <= limit);
        if z {
            passed = report.z.is_some_and(|test| test.passed);
        }
        let mut text = self.metric.judgement(value, limit, report);
        let bad = report.non_finite.either;
        if bad > 0 {
            passed = false;
            text = format!(
                "{bad} pixels are not finite, which no tolerance covers; beside them {text}"
            );
        }
        Ok(Some(Verdict {
            metric: self.metric,
            value,
            limit,
            passed,
            text,
        }))
    }
}

fn z_limit(report: &Report) -> f64 {
    report.z.map_or(f64::NAN, |test| test.limit)
}

impl Metric {
    fn value(self, report: &Report) -> Option<f64> {
        let errors = report.errors.as_ref();
        match self {
            Self::Relrmse => errors.map(|e| e.relrmse),
            Self::Mape => errors.map(|e| e.mape),
            Self::Bias => errors.and_then(|e| e.bias.overall).map(f64::abs),
            Self::Flip => report.flip,
            Self::Ssim => report.ssim.map(|ssim| 1.0 - ssim),
            Self::Z => report.z.map(|test| test.worst),
        }
    }

    /// As in `relRMSE 0.5 % is within 1 %`.
    fn judgement(self, value: Option<f64>, limit: f64, report: &Report) -> String {
        if let (Self::Z, Some(test)) = (self, &report.z) {
            let word = if test.passed {
                "explain"
            } else {
                "do not explain"
            };
            return format!(
                "the standard errors {word} the difference: worst {:.2} of {:.2}, pooled {:.2} of {:.2}, \
                 {} values untested",
                test.worst, test.limit, test.pooled, test.pooled_limit, test.untested
            );
        }
        let name = match self {
            Self::Relrmse => "relRMSE",
            Self::Mape => "MAPE",
            Self::Bias => "the bias of the mean",
            Self::Flip => "FLIP",
            Self::Ssim => "1 - SSIM",
            Self::Z => "z",
        };
        match value {
            None => format!("{name} is unknown"),
            Some(value) => {
                let relation = if value <= limit { "within" } else { "above" };
                format!("{name} {} is {relation} {}", percent(value), percent(limit))
            }
        }
    }
}

/// What the JSON says of a file.
fn about(input: &Input) -> serde_json::Value {
    json!({
        "path": input.path, "format": input.format.name(), "encoding": input.encoding.to_string(),
        "stderr": input.stderr.is_some(), "about": input.about, "notes": input.notes,
    })
}

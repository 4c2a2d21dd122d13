//! The figures as tables of text, for the report and the terminal.

use super::analysis::Analysis;
use super::bootstrap::Interval;
use super::equal::{EqualError, EqualTime};
use super::pictures::Pair;
use super::summary::Summary;
use super::table::Table;
use crate::numbers::{duration, percent, significant};
use crate::variance::VarianceClass;

const UNKNOWN: &str = "–";

/// Where each series came to.
#[must_use]
pub fn overview(analysis: &Analysis) -> Table {
    let mut table = Table::new(
        "Where each series came to",
        "Error is relRMSE at the last number of samples; time is the median of the runs, with setup and \
         compilation, which stand beside it.",
        &[
            "series", "runs", "samples", "error", "5–95 %", "time", "setup", "compile",
        ],
    );
    table.rows = analysis.series.iter().map(row).collect();
    table
}

fn row(s: &Summary) -> Vec<String> {
    let last = s.levels.last();
    let median = s.variance == VarianceClass::Infinite;
    let error = last.and_then(|l| l.error).map_or(UNKNOWN.into(), |e| {
        let word = if median { "median " } else { "" };
        format!("{word}{}", percent(e))
    });
    let spread = last
        .and_then(|l| l.low.zip(l.high))
        .map_or(UNKNOWN.into(), |(low, high)| {
            format!("{}–{}", significant(100.0 * low), percent(high))
        });
    vec![
        s.label.clone(),
        s.runs.to_string(),
        last.map_or(UNKNOWN.into(), |l| l.spp.to_string()),
        error,
        spread,
        last.map_or(UNKNOWN.into(), |l| seconds(l.seconds)),
        seconds(s.setup),
        match s.compile {
            0.0 => UNKNOWN.into(),
            time => seconds(time),
        },
    ]
}

/// Slopes and efficiency.
#[must_use]
pub fn laws(analysis: &Analysis) -> Table {
    let mut table = Table::new(
        "How fast the error falls",
        "Slopes of ln error over ln samples and over ln seconds of rendering, with 95 % intervals; -0.5 is \
         the law of independent samples. Efficiency is 1/(MSE t), t with setup and compilation; beside it \
         in units of the first series.",
        &[
            "series",
            "slope over samples",
            "slope over time",
            "efficiency",
            "of the first",
        ],
    );
    let first = analysis
        .series
        .iter()
        .find_map(|s| s.efficiency)
        .map(|e| e.value);
    table.rows = analysis
        .series
        .iter()
        .map(|s| {
            let infinite = || match s.variance {
                VarianceClass::Infinite => "infinite variance".into(),
                _ => UNKNOWN.into(),
            };
            let share = s.efficiency.zip(first).map(|(e, first)| e.value / first);
            vec![
                s.label.clone(),
                interval(s.slope_spp, 2),
                interval(s.slope_time, 2),
                s.efficiency.map_or_else(infinite, |e| significant(e.value)),
                share.map_or(UNKNOWN.into(), significant),
            ]
        })
        .collect();
    table
}

/// The fits of bias and variance.
#[must_use]
pub fn biases(analysis: &Analysis) -> Table {
    let mut table = Table::new(
        "Bias and variance",
        "The fit MSE = b² + v/N: b is the error that no number of samples removes, as a share of the \
         reference's mean, v the variance of a sample. b² is fitted without constraint, so that it is \
         negative about as often as not where there is no bias: b is then 0 within its error. The last \
         column is the error of the image's mean after the last samples.",
        &[
            "series",
            "b",
            "b: 95 %",
            "b²",
            "v",
            "verdict",
            "mean off by",
        ],
    );
    let rows = analysis.series.iter().map(|s| {
        let mean = s
            .levels
            .last()
            .map_or(UNKNOWN.into(), |l| signed(l.mean_error));
        let Some(bias) = &s.bias else {
            let why = match s.variance {
                VarianceClass::Infinite => "infinite variance",
                _ => "too few points",
            };
            let none = || UNKNOWN.to_owned();
            return vec![
                s.label.clone(),
                none(),
                none(),
                none(),
                none(),
                why.into(),
                mean,
            ];
        };
        let range = bias.range.map_or(UNKNOWN.into(), |[low, high]| {
            format!("{}–{}", significant(100.0 * low), percent(high))
        });
        let verdict = match bias.biased {
            Some(true) => "biased",
            Some(false) => "none seen",
            None => "needs 4 seeds",
        };
        vec![
            s.label.clone(),
            percent(bias.b),
            range,
            significant(bias.b_squared.value),
            significant(bias.variance),
            verdict.into(),
            mean,
        ]
    });
    table.rows = rows.collect();
    table
}

/// Errors after the same times.
#[must_use]
pub fn equal_time(analysis: &Analysis) -> Table {
    let mut table = Table::new(
        "Error at equal time",
        "relRMSE, and the samples a pixel that fit into the time. The last column is the longest time that \
         every series was given.",
        &["series"],
    );
    table
        .head
        .extend(analysis.equal_time.iter().map(|t| seconds(t.seconds)));
    let cell = |t: &EqualTime, i: usize| match (t.errors[i], t.spp[i]) {
        (Some(error), Some(spp)) => {
            format!("{} ({} spp)", percent(error), spp.floor())
        }
        (None, Some(spp)) => format!("unknown ({} spp)", spp.floor()),
        _ => "not started".into(),
    };
    table.rows = by_series(analysis, |i| {
        analysis.equal_time.iter().map(|t| cell(t, i)).collect()
    });
    table
}

/// Times to the same errors.
#[must_use]
pub fn equal_error(analysis: &Analysis) -> Table {
    let mut table = Table::new(
        "Time to equal error",
        "Seconds until relRMSE is this small, on lines between the points, with setup and compilation; ≤ \
         where the first point was below it already, > where the study ended first, – from where on the \
         reference's own noise hides the error.",
        &["series"],
    );
    table
        .head
        .extend(analysis.equal_error.iter().map(|e| plain_percent(e.error)));
    let cell = |e: &EqualError, i: usize| match e.seconds[i] {
        Some(t) if e.at_once[i] => format!("≤ {}", seconds(t)),
        Some(t) => seconds(t),
        None if e.unknown[i] => UNKNOWN.into(),
        None => {
            let end = analysis.series[i].levels.last().map_or(0.0, |l| l.seconds);
            format!("> {}", seconds(end))
        }
    };
    table.rows = by_series(analysis, |i| {
        analysis.equal_error.iter().map(|e| cell(e, i)).collect()
    });
    table
}

/// What differs from the same samples in f64; `None` without such pairs.
#[must_use]
pub fn precision(pairs: &[Pair]) -> Option<Table> {
    let last = pairs
        .iter()
        .filter_map(|p| p.levels.last())
        .map(|l| l.spp)
        .max()?;
    let mut shown: Vec<u64> = pairs
        .iter()
        .flat_map(|p| &p.levels)
        .map(|l| l.spp)
        .collect();
    shown.sort_unstable();
    shown.dedup();
    shown.retain(|n| *n == last || n.is_power_of_two() && n.trailing_zeros() % 3 == 0);
    let mut table = Table::new(
        "The same samples in f32 and in f64",
        "relRMSE of the image against that of the CPU in f64 without a nudge, from the same random numbers \
         (first seed): the noise is the same, so what is left is precision and the nudge. The last column \
         is the difference of the images' means.",
        &["series"],
    );
    table.head.extend(shown.iter().map(|n| format!("{n} spp")));
    table.head.push("mean off by".into());
    table.rows = pairs
        .iter()
        .map(|pair| {
            let at = |n: &u64| pair.levels.iter().find(|l| l.spp == *n);
            let mut row = vec![pair.label.clone()];
            row.extend(
                shown
                    .iter()
                    .map(|n| at(n).map_or(UNKNOWN.into(), |l| percent(l.relrmse))),
            );
            row.push(
                pair.levels
                    .last()
                    .map_or(UNKNOWN.into(), |l| signed(l.mean)),
            );
            row
        })
        .collect();
    Some(table)
}

fn by_series(analysis: &Analysis, cells: impl Fn(usize) -> Vec<String>) -> Vec<Vec<String>> {
    let rows = analysis.series.iter().enumerate();
    rows.map(|(i, s)| std::iter::once(s.label.clone()).chain(cells(i)).collect())
        .collect()
}

fn interval(interval: Option<Interval>, decimals: usize) -> String {
    let number = |x: f64| format!("{x:.decimals$}").replace('-', "−");
    match interval {
        None => UNKNOWN.into(),
        Some(Interval { value, range: None }) => number(value),
        Some(Interval {
            value,
            range: Some([low, high]),
        }) => format!("{} ({} to {})", number(value), number(low), number(high)),
    }
}

fn signed(fraction: f64) -> String {
    let sign = if fraction < 0.0 { "−" } else { "+" };
    format!("{sign}{}", percent(fraction.abs()))
}

/// A time as people say it, in milliseconds if it is short.
#[must_use]
pub fn seconds(time: f64) -> String {
    match time {
        t if t < 0.1 => format!("{} ms", significant(1000.0 * t)),
        t => duration(t),
    }
}

/// A round percentage without trailing zeros.
fn plain_percent(fraction: f64) -> String {
    let text = format!("{:.8}", 100.0 * fraction);
    format!("{} %", text.trim_end_matches('0').trim_end_matches('.'))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::Sampler;
    use crate::settings::{Integrator, Offset};
    use crate::study::analysis::analyse;
    use crate::study::measure::Noise;
    use crate::study::run::{Point, Run};
    use crate::study::series::{BackendKind, Series, Subject};

    /// The time to 20 %, by series, of runs with these relRMSEs at 1, 2, 4, ... samples.
    fn times(errors: [&[f64]; 2], hidden: f64) -> [String; 2] {
        let subjects = [1, 64].map(|max_bounces| Subject {
            series: Series {
                integrator: Integrator::Bsdf,
                sampler: Sampler::Sobol,
                backend: BackendKind::Cpu,
                offset: Offset::Exact,
                max_bounces,
                radiance_cache: false,
            },
            variance: VarianceClass::Finite,
        });
        let point = |(i, error): (usize, &f64)| Point {
            spp: 1 << i,
            seconds: (1 << i) as f64,
            mse: error * error,
            relmse: error * error,
            bias: 0.0,
            estimated: None,
        };
        let runs: Vec<Run> = subjects
            .iter()
            .zip(errors)
            .map(|(subject, errors)| Run {
                series: subject.series.key(),
                seed: 0,
                complete: true,
                device: String::new(),
                setup: 0.0,
                compile: 0.0,
                non_finite: 0,
                points: errors.iter().enumerate().map(point).collect(),
            })
            .collect();
        let noise = Noise {
            relmse_error: hidden * hidden / 2.0,
            ..Noise::default()
        };
        let table = equal_error(&analyse(&subjects, &runs, Some(noise), 1.0));
        let column = table.head.iter().position(|name| name == "20 %");
        let column = column.unwrap_or_else(|| panic!("{:?}", table.head));
        [0, 1].map(|i| table.rows[i][column].clone())
    }

    #[test]
    fn what_the_reference_hides_is_not_said_to_be_missed() {
        let other: &[f64] = &[0.4, 0.3, 0.11];
        let [hidden, known] = times([&[0.4, 0.3, 0.08], other], 0.1);
        assert_eq!(hidden, UNKNOWN);
        assert!(known.starts_with(|c: char| c.is_ascii_digit()), "{known}");
        // With a better reference it was reached, and if the series had ended there it was not.
        let [reached, same] = times([&[0.4, 0.3, 0.08], other], 0.0);
        assert!(reached < known && same == known, "{reached} {known}");
        let [missed, _] = times([&[0.4, 0.3], other], 0.1);
        assert_eq!(missed, format!("> {}", seconds(2.0)));
    }
}

//! `gpu-trace check`: the hard cases on this adapter, against f64.

use std::fmt::Write as _;

use clap::Args;
use serde_json::json;

use super::print;
use crate::backend::open_gpu;
use crate::check::{
    Case, CaseReport, Context, DriverReport, Options, Verdict, cases, probe_driver,
};
use crate::error::{Error, Result};
use crate::gpu::device::AdapterSummary;
use crate::settings::Offset;

/// The options of `check`.
#[derive(Clone, Debug, Args)]
pub(super) struct CheckArgs {
    /// Only this case, by number or part of its name; may be repeated.
    #[arg(long, value_name = "NAME", allow_hyphen_values = true,
          value_parser = clap::builder::NonEmptyStringValueParser::new())]
    pub(super) case: Vec<String>,
    /// Fewer trials: under a minute without a GPU.
    #[arg(long)]
    pub(super) quick: bool,
    /// Print JSON.
    #[arg(long)]
    pub(super) json: bool,
    /// Say what each case sets up, and where its worst error is.
    #[arg(short, long)]
    pub(super) verbose: bool,
    /// How paths leave a surface: exact, or to see what fails then none, back:X, out:X, ulp.
    #[arg(
        long,
        value_name = "MODE",
        default_value = "exact",
        hide_default_value = true
    )]
    pub(super) offset: Offset,
    /// Which adapter, as `gpu-trace devices` lists them.
    #[arg(long, value_name = "INDEX|NAME")]
    pub(super) device: Option<String>,
    /// Give every case a slightly wrong truth: all must fail (a check of the check).
    #[arg(long)]
    pub(super) disturb: bool,
}

/// Runs `check`.
pub(super) fn run(args: &CheckArgs) -> Result<()> {
    let chosen = choose(&args.case)?;
    let gpu = open_gpu(args.device.as_deref())?;
    let options = Options {
        offset: args.offset,
        quick: args.quick,
        disturb: args.disturb,
    };
    let context = Context { gpu, options };
    let summary = &context.gpu.summary;
    let driver = probe_driver(&context)?;
    if !args.json {
        print(&heading(summary, &driver, &options))?;
    }
    let mut reports = Vec::new();
    for case in &chosen {
        let report = case.report(&context)?;
        if !args.json {
            print(&row(&report, args.verbose))?;
        }
        reports.push(report);
    }
    if args.json {
        let all = json!({
            "device": {
                "name": summary.name, "backend": summary.backend, "driver": summary.driver,
                "arithmetic": driver,
            },
            "offset": options.offset.to_string(),
            "quick": options.quick,
            "disturb": options.disturb,
            "cases": reports,
        });
        let text = serde_json::to_string_pretty(&all)
            .map_err(|e| Error::Device(format!("cannot write JSON: {e}")))?;
        print(&(text + "\n"))?;
    } else {
        print(&totals(&reports, summary, &options))?;
    }
    let failed: Vec<String> = reports
        .iter()
        .filter(|r| r.verdict == Verdict::Fail)
        .map(|r| r.id.to_string())
        .collect();
    if failed.is_empty() {
        return Ok(());
    }
    Err(Error::Check(format!(
        "{} of {} cases failed: {}",
        failed.len(),
        reports.len(),
        failed.join(", ")
    )))
}

/// The cases that were named, by number or part of the name; all if none was.
fn choose(wanted: &[String]) -> Result<Vec<Case>> {
    let all = cases();
    if wanted.is_empty() {
        return Ok(all);
    }
    let is = |case: &Case, text: &str| match text.parse::<u32>() {
        Ok(id) => case.id == id,
        Err(_) => case.name.contains(&text.to_lowercase()),
    };
    if let Some(unknown) = wanted.iter().find(|w| !all.iter().any(|c| is(c, w))) {
        let known: Vec<String> = all
            .iter()
            .map(|c| format!("  {:>2}  {}", c.id, c.name))
            .collect();
        return Err(Error::Usage(format!(
            "--case {unknown}: no case has this number or this in its name; the cases are\n{}",
            known.join("\n")
        )));
    }
    let named = |case: &Case| wanted.iter().any(|w| is(case, w));
    Ok(all.into_iter().filter(named).collect())
}

fn heading(device: &AdapterSummary, driver: &DriverReport, options: &Options) -> String {
    let yes = |is: bool| if is { "yes" } else { "no" };
    let mut text = format!(
        "{} ({}, {})\n\n\
         arithmetic    a b + c rounded once: {}, fma: {}; (a + b) - a taken for b: {}, sums hold: {};\n\
         \x20             subnormals flushed: {}; division {:.2} ulp, sqrt {:.2}, inverseSqrt {:.2};\n\
         \x20             sin {:.1e}, cos {:.1e} (absolute)\n\n",
        device.name,
        device.backend,
        device.driver,
        yes(driver.contracts),
        yes(driver.fma_is_fused),
        yes(driver.reassociates),
        yes(driver.sums_hold),
        yes(driver.flushes_subnormals),
        driver.division_ulp,
        driver.sqrt_ulp,
        driver.inverse_sqrt_ulp,
        driver.sin_error,
        driver.cos_error,
    );
    if options.offset != crate::settings::Offset::Exact {
        let _ = writeln!(
            text,
            "paths leave surfaces by --offset {}\n",
            options.offset
        );
    }
    let _ = writeln!(
        text,
        "{:>4}  {:<4}  {:<36}{:>18}{:>10}{:>9}  unit",
        "case", "", "", "failed", "worst", "limit"
    );
    text
}

fn row(report: &CaseReport, verbose: bool) -> String {
    let verdict = match report.verdict {
        Verdict::Pass => "ok",
        Verdict::Fail => "FAIL",
    };
    let mut text = format!("{:>4}  {verdict:<4}  {:<36}", report.id, report.name);
    let failed = format!("{} of {}", report.failures, report.trials);
    let worst = report.worst.map_or("inf".into(), short);
    let limit = short(report.limit);
    let _ = writeln!(text, "{failed:>18}{worst:>10}{limit:>9}  {}", report.unit);
    if verbose {
        let _ = writeln!(text, "            {}", report.setup);
    }
    if verbose || report.verdict == Verdict::Fail {
        let _ = writeln!(text, "            worst: {}", report.why);
    }
    text
}

/// Two or three digits.
fn short(x: f64) -> String {
    if x == 0.0 {
        "0".into()
    } else if (0.01..10_000.0).contains(&x) {
        format!("{x:.3}")
            .trim_end_matches('0')
            .trim_end_matches('.')
            .into()
    } else {
        format!("{x:.1e}")
    }
}

fn totals(reports: &[CaseReport], device: &AdapterSummary, options: &Options) -> String {
    let count = |v: Verdict| reports.iter().filter(|r| r.verdict == v).count();
    let disturbed = if options.disturb {
        " (disturbed: all should fail)"
    } else {
        ""
    };
    format!(
        "\n{} passed, {} failed{disturbed}, on {} ({}, {})\n",
        count(Verdict::Pass),
        count(Verdict::Fail),
        device.name,
        device.backend,
        device.driver,
    )
}

//! `cargo xtask numerics`: the hard cases on every driver that is there, into `docs/numerics.md`.

use std::process::{Command, Stdio};

use serde_json::Value;

use crate::drivers::{Driver, Optional, first};
use crate::{cargo, program, root, run};

const PAGE: &str = "docs/numerics.md";
const BEGIN: &str = "<!-- cargo xtask numerics -->\n";
const END: &str = "<!-- end -->";

/// Runs `gpu-trace check` on every driver and replaces the page's table.
pub(crate) fn all() -> Result<(), String> {
    run(cargo().args(["build", "--release"]))?;
    // Drivers are found with the debug build.
    run(cargo().args(["build"]))?;
    let (driver, alone) = first()?;
    let mut drivers = vec![driver];
    if !alone {
        drivers.extend(Optional::ALL.iter().filter_map(|o| Some(o.find()?.0)));
    }
    let reports: Vec<Value> = drivers.iter().map(report).collect::<Result<_, _>>()?;
    let page = root().join(PAGE);
    let text = std::fs::read_to_string(&page).map_err(|e| format!("{PAGE}: {e}"))?;
    let (head, rest) = text
        .split_once(BEGIN)
        .ok_or("the page has no place for it")?;
    let (_, tail) = rest.split_once(END).ok_or("the page has no end of it")?;
    let text = format!("{head}{BEGIN}{}{END}{tail}", table(&drivers, &reports));
    std::fs::write(&page, text).map_err(|e| format!("{PAGE}: {e}"))
}

fn report(driver: &Driver) -> Result<Value, String> {
    let mut command = Command::new(program("release"));
    driver.choose(command.args(["check", "--json"]).stderr(Stdio::inherit()));
    eprintln!("{}: gpu-trace check --json", driver.name);
    let output = command.output().map_err(|e| e.to_string())?;
    serde_json::from_slice(&output.stdout).map_err(|e| format!("{}: {e}", driver.name))
}

/// A number with two digits.
fn short(value: &Value) -> String {
    match value.as_f64() {
        None => "inf".into(),
        Some(x) if x == 0.0 || (0.01..10_000.0).contains(&x) && x.fract() == 0.0 => format!("{x}"),
        Some(x) if (0.01..10_000.0).contains(&x) => format!("{x:.2}"),
        Some(x) => format!("{x:.1e}"),
    }
}

fn table(drivers: &[Driver], reports: &[Value]) -> String {
    // A bar would end the cell.
    let text = |value: &Value| value.as_str().unwrap_or_default().replace('|', "\\|");
    let mut lines = Vec::new();
    let heads: Vec<&str> = drivers.iter().map(|d| d.name).collect();
    lines.push(format!("| case | | limit | {} |", heads.join(" | ")));
    lines.push(format!("|---|---|---|{}", "---|".repeat(drivers.len())));
    let cases = |report: &Value| report["cases"].as_array().cloned().unwrap_or_default();
    for (i, case) in cases(&reports[0]).iter().enumerate() {
        let name = format!("**{}**: {}", text(&case["name"]), text(&case["setup"]));
        if case["verdict"] == "not-applicable" {
            let why = text(&case["why"]);
            lines.push(format!(
                "| {} | {name} | not applicable: {why} |",
                case["id"]
            ));
            continue;
        }
        let cells: Vec<String> = reports
            .iter()
            .map(|report| {
                let case = &cases(report)[i];
                let fails = if case["verdict"] == "fail" {
                    "**FAILS** "
                } else {
                    ""
                };
                format!(
                    "{fails}{} of {}; {}",
                    case["failures"],
                    case["trials"],
                    short(&case["worst"])
                )
            })
            .collect();
        lines.push(format!(
            "| {} | {name} | {} {} | {} |",
            case["id"],
            short(&case["limit"]),
            text(&case["unit"]),
            cells.join(" | ")
        ));
    }
    lines.push("\n| arithmetic | ".to_owned() + &heads.join(" | ") + " |");
    lines.push(format!("|---|{}", "---|".repeat(drivers.len())));
    for (key, name) in [
        ("contracts", "a b + c rounded once"),
        ("fma_is_fused", "`fma` rounded once"),
        ("reassociates", "(a + b) - a taken for b"),
        ("sums_hold", "the kernel's sums hold"),
        ("flushes_subnormals", "subnormals flushed"),
        ("division_ulp", "division, ulp"),
        ("sqrt_ulp", "sqrt, ulp"),
        ("inverse_sqrt_ulp", "inverseSqrt, ulp"),
        ("sin_error", "sin, absolute"),
        ("cos_error", "cos, absolute"),
    ] {
        let cells: Vec<String> = reports
            .iter()
            .map(|report| match &report["device"]["arithmetic"][key] {
                Value::Bool(true) => "yes".into(),
                Value::Bool(false) => "no".into(),
                value => short(value),
            })
            .collect();
        lines.push(format!("| {name} | {} |", cells.join(" | ")));
    }
    let drivers = drivers.iter().zip(reports).map(|(driver, report)| {
        let device = &report["device"];
        format!(
            "{}: {} ({}, {})",
            driver.name,
            text(&device["name"]),
            text(&device["backend"]),
            text(&device["driver"])
        )
    });
    lines.push(format!("\n{}.", drivers.collect::<Vec<_>>().join("; ")));
    lines.join("\n") + "\n"
}

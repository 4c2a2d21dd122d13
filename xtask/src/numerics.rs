//! `cargo xtask numerics`: the hard cases on every driver that is there, into `docs/numerics.md`.

use std::collections::BTreeMap;
use std::process::{Command, Stdio};

use serde_json::Value;

use crate::drivers::{Driver, Optional, first};
use crate::{cargo, program, root, run};

const USAGE: &str = "\
Usage: cargo xtask numerics [--driver NAME]... [--case NUMBER[,NUMBER]...]...

Runs `gpu-trace check` and puts what it says into the table of docs/numerics.md.

  --driver   on this driver only, by a part of its name: lavapipe, SwiftShader, GL, current Mesa
  --case     these cases only

What is not measured this time keeps its place in the table.
";

const PAGE: &str = "docs/numerics.md";
const BEGIN: &str = "<!-- cargo xtask numerics -->\n";
const END: &str = "<!-- end -->";
const UNKNOWN: &str = "not measured yet";

/// What is measured.
#[derive(Debug, Default)]
struct Choice {
    /// Parts of names; empty for all drivers.
    drivers: Vec<String>,
    /// Numbers; empty for all cases.
    cases: Vec<String>,
}

/// Runs `gpu-trace check` as `arguments` choose, and brings the page's table up to date.
///
/// # Errors
/// If a driver is not there, the check cannot run, or the page is not as this task left it.
pub(crate) fn all(arguments: &[String]) -> Result<(), String> {
    if arguments.iter().any(|a| a == "--help" || a == "-h") {
        print!("{USAGE}");
        return Ok(());
    }
    let choice = Choice::parse(arguments)?;
    run(cargo().args(["build", "--release"]))?;
    // Drivers are found with the debug build.
    run(cargo().args(["build"]))?;
    let (driver, alone) = first()?;
    let mut drivers = vec![driver];
    if !alone {
        drivers.extend(Optional::ALL.iter().filter_map(|o| Some(o.find()?.0)));
    }
    drivers.retain(|driver| choice.has(driver.name));
    if drivers.is_empty() {
        return Err(format!(
            "no driver of this name is there; `cargo xtask test --drivers` installs those that are missing\n{USAGE}"
        ));
    }
    let page = root().join(PAGE);
    let text = std::fs::read_to_string(&page).map_err(|e| format!("{PAGE}: {e}"))?;
    let (head, rest) = text
        .split_once(BEGIN)
        .ok_or("the page has no place for it")?;
    let (old, tail) = rest.split_once(END).ok_or("the page has no end of it")?;
    let mut table = Table::parse(old)?;
    for driver in drivers {
        let report = report(&driver, &choice.cases)?;
        table.take(driver.name, &report, choice.cases.is_empty())?;
    }
    let text = format!("{head}{BEGIN}{}{END}{tail}", table.text());
    std::fs::write(&page, text).map_err(|e| format!("{PAGE}: {e}"))
}

impl Choice {
    fn parse(arguments: &[String]) -> Result<Self, String> {
        let mut choice = Self::default();
        let mut words = arguments.iter();
        while let Some(word) = words.next() {
            let value = words.next();
            match (word.as_str(), value) {
                ("--driver", Some(name)) => choice.drivers.push(name.clone()),
                ("--case", Some(list)) => {
                    choice
                        .cases
                        .extend(list.split(',').map(|n| n.trim().to_owned()));
                }
                _ => return Err(USAGE.into()),
            }
        }
        if choice.cases.iter().any(|n| n.parse::<u32>().is_err()) {
            return Err(format!("cases are chosen by their numbers\n{USAGE}"));
        }
        Ok(choice)
    }

    fn has(&self, driver: &str) -> bool {
        let driver = driver.to_lowercase();
        let part = |name: &String| driver.contains(&name.to_lowercase());
        self.drivers.is_empty() || self.drivers.iter().any(part)
    }
}

fn report(driver: &Driver, cases: &[String]) -> Result<Value, String> {
    let mut command = Command::new(program("release"));
    command.args(["check", "--json"]);
    for case in cases {
        command.args(["--case", case]);
    }
    let shown: Vec<_> = command.get_args().map(|a| a.to_string_lossy()).collect();
    eprintln!("{}: gpu-trace {}", driver.name, shown.join(" "));
    let output = driver
        .choose(&command)
        .stderr(Stdio::inherit())
        .output()
        .map_err(|e| e.to_string())?;
    serde_json::from_slice(&output.stdout).map_err(|e| format!("{}: {e}", driver.name))
}

/// The page's table: what every driver has said of every case, and of its arithmetic.
#[derive(Clone, Debug, Default, PartialEq)]
struct Table {
    /// Names of drivers, as the columns have them.
    drivers: Vec<String>,
    cases: BTreeMap<u32, Row>,
    /// Names of lines, each with its cells.
    arithmetic: Vec<(String, Cells)>,
    /// What device that was, by driver.
    devices: Cells,
}

/// By driver.
type Cells = BTreeMap<String, String>;

/// A case.
#[derive(Clone, Debug, Default, PartialEq)]
struct Row {
    /// Name and setup.
    name: String,
    /// The limit with its unit.
    limit: String,
    cells: Cells,
}

impl Table {
    /// Reads what [`text`](Self::text) wrote.
    fn parse(text: &str) -> Result<Self, String> {
        let wrong = |line: &str| format!("{PAGE}: not a line of the table: {line}");
        let mut table = Self::default();
        let named = |drivers: &[String], cells: &[String]| -> Cells {
            let pairs = drivers.iter().cloned().zip(cells.iter().cloned());
            pairs.filter(|(_, cell)| cell != UNKNOWN).collect()
        };
        for line in text
            .lines()
            .filter(|l| !l.is_empty() && !l.starts_with("|-"))
        {
            let Some(cells) = cells(line) else {
                // The last line: the devices.
                for part in line.trim_end_matches('.').split("; ") {
                    let (driver, device) = part.split_once(": ").ok_or_else(|| wrong(line))?;
                    table.devices.insert(driver.into(), device.into());
                }
                continue;
            };
            match &cells[..] {
                [case, _, _, drivers @ ..] if case == "case" => table.drivers = drivers.to_vec(),
                [title, ..] if title == "arithmetic" => {}
                [number, name, limit, rest @ ..] if number.parse::<u32>().is_ok() => {
                    let row = Row {
                        name: name.clone(),
                        limit: limit.clone(),
                        cells: named(&table.drivers, rest),
                    };
                    let number = number.parse().map_err(|_| wrong(line))?;
                    table.cases.insert(number, row);
                }
                [name, rest @ ..] if rest.len() == table.drivers.len() => {
                    let cells = named(&table.drivers, rest);
                    table.arithmetic.push((name.clone(), cells));
                }
                _ => return Err(wrong(line)),
            }
        }
        Ok(table)
    }

    /// Takes what `driver` has said, of all cases or of some.
    ///
    /// # Errors
    /// If that would put figures of two devices into one column.
    fn take(&mut self, driver: &str, report: &Value, of_all: bool) -> Result<(), String> {
        let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
        let device = &report["device"];
        let name = format!(
            "{} ({}, {})",
            text(&device["name"]),
            text(&device["backend"]),
            text(&device["driver"])
        );
        if !self.drivers.iter().any(|d| d == driver) {
            self.drivers.push(driver.into());
        }
        let before = self.devices.insert(driver.into(), name.clone());
        if let Some(before) = before.filter(|before| *before != name && !of_all) {
            return Err(format!(
                "{driver} was {before}, and is {name} now: measure all cases of it"
            ));
        }
        for case in report["cases"].as_array().into_iter().flatten() {
            let number = case["id"].as_u64().unwrap_or_default() as u32;
            let new = row(case);
            let row = self.cases.entry(number).or_default();
            if (&row.name, &row.limit) != (&new.name, &new.limit) {
                // What is known is of another case.
                *row = new.clone();
            }
            row.cells.insert(driver.into(), cell(case));
        }
        if self.arithmetic.is_empty() {
            let lines = ARITHMETIC
                .iter()
                .map(|(_, name)| ((*name).into(), Cells::new()));
            self.arithmetic = lines.collect();
        }
        for (key, name) in ARITHMETIC {
            let value = match &device["arithmetic"][key] {
                Value::Bool(true) => "yes".into(),
                Value::Bool(false) => "no".into(),
                value => short(value),
            };
            let lines = self.arithmetic.iter_mut().filter(|(line, _)| line == name);
            lines.for_each(|(_, cells)| {
                cells.insert(driver.into(), value.clone());
            });
        }
        Ok(())
    }

    fn text(&self) -> String {
        let all = |cells: &Cells| -> String {
            let cell = |driver| cells.get(driver).map_or(UNKNOWN, String::as_str);
            let cells: Vec<&str> = self.drivers.iter().map(cell).collect();
            cells.join(" | ")
        };
        let heads = self.drivers.join(" | ");
        let rule = "---|".repeat(self.drivers.len());
        let mut lines = vec![
            format!("| case | | limit | {heads} |"),
            format!("|---|---|---|{rule}"),
        ];
        for (number, Row { name, limit, cells }) in &self.cases {
            lines.push(format!("| {number} | {name} | {limit} | {} |", all(cells)));
        }
        lines.push(format!("\n| arithmetic | {heads} |"));
        lines.push(format!("|---|{rule}"));
        for (name, cells) in &self.arithmetic {
            lines.push(format!("| {name} | {} |", all(cells)));
        }
        let device = |driver: &String| Some(format!("{driver}: {}", self.devices.get(driver)?));
        let devices: Vec<String> = self.drivers.iter().filter_map(device).collect();
        lines.push(format!("\n{}.", devices.join("; ")));
        lines.join("\n") + "\n"
    }
}

/// Members of the report, and what the table calls them.
const ARITHMETIC: [(&str, &str); 10] = [
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
];

/// What the table says of a case before any driver does.
fn row(case: &Value) -> Row {
    // A bar would end the cell.
    let text = |value: &Value| value.as_str().unwrap_or_default().replace('|', "\\|");
    Row {
        name: format!("**{}**: {}", text(&case["name"]), text(&case["setup"])),
        limit: format!("{} {}", short(&case["limit"]), text(&case["unit"])),
        cells: Cells::new(),
    }
}

fn cell(case: &Value) -> String {
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
}

/// The cells of a line of a table; `None` if it is none. A bar after a backslash is text.
fn cells(line: &str) -> Option<Vec<String>> {
    let inside = line.strip_prefix('|')?.strip_suffix('|')?;
    let mut cells = vec![String::new()];
    let mut last = ' ';
    for c in inside.chars() {
        match (c, cells.last_mut()) {
            ('|', _) if last != '\\' => cells.push(String::new()),
            (_, Some(cell)) => cell.push(c),
            (_, None) => {}
        }
        last = c;
    }
    Some(cells.iter().map(|cell| cell.trim().to_owned()).collect())
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

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::*;

    fn part_of_page() -> (String, Table) {
        let page = std::fs::read_to_string(root().join(PAGE)).expect("the page");
        let (_, rest) = page.split_once(BEGIN).expect("its place");
        let (old, _) = rest.split_once(END).expect("its end");
        (old.into(), Table::parse(old).expect("a table"))
    }

    fn said(driver: &str, cases: &[Value]) -> Value {
        let device = json!({
            "name": "N", "backend": "b", "driver": driver,
            "arithmetic": { "contracts": true, "sqrt_ulp": 0.5 },
        });
        json!({ "device": device, "cases": cases })
    }

    fn case(id: u32, setup: &str, worst: f64) -> Value {
        json!({
            "id": id, "name": "a", "setup": setup, "verdict": "pass", "failures": 0, "trials": 7,
            "limit": 1.0, "unit": "of |b|", "worst": worst,
        })
    }

    #[test]
    fn the_page_stays_what_it_is() {
        let (old, table) = part_of_page();
        assert!(table.cases.len() > 30 && table.arithmetic.len() == ARITHMETIC.len());
        assert_eq!(table.text(), old);
    }

    #[test]
    fn what_is_measured_is_replaced_and_the_rest_stays() {
        let mut table = Table::default();
        let both = [case(1, "of one", 0.25), case(2, "of two", 3.0)];
        table
            .take("A", &said("v1", &both), true)
            .expect("one device");
        table
            .take("B", &said("v1", &both[..1]), false)
            .expect("the first of it");
        assert_eq!(table.cases[&2].cells.get("B"), None);
        let text = table.text();
        assert!(
            text.contains("| 2 | **a**: of two | 1 of \\|b\\| | 0 of 7; 3 | not measured yet |"),
            "{text}"
        );
        assert_eq!(Table::parse(&text), Ok(table.clone()));

        let before = table.clone();
        table
            .take("A", &said("v1", &[case(1, "of one", 0.5)]), false)
            .expect("the same device");
        assert_eq!(table.cases[&1].cells["A"], "0 of 7; 0.50");
        assert_eq!(table.cases[&1].cells["B"], before.cases[&1].cells["B"]);
        assert_eq!(table.cases[&2], before.cases[&2]);
        // Another case of the same number: what others have said is of no use.
        table
            .take("A", &said("v1", &[case(1, "of more", 0.5)]), false)
            .expect("the same device");
        assert_eq!(table.cases[&1].cells.keys().collect::<Vec<_>>(), ["A"]);
        // Another device cannot have a part of a column.
        let other = said("v2", &[case(1, "of more", 0.5)]);
        assert!(table.clone().take("A", &other, false).is_err());
        assert!(table.take("A", &other, true).is_ok());
    }

    #[test]
    fn drivers_and_cases_are_chosen() {
        let parse = |text: &str| {
            let words: Vec<String> = text.split_whitespace().map(String::from).collect();
            Choice::parse(&words)
        };
        let choice = parse("--driver gl --case 16,17 --case 20").expect("a choice");
        assert_eq!(choice.cases, ["16", "17", "20"]);
        assert!(choice.has("llvmpipe, GL") && !choice.has("lavapipe"));
        assert!(parse("").expect("all").has("lavapipe"));
        for wrong in ["--driver", "--case x", "--cases 3", "16"] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }
}

//! `cargo xtask prices`: what every effect costs on this device, into docs/effects.md, with a picture.

use std::fmt::Write as _;
use std::process::{Command, Stdio};

use serde_json::Value;

use crate::{cargo, program, root, run};

const USAGE: &str = "\
Usage: cargo xtask prices

Runs `gpu-trace effects --measure --all` and puts what it says into docs/effects.md and
docs/images/prices.svg. Run it on an idle machine.
";

const PAGE: &str = "docs/effects.md";
const PICTURE: &str = "docs/images/prices.svg";
const BEGIN: &str = "<!-- cargo xtask prices -->\n";
const END: &str = "<!-- end -->";

/// Measures, and writes both.
///
/// # Errors
/// If the program fails, or the page is not as this task left it.
pub(crate) fn all(arguments: &[String]) -> Result<(), String> {
    if !arguments.is_empty() {
        return Err(USAGE.into());
    }
    run(cargo().args(["build", "--release"]))?;
    let output = Command::new(program("release"))
        .args(["effects", "--measure", "--all", "--json"])
        .env("NODEVICE_SELECT", "1")
        .env("MESA_SHADER_CACHE_DISABLE", "true")
        .stderr(Stdio::inherit())
        .output()
        .map_err(|e| e.to_string())?;
    let list: Value = serde_json::from_slice(&output.stdout)
        .map_err(|e| format!("gpu-trace effects --measure --all: {e}"))?;
    let page = root().join(PAGE);
    let text = std::fs::read_to_string(&page).map_err(|e| format!("{PAGE}: {e}"))?;
    let (head, rest) = text
        .split_once(BEGIN)
        .ok_or("the page has no place for it")?;
    let (_, tail) = rest.split_once(END).ok_or("the page has no end of it")?;
    let rows = rows(&list);
    let text = format!("{head}{BEGIN}{}{END}{tail}", table(&list, &rows));
    std::fs::write(&page, text).map_err(|e| format!("{PAGE}: {e}"))?;
    std::fs::write(root().join(PICTURE), picture(&rows)).map_err(|e| format!("{PICTURE}: {e}"))
}

/// An effect, as the program has measured it.
#[derive(Clone, Debug, PartialEq)]
struct Row {
    name: String,
    /// What it is measured against; `None` where it was linked in, unused.
    against: Option<String>,
    /// Seconds of a million samples: the price and the ends of its interval.
    price: [f64; 3],
    /// Time of a sample over that with the alternative, with the interval.
    ratio: [f64; 3],
    /// Decimal places of the price that matter beside the time of a sample.
    places: usize,
    variance: Option<f64>,
    lines: i64,
}

fn rows(list: &Value) -> Vec<Row> {
    let effects = list["effects"].as_array().into_iter().flatten();
    effects
        .filter_map(|effect| {
            let against = effect["against"].as_str().map(str::to_owned);
            let figures = match against {
                Some(_) => effect,
                None => effect.get("forced")?,
            };
            let number = |key: &str| figures[key].as_f64();
            let price = [
                number("seconds_per_megasample")?,
                number("low")?,
                number("high")?,
            ];
            let other = number("seconds_against")?;
            Some(Row {
                name: effect["name"].as_str()?.to_owned(),
                against,
                price,
                ratio: price.map(|price| 1.0 + price / other),
                places: (3.0 - other.log10().floor()).clamp(0.0, 9.0) as usize,
                variance: number("variance_ratio"),
                lines: figures["kernel_lines"].as_i64()?,
            })
        })
        .collect()
}

/// Three digits.
fn digits(x: f64) -> String {
    if x == 0.0 {
        return "0".into();
    }
    let decimals = (2.0 - x.abs().log10().floor()).clamp(0.0, 4.0) as usize;
    format!("{x:.decimals$}")
}

fn table(list: &Value, rows: &[Row]) -> String {
    let device = &list["device"];
    let text = |key: &str| device[key].as_str().unwrap_or_default();
    let mut table = format!(
        "{} ({}, {}).\n\n| effect | seconds a million samples | 95 % interval | time of a sample | variance | \
         time x variance | lines | against |\n|---|---|---|---|---|---|---|---|\n",
        text("name"),
        text("backend"),
        text("driver")
    );
    for row in rows {
        let places = row.places;
        let [price, low, high] = row.price.map(|x| format!("{x:+.places$}"));
        let or_dash = |x: Option<f64>| x.map_or_else(String::new, digits);
        let _ = writeln!(
            table,
            "| `{}` | {price} | {low} to {high} | x {} | {} | {} | {:+} | {} |",
            row.name,
            digits(row.ratio[0]),
            or_dash(row.variance),
            or_dash(row.variance.map(|v| v * row.ratio[0])),
            row.lines,
            row.against
                .as_deref()
                .unwrap_or("nothing: linked in, unused"),
        );
    }
    table
}

/// Sizes of the picture.
const LEFT: f64 = 180.0;
const WIDTH: f64 = 720.0;
const TOP: f64 = 74.0;
const LINE: f64 = 18.0;

/// The times of a sample with each effect over those with its alternative, and what an error takes, on a logarithmic
/// axis.
fn picture(rows: &[Row]) -> String {
    let all = || {
        rows.iter().flat_map(|row| {
            let error = row.variance.map(|v| v * row.ratio[0]);
            row.ratio.into_iter().chain(error)
        })
    };
    let end = |f: fn(f64, f64) -> f64, of: f64| all().filter(|x| *x > 0.0).fold(of, f).log2();
    let low = end(f64::min, 0.5).floor();
    let high = end(f64::max, 2.0).ceil();
    let x = |ratio: f64| {
        let share = (ratio.max(1e-9).log2() - low) / (high - low);
        LEFT + share.clamp(0.0, 1.0) * (WIDTH - LEFT - 20.0)
    };
    let height = TOP + LINE * rows.len() as f64 + 12.0;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" width=\"{WIDTH}\" \
         height=\"{height}\" font-family=\"system-ui,-apple-system,'Segoe UI',Roboto,'DejaVu Sans',sans-serif\" \
         font-size=\"12\" role=\"img\" aria-label=\"What each effect costs\">\n<style>@media \
         (prefers-color-scheme:dark){{.paper{{fill:#14181c}}.text{{fill:#e8ecf0}}.grid{{stroke:#39424b}}\
         .one{{stroke:#a3adb8}}.time{{fill:#5db2ff;stroke:#5db2ff}}.error{{stroke:#ff8f4d}}}}</style>\n\
         <rect class=\"paper\" width=\"{WIDTH}\" height=\"{height}\" fill=\"#ffffff\"/>\n\
         <text class=\"text\" x=\"14\" y=\"20\" font-size=\"14\" font-weight=\"600\" fill=\"#1c2127\">What each \
         effect costs, as a multiple of its alternative</text>\n"
    );
    let _ = writeln!(
        svg,
        "<circle class=\"time\" cx=\"20\" cy=\"37\" r=\"4\" fill=\"#0060a8\" stroke=\"#0060a8\"/>\
         <text class=\"text\" x=\"30\" y=\"41\" fill=\"#1c2127\">time of a sample, with its 95 % interval</text>\
         <circle class=\"error\" cx=\"304\" cy=\"37\" r=\"4\" fill=\"none\" stroke=\"#b84300\" stroke-width=\"1.6\"/>\
         <text class=\"text\" x=\"314\" y=\"41\" fill=\"#1c2127\">time that an error takes (time x variance)</text>"
    );
    let bottom = height - 8.0;
    // As many as there is room for.
    let step = ((high - low) / 10.0).ceil().max(1.0) as i32;
    for power in (low as i32..=high as i32).filter(|power| power % step == 0) {
        let ratio = 2.0_f64.powi(power);
        let (at, class, ink) = match power {
            0 => (x(ratio), "one", "#5b6570"),
            _ => (x(ratio), "grid", "#d9dee3"),
        };
        let label = match power {
            0.. => format!("{ratio}"),
            _ => format!("1/{}", 1.0 / ratio),
        };
        let _ = writeln!(
            svg,
            "<line class=\"{class}\" x1=\"{at:.1}\" x2=\"{at:.1}\" y1=\"{:.1}\" y2=\"{bottom:.1}\" stroke=\"{ink}\"/>\
             <text class=\"text\" x=\"{at:.1}\" y=\"{:.1}\" text-anchor=\"middle\" fill=\"#1c2127\">{label}</text>",
            TOP - 8.0,
            TOP - 13.0
        );
    }
    for (row, y) in rows
        .iter()
        .zip((0..).map(|i| TOP + LINE * (f64::from(i) + 0.5)))
    {
        let [ratio, from, to] = row.ratio.map(x);
        let _ = writeln!(
            svg,
            "<text class=\"text\" x=\"{}\" y=\"{:.1}\" text-anchor=\"end\" fill=\"#1c2127\">{}</text>\
             <line class=\"time\" x1=\"{from:.1}\" x2=\"{to:.1}\" y1=\"{y:.1}\" y2=\"{y:.1}\" stroke=\"#0060a8\" \
             stroke-width=\"2\"/><circle class=\"time\" cx=\"{ratio:.1}\" cy=\"{y:.1}\" r=\"3.5\" fill=\"#0060a8\"/>",
            LEFT - 12.0,
            y + 4.0,
            row.name,
        );
        if let Some(variance) = row.variance {
            let _ = writeln!(
                svg,
                "<circle class=\"error\" cx=\"{:.1}\" cy=\"{y:.1}\" r=\"5\" fill=\"none\" stroke=\"#b84300\" \
                 stroke-width=\"1.6\"/>",
                x(variance * row.ratio[0])
            );
        }
    }
    svg + "</svg>\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_for_what_has_a_figure() {
        let list = serde_json::json!({"effects": [
            {"name": "a", "against": "b", "seconds_per_megasample": 1.0, "low": 0.5, "high": 1.5,
             "seconds_against": 2.0, "variance_ratio": 0.5, "kernel_lines": 7},
            {"name": "c", "no_price": "why"},
            {"name": "d", "forced": {"seconds_per_megasample": 0.0, "low": -0.1, "high": 0.1,
             "seconds_against": 2.0, "variance_ratio": null, "kernel_lines": -1}},
        ]});
        let rows = rows(&list);
        assert_eq!(rows.len(), 2);
        assert_eq!(rows[0].ratio, [1.5, 1.25, 1.75]);
        let table = table(&list, &rows);
        assert!(
            table.contains("| `a` | +1.000 | +0.500 to +1.500 | x 1.50 | 0.500 | 0.750 | +7 | b |"),
            "{table}"
        );
        let picture = picture(&rows);
        assert_eq!(
            picture.matches("class=\"error\"").count(),
            2,
            "a key and a row"
        );
    }
}

//! A price list as text and as JSON.

use std::fmt::Write as _;

use serde_json::{Value, json};

use super::super::super::format::{duration, significant};
use crate::prices::{Against, Difference, Measured, Price, PriceList};

pub(super) fn document(scene: &str, list: &PriceList) -> Value {
    let (name, backend, driver) = &list.device;
    let mut document = json!({
        "device": { "name": name, "backend": backend, "driver": driver },
        "scene": scene,
        "rounds": list.rounds,
        "interrupted": list.interrupted,
        "effects": list.prices.iter().map(row_json).collect::<Vec<_>>(),
    });
    if let Some(kernel) = &list.kernel {
        document["kernel"] = json!({
            "width": kernel.size[0], "height": kernel.size[1], "spp": kernel.spp,
            "seconds_per_megasample": kernel.seconds_per_megasample,
            "kernel_lines": kernel.lines, "compile_seconds": kernel.compile_seconds,
        });
    }
    document
}

fn row_json(price: &Price) -> Value {
    let used = !price.reasons.is_empty();
    let mut row = json!({
        "name": price.effect.name(), "what": price.effect.row().what, "used": used, "reasons": price.reasons,
        "seconds_per_megasample": null, "low": null, "high": null, "kernel_lines": null,
    });
    match &price.against {
        Some(Ok(against)) => {
            figures(&mut row, &against.difference);
            row["against"] = json!(against.what);
            row["without"] = json!(against.without);
            row["instead"] = json!(against.instead);
        }
        Some(Err(why)) => row["no_price"] = json!(why),
        None => {}
    }
    if price.absent == Some(true) {
        for (key, nothing) in [
            ("seconds_per_megasample", json!(0.0)),
            ("low", json!(0.0)),
            ("high", json!(0.0)),
            ("kernel_lines", json!(0)),
        ] {
            row[key] = nothing;
        }
    }
    match &price.forced {
        Some(Ok(difference)) => {
            let mut forced = json!({});
            figures(&mut forced, difference);
            row["forced"] = forced;
        }
        Some(Err(why)) => row["not_forced"] = json!(why),
        None => {}
    }
    row
}

fn figures(row: &mut Value, difference: &Difference) {
    let cost = &difference.cost;
    row["seconds_per_megasample"] = json!(cost.price);
    row["low"] = json!(cost.interval[0]);
    row["high"] = json!(cost.interval[1]);
    row["seconds_with"] = json!(cost.with);
    row["seconds_against"] = json!(cost.against);
    row["variance_ratio"] = json!(cost.variance_ratio);
    row["kernel_lines"] = json!(difference.kernel_lines);
    row["compile_seconds"] = json!(difference.compile_seconds);
}

/// Columns of figures: price, interval, share, variance, time x variance, lines, compile time.
const FIGURES: [usize; 7] = [10, 22, 8, 9, 9, 7, 9];

pub(super) fn text(name: &str, list: &PriceList) -> String {
    let (device, backend, driver) = &list.device;
    let mut text = format!("{name}: {device} ({backend}, {driver})\n");
    if let Some(Measured {
        size: [width, height],
        spp,
        seconds_per_megasample,
        lines,
        compile_seconds,
    }) = list.kernel
    {
        let _ = writeln!(
            text,
            "{} s a million samples of {width}x{height} pixels, in turns of {spp} spp; a kernel of {lines} \
             lines, there after {}",
            significant(seconds_per_megasample),
            duration(compile_seconds),
        );
    }
    let used = || list.prices.iter().filter(|price| price.against.is_some());
    let forced = || list.prices.iter().filter(|price| price.forced.is_some());
    let names = list.prices.iter().map(|price| price.effect.name().len());
    let width = names.max().unwrap_or(0);
    if used().next().is_some() {
        text += "\nPrice: seconds a million samples, with the effect less with what stands in its place\n\n";
        text += &(heading(width) + "  against\n");
        for price in used() {
            text += &line_of_used(price, width);
        }
        text += "\nshare: of a sample's time. variance: of a sample, with the effect over without; t x v: the same of \
                 time x variance,\nthe time that an error takes.\n";
    }
    if forced().next().is_some() {
        let absent = |price: &&Price| price.absent == Some(false);
        let present: Vec<_> = list.prices.iter().filter(absent).collect();
        text += match list.kernel {
            None => "\nWithout an alternative: linked into the plain ball's kernel, unused\n",
            Some(_) => {
                "\nLeft out, at the price of 0: the kernel is, byte for byte, the one without their sources.\n\
                 Forced in, unused:\n"
            }
        };
        text += &(heading(width) + "\n");
        for price in present {
            let _ = writeln!(text, "  {} IS in the kernel: a defect", price.effect.name());
        }
        for price in forced() {
            let _ = match &price.forced {
                Some(Ok(d)) => writeln!(text, "  {:width$}{}", price.effect.name(), columns(d)),
                Some(Err(why)) => writeln!(text, "  {:width$}  {why}", price.effect.name()),
                None => Ok(()),
            };
        }
    }
    if list.interrupted {
        text += "\nInterrupted: the rest was not measured.\n";
    }
    text
}

fn heading(width: usize) -> String {
    let titles = [
        "price",
        "95 % interval",
        "share",
        "variance",
        "t x v",
        "lines",
        "compile",
    ];
    let mut text = format!("  {:width$}", "");
    for (title, width) in titles.iter().zip(FIGURES) {
        let _ = write!(text, "{title:>width$}");
    }
    text
}

fn line_of_used(price: &Price, width: usize) -> String {
    let name = price.effect.name();
    match price.against.as_ref() {
        None => String::new(),
        Some(Err(why)) => format!("  {name:width$}  no price: {why}\n"),
        Some(Ok(against)) => {
            let columns = columns(&against.difference);
            format!("  {name:width$}{columns}  {}\n", what(against))
        }
    }
}

/// What stands in an effect's place, and what else that changes.
fn what(against: &Against) -> String {
    let mut text = against.what.clone();
    for (word, names) in [("without", &against.without), ("with", &against.instead)] {
        if !names.is_empty() {
            let _ = write!(text, ", {word} {}", names.join(", "));
        }
    }
    text
}

fn columns(difference: &Difference) -> String {
    let cost = &difference.cost;
    // As many for all of a row: those that matter beside the time of a sample.
    let places = (3.0 - cost.with.max(cost.against).log10().floor()).clamp(0.0, 9.0) as usize;
    let signed = |seconds: f64| format!("{seconds:+.places$}");
    let [low, high] = cost.interval.map(signed);
    let ratio = |ratio: Option<f64>| ratio.map_or_else(|| "-".to_owned(), significant);
    let times = cost.variance_ratio.map(|v| v * cost.with / cost.against);
    let cells = [
        signed(cost.price),
        format!("{low} to {high}"),
        percent_rounded(cost.price / cost.with),
        ratio(cost.variance_ratio),
        ratio(times),
        format!("{:+}", difference.kernel_lines),
        format!("{:+.2} s", difference.compile_seconds),
    ];
    let mut text = String::new();
    for (cell, width) in cells.iter().zip(FIGURES) {
        let _ = write!(text, "{cell:>width$}");
    }
    text
}

fn percent_rounded(share: f64) -> String {
    format!("{:.0} %", 100.0 * share)
}

/// What `price` says of the effects: those with a price, the dearest first.
pub(in super::super::super) fn shares_text(list: &PriceList) -> String {
    let told = list.prices.iter().filter_map(|price| {
        let against = price.against.as_ref()?.as_ref().ok()?;
        Some((price.effect.name(), against))
    });
    let mut rows: Vec<(&str, &Against)> = told.collect();
    let share = |against: &Against| against.difference.cost.price / against.difference.cost.with;
    rows.sort_by(|a, b| share(b.1).total_cmp(&share(a.1)));
    let width = rows.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
    let mut text =
        "\n  of a sample's time, less what stands in its place takes (below 0: what it saves)\n"
            .to_owned();
    for (name, against) in rows {
        let cost = &against.difference.cost;
        let [low, high] = cost.interval.map(|end| percent_rounded(end / cost.with));
        let _ = writeln!(
            text,
            "  {name:width$}{:>8}  {:<20}  against {}",
            percent_rounded(share(against)),
            format!("{low} to {high}"),
            what(against)
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::Effect;
    use crate::prices::Cost;

    fn list() -> PriceList {
        let difference = Difference {
            cost: Cost {
                with: 0.5,
                against: 0.4,
                price: 0.1,
                interval: [0.05, 0.15],
                variance_ratio: Some(0.5),
            },
            kernel_lines: 7,
            compile_seconds: 0.25,
        };
        let price = |effect, against, forced| Price {
            effect,
            reasons: match &against {
                Some(_) => vec!["a reason".into()],
                None => vec![],
            },
            absent: against.is_none().then_some(true),
            against,
            forced,
        };
        let lens = Against {
            what: "a pinhole".into(),
            without: vec!["mis"],
            instead: vec!["table"],
            difference,
        };
        PriceList {
            device: ("a".into(), "b".into(), "c".into()),
            kernel: None,
            prices: vec![
                price(Effect::Lens, Some(Ok(lens)), None),
                price(Effect::Pole, Some(Err("it cannot".into())), None),
                price(Effect::Sky, None, Some(Err("it has not".into()))),
                price(Effect::Classes, None, Some(Ok(difference))),
            ],
            rounds: 8,
            interrupted: true,
        }
    }

    #[test]
    fn a_line_for_each_effect() {
        let text = text("scene", &list());
        let line = |name: &str| {
            let mut lines = text.lines();
            let line = lines.find(|line| line.trim_start().starts_with(name));
            let words: Vec<_> = line.expect(name).split_whitespace().collect();
            words.join(" ")
        };
        let figures = "+0.1000 +0.0500 to +0.1500 20 % 0.500 0.625 +7 +0.25 s";
        let lens = format!("lens {figures} a pinhole, without mis, with table");
        assert_eq!(line("lens"), lens);
        assert_eq!(line("pole"), "pole no price: it cannot");
        assert_eq!(line("sky"), "sky it has not");
        assert_eq!(line("classes"), format!("classes {figures}"));
        assert!(text.ends_with("the rest was not measured.\n"));
        let shares = shares_text(&list());
        assert!(shares.contains("20 %  10 % to 30 %"), "{shares}");
        assert_eq!(shares.lines().count(), 3, "{shares}");
    }

    #[test]
    fn json_has_what_the_text_has() {
        let document = document("scene", &list());
        let effects = document["effects"].as_array().expect("a list");
        let row = |name: &str| effects.iter().find(|row| row["name"] == name).expect(name);
        let lens = row("lens");
        assert_eq!(lens["seconds_per_megasample"], 0.1);
        assert_eq!([&lens["low"], &lens["high"]], [0.05, 0.15]);
        assert_eq!(
            (&lens["used"], &lens["kernel_lines"]),
            (&json!(true), &json!(7))
        );
        assert_eq!(row("pole")["no_price"], "it cannot");
        assert!(row("pole")["seconds_per_megasample"].is_null());
        let classes = row("classes");
        assert_eq!(
            (&classes["used"], &classes["seconds_per_megasample"]),
            (&json!(false), &json!(0.0))
        );
        assert_eq!(classes["forced"]["kernel_lines"], 7);
        assert_eq!(row("sky")["not_forced"], "it has not");
    }
}

//! `gpu-trace price`: what a render will cost, from a short pilot.

use std::fmt::Write as _;
use std::time::{Duration, Instant};

use clap::Args;
use serde_json::{Value, json};

use super::args::RenderArgs;
use super::choices::{self, Wanted};
use super::effects::{shares, shares_text};
use super::format::{duration, percent, significant};
use super::signals::Signals;
use super::{print, values};
use crate::backend::{Backend, BackendChoice, BackendKind};
use crate::error::{Error, Result};
use crate::forecast::{self, Forecast, Pilot};
use crate::job::prepare;
use crate::memory::{LEAST_PIXEL_BYTES, check_memory};
use crate::output::Progress;
use crate::prices::{Price, PriceList, smaller};
use crate::settings::{MAXIMUM_SPP, Rect, Settings};

pub(super) const AFTER_HELP: &str = "\
Takes the options of a render and says what that render would cost; it writes no image.

Examples:
  gpu-trace price                              samples and seconds to 5, 2, 1, 0.5 and 0.1 %
  gpu-trace price my.toml --error 1%           to 1 %
  gpu-trace price my.toml --time 10m           the error that ten minutes buy
  gpu-trace price glass --backends gpu,cpu     on both
  gpu-trace price glass --by-effect            and which effects the time goes to

Seconds are those of rendering alone: setup and compilation are given apart. The interval holds
95 % of such renders, as far as the pilot can tell: light that it has not seen, as of a rare
caustic, is in neither figure.";

/// The errors of the table.
const ERRORS: [f64; 5] = [0.05, 0.02, 0.01, 0.005, 0.001];

/// The options of `price`.
#[derive(Clone, Debug, Args)]
#[command(
    mut_arg("output", |a| a.hide(true)),
    mut_arg("stats", |a| a.hide(true)),
    mut_arg("aov", |a| a.hide(true)),
    mut_arg("adaptive", |a| a.hide(true)),
    mut_arg("exposure", |a| a.hide(true)),
    mut_arg("dump_wgsl", |a| a.hide(true)),
    mut_arg("allow_non_finite", |a| a.hide(true)),
    mut_arg("progress", |a| a.hide(true)),
    mut_arg("verbose", |a| a.hide(true)),
    mut_arg("error", |a| a.help("Only this error: 1% or 0.01")),
    mut_arg("time", |a| a.help("The error that this time buys: 30s, 2m, 1h")),
    mut_arg("spp", |a| a.help("The error and time of so many samples a pixel")),
)]
pub(super) struct PriceArgs {
    #[command(flatten)]
    pub(super) render: RenderArgs,
    /// Several backends, as in gpu,cpu [default: the one of --backend].
    #[arg(
        long,
        value_name = "LIST",
        value_parser = choices::backend(),
        value_delimiter = ',',
        conflicts_with = "backend",
        hide_possible_values = true,
        help_heading = "Device"
    )]
    pub(super) backends: Vec<Wanted>,
    /// About how long to measure, on each backend.
    #[arg(long, value_name = "TIME", value_parser = values::time, default_value = "5s",
          help_heading = "How long")]
    pub(super) pilot: Duration,
    /// Measure which effects the time goes to, as `effects --measure` does: it takes several times as long.
    #[arg(long, help_heading = "Output")]
    pub(super) by_effect: bool,
    /// Print JSON.
    #[arg(long, help_heading = "Output")]
    pub(super) json: bool,
}

/// What was measured on one backend.
struct Quote {
    backend: &'static str,
    device: String,
    setup: f64,
    compile: f64,
    /// Of the image and what is made of it, in this program.
    host_bytes: u64,
    device_bytes: u64,
    pilot: Pilot,
    /// What the time goes to, if that was asked for.
    effects: Option<PriceList>,
}

/// Runs `price`.
pub(super) fn run(args: &PriceArgs) -> Result<()> {
    let render = &args.render;
    let loaded = render.load()?;
    let job = prepare(&loaded.scene, &render.settings(&loaded.scene)?)?;
    let settings = job.settings();
    forecast::check(&job)?;
    // Before a device is touched; what one needs beside is known with it.
    check_memory(&settings.crop, LEAST_PIXEL_BYTES)?;
    let signals = Signals::listen()?;
    let progress = Progress::new(render.progress, render.quiet);
    let mut warnings: Vec<String> = job.variance().warning.iter().cloned().collect();
    if !args.json {
        let Rect { width, height, .. } = settings.crop;
        print(&format!(
            "{}: {width}x{height}, integrator {}, sampler {}\n",
            loaded.name,
            settings.integrator.name(),
            settings.sampler.name()
        ))?;
    }
    let mut quotes = Vec::new();
    let chosen = match args.backends.as_slice() {
        [] => std::slice::from_ref(&render.backend),
        several => several,
    };
    for wanted in chosen {
        let opening = Instant::now();
        // Of several backends those that have devices.
        let device = render.device.as_deref();
        let choice = BackendChoice {
            kind: wanted.kind(),
            device: device.filter(|_| wanted.kind() != Some(BackendKind::Cpu)),
            ..render.backend_choice()
        };
        let backend = Backend::open(&choice, &mut warnings)?;
        let setup = opening.elapsed().as_secs_f64();
        let compiling = Instant::now();
        let mut renderer = backend.renderer(&job)?;
        let compile = compiling.elapsed().as_secs_f64();
        let (device, ..) = renderer.device();
        let go_on = || signals.code().is_none();
        let Some(pilot) = forecast::run(renderer.as_mut(), &job, args.pilot, &go_on)? else {
            return Err(Error::Interrupted(signals.code().unwrap_or_default()));
        };
        if pilot.is_blind() {
            warnings.push(format!(
                "the pilot on {device} has seen no light that varies: errors cannot be forecast"
            ));
        }
        let effects = match args.by_effect {
            true => {
                let settings = smaller(settings);
                Some(shares(&backend, &loaded, &settings, &signals, &progress)?)
            }
            false => None,
        };
        progress.finish();
        if let (
            Some(code),
            Some(PriceList {
                interrupted: true, ..
            }),
        ) = (signals.code(), &effects)
        {
            return Err(Error::Interrupted(code));
        }
        let quote = Quote {
            backend: backend.kind().name(),
            device,
            setup,
            compile,
            host_bytes: backend.pixel_bytes(settings) as u64 * pilot.pixels,
            device_bytes: renderer.device_bytes(),
            pilot,
            effects,
        };
        if !args.json {
            print(&table(render, &quote, settings))?;
            if let Some(list) = &quote.effects {
                print(&shares_text(list))?;
            }
        }
        quotes.push(quote);
    }
    for warning in &warnings {
        progress.warning(warning);
    }
    if args.json {
        let document = json!({
            "scene": loaded.name, "scene_hash": loaded.hash,
            "width": settings.crop.width, "height": settings.crop.height,
            "integrator": settings.integrator.name(), "sampler": settings.sampler.name(),
            "targets": quotes.iter().flat_map(|q| targets(render, q, settings)).collect::<Vec<_>>(),
            "backends": quotes.iter().map(about).collect::<Vec<_>>(),
            "warnings": warnings,
        });
        let text = serde_json::to_string_pretty(&document)
            .map_err(|e| Error::Usage(format!("cannot write JSON: {e}")))?;
        return print(&(text + "\n"));
    }
    Ok(())
}

/// What was asked for, and what it comes to.
struct Row {
    asked: Asked,
    /// `None` where no number of samples is known to do.
    forecast: Option<Forecast>,
}

#[derive(Clone, Copy)]
enum Asked {
    Error(f64),
    Time(f64),
    Samples(u64),
}

/// The most samples that are thought of: beyond any render.
const MOST: u64 = 1 << 40;

fn rows(args: &RenderArgs, pilot: &Pilot, settings: &Settings) -> Vec<Row> {
    let mut asked: Vec<Asked> = Vec::new();
    asked.extend(args.error.map(Asked::Error));
    asked.extend(args.time.map(|t| Asked::Time(t.as_secs_f64())));
    let samples = settings.samples.end - settings.samples.start;
    if args.spp.is_some() || args.sample_range.is_some() {
        asked.push(Asked::Samples(samples));
    }
    if asked.is_empty() {
        asked.extend(ERRORS.map(Asked::Error));
    }
    let forecast = |asked: &Asked| match *asked {
        Asked::Error(limit) => pilot.to_error(limit, MOST),
        Asked::Time(seconds) => Some(pilot.to_time(seconds, MOST)),
        Asked::Samples(spp) => Some(pilot.to_samples(spp)),
    };
    asked
        .into_iter()
        .map(|asked| Row {
            forecast: forecast(&asked),
            asked,
        })
        .collect()
}

fn targets(args: &RenderArgs, quote: &Quote, settings: &Settings) -> Vec<Value> {
    let target = |row: &Row| {
        let f = row.forecast;
        let error = match row.asked {
            Asked::Error(limit) => Some(limit),
            _ => f.map(|f| f.error),
        };
        let asked = match row.asked {
            Asked::Error(_) => "error",
            Asked::Time(_) => "time",
            Asked::Samples(_) => "spp",
        };
        json!({
            "backend": quote.backend, "asked": asked, "error": error, "spp": f.map(|f| f.spp),
            "seconds": f.map(|f| f.seconds), "seconds_low": f.map(|f| f.interval[0]),
            "seconds_high": f.map(|f| f.interval[1]),
        })
    };
    rows(args, &quote.pilot, settings)
        .iter()
        .map(target)
        .collect()
}

fn about(quote: &Quote) -> Value {
    let share = |price: &Price| {
        let cost = price.against.as_ref()?.as_ref().ok()?.difference.cost;
        Some(json!({
            "name": price.effect.name(), "share": cost.price / cost.with,
            "low": cost.interval[0] / cost.with, "high": cost.interval[1] / cost.with,
        }))
    };
    let effects = quote.effects.as_ref();
    let effects = effects.map(|list| list.prices.iter().filter_map(share).collect::<Vec<_>>());
    json!({
        "effects": effects,
        "backend": quote.backend, "device": quote.device,
        "paths_per_second": 1.0 / quote.pilot.path_seconds.value,
        "host_bytes": quote.host_bytes, "device_bytes": quote.device_bytes,
        "seconds": {
            "setup": quote.setup, "compile": quote.compile, "pilot": quote.pilot.seconds,
        },
    })
}

fn table(args: &RenderArgs, quote: &Quote, settings: &Settings) -> String {
    let mebibytes = |bytes: u64| significant(bytes as f64 / f64::from(1 << 20));
    let on_device = match quote.device_bytes {
        0 => String::new(),
        bytes => format!(", {} MiB on the device", mebibytes(bytes)),
    };
    let mut text = format!(
        "\n{}: {} Mpaths/s; setup {}, compilation {}; memory {} MiB{on_device}; pilot {}\n\n  \
         {:>7}  {:>10}  {:>12}  95 % interval\n",
        quote.device,
        significant(1.0e-6 / quote.pilot.path_seconds.value),
        duration(quote.setup),
        duration(quote.compile),
        mebibytes(quote.host_bytes),
        duration(quote.pilot.seconds),
        "error",
        "spp",
        "time",
    );
    for row in rows(args, &quote.pilot, settings) {
        let error = match (row.asked, row.forecast) {
            (Asked::Error(limit), _) => percent(limit),
            (_, Some(f)) if !quote.pilot.is_blind() => percent(f.error),
            _ => "unknown".into(),
        };
        let Some(f) = row.forecast else {
            let _ = writeln!(text, "  {error:>7}  {:>10}", "unknown");
            continue;
        };
        let note = match row.asked {
            Asked::Error(_) if f.spp > MAXIMUM_SPP => {
                format!("  beyond the default cap: give --spp {}", f.spp)
            }
            _ => String::new(),
        };
        let [low, high] = f.interval.map(duration);
        let _ = writeln!(
            text,
            "  {error:>7}  {:>10}  {:>12}  {low} to {high}{note}",
            f.spp,
            duration(f.seconds),
        );
    }
    text
}

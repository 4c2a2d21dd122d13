//! `gpu-trace effects`: what is in the kernel, why, and what is left out; and what each costs.

mod prices;

use std::fmt::Write as _;

use clap::Args;

use super::args::RenderArgs;
use super::format::significant;
use super::print;
use crate::choice::{Candidate, Choice};
use crate::effects::Effects;
use crate::error::{Error, Result};
use crate::job::prepare;
use crate::output::{atomic, check_all};
use crate::shader::{Stage, link};

pub(super) use prices::{shares, shares_text};

pub(super) const AFTER_HELP: &str = "\
With --measure every effect has a price: the seconds of a million samples with it, less those of a
million samples with its alternative, which run in turns on this device. The alternative of a
material is a diffuse one of its colour, that of a choice of how to render is the other one, else it
is nothing. What is left out costs 0 where the kernel is, byte for byte, the one that is linked
without its sources; forced in, it has the cost of being linked in and unused. Run it on an idle
machine. `compile` is what linking and compiling took; a driver may have kept what it compiled
before (Mesa does, unless MESA_SHADER_CACHE_DISABLE=true).

Examples:
  gpu-trace effects my.toml                    what the kernel will hold, and why
  gpu-trace effects my.toml --measure          what each effect costs, some two minutes
  gpu-trace effects --measure --all            the price list: every effect on a scene of its own";

/// The options of `effects`.
#[derive(Clone, Debug, Args)]
pub(super) struct EffectsArgs {
    #[command(flatten)]
    pub(super) render: RenderArgs,
    /// Print JSON.
    #[arg(long, help_heading = "Output")]
    pub(super) json: bool,
    /// Measure what each effect costs on this device.
    #[arg(long, conflicts_with = "crop", help_heading = "Prices")]
    pub(super) measure: bool,
    /// Of all effects, each on a scene of its own: a ball under a lamp.
    #[arg(
        long,
        requires = "measure",
        conflicts_with_all = [
            "scene", "size", "integrator", "light_sampling", "sampler", "max_bounces", "radiance_cache", "lamp_images",
            "roulette", "termination", "offset", "geometry", "aov", "view", "adaptive", "spp", "error", "time",
            "sample_range", "dump_wgsl",
        ],
        help_heading = "Prices"
    )]
    pub(super) all: bool,
}

/// Runs `effects`.
pub(super) fn run(args: &EffectsArgs) -> Result<()> {
    if args.all {
        return prices::all(args);
    }
    let render = &args.render;
    let loaded = render.load()?;
    let (settings, choice) = render.decide(&loaded.scene)?;
    let job = prepare(&loaded.scene, &settings)?;
    let effects = job.effects();
    let kernel = link(Stage::Path, job.scene(), job.placement(), effects)?;
    if let Some(path) = &render.dump_wgsl {
        check_all(&[path], &loaded.inputs())?;
        atomic::write(path, kernel.wgsl.as_bytes())?;
    }
    if args.measure {
        return prices::of_scene(args, &loaded, &settings);
    }
    let (lines, state) = (kernel.wgsl.lines().count(), kernel.state_bytes("render"));
    if args.json {
        let rows: Vec<_> = effects
            .rows()
            .map(|(row, reasons)| {
                let (name, what, used) = (row.name, row.what, !reasons.is_empty());
                serde_json::json!({
                    "name": name, "used": used, "what": what, "reasons": reasons,
                })
            })
            .collect();
        return print_json(&serde_json::json!({
            "scene": loaded.name, "geometry": effects.geometry(), "kernel_lines": lines, "state_bytes": state,
            "integrator": settings.integrator.name(), "choice": choice.as_ref().map(choice_json),
            "effects": rows,
        }));
    }
    let mut chosen = choice.as_ref().map(why_chosen).unwrap_or_default();
    if let Some(why) = job.cache_obstacle() {
        let _ = writeln!(chosen, "\n--radiance-cache is off: {why}");
    }
    if let Some(why) = job.image_obstacle() {
        let _ = writeln!(chosen, "\n--lamp-images is off: {why}");
    }
    print(&(table(&loaded.name, effects, [lines, state as usize]) + &chosen))
}

fn print_json(value: &serde_json::Value) -> Result<()> {
    let text = serde_json::to_string_pretty(value)
        .map_err(|e| Error::Usage(format!("cannot write JSON: {e}")))?;
    print(&(text + "\n"))
}

/// What `--integrator auto` has chosen, and by which figures.
fn why_chosen(choice: &Choice) -> String {
    let name = choice.candidate.name();
    let mut text = format!("\nWhat pays here is {name}");
    if let Some(why) = choice.without_pilot {
        let _ = writeln!(text, ": {why}");
        return text;
    }
    text += ", by a pilot of the f64 reference that counts and times nothing\n";
    let _ = writeln!(
        text,
        "  {:10}  {:>17}  {:>11}  {:>12}  {:>11}  {:>8}",
        "", "relative variance", "rays a path", "and to lamps", "cost a path", "effort"
    );
    for trial in &choice.trials {
        let _ = write!(
            text,
            "  {:10}  {:>17}  {:>11}  {:>12}  {:>11}  {:>8}",
            trial.candidate.name(),
            significant(trial.relative_variance),
            significant(trial.rays),
            significant(trial.connections),
            significant(trial.cost),
            significant(trial.effort()),
        );
        let doubt = trial.doubt.as_ref().map(|why| format!("  doubtful: {why}"));
        let _ = writeln!(text, "{}", doubt.unwrap_or_default());
    }
    text
}

fn choice_json(choice: &Choice) -> serde_json::Value {
    let trials = choice.trials.iter().map(|trial| {
        serde_json::json!({
            "integrator": trial.candidate.integrator().name(),
            "radiance_cache": trial.candidate == Candidate::RadianceCache, "relative_variance": trial.relative_variance,
            "rays": trial.rays, "connections": trial.connections, "lookups": trial.lookups, "cost": trial.cost,
            "effort": trial.effort(), "doubt": trial.doubt,
        })
    });
    serde_json::json!({
        "integrator": choice.candidate.integrator().name(),
        "radiance_cache": choice.candidate == Candidate::RadianceCache, "without_pilot": choice.without_pilot,
        "trials": trials.collect::<Vec<_>>(),
    })
}

/// Of a kernel of so many lines, whose loop carries so many bytes.
fn table(scene: &str, effects: &Effects, [lines, state]: [usize; 2]) -> String {
    let mut text = format!(
        "{scene}: a kernel of {lines} lines, whose loop carries {state} bytes\n\nIn the kernel\n"
    );
    let width = effects.rows().map(|(row, _)| row.name.len()).max();
    let width = width.unwrap_or(0);
    for (row, reasons) in effects.rows().filter(|(_, r)| !r.is_empty()) {
        let _ = writeln!(text, "  {:width$}  {}", row.name, row.what);
        let _ = writeln!(text, "  {:width$}    for {}", "", reasons.join("; "));
    }
    text += "\nLeft out\n";
    for (row, _) in effects.rows().filter(|(_, r)| r.is_empty()) {
        let _ = writeln!(text, "  {:width$}  {}", row.name, row.what);
    }
    text
}

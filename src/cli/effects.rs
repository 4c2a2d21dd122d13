//! `gpu-trace effects`: what is in the kernel, why, and what is left out.

use std::fmt::Write as _;

use super::args::RenderArgs;
use super::print;
use crate::effects::Effects;
use crate::error::{Error, Result};
use crate::job::prepare;
use crate::output::{atomic, check_all};
use crate::scene::builtin;
use crate::shader::{Stage, link};

/// Runs `effects`.
pub(super) fn run(args: &RenderArgs, json: bool) -> Result<()> {
    let loaded = builtin::resolve(args.scene.as_deref())?;
    let job = prepare(&loaded.scene, &args.settings(&loaded.scene)?)?;
    let effects = job.effects();
    let kernel = link(Stage::Path, job.scene(), job.placement(), effects)?;
    if let Some(path) = &args.dump_wgsl {
        check_all(&[path], args.scene_file().as_slice())?;
        atomic::write(path, kernel.wgsl.as_bytes())?;
    }
    let lines = kernel.wgsl.lines().count();
    if json {
        let rows: Vec<_> = effects
            .table()
            .iter()
            .map(|e| {
                serde_json::json!({
                    "name": e.name, "used": e.used(), "what": e.what, "reasons": e.reasons,
                })
            })
            .collect();
        let all = serde_json::json!({
            "scene": loaded.name, "geometry": effects.geometry(), "kernel_lines": lines,
            "effects": rows,
        });
        let text = serde_json::to_string_pretty(&all)
            .map_err(|e| Error::Usage(format!("cannot write JSON: {e}")))?;
        return print(&(text + "\n"));
    }
    print(&table(&loaded.name, effects, lines))
}

fn table(scene: &str, effects: &Effects, lines: usize) -> String {
    let mut text = format!("{scene}: a kernel of {lines} lines\n\nIn the kernel\n");
    let width = effects
        .table()
        .iter()
        .map(|e| e.name.len())
        .max()
        .unwrap_or(0);
    for effect in effects.table().iter().filter(|e| e.used()) {
        let _ = writeln!(text, "  {:width$}  {}", effect.name, effect.what);
        let _ = writeln!(text, "  {:width$}    for {}", "", effect.reasons.join("; "));
    }
    text += "\nLeft out\n";
    for effect in effects.table().iter().filter(|e| !e.used()) {
        let _ = writeln!(text, "  {:width$}  {}", effect.name, effect.what);
    }
    text
}

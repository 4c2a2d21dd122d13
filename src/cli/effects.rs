//! `gpu-trace effects`: what is in the kernel, why, and what is left out.

use std::fmt::Write as _;

use super::args::RenderArgs;
use super::print;
use crate::effects::Effects;
use crate::error::{Error, Result};
use crate::job::prepare;
use crate::output::{atomic, check_all};
use crate::shader::{Stage, link};

/// Runs `effects`.
pub(super) fn run(args: &RenderArgs, json: bool) -> Result<()> {
    let loaded = args.load()?;
    let job = prepare(&loaded.scene, &args.settings(&loaded.scene)?)?;
    let effects = job.effects();
    let kernel = link(Stage::Path, job.scene(), job.placement(), effects)?;
    if let Some(path) = &args.dump_wgsl {
        check_all(&[path], &loaded.inputs())?;
        atomic::write(path, kernel.wgsl.as_bytes())?;
    }
    let lines = kernel.wgsl.lines().count();
    if json {
        let rows: Vec<_> = effects
            .rows()
            .map(|(row, reasons)| {
                let (name, what, used) = (row.name, row.what, !reasons.is_empty());
                serde_json::json!({
                    "name": name, "used": used, "what": what, "reasons": reasons,
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

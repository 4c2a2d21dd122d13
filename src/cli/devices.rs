//! `gpu-trace devices`: adapters, drivers, limits.

use std::fmt::Write as _;

use super::print;
use crate::error::{Error, Result};
use crate::gpu::device::{DRIVER_ADVICE, list};

/// Runs `devices`.
pub(super) fn run(json: bool) -> Result<()> {
    let adapters = list();
    if json {
        let rows: Vec<_> = adapters
            .iter()
            .map(|a| {
                serde_json::json!({
                    "index": a.index, "name": a.name, "kind": a.kind, "backend": a.backend,
                    "driver": a.driver, "usable": a.unusable.is_none(), "why_not": a.unusable,
                    "limits": {
                        "texture_side": a.limits.max_texture_dimension_2d,
                        "storage_binding_bytes": a.limits.max_storage_buffer_binding_size,
                        "buffer_bytes": a.limits.max_buffer_size,
                        "workgroup_invocations": a.limits.max_compute_invocations_per_workgroup,
                        "workgroups_per_axis": a.limits.max_compute_workgroups_per_dimension,
                    },
                })
            })
            .collect();
        let text = serde_json::to_string_pretty(&rows)
            .map_err(|e| Error::Device(format!("cannot write JSON: {e}")))?;
        return print(&(text + "\n"));
    }
    let mut text = String::new();
    for a in &adapters {
        let limits = &a.limits;
        let _ = writeln!(text, "{}: {} ({}, {})", a.index, a.name, a.kind, a.backend);
        let _ = writeln!(text, "   driver   {}", a.driver);
        let _ = writeln!(
            text,
            "   limits   textures {}, bindings {} MiB, buffers {} MiB, workgroup {}",
            limits.max_texture_dimension_2d,
            limits.max_storage_buffer_binding_size >> 20,
            limits.max_buffer_size >> 20,
            limits.max_compute_invocations_per_workgroup,
        );
        if let Some(why) = &a.unusable {
            let _ = writeln!(text, "   unusable {why}");
        }
    }
    if adapters.is_empty() {
        let _ = writeln!(text, "no adapters; {DRIVER_ADVICE}");
    }
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let _ = writeln!(
        text,
        "cpu: the f64 reference on {threads} threads (--backend cpu)"
    );
    print(&text)
}

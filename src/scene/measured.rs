//! Tables of measured materials that a scene names.

use std::collections::HashMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::named;
use super::names::MaterialKeys;
use super::report::{Problem, Report};
use crate::materials::measured::{BrdfTable, MERL_BYTES, parse};
use crate::materials::{Material, MaterialKind};

/// Gives measured materials their tables, each file read once. `files` gets what they name, relative to `folder`.
pub(super) fn apply(
    materials: &mut [Material],
    keys: &MaterialKeys,
    folder: &Path,
    files: &mut Vec<PathBuf>,
    report: &mut Report,
) {
    let mut known: HashMap<PathBuf, Arc<BrdfTable>> = HashMap::new();
    for material in materials {
        // Nothing is read for a file with errors.
        if !report.errors.is_empty() {
            return;
        }
        let MaterialKind::Measured(measured) = &mut material.kind else {
            continue;
        };
        let path = folder.join(&measured.file);
        if let Some(table) = known.get(&path) {
            measured.table = Some(Arc::clone(table));
            continue;
        }
        match load(&path) {
            Ok(table) => {
                let table = Arc::new(table);
                measured.table = Some(Arc::clone(&table));
                files.push(path.clone());
                known.insert(path, table);
            }
            Err(text) => {
                let place = keys.get(&(material.name.clone(), "file".to_owned()));
                let span: Range<usize> = place.cloned().unwrap_or_default();
                report.errors.push(Problem::new(span, text, ""));
            }
        }
    }
}

fn load(path: &Path) -> Result<BrdfTable, String> {
    let shown = path.display().to_string();
    // What is longer says so by its sizes first, if it is short enough to be looked at.
    let bytes = named::read(path, 2 * MERL_BYTES)?;
    parse(&bytes).map_err(|error| format!("{}: {error}", shown.escape_debug()))
}

//! `gpu-trace scene`: check a file, print the schema, list the gallery.

use std::fmt::Write as _;

use super::print;
use crate::error::{Error, Result};
use crate::scene::builtin;

/// Runs `scene check`.
pub(super) fn check(scene: &str) -> Result<()> {
    let loaded = builtin::resolve(Some(scene))?;
    let mut text = crate::scene::summary(&loaded);
    for warning in &loaded.warnings {
        let _ = write!(text, "\n{warning}");
    }
    print(&text)
}

/// Runs `scene schema`.
pub(super) fn schema() -> Result<()> {
    let text = serde_json::to_string_pretty(&crate::scene::json_schema())
        .map_err(|e| Error::Usage(format!("cannot write the schema: {e}")))?;
    print(&(text + "\n"))
}

/// Runs `scene list`.
pub(super) fn list(name: Option<&str>) -> Result<()> {
    if let Some(name) = name {
        let builtin = builtin::get(name).ok_or_else(|| {
            let known = builtin::names().collect::<Vec<_>>().join(", ");
            Error::Usage(format!("no built-in scene '{name}'; there are {known}"))
        })?;
        return print(builtin.text);
    }
    let width = builtin::names().map(str::len).max().unwrap_or(0);
    let mut text = String::new();
    for builtin in builtin::GALLERY {
        let _ = writeln!(text, "{:width$}  {}", builtin.name, builtin.description);
    }
    print(&text)
}

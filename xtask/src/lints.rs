//! What needs no driver: format, lints, documentation, and the licences of dependencies.

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Stdio};

use crate::{cargo, root, run};

/// Sources that a macro declares as modules, so that `cargo fmt` does not find them.
const HIDDEN: &str = "src/materials";

/// Checks all of it. Components that a minimal toolchain may lack are checked where they are there.
///
/// # Errors
/// The first that does not hold.
pub(crate) fn all() -> Result<(), String> {
    if has("fmt") {
        run(cargo().args(["fmt", "--all", "--check"]))?;
        let hidden = hidden()?;
        if !hidden.is_empty() {
            let mut command = Command::new("rustfmt");
            command.args(["--check", "--edition", EDITION]).args(hidden);
            run(command.current_dir(root()))?;
        }
    }
    if has("clippy") {
        run(cargo().args([
            "clippy",
            "--workspace",
            "--all-targets",
            "--",
            "-D",
            "warnings",
        ]))?;
    }
    if has("deny") {
        // What the lock file says; advisories need a network, and change without it.
        run(cargo().args(["deny", "check", "bans", "licenses", "sources"]))?;
    }
    // There are no examples: with them cargo takes the features that development adds to dependencies,
    // which are those of the lints and the tests, and so compiles none of them once more.
    run(cargo()
        .args(["doc", "--no-deps", "--quiet", "--lib", "--examples"])
        .env("RUSTDOCFLAGS", "-D warnings"))
}

/// That of the workspace.
const EDITION: &str = "2024";

/// The sources in [`HIDDEN`].
fn hidden() -> Result<Vec<PathBuf>, String> {
    let folder = root().join(HIDDEN);
    if !folder.is_dir() {
        return Ok(Vec::new());
    }
    let failed = |error: std::io::Error| format!("{HIDDEN}: {error}");
    let mut found = Vec::new();
    for entry in fs::read_dir(&folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}

/// Whether `cargo NAME` is installed.
fn has(name: &str) -> bool {
    cargo()
        .args([name, "--version"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|status| status.success())
}

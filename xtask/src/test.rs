//! `cargo xtask test`: everything that must hold, on a fresh machine.

use std::path::Path;
use std::process::{Command, Stdio};

use crate::{cargo, run};

/// Where distributions keep lavapipe's manifest.
const MANIFESTS: &[&str] = &[
    "/usr/share/vulkan/icd.d/lvp_icd.x86_64.json",
    "/usr/share/vulkan/icd.d/lvp_icd.aarch64.json",
    "/usr/share/vulkan/icd.d/lvp_icd.json",
];

const INSTALL: &str = "\
the tests need Mesa lavapipe, a Vulkan driver without a GPU. Install it and try again:
  Debian, Ubuntu   apt-get install mesa-vulkan-drivers
  Fedora           dnf install mesa-vulkan-drivers
  Arch             pacman -S vulkan-swrast";

/// Runs the tests; further arguments go to `cargo test`.
pub(crate) fn all(arguments: &[String]) -> Result<(), String> {
    let manifest = lavapipe()?;
    // Components that a minimal toolchain may lack are checked where they are there.
    if has("fmt") {
        run(cargo().args(["fmt", "--all", "--check"]))?;
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
    let mut tests = cargo();
    tests.args(["test", "--workspace"]).args(arguments);
    if let Some(manifest) = manifest {
        tests.env("VK_ICD_FILENAMES", manifest);
    }
    // Without a display, Mesa's device selection would complain on stderr.
    tests.env("NODEVICE_SELECT", "1");
    run(&mut tests)?;
    let mut documents = cargo();
    documents
        .args(["doc", "--no-deps", "--quiet"])
        .env("RUSTDOCFLAGS", "-D warnings");
    run(&mut documents)
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

/// Finds or installs lavapipe; its manifest, or `None` where the user's own choice of driver or
/// another system's drivers are to be used.
fn lavapipe() -> Result<Option<&'static str>, String> {
    if std::env::var_os("VK_ICD_FILENAMES").is_some()
        || std::env::var_os("VK_DRIVER_FILES").is_some()
    {
        eprintln!("using the Vulkan driver that the environment names");
        return Ok(None);
    }
    if !cfg!(target_os = "linux") {
        return Ok(None);
    }
    if let Some(found) = manifest() {
        return Ok(Some(found));
    }
    eprintln!("lavapipe is not installed; trying apt-get");
    let mut update = Command::new("apt-get");
    let mut install = Command::new("apt-get");
    install
        .args([
            "install",
            "-y",
            "--no-install-recommends",
            "mesa-vulkan-drivers",
        ])
        .env("DEBIAN_FRONTEND", "noninteractive");
    let installed = run(update.arg("update")).and_then(|()| run(&mut install));
    installed.map_err(|error| format!("{error}\n{INSTALL}"))?;
    manifest().map(Some).ok_or_else(|| INSTALL.to_owned())
}

fn manifest() -> Option<&'static str> {
    MANIFESTS
        .iter()
        .copied()
        .find(|path| Path::new(path).exists())
}

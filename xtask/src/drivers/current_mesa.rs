//! Lavapipe as Debian's unstable distribution has it: years younger than that of the stable one, with another compiler
//! and other ways to load from buffers. With all its libraries, down to that of C, it lies in a folder of ours, and
//! programs are started by the loader in there; so nothing of the system changes.
//!
//! What such a program starts itself is started without it, on whatever the system has.

use std::ffi::OsString;
use std::fs;
use std::path::PathBuf;
use std::process::Command;

use super::{apt, empty, packages, unpack as unpack_package};
use crate::{root, run};

/// What apt takes besides what these depend on.
const WANTED: [&str; 3] = ["mesa-vulkan-drivers", "libvulkan1", "libgcc-s1"];
const SUITE: &str = "sid";
const KEYS: &str = "/usr/share/keyrings/debian-archive-keyring.gpg";
/// Where packages have libraries, and what of these is wanted.
const LIBRARIES: &str = "usr/lib/x86_64-linux-gnu";
const LOADER: &str = "ld-linux-x86-64.so.2";
const DRIVER: &str = "libvulkan_lvp.so";
const MANIFEST: &str = "lvp_icd.json";

/// Where it is unpacked.
fn folder() -> PathBuf {
    root().join("target/drivers/mesa")
}

/// Its manifest and what starts a program with its libraries, if it is there.
pub(super) fn find() -> Option<(OsString, Vec<OsString>)> {
    let manifest = folder().join(MANIFEST);
    let libraries = folder().join(LIBRARIES);
    let loader = [
        libraries.join(LOADER).into(),
        "--library-path".into(),
        libraries.into(),
    ];
    manifest.exists().then(|| (manifest.into(), loader.into()))
}

/// Takes it and its libraries out of their packages, without installing these.
///
/// # Errors
/// Where apt has no packages of Debian for this processor.
pub(super) fn unpack() -> Result<(), String> {
    let folder = folder();
    let failed = |error: std::io::Error| format!("{}: {error}", folder.display());
    if !cfg!(target_arch = "x86_64") {
        return Err("it is there for x86_64 alone".into());
    }
    empty(&folder)?;
    // An apt of its own, on whose system nothing is installed yet.
    let own = folder.join("apt");
    for part in ["etc/apt", "var/lib/apt", "var/cache/apt", "var/lib/dpkg"] {
        fs::create_dir_all(own.join(part)).map_err(failed)?;
    }
    fs::write(own.join("var/lib/dpkg/status"), "").map_err(failed)?;
    let source = format!("deb [signed-by={KEYS}] {} {SUITE} main\n", mirror()?);
    fs::write(own.join("etc/apt/sources.list"), source).map_err(failed)?;
    let apt = || {
        let mut command = apt();
        let status = own.join("var/lib/dpkg/status");
        for option in [
            format!("Dir={}", own.display()),
            format!("Dir::State::status={}", status.display()),
            "APT::Architecture=amd64".into(),
            "APT::Install-Recommends=false".into(),
            "Debug::NoLocking=1".into(),
        ] {
            command.args(["-o", &option]);
        }
        command
    };
    run(apt().arg("update"))?;
    run(apt()
        .args(["install", "-y", "--download-only"])
        .args(WANTED))?;
    for package in packages(&own.join("var/cache/apt/archives"))? {
        unpack_package(&package, &folder)?;
    }
    fs::remove_dir_all(&own).map_err(failed)?;
    let driver = folder.join(LIBRARIES).join(DRIVER);
    if !driver.exists() {
        return Err(format!("{} has no {DRIVER}", WANTED[0]));
    }
    // The manifest last: it says that all is there.
    let manifest = serde_json::json!({
        "file_format_version": "1.0.1",
        "ICD": { "api_version": "1.3.0", "library_path": driver },
    });
    fs::write(folder.join(MANIFEST), manifest.to_string()).map_err(failed)
}

/// Where apt has Debian's packages from.
fn mirror() -> Result<String, String> {
    let output = Command::new("apt-get")
        .args(["indextargets", "--format", "$(REPO_URI)"])
        .args(["Created-By: Packages", "Origin: Debian", "Label: Debian"])
        .output()
        .map_err(|error| format!("apt-get: {error}"))?;
    let text = String::from_utf8_lossy(&output.stdout);
    let first = text.lines().next().map(str::to_owned);
    first.ok_or_else(|| "apt has no packages of Debian".into())
}

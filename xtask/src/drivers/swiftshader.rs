//! SwiftShader, out of the package that Debian has it in.

use std::ffi::OsString;
use std::fs;
use std::path::PathBuf;

use super::{apt, empty, packages, unpack as unpack_package};
use crate::{root, run};

/// Debian's package with SwiftShader, and what of it is wanted. The manifest names the library as
/// its neighbour.
const PACKAGE: &str = "chromium-common";
const MANIFEST: &str = "vk_swiftshader_icd.json";
const LIBRARY: &str = "libvk_swiftshader.so";
/// Our note of the package that it came from.
const VERSION: &str = "package";

/// Where it is unpacked.
fn folder() -> PathBuf {
    root().join("target/drivers/swiftshader")
}

/// Its manifest, if it is there.
pub(super) fn find() -> Option<OsString> {
    let manifest = folder().join(MANIFEST);
    manifest.exists().then(|| manifest.into())
}

/// The package that it came from.
pub(super) fn version() -> String {
    fs::read_to_string(folder().join(VERSION)).unwrap_or_default()
}

/// Takes it out of its package, without installing that.
///
/// # Errors
/// If apt has no such package, or it holds something else.
pub(super) fn unpack() -> Result<(), String> {
    unpacked().map_err(|error| format!("{error} (it is taken from Debian's package {PACKAGE})"))
}

fn unpacked() -> Result<(), String> {
    let folder = folder();
    let failed = |error: std::io::Error| format!("{}: {error}", folder.display());
    let scratch = folder.with_extension("scratch");
    empty(&scratch)?;
    let download = || run(apt().args(["download", PACKAGE]).current_dir(&scratch));
    // The package lists may be missing, or older than what the mirror has.
    download().or_else(|_| run(apt().arg("update")).and_then(|()| download()))?;
    let package = packages(&scratch)?.pop();
    let package = package.ok_or("apt-get download left no package")?;
    unpack_package(&package, &scratch)?;
    let version = package.file_name().unwrap_or_default().to_string_lossy();
    fs::create_dir_all(&folder).map_err(failed)?;
    fs::write(folder.join(VERSION), version.as_bytes()).map_err(failed)?;
    // The manifest last: it says that all is there.
    for file in [LIBRARY, MANIFEST] {
        fs::rename(
            scratch.join("usr/lib/chromium").join(file),
            folder.join(file),
        )
        .map_err(|error| format!("{file} of {PACKAGE}: {error}"))?;
    }
    fs::remove_dir_all(&scratch).map_err(failed)
}

//! The drivers in software that the tests run on: finding, installing and choosing them.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::{program, root, run};

/// Where distributions keep lavapipe's manifest.
const LAVAPIPE: &[&str] = &[
    "/usr/share/vulkan/icd.d/lvp_icd.x86_64.json",
    "/usr/share/vulkan/icd.d/lvp_icd.aarch64.json",
    "/usr/share/vulkan/icd.d/lvp_icd.json",
];

const INSTALL_LAVAPIPE: &str = "\
the tests need Mesa lavapipe, a Vulkan driver without a GPU. Install it and try again:
  Debian, Ubuntu   apt-get install mesa-vulkan-drivers
  Fedora           dnf install mesa-vulkan-drivers
  Arch             pacman -S vulkan-swrast";

/// Variables that choose a driver: where the user has set one, the tests run on that driver alone.
const CHOICES: [&str; 3] = ["VK_ICD_FILENAMES", "VK_DRIVER_FILES", "WGPU_BACKEND"];

/// Debian's package with SwiftShader, and what of it is wanted. The manifest names the library as
/// its neighbour.
const SWIFTSHADER_PACKAGE: &str = "chromium-common";
const SWIFTSHADER_MANIFEST: &str = "vk_swiftshader_icd.json";
const SWIFTSHADER_LIBRARY: &str = "libvk_swiftshader.so";
/// Our note of the package that it came from.
const SWIFTSHADER_VERSION: &str = "package";

/// A driver, and the variables that choose it.
#[derive(Clone, Debug)]
pub(crate) struct Driver {
    /// What we call it.
    pub(crate) name: &'static str,
    variables: Vec<(&'static str, OsString)>,
}

impl Driver {
    /// Whatever the system has.
    pub(crate) fn system() -> Self {
        Self {
            name: "system",
            variables: Vec::new(),
        }
    }

    /// Makes `command` run on this driver.
    pub(crate) fn choose<'a>(&self, command: &'a mut Command) -> &'a mut Command {
        command
            // Without a display, Mesa's device selection would complain on stderr.
            .env("NODEVICE_SELECT", "1")
            .envs(self.variables.iter().map(|(name, value)| (name, value)))
    }

    /// What the program says it runs on with this driver: adapter, and driver with its version;
    /// `None` if that is nothing that it could use.
    pub(crate) fn adapter(&self) -> Option<String> {
        let output = self
            .choose(Command::new(program("debug")).arg("devices"))
            .stderr(Stdio::null())
            .output()
            .ok()?;
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        let mut lines = text.lines();
        let adapter = lines.next()?.strip_prefix("0: ")?;
        let of_adapter = || lines.clone().take_while(|line| line.starts_with(' '));
        if of_adapter().any(|line| line.trim().starts_with("unusable")) {
            return None;
        }
        let driver = of_adapter().find_map(|line| line.trim().strip_prefix("driver"));
        Some(format!("{adapter}, {}", driver.unwrap_or_default().trim()))
    }
}

/// The driver that all tests run on: lavapipe, which is installed if need be; or the one that the
/// environment names, and then `true`: it is the only one.
pub(crate) fn first() -> Result<(Driver, bool), String> {
    let driver = |name, variables| Driver { name, variables };
    if let Some(named) = CHOICES.iter().find(|name| std::env::var_os(name).is_some()) {
        eprintln!("{named} is set: using the driver that it names, and no other");
        return Ok((driver("environment", Vec::new()), true));
    }
    if !cfg!(target_os = "linux") {
        return Ok((Driver::system(), true));
    }
    let find = || LAVAPIPE.iter().find(|path| Path::new(path).exists());
    if find().is_none() {
        eprintln!("lavapipe is not installed; trying apt-get");
        install(&["mesa-vulkan-drivers"])
            .map_err(|error| format!("{error}\n{INSTALL_LAVAPIPE}"))?;
    }
    let manifest = find().ok_or(INSTALL_LAVAPIPE)?;
    let variables = vec![("VK_ICD_FILENAMES", OsString::from(manifest))];
    Ok((driver("lavapipe", variables), false))
}

/// A driver that the tests run on where it is there.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Optional {
    /// A Vulkan driver of another family than Mesa's.
    SwiftShader,
    /// Mesa's llvmpipe: GLSL in the place of SPIR-V.
    Gl,
}

impl Optional {
    pub(crate) const ALL: [Self; 2] = [Self::SwiftShader, Self::Gl];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::SwiftShader => "SwiftShader",
            Self::Gl => "llvmpipe, GL",
        }
    }

    /// The driver and what the program says of it, if it is there.
    pub(crate) fn find(self) -> Option<(Driver, String)> {
        let variables = match self {
            Self::SwiftShader => {
                let manifest = folder().join(SWIFTSHADER_MANIFEST);
                vec![(
                    "VK_ICD_FILENAMES",
                    manifest.exists().then_some(manifest)?.into(),
                )]
            }
            Self::Gl => vec![
                ("WGPU_BACKEND", "gl".into()),
                ("LIBGL_ALWAYS_SOFTWARE", "1".into()),
            ],
        };
        let name = self.name();
        let driver = Driver { name, variables };
        let mut adapter = driver.adapter()?;
        if let Self::SwiftShader = self {
            // It tells no version of its own.
            let version = fs::read_to_string(folder().join(SWIFTSHADER_VERSION));
            adapter = format!("{adapter} of {}", version.unwrap_or_default());
        }
        Some((driver, adapter))
    }

    /// Installs it: GL with apt, SwiftShader into `target/`.
    pub(crate) fn install(self) -> Result<(), String> {
        eprintln!("{} is not installed; trying apt-get", self.name());
        match self {
            Self::SwiftShader => unpack_swiftshader().map_err(|error| {
                format!("{error} (it is taken from Debian's package {SWIFTSHADER_PACKAGE})")
            }),
            Self::Gl => install(&["libegl1", "libgl1-mesa-dri"]),
        }
    }
}

/// Where SwiftShader is unpacked.
fn folder() -> PathBuf {
    root().join("target/drivers/swiftshader")
}

fn apt() -> Command {
    let mut command = Command::new("apt-get");
    command
        .env("DEBIAN_FRONTEND", "noninteractive")
        // A download into a folder of ours is no fault to warn of.
        .args(["-o", "APT::Sandbox::User=root"]);
    command
}

fn install(packages: &[&str]) -> Result<(), String> {
    run(apt().arg("update"))?;
    run(apt()
        .args(["install", "-y", "--no-install-recommends"])
        .args(packages))
}

/// Takes SwiftShader out of the package that Debian has it in, without installing that.
fn unpack_swiftshader() -> Result<(), String> {
    let folder = folder();
    let failed = |error: std::io::Error| format!("{}: {error}", folder.display());
    let scratch = folder.with_extension("scratch");
    if scratch.exists() {
        fs::remove_dir_all(&scratch).map_err(failed)?;
    }
    fs::create_dir_all(&scratch).map_err(failed)?;
    let download = || {
        run(apt()
            .args(["download", SWIFTSHADER_PACKAGE])
            .current_dir(&scratch))
    };
    // The package lists may be missing, or older than what the mirror has.
    download().or_else(|_| run(apt().arg("update")).and_then(|()| download()))?;
    let package = fs::read_dir(&scratch)
        .map_err(failed)?
        .find_map(|entry| {
            let path = entry.ok()?.path();
            (path.extension()? == "deb").then_some(path)
        })
        .ok_or("apt-get download left no package")?;
    run(Command::new("dpkg").arg("-x").arg(&package).arg(&scratch))?;
    let version = package.file_name().unwrap_or_default().to_string_lossy();
    fs::create_dir_all(&folder).map_err(failed)?;
    fs::write(folder.join(SWIFTSHADER_VERSION), version.as_bytes()).map_err(failed)?;
    // The manifest last: it says that all is there.
    for file in [SWIFTSHADER_LIBRARY, SWIFTSHADER_MANIFEST] {
        fs::rename(
            scratch.join("usr/lib/chromium").join(file),
            folder.join(file),
        )
        .map_err(|error| format!("{file} of {SWIFTSHADER_PACKAGE}: {error}"))?;
    }
    fs::remove_dir_all(&scratch).map_err(failed)
}

//! The drivers in software that the tests run on: finding, installing and choosing them.

mod current_mesa;
mod swiftshader;

use std::ffi::OsString;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use crate::{program, run};

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

/// A driver, and what chooses it.
#[derive(Clone, Debug)]
pub(crate) struct Driver {
    /// What we call it.
    pub(crate) name: &'static str,
    variables: Vec<(&'static str, OsString)>,
    /// What a program is started by, if not by itself: a loader that has the driver's own libraries.
    loader: Vec<OsString>,
}

impl Driver {
    /// Whatever the system has.
    pub(crate) fn system() -> Self {
        Self {
            name: "system",
            variables: Vec::new(),
            loader: Vec::new(),
        }
    }

    /// `command`, on this driver; what it reads and writes is not taken over.
    pub(crate) fn choose(&self, command: &Command) -> Command {
        let own = [command.get_program()];
        let words = self.loader.iter().map(OsString::as_os_str).chain(own);
        let mut words = words.chain(command.get_args());
        let mut chosen = Command::new(words.next().unwrap_or_default());
        chosen.args(words);
        for (name, value) in command.get_envs() {
            match value {
                Some(value) => chosen.env(name, value),
                None => chosen.env_remove(name),
            };
        }
        if let Some(folder) = command.get_current_dir() {
            chosen.current_dir(folder);
        }
        // Without a display, Mesa's device selection would complain on stderr.
        chosen.env("NODEVICE_SELECT", "1");
        chosen.envs(self.variables.iter().map(|(name, value)| (name, value)));
        chosen
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
    let driver = |name, variables| Driver {
        name,
        variables,
        loader: Vec::new(),
    };
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
    /// Lavapipe some years younger than that of the distribution.
    CurrentMesa,
}

impl Optional {
    pub(crate) const ALL: [Self; 3] = [Self::SwiftShader, Self::Gl, Self::CurrentMesa];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::SwiftShader => "SwiftShader",
            Self::Gl => "llvmpipe, GL",
            Self::CurrentMesa => "current Mesa",
        }
    }

    /// The driver and what the program says of it, if it is there.
    pub(crate) fn find(self) -> Option<(Driver, String)> {
        let (variables, loader) = match self {
            Self::SwiftShader => (vec![("VK_ICD_FILENAMES", swiftshader::find()?)], vec![]),
            Self::Gl => {
                let software = ("LIBGL_ALWAYS_SOFTWARE", "1".into());
                (vec![("WGPU_BACKEND", "gl".into()), software], vec![])
            }
            Self::CurrentMesa => {
                let (manifest, loader) = current_mesa::find()?;
                (vec![("VK_ICD_FILENAMES", manifest)], loader)
            }
        };
        let driver = Driver {
            name: self.name(),
            variables,
            loader,
        };
        let mut adapter = driver.adapter()?;
        if let Self::SwiftShader = self {
            // It tells no version of its own.
            adapter = format!("{adapter} of {}", swiftshader::version());
        }
        Some((driver, adapter))
    }

    /// Installs it: GL with apt, the others into `target/`.
    pub(crate) fn install(self) -> Result<(), String> {
        eprintln!("{} is not installed; trying apt-get", self.name());
        match self {
            Self::SwiftShader => swiftshader::unpack(),
            Self::Gl => install(&["libegl1", "libgl1-mesa-dri"]),
            Self::CurrentMesa => current_mesa::unpack(),
        }
    }
}

/// An empty folder of this name.
fn empty(folder: &Path) -> Result<(), String> {
    let failed = |error: std::io::Error| format!("{}: {error}", folder.display());
    if folder.exists() {
        fs::remove_dir_all(folder).map_err(failed)?;
    }
    fs::create_dir_all(folder).map_err(failed)
}

/// Unpacks a package of Debian's into a folder, without installing it.
fn unpack(package: &Path, folder: &Path) -> Result<(), String> {
    run(Command::new("dpkg").arg("-x").arg(package).arg(folder))
}

/// The packages in a folder.
fn packages(folder: &Path) -> Result<Vec<std::path::PathBuf>, String> {
    let entries = fs::read_dir(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
    Ok(paths
        .filter(|path| path.extension().is_some_and(|e| e == "deb"))
        .collect())
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

//! Where an image goes: a path whose extension names the format.

use std::fmt;
use std::path::{Path, PathBuf};

use super::atomic;
use crate::error::{Error, Result};
use crate::image::Format;

/// An image file to be written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Target {
    /// As it was typed.
    pub path: PathBuf,
    /// What to write there.
    pub format: Format,
}

impl Target {
    /// Reads the format off the extension, in upper or lower case. Touches no file.
    ///
    /// # Errors
    /// [`Error::Usage`] if the extension is missing or unknown.
    pub fn parse(path: impl Into<PathBuf>) -> Result<Self> {
        let path = path.into();
        let extension = path
            .extension()
            .map(|text| text.to_string_lossy().to_lowercase());
        let format = match extension.as_deref() {
            Some("png") => Format::Png,
            Some("exr") => Format::Exr,
            Some("npy") => Format::Npy,
            other => {
                let problem = match other {
                    Some(extension) => format!("the extension .{extension} is not known"),
                    None => String::from("it has no extension"),
                };
                return Err(Error::Usage(format!(
                    "cannot tell the format of the output '{}': {problem}; use .png, .exr or .npy",
                    path.display()
                )));
            }
        };
        Ok(Self { path, format })
    }

    /// Finds out whether the file can be written, as [`check_all`] does.
    ///
    /// # Errors
    /// [`Error::Usage`] with the reason if it cannot.
    pub fn check(&self) -> Result<()> {
        check_all(&[&self.path], &[])
    }
}

/// Refuses layers that no image has room for.
///
/// # Errors
/// [`Error::Usage`] if there are some and none of the `targets` is an EXR file.
pub fn check_layers<T>(layers: &[T], targets: &[Target]) -> Result<()> {
    if !layers.is_empty() && !targets.iter().any(|t| t.format == Format::Exr) {
        return Err(Error::Usage(
            "--aov: only EXR files have room for layers: add an output such as -o image.exr".into(),
        ));
    }
    Ok(())
}

impl fmt::Display for Target {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.path.display().fmt(formatter)
    }
}

/// Finds out, before any work, whether all `outputs` (images, statistics, dumps) can be written:
/// directories exist and take a new file (one is made and removed again), no output is a directory
/// or a file that may not be changed, no two are the same file, and none is one of the `inputs`.
/// Nothing is changed and nothing is left behind.
///
/// # Errors
/// [`Error::Usage`] for the first output that cannot be written.
pub fn check_all(outputs: &[&Path], inputs: &[&Path]) -> Result<()> {
    let mut seen: Vec<(PathBuf, &Path)> = Vec::new();
    for &output in outputs {
        let identity = atomic::check(output).map_err(|reason| {
            Error::Usage(format!(
                "cannot write the output '{}': {reason}",
                output.display()
            ))
        })?;
        // Devices and pipes have no identity here: two outputs may both go to /dev/null.
        let Some(identity) = identity else { continue };
        if let Some((_, other)) = seen.iter().find(|(known, _)| *known == identity) {
            return Err(Error::Usage(format!(
                "the outputs '{}' and '{}' are the same file",
                other.display(),
                output.display()
            )));
        }
        let is_identity = |input: &&&Path| input.canonicalize().is_ok_and(|real| real == identity);
        if let Some(input) = inputs.iter().find(is_identity) {
            return Err(Error::Usage(format!(
                "the output '{}' would replace the input '{}'",
                output.display(),
                input.display()
            )));
        }
        seen.push((identity, output));
    }
    Ok(())
}

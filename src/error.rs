//! What can go wrong, and the exit code of each.

use std::path::PathBuf;

/// Every error of the program. The message is complete: it names the file, the option or the
/// device, and says what to do where that is known.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A scene that cannot be used. The text holds file, line, column, and the line itself with the
    /// place underlined.
    #[error("{0}")]
    Scene(String),
    /// An option or a combination of options that cannot be used.
    #[error("{0}")]
    Usage(String),
    /// A file that cannot be read or written.
    #[error("{action} {}: {source}", path.display())]
    File {
        /// What was tried, as in "cannot write".
        action: &'static str,
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// No adapter, or none that fits what was asked for.
    #[error("{0}")]
    Device(String),
    /// The device failed while it worked: lost, out of memory, or a validation error.
    #[error("{0}")]
    Gpu(String),
    /// The kernel could not be linked or validated: a defect of this program.
    #[error("{0}")]
    Shader(String),
    /// The estimate holds values that are not finite.
    #[error("{0}")]
    NonFinite(String),
    /// A hard case failed on the device.
    #[error("{0}")]
    Check(String),
    /// The program was told to stop.
    #[error("interrupted")]
    Interrupted(i32),
}

impl Error {
    /// The exit code of the process: 2 for what the user can correct in the input, 129, 130 or 143
    /// after a signal, 3 if a check failed, else 1.
    #[must_use]
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Scene(_)
            | Self::Usage(_)
            | Self::File {
                action: "cannot read",
                ..
            } => 2,
            Self::Check(_) => 3,
            Self::Interrupted(code) => u8::try_from(*code).unwrap_or(1),
            _ => 1,
        }
    }
}

/// The result of everything that can fail.
pub type Result<T, E = Error> = std::result::Result<T, E>;

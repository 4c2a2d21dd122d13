//! What can go wrong, and the exit code of each.

use std::fmt;
use std::io;
use std::path::PathBuf;

/// Every error of the program. The message is complete: it names the file, the option or the
/// device, and says what to do where that is known.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A scene file that cannot be used. The text holds file, line, column, and the line itself with the
    /// place underlined, under a heading of its own.
    #[error("{0}")]
    Scene(String),
    /// A scene that was made in code as no file could hold it, or that the kernel cannot hold.
    #[error("{0}")]
    Placement(String),
    /// An option or a combination of options that cannot be used.
    #[error("{0}")]
    Usage(String),
    /// A file that cannot be read or written.
    #[error("{action} {}: {source}", path.display())]
    File {
        /// What was tried.
        action: Action,
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// No adapter, or none that fits what was asked for.
    #[error("{0}")]
    Device(String),
    /// The device failed while it worked: lost, out of memory, or a validation error.
    #[error("{0}")]
    Gpu(String),
    /// A buffer is beyond a limit of the device.
    #[error("{0}")]
    DeviceLimit(String),
    /// The kernel could not be linked or validated: a defect of this program.
    #[error("{0}")]
    Shader(String),
    /// The estimate holds values that are not finite.
    #[error("{0}")]
    NonFinite(String),
    /// A hard case failed on the device.
    #[error("{0}")]
    Check(String),
    /// Slurm is not here, or takes no job.
    #[error("{0}")]
    Slurm(String),
    /// The program was told to stop.
    #[error("interrupted")]
    Interrupted(i32),
}

/// What is done to a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// It is read.
    Read,
    /// It is written.
    Write,
    /// It is removed.
    Remove,
}

/// As messages say that it failed.
impl fmt::Display for Action {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Read => "cannot read",
            Self::Write => "cannot write",
            Self::Remove => "cannot remove",
        })
    }
}

impl Error {
    /// The exit code of the process: 2 for what the user can correct in the input, 129, 130 or 143
    /// after a signal, 3 if a check failed, else 1.
    #[must_use]
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Scene(_)
            | Self::Placement(_)
            | Self::Usage(_)
            | Self::File {
                action: Action::Read,
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

/// What is wrong with the bytes of a file.
pub(crate) fn invalid(text: impl Into<String>) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, text.into())
}

/// A part of a file as a message may show it: what is corrupt can be long and hold control
/// characters.
pub(crate) fn shown(text: &str) -> String {
    let visible = |c: char| match c {
        '\'' | '"' => vec![c],
        _ => c.escape_debug().collect(),
    };
    text.trim().chars().take(80).flat_map(visible).collect()
}

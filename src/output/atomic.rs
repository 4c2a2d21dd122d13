//! Writes a file in one step: the bytes go to a temporary file beside it, which then takes its
//! name. A reader sees the old content or the new one, never a part; a full disk leaves the old one.
//! A process that is killed in between leaves its temporary file, `.gpu-trace-*.tmp`, and no more.

use std::fs::{self, File, OpenOptions, Permissions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::error::{Action, Error, Result};

/// Writes `bytes` to `path`, all or nothing. A new file has the permissions that any new file
/// would have, a replaced one keeps its own; a symbolic link stays, and what it leads to is
/// replaced. Pipes, devices and the standard streams are written directly.
///
/// # Errors
/// [`Error::File`] with the system's reason. An older file is then unchanged and no temporary file
/// remains.
pub fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    replace(path, bytes).map_err(|source| Error::File {
        action: Action::Write,
        path: path.to_path_buf(),
        source,
    })
}

/// As [`write`], for callers that add the path to the error themselves.
pub(super) fn replace(path: &Path, bytes: &[u8]) -> io::Result<()> {
    match Destination::of(path)? {
        Destination::Stdout => write_flushed(io::stdout().lock(), bytes),
        Destination::Stderr => write_flushed(io::stderr().lock(), bytes),
        Destination::Stream(path) => {
            // Appending, for a descriptor may lead to a file that others write to as well.
            write_flushed(File::options().append(true).open(path)?, bytes)
        }
        Destination::File(path) => {
            let mut temporary = temporary_beside(&path)?;
            // Past the wrapper, whose errors name the temporary file: that name helps nobody.
            write_flushed(temporary.as_file_mut(), bytes)?;
            temporary
                .persist(&path)
                .map(drop)
                .map_err(|failure| failure.error)
        }
    }
}

/// As [`replace`], for what must survive even a machine that stops: the bytes are on the disk before the file
/// takes its name, and the name is before this returns. Only for regular files.
pub(crate) fn replace_durably(
    path: &Path,
    write: impl FnOnce(&mut File) -> io::Result<()>,
) -> io::Result<()> {
    let Destination::File(path) = Destination::of(path)? else {
        return Err(io::Error::other("it is no regular file"));
    };
    let mut temporary = temporary_beside(&path)?;
    write(temporary.as_file_mut())?;
    temporary.as_file().sync_all()?;
    temporary.persist(&path).map_err(|failure| failure.error)?;
    sync_directory(split(&path)?.0)
}

/// Waits until the names in a directory are on the disk.
#[cfg(unix)]
fn sync_directory(directory: &Path) -> io::Result<()> {
    match File::open(directory).and_then(|directory| directory.sync_all()) {
        // Some file systems cannot, and a directory may be written to but not read: nothing is lost by that as
        // long as the machine runs.
        Err(error) if error.kind() == io::ErrorKind::PermissionDenied => Ok(()),
        Err(error) if error.raw_os_error() == Some(libc::EINVAL) => Ok(()),
        done => done,
    }
}

#[cfg(not(unix))]
fn sync_directory(_directory: &Path) -> io::Result<()> {
    Ok(())
}

/// Whether [`write`] could write to `path`, found out by creating and removing a temporary file
/// where a real one would be created. Returns what identifies the file, or nothing for what is not
/// a regular file. Two paths to one file have the same identity.
pub(super) fn check(path: &Path) -> Result<Option<PathBuf>, String> {
    let text = |error: io::Error| error.to_string();
    let Destination::File(file) = Destination::of(path).map_err(text)? else {
        return Ok(None);
    };
    let (directory, name) = split(&file).map_err(text)?;
    match fs::metadata(directory) {
        Ok(metadata) if metadata.is_dir() => {}
        Ok(_) => return Err(format!("'{}' is not a directory", directory.display())),
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            return Err(format!(
                "the directory '{}' does not exist",
                directory.display()
            ));
        }
        Err(error) => return Err(error.to_string()),
    }
    if file.exists() {
        // A rename would succeed on a write-protected file, against its owner's wish.
        File::options().write(true).open(&file).map_err(text)?;
    }
    temporary_beside(&file)
        .map_err(|error| format!("no file can be made in '{}': {error}", directory.display()))?;
    directory
        .canonicalize()
        .map(|directory| Some(directory.join(name)))
        .map_err(text)
}

/// What a path leads to, and hence how to write there.
enum Destination {
    /// The process's own stream: opened anew by name it would start at its own offset, and
    /// overwrite what is printed to a redirected stdout.
    Stdout,
    /// As `Stdout`.
    Stderr,
    /// A device, a pipe or a descriptor, which a file must not replace.
    Stream(PathBuf),
    /// A regular file, there already or not, with symbolic links resolved.
    File(PathBuf),
}

impl Destination {
    fn of(path: &Path) -> io::Result<Self> {
        match path.to_str() {
            Some("/dev/stdout" | "/dev/fd/1" | "/proc/self/fd/1") => return Ok(Self::Stdout),
            Some("/dev/stderr" | "/dev/fd/2" | "/proc/self/fd/2") => return Ok(Self::Stderr),
            // The system calls would drop the separator, or fail only at the rename.
            Some(text) if text.ends_with(std::path::is_separator) => {
                return Err(io::ErrorKind::IsADirectory.into());
            }
            _ => {}
        }
        let is_descriptor = path.starts_with("/dev/fd") || path.starts_with("/proc/self/fd");
        match fs::metadata(path) {
            Ok(metadata) if metadata.is_dir() => Err(io::ErrorKind::IsADirectory.into()),
            Ok(metadata) if is_descriptor || !metadata.is_file() => Ok(Self::Stream(path.into())),
            Ok(_) => path.canonicalize().map(Self::File),
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                Ok(Self::File(follow_dangling(path)?))
            }
            Err(error) => Err(error),
        }
    }
}

/// The end of a chain of symbolic links that leads to nothing yet; `path` itself if it is none.
fn follow_dangling(path: &Path) -> io::Result<PathBuf> {
    // The usual limit of systems. They report longer chains themselves, unless these change while
    // we look.
    const LINKS: usize = 40;
    let mut path = path.to_path_buf();
    for _ in 0..LINKS {
        let Ok(next) = fs::read_link(&path) else {
            return Ok(path);
        };
        path = split(&path)?.0.join(next);
    }
    Err(io::Error::other("too many symbolic links"))
}

/// Directory and name of a file.
fn split(path: &Path) -> io::Result<(&Path, &std::ffi::OsStr)> {
    let name = path
        .file_name()
        .ok_or(io::Error::other("the path does not name a file"))?;
    let directory = match path.parent() {
        Some(parent) if parent != Path::new("") => parent,
        _ => Path::new("."),
    };
    Ok((directory, name))
}

/// An empty temporary file in the directory of `path`, removed when dropped.
fn temporary_beside(path: &Path) -> io::Result<NamedTempFile> {
    let existing = fs::metadata(path).ok().map(|data| data.permissions());
    let mut options = File::options();
    options.write(true).create_new(true);
    if let Some(permissions) = &existing {
        create_with(&mut options, permissions);
    }
    // Not made from the file's own name, which may already be as long as a name can be. Opened
    // here, because the crate's way makes a private file, and its errors name the temporary one.
    let temporary = tempfile::Builder::new()
        .prefix(".gpu-trace-")
        .suffix(".tmp")
        .make_in(split(path)?.0, |temporary| options.open(temporary))?;
    if let Some(permissions) = existing {
        // Adds what the process's mask took away. Some file systems hold no permissions and
        // refuse, which costs nothing.
        let _ = temporary.as_file().set_permissions(permissions);
    }
    Ok(temporary)
}

/// Lets a replacement be no more public than the old file was, from the first moment.
#[cfg(unix)]
fn create_with(options: &mut OpenOptions, permissions: &Permissions) {
    use std::os::unix::fs::{OpenOptionsExt, PermissionsExt};
    options.mode(permissions.mode());
}

#[cfg(not(unix))]
fn create_with(_options: &mut OpenOptions, _permissions: &Permissions) {}

fn write_flushed(mut to: impl Write, bytes: &[u8]) -> io::Result<()> {
    to.write_all(bytes)?;
    to.flush()
}

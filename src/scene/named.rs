//! Files that a scene names, as bytes.

use std::fs::{self, File};
use std::io::Read as _;
use std::path::Path;

/// The bytes of a regular file of at most `most` of them.
///
/// # Errors
/// What is wrong with the file, which the text names.
pub(super) fn read(path: &Path, most: u64) -> Result<Vec<u8>, String> {
    let shown = path.display().to_string();
    let shown = shown.escape_debug();
    let unread = |error: std::io::Error| format!("cannot read {shown}: {error}");
    let about = fs::metadata(path).map_err(unread)?;
    // Before it is opened: a pipe would wait, and a device may have no end.
    if !about.is_file() {
        return Err(format!("{shown} is no regular file"));
    }
    let too_long = || format!("{shown} is longer than {most} bytes, the limit");
    if about.len() > most {
        return Err(too_long());
    }
    let mut bytes = Vec::new();
    let file = File::open(path).map_err(unread)?;
    let mut file = file.take(most + 1);
    file.read_to_end(&mut bytes).map_err(unread)?;
    if bytes.len() as u64 > most {
        return Err(too_long());
    }
    Ok(bytes)
}

//! Film files: a render that can go on, or be joined with others of the same image.
//!
//! 1. [`about`]: what the file says. [`scene`]: what the scene was made from. `archive`: how all is kept, and
//!    how it is read back, of which nothing is believed that the rest contradicts.
//! 2. [`join`]: parts of an image become one.

pub mod about;
mod archive;
pub mod join;
pub mod scene;

use std::fs::File;
use std::io::{self, BufReader, BufWriter, Read, Seek, Write as _};
use std::path::Path;

pub use about::{About, Choices, Command, FORMAT, Goal, Maker, check};
pub use scene::SceneRecord;
use serde::Deserialize;

use crate::error::{Action, Error, Result, invalid};
use crate::film::Film;
use crate::output::atomic;

/// A film with what there is to say of it.
#[derive(Clone, Debug)]
pub struct FilmFile {
    /// What it says.
    pub about: About,
    /// The sums.
    pub film: Film,
}

/// Writes a film file in one step, and returns once it is on the disk: whatever happens, one of the two is
/// there, the old file or the new one.
///
/// # Errors
/// [`Error::File`] with the system's reason; an older file is then unchanged.
pub fn write(path: &Path, about: &About, film: &Film) -> Result<()> {
    let written = atomic::replace_durably(path, |file| {
        let mut file = BufWriter::new(file);
        archive::write(&mut file, about, film)?;
        file.flush()
    });
    written.map_err(|source| Error::File {
        action: Action::Write,
        path: path.to_owned(),
        source,
    })
}

/// The bytes of a film file.
///
/// # Errors
/// None that are known: memory takes all.
pub fn encode(about: &About, film: &Film) -> io::Result<Vec<u8>> {
    let mut bytes = io::Cursor::new(Vec::new());
    archive::write(&mut bytes, about, film)?;
    Ok(bytes.into_inner())
}

/// Reads a film file.
///
/// # Errors
/// [`Error::File`] if it cannot be read, is none, is damaged, or is in another form than this program's.
pub fn read(path: &Path) -> Result<FilmFile> {
    read_with(path, decode)
}

/// Reads what a film file says, and no array: how large it is can then be known before there is room for it.
///
/// # Errors
/// As [`read`], as far as no array is at fault.
pub fn read_about(path: &Path) -> Result<About> {
    read_with(path, |file| about_of(&mut archive::Reader::open(file)?))
}

fn read_with<T>(path: &Path, decode: impl FnOnce(BufReader<File>) -> io::Result<T>) -> Result<T> {
    let opened = File::open(path).and_then(|file| match file.metadata()?.is_dir() {
        true => Err(io::ErrorKind::IsADirectory.into()),
        false => Ok(BufReader::new(file)),
    });
    opened.and_then(decode).map_err(|source| Error::File {
        action: Action::Read,
        path: path.to_owned(),
        source,
    })
}

/// The film file in `from`.
///
/// # Errors
/// As [`read`], as the system's errors or of the kind [`InvalidData`](io::ErrorKind::InvalidData).
pub fn decode(from: impl Read + Seek) -> io::Result<FilmFile> {
    let mut file = archive::Reader::open(from)?;
    let about = about_of(&mut file)?;
    let film = file.film(
        about.settings.crop(),
        about.counts.clone(),
        about.settings.has_layers(),
    )?;
    let samples = about.ranges.iter().map(|[start, end]| end - start);
    if samples.sum::<u64>() != film.samples() {
        return Err(invalid(
            "film.json: its samples are not those of the ranges",
        ));
    }
    Ok(FilmFile { about, film })
}

fn about_of(file: &mut archive::Reader<impl Read + Seek>) -> io::Result<About> {
    /// Looked at before the rest, which another form may have otherwise.
    #[derive(Deserialize)]
    struct Form {
        format: u32,
    }
    let [text, scene] = file.texts()?;
    let fault = |error: serde_json::Error| invalid(format!("film.json: {error}"));
    let Form { format } = serde_json::from_slice(&text).map_err(fault)?;
    if format != FORMAT {
        return Err(invalid(format!(
            "it is a film file of format {format}, and this version of gpu-trace, {}, knows {FORMAT}",
            env!("CARGO_PKG_VERSION")
        )));
    }
    let mut about: About = serde_json::from_slice(&text).map_err(fault)?;
    about.scene.text = str::from_utf8(&scene)
        .map_err(|error| invalid(format!("scene.toml: {error}")))?
        .into();
    about
        .check()
        .map_err(|text| invalid(format!("film.json: {text}")))?;
    Ok(about)
}

//! Film files: a render that can go on, or be joined with others of the same image.
//!
//! 1. [`about`]: what the file says. `archive`: how it is kept, and how it is read back, of which nothing is
//!    believed that the rest contradicts.
//! 2. [`join`]: parts of an image become one.

pub mod about;
mod archive;
pub mod join;

use std::fs::File;
use std::io::{self, BufReader, BufWriter, Read, Seek, Write as _};
use std::path::Path;

pub use about::{About, Choices, Command, Device, FORMAT, Goal, SceneText};

use crate::error::{Action, Error, Result};
use crate::film::Film;
use crate::output::atomic;
use crate::scene::load::{Loaded, load_str};

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
    let written = serde_json::to_vec_pretty(about)
        .map_err(io::Error::from)
        .and_then(|text| {
            atomic::replace_durably(path, |file| {
                let mut file = BufWriter::new(file);
                archive::write(&mut file, &text, film)?;
                file.flush()
            })
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
    archive::write(&mut bytes, &serde_json::to_vec_pretty(about)?, film)?;
    Ok(bytes.into_inner())
}

/// Reads a film file.
///
/// # Errors
/// [`Error::File`] if it cannot be read, is none, is damaged, or is in another form than this program's.
pub fn read(path: &Path) -> Result<FilmFile> {
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
    let invalid = |text: String| io::Error::new(io::ErrorKind::InvalidData, text);
    let mut file = archive::Reader::open(from)?;
    let text = file.text()?;
    let value: serde_json::Value =
        serde_json::from_slice(&text).map_err(|e| invalid(format!("film.json: {e}")))?;
    // Before the rest, which another form may have otherwise.
    if value["format"] != FORMAT {
        return Err(invalid(format!(
            "film.json: the form of the file is {}, and this version of gpu-trace knows {FORMAT}",
            value["format"]
        )));
    }
    let about: About =
        serde_json::from_value(value).map_err(|e| invalid(format!("film.json: {e}")))?;
    let choices = &about.settings;
    let film = file.film(choices.crop(), about.counts.clone(), choices.has_layers())?;
    about
        .check(&film)
        .map_err(|text| invalid(format!("film.json: {text}")))?;
    Ok(FilmFile { about, film })
}

impl About {
    /// Whether it is of the film.
    fn check(&self, film: &Film) -> Result<(), String> {
        self.settings.settings(&self.goal)?;
        let mut last = 0;
        let mut all: u64 = 0;
        for (at, [start, end]) in self.ranges.iter().enumerate() {
            if start >= end || (at > 0 && *start <= last) {
                return Err("the ranges of its samples are in no order".into());
            }
            last = *end;
            all += end - start;
        }
        if all != film.samples() || self.samples != self.counts.samples() {
            return Err("its samples are not those of the ranges".into());
        }
        if !(self.seconds.is_finite() && self.seconds >= 0.0) {
            return Err("its seconds are no time".into());
        }
        Ok(())
    }
}

impl FilmFile {
    /// Loads the scene from the text in the file.
    ///
    /// # Errors
    /// [`Error::Scene`] if the text is no scene any more, [`Error::Usage`] if it is another one than was
    /// rendered.
    pub fn scene(&self) -> Result<Loaded> {
        let SceneText {
            name, text, hash, ..
        } = &self.about.scene;
        let loaded = load_str(name, text)?;
        if loaded.hash == *hash {
            return Ok(loaded);
        }
        Err(Error::Usage(format!(
            "the scene {name} in the film file is another one now: its content has the hash {}, and the \
             samples are of {hash}; render it anew",
            loaded.hash
        )))
    }
}

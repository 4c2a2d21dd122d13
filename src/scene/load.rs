//! Reads a scene file: bytes to text to TOML to a validated [`Scene`].
//!
//! Each step reports everything that it can, with the place; the next one starts only if nothing
//! was wrong, so it may rely on what the last one checked.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::Deserialize;
use toml::de::{DeTable, Deserializer};

use super::file::{SceneFile, schema};
use super::parsed::{Parsed, Place};
use super::particles::look::Look;
use super::report::{Problem, Report};
use super::{Scene, content_hash, names, pieces, shape, texture_table, validate};
use crate::error::{Action, Error, Result};

/// The largest scene file that is read, in bytes; about three million spheres.
const MAX_FILE_SIZE: u64 = 256 << 20;

/// From this size on, in bytes, lists of spheres are parsed by pieces.
const LONG: usize = 1 << 20;

/// A scene with what there is to say about it.
#[derive(Clone, Debug, PartialEq)]
pub struct Loaded {
    /// The scene.
    pub scene: Scene,
    /// Its name: the built-in's name or the file's stem; good for the name of an output.
    pub name: String,
    /// What is legal and probably not meant, each rendered with file, line, column and the line.
    pub warnings: Vec<String>,
    /// What it was made from.
    pub source: Source,
    /// The files that the source names, each once.
    pub files: Vec<PathBuf>,
    /// Where a frame was asked for: how many frames all those files have that it is of; `None` if it is of none.
    pub frames: Option<u64>,
    /// Hash of the scene's values (16 hexadecimal digits), see [`content_hash`].
    pub hash: String,
}

/// What a scene was made from: with the files that it names it can be made again.
#[derive(Clone, Debug, PartialEq)]
pub enum Source {
    /// The text of a scene file.
    Text {
        /// All of it.
        text: Arc<str>,
        /// The file; `None` for a scene that is in none, as a built-in one.
        file: Option<PathBuf>,
    },
    /// A particle file, which is the only one named, without a scene file.
    Particles(Look),
}

impl Loaded {
    /// The files that it was read from: no output may replace them.
    #[must_use]
    pub fn inputs(&self) -> Vec<&Path> {
        let scene = match &self.source {
            Source::Text { file, .. } => file.as_deref(),
            Source::Particles(_) => None,
        };
        let named = self.files.iter().map(PathBuf::as_path);
        named.chain(scene).collect()
    }
}

/// Loads a scene file.
///
/// # Errors
/// [`Error::File`] if it cannot be read, [`Error::Scene`] if it is not a scene.
pub fn load_file(path: &Path) -> Result<Loaded> {
    load_file_at(path, None)
}

/// The same, at a frame of the particle files that name none and have several.
///
/// # Errors
/// Those of [`load_file`].
pub fn load_file_at(path: &Path, frame: Option<u64>) -> Result<Loaded> {
    let shown = path.display().to_string();
    let bytes = read(path).map_err(|source| Error::File {
        action: Action::Read,
        path: path.to_owned(),
        source,
    })?;
    let name = path
        .file_stem()
        .map_or_else(|| shown.clone(), |stem| stem.to_string_lossy().into_owned());
    match str::from_utf8(&bytes) {
        Ok(text) => {
            let folder = path.parent().unwrap_or(Path::new(""));
            let file = Some(path.to_owned());
            let place = Place { folder, frame };
            load(name, &shown, text, place, file)
        }
        Err(error) => Err(not_utf8(&shown, &bytes, error.valid_up_to())),
    }
}

/// Loads a scene from text. The name is the scene's, and stands for the file in messages; files that it names
/// are relative to the current folder.
///
/// # Errors
/// [`Error::Scene`] if the text is not a scene.
pub fn load_str(name: &str, text: &str) -> Result<Loaded> {
    load_str_in(name, text, Path::new(""))
}

/// As [`load_str`], with the files that the text names relative to `folder`.
///
/// # Errors
/// Those of [`load_str`].
pub fn load_str_in(name: &str, text: &str, folder: &Path) -> Result<Loaded> {
    let place = Place {
        folder,
        frame: None,
    };
    load(name.to_owned(), name, text, place, None)
}

fn read(path: &Path) -> io::Result<Vec<u8>> {
    if fs::metadata(path)?.is_dir() {
        return Err(io::ErrorKind::IsADirectory.into());
    }
    // A device or a pipe has no size in advance: one byte more than the limit is asked for.
    let mut bytes = Vec::new();
    File::open(path)?
        .take(MAX_FILE_SIZE + 1)
        .read_to_end(&mut bytes)?;
    if bytes.len() as u64 > MAX_FILE_SIZE {
        let message = format!("larger than {} MiB, the limit", MAX_FILE_SIZE >> 20);
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, message));
    }
    Ok(bytes)
}

fn not_utf8(shown: &str, bytes: &[u8], valid: usize) -> Error {
    if bytes.iter().take(1024).any(|&byte| byte == 0) {
        return Error::Scene(format!(
            "error: {shown} is not a scene file: it holds binary data"
        ));
    }
    // Up to the bad byte the offsets are those of the file.
    let text = String::from_utf8_lossy(bytes);
    let message = format!("the file is not UTF-8 text: byte 0x{:02x}", bytes[valid]);
    let problem = Problem::new(valid..valid + 1, message, "here")
        .help("save the file with the encoding UTF-8");
    failed(shown, &text, vec![problem])
}

fn failed(shown: &str, text: &str, errors: Vec<Problem>) -> Error {
    let report = Report {
        errors,
        warnings: Vec::new(),
    };
    Error::Scene(report.error_text(shown, text).unwrap_or_default())
}

fn load(
    name: String,
    shown: &str,
    text: &str,
    place: Place<'_>,
    file: Option<PathBuf>,
) -> Result<Loaded> {
    let mut report = Report::default();
    let parsed = parse(text, place, &mut report);
    if let Some(errors) = report.error_text(shown, text) {
        return Err(Error::Scene(errors));
    }
    let Some(Parsed {
        scene,
        mut files,
        frames,
    }) = parsed
    else {
        return Err(Error::Scene(format!("error: {shown} is not a scene file")));
    };
    files.sort();
    files.dedup();
    Ok(Loaded {
        hash: content_hash(&scene),
        warnings: report.warning_texts(shown, text),
        source: Source::Text {
            text: text.into(),
            file,
        },
        name,
        files,
        frames,
        scene,
    })
}

/// `None` after errors, which the report then holds.
fn parse(text: &str, place: Place<'_>, report: &mut Report) -> Option<Parsed> {
    if text.len() >= LONG
        && let Some((file, keys, textures)) = pieces::parse(text, schema())
    {
        return validate::scene(file, &keys, textures, place, report);
    }
    let root = DeTable::parse(text).map_err(|error| report.errors.push(syntax(&error)));
    let mut root = root.ok()?;
    if root.get_ref().is_empty() {
        let problem = Problem::new(0..0, "the scene file is empty", "");
        report.errors.push(problem.help(
            "a scene needs at least `[camera]` and `[image]`; \
             `gpu-trace scene list` names scenes to start from",
        ));
        return None;
    }
    shape::check(root.get_ref(), schema(), report);
    if !report.errors.is_empty() {
        return None;
    }
    let keys = names::material_keys(root.get_ref());
    let textures = texture_table::take(root.get_mut());
    let file = SceneFile::deserialize(Deserializer::from(root))
        .map_err(|error| report.errors.push(syntax(&error)));
    validate::scene(file.ok()?, &keys, textures, place, report)
}

/// An error of the TOML parser, in words for those who know other formats. It has a text and a place, and
/// says of no kind which it is: a test of `tests/scene.rs` fails where a version of the parser has other words.
fn syntax(error: &toml::de::Error) -> Problem {
    let message = error.message();
    let starts = |start: &str| message.starts_with(start);
    // The parser's words and ours; what is not known here is shown as the parser says it.
    let (message, help) = if starts("duplicate key") {
        let help = "a key or a table may stand only once; spheres are `[[sphere]]`, \
                    with two brackets";
        ("duplicate key", help)
    } else if starts("key with no value") {
        (
            "a key without a value",
            "a line is `key = value`, `[table]` or `[[sphere]]`",
        )
    } else if starts("string values must be quoted") {
        let help = "numbers are 1 or 0.5, vectors [x, y, z] with commas, words \"in quotes\"";
        ("not a value", help)
    } else if starts("unexpected key or value") {
        let help = "one key a line; a decimal point, not a comma; brackets for vectors: [x, y, z]";
        ("the line should end here", help)
    } else if starts("invalid mantissa") || starts("invalid fraction") {
        (
            message,
            "a decimal point needs a digit on both sides: 0.5, 1.0",
        )
    } else {
        (message, "")
    };
    let problem = Problem::new(error.span().unwrap_or_default(), message, "");
    if help.is_empty() {
        problem
    } else {
        problem.help(help)
    }
}

//! Reads a scene file: bytes to text to TOML to a validated [`Scene`].
//!
//! Each step reports everything that it can, with the place; the next one starts only if nothing
//! was wrong, so it may rely on what the last one checked.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use serde::Deserialize;
use toml::de::{DeTable, Deserializer};

use super::file::{SceneFile, json_schema};
use super::report::{Problem, Report};
use super::{Scene, content_hash, shape, validate};
use crate::error::{Action, Error, Result};

/// The largest scene file that is read, in bytes; about three million spheres.
const MAX_FILE_SIZE: u64 = 256 << 20;

/// A scene with what there is to say about it.
#[derive(Clone, Debug, PartialEq)]
pub struct Loaded {
    /// The scene.
    pub scene: Scene,
    /// Its name: the built-in's name or the file's stem; good for the name of an output.
    pub name: String,
    /// What is legal and probably not meant, each rendered with file, line, column and the line.
    pub warnings: Vec<String>,
    /// The scene file's text.
    pub text: String,
    /// The folder of the scene file; `None` for a built-in scene.
    pub folder: Option<PathBuf>,
    /// Hash of the scene's values (16 hexadecimal digits), see [`content_hash`].
    pub hash: String,
}

/// Loads a scene file.
///
/// # Errors
/// [`Error::File`] if it cannot be read, [`Error::Scene`] if it is not a scene.
pub fn load_file(path: &Path) -> Result<Loaded> {
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
        Ok(text) => Ok(Loaded {
            folder: path.parent().map(Path::to_owned),
            ..load(name, &shown, text)?
        }),
        Err(error) => Err(not_utf8(&shown, &bytes, error.valid_up_to())),
    }
}

/// Loads a scene from text. The name is the scene's, and stands for the file in messages.
///
/// # Errors
/// [`Error::Scene`] if the text is not a scene.
pub fn load_str(name: &str, text: &str) -> Result<Loaded> {
    load(name.to_owned(), name, text)
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

fn load(name: String, shown: &str, text: &str) -> Result<Loaded> {
    let mut report = Report::default();
    let scene = parse(text, &mut report);
    if let Some(errors) = report.error_text(shown, text) {
        return Err(Error::Scene(errors));
    }
    let Some(scene) = scene else {
        return Err(Error::Scene(format!("error: {shown} is not a scene file")));
    };
    Ok(Loaded {
        hash: content_hash(&scene),
        warnings: report.warning_texts(shown, text),
        text: text.to_owned(),
        folder: None,
        name,
        scene,
    })
}

/// The scene; `None` after errors, which the report then holds.
fn parse(text: &str, report: &mut Report) -> Option<Scene> {
    static SCHEMA: LazyLock<serde_json::Value> = LazyLock::new(json_schema);

    let root = DeTable::parse(text).map_err(|error| report.errors.push(syntax(&error)));
    let root = root.ok()?;
    if root.get_ref().is_empty() {
        let problem = Problem::new(0..0, "the scene file is empty", "");
        report.errors.push(problem.help(
            "a scene needs at least `[camera]` and `[image]`; \
             `gpu-trace scene list` names scenes to start from",
        ));
        return None;
    }
    shape::check(root.get_ref(), &SCHEMA, report);
    if !report.errors.is_empty() {
        return None;
    }
    let keys = validate::material_keys(root.get_ref());
    let file = SceneFile::deserialize(Deserializer::from(root))
        .map_err(|error| report.errors.push(syntax(&error)));
    validate::scene(file.ok()?, &keys, report)
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

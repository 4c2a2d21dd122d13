//! The directory of a study: finished runs, the reference, images, and what comes of them.
//!
//! `runs.jsonl` has the study's identity in its first line and a run in every further one. A process
//! that is killed can leave a torn last line, which is dropped; the run is then done again.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::run::Run;
use crate::error::{Error, Result};
use crate::film::Film;
use crate::output::{Picture, atomic, npy, read_npy};

/// What all runs of a directory share: runs of another scene, size, length or reference, or of
/// another version of the program, say nothing about these.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Identity {
    /// The version of the program.
    pub version: String,
    /// The scene's name.
    pub scene: String,
    /// The scene's content.
    pub scene_hash: String,
    /// Columns and rows.
    pub size: [u32; 2],
    /// `--spp`
    pub spp: u64,
    /// `--time` in seconds.
    pub time: Option<f64>,
    /// What errors are measured against.
    pub reference: ReferenceIdentity,
    /// Threads of the CPU reference, 0 for one a core.
    pub threads: usize,
    /// The name of the GPU; `None` if the study uses none.
    pub gpu: Option<String>,
}

/// Which image errors are measured against.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ReferenceIdentity {
    /// A file.
    File {
        /// As it was typed.
        path: PathBuf,
        /// FNV-1a of its bytes.
        hash: String,
    },
    /// The study's own long render.
    Own {
        /// What rendered.
        backend: String,
        /// Name of the estimator.
        integrator: String,
        /// Samples a pixel.
        spp: u64,
        /// The seed, which no run has.
        seed: u64,
        /// The most scattering events.
        max_bounces: u32,
    },
}

/// An open directory.
#[derive(Debug)]
pub struct Store {
    directory: PathBuf,
    /// Runs that were found and those added since; for a series and a seed the last one counts.
    pub runs: Vec<Run>,
}

/// The file with the runs.
pub const RUNS: &str = "runs.jsonl";
/// The study's own reference.
pub const REFERENCE: &str = "reference.exr";
/// The folder of images that the report is made of.
const IMAGES: &str = "images";

impl Store {
    /// Opens a directory, which need not exist. Touches nothing if it is refused.
    ///
    /// # Errors
    /// [`Error::Usage`] with both facts if it holds another study, or other things; [`Error::File`] if it
    /// cannot be read or written.
    pub fn open(directory: &Path, identity: &Identity, fresh: bool) -> Result<Self> {
        let store = Self {
            directory: directory.to_owned(),
            runs: Vec::new(),
        };
        let runs = store.path(RUNS);
        match fs::read(&runs) {
            Ok(bytes) if !fresh => store.resume(&bytes, identity),
            Ok(_) => store.begin(identity),
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                store.check_unused()?;
                store.begin(identity)
            }
            Err(source) => Err(file("cannot read", &runs, source)),
        }
    }

    /// A path in the directory.
    #[must_use]
    pub fn path(&self, name: &str) -> PathBuf {
        self.directory.join(name)
    }

    /// Writes a file of the directory in one step.
    ///
    /// # Errors
    /// [`Error::File`]
    pub fn write(&self, name: &str, bytes: &[u8]) -> Result<()> {
        atomic::write(&self.path(name), bytes)
    }

    /// Keeps a run.
    ///
    /// # Errors
    /// [`Error::File`]
    pub fn add(&mut self, run: Run) -> Result<()> {
        self.append(&json(&run))?;
        self.runs
            .retain(|r| (&r.series, r.seed) != (&run.series, run.seed));
        self.runs.push(run);
        Ok(())
    }

    /// Keeps the image of a film under a name.
    ///
    /// # Errors
    /// [`Error::File`]
    pub fn keep_image(&self, name: &str, film: &Film) -> Result<()> {
        let rect = film.rect();
        let picture = Picture::new(rect.width, rect.height, film.pixels());
        self.write(&image_path(name), &npy::encode(&picture))
    }

    /// An image that was kept; `None` if there is none that can be read.
    #[must_use]
    pub fn image(&self, name: &str) -> Option<Picture> {
        read_npy(&self.path(&image_path(name))).ok()
    }

    /// Refuses a directory that holds anything: `-o .` would strew files among others.
    fn check_unused(&self) -> Result<()> {
        let shown = self.directory.display();
        match fs::read_dir(&self.directory) {
            Ok(mut entries) => match entries.next() {
                Some(_) => Err(Error::Usage(format!(
                    "the directory {shown} holds other files and no study: choose another with -o"
                ))),
                None => Ok(()),
            },
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
            Err(error) => Err(Error::Usage(format!(
                "cannot write the study to {shown}: {error}"
            ))),
        }
    }

    fn begin(self, identity: &Identity) -> Result<Self> {
        let images = self.path(IMAGES);
        let failed = |source| file("cannot write", &images, source);
        // The images of an older study, which is given up.
        match fs::remove_dir_all(&images) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(failed(error)),
            _ => {}
        }
        fs::create_dir_all(&images).map_err(failed)?;
        self.write(RUNS, (json(identity) + "\n").as_bytes())?;
        Ok(self)
    }

    fn resume(mut self, bytes: &[u8], identity: &Identity) -> Result<Self> {
        let path = self.path(RUNS);
        let damaged = |line: usize| {
            Error::Usage(format!(
                "{}: line {line} is damaged; --fresh starts over",
                path.display()
            ))
        };
        let whole = bytes.iter().rposition(|b| *b == b'\n').map_or(0, |i| i + 1);
        let text = str::from_utf8(&bytes[..whole]).map_err(|_| damaged(1))?;
        let mut lines = text.lines().enumerate();
        let there: Value = lines
            .next()
            .and_then(|(_, line)| serde_json::from_str(line).ok())
            .ok_or_else(|| damaged(1))?;
        let here = serde_json::to_value(identity).map_err(|_| damaged(1))?;
        if let Some(name) = differs(&there, &here) {
            let shown = |v: &Value| v.get(name).map_or("nothing".into(), plain);
            return Err(Error::Usage(format!(
                "the directory {} holds a study with another {name}: {} there, {} now; choose another \
                 directory with -o, or start over with --fresh",
                self.directory.display(),
                shown(&there),
                shown(&here)
            )));
        }
        for (index, line) in lines {
            let run: Run = serde_json::from_str(line).map_err(|_| damaged(index + 1))?;
            self.runs
                .retain(|r| (&r.series, r.seed) != (&run.series, run.seed));
            self.runs.push(run);
        }
        if whole < bytes.len() {
            // What follows must not be joined to the torn line.
            self.write(RUNS, &bytes[..whole])?;
        }
        Ok(self)
    }

    fn append(&self, line: &str) -> Result<()> {
        let path = self.path(RUNS);
        let appended = OpenOptions::new()
            .append(true)
            .open(&path)
            .and_then(|mut file: File| file.write_all(format!("{line}\n").as_bytes()));
        appended.map_err(|source| file("cannot write", &path, source))
    }
}

fn image_path(name: &str) -> String {
    format!("{IMAGES}/{name}.npy")
}

fn file(action: &'static str, path: &Path, source: io::Error) -> Error {
    Error::File {
        action,
        path: path.to_owned(),
        source,
    }
}

fn json(value: &impl Serialize) -> String {
    serde_json::to_string(value).expect("names and finite numbers")
}

/// The first member in which two identities differ.
fn differs<'a>(there: &Value, here: &'a Value) -> Option<&'a str> {
    let members = here.as_object()?;
    members
        .iter()
        .find(|(name, value)| there.get(name) != Some(value))
        .map(|(name, _)| name.as_str())
}

/// A value without JSON's quotes, for messages.
fn plain(value: &Value) -> String {
    match value {
        Value::String(text) => text.escape_debug().to_string(),
        Value::Null => "none".into(),
        other => other.to_string(),
    }
}

/// FNV-1a of bytes, as 16 hexadecimal digits: against accidents, not against forgery.
#[must_use]
pub fn hash(bytes: &[u8]) -> String {
    let hash = bytes.iter().fold(0xcbf2_9ce4_8422_2325_u64, |h, b| {
        (h ^ u64::from(*b)).wrapping_mul(0x0100_0000_01b3)
    });
    format!("{hash:016x}")
}

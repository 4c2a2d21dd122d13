//! The directory of a study: finished runs, the reference, images, and what comes of them.
//!
//! `runs.jsonl` has the study's identity in its first line and a run in every further one. A process
//! that is killed can leave a torn last line, which is dropped; the run is then done again.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde_json::Value;

use super::identity::{Identity, ReferenceIdentity};
use super::run::Run;
use crate::error::{Action, Error, Result};
use crate::film::Film;
use crate::image::Picture;
use crate::input::read;
use crate::output::{atomic, npy};

/// An open directory.
#[derive(Debug)]
pub struct Store {
    directory: PathBuf,
    /// Of all images.
    size: [u32; 2],
    /// Runs that were found and those added since; for a series and a seed the last one counts that
    /// came to its end, or the last one.
    pub runs: Vec<Run>,
}

/// The file with the runs.
pub const RUNS: &str = "runs.jsonl";
/// The study's own reference.
pub const REFERENCE: &str = "reference.exr";
/// What is made of the runs at the end, in the order in which it is written.
pub const FILES: [&str; 5] = [
    "converge.csv",
    "converge.json",
    "error-time.svg",
    "error-spp.svg",
    "report.html",
];
/// The folder of images that the report is made of.
const IMAGES: &str = "images";
/// How the names of all of them end (`pictures::sample_image`).
const IMAGE: &str = "spp.npy";

impl Store {
    /// Opens a directory, which need not exist. Touches nothing if it is refused.
    ///
    /// # Errors
    /// [`Error::Usage`] with both facts if it holds another study, or other things; [`Error::File`] if it
    /// cannot be read or written.
    pub fn open(directory: &Path, identity: &Identity, fresh: bool) -> Result<Self> {
        let store = Self {
            directory: directory.to_owned(),
            size: identity.size,
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
            Err(source) => Err(file(Action::Read, &runs, source)),
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
        self.count(run);
        Ok(())
    }

    fn count(&mut self, run: Run) {
        let same = |r: &Run| (&r.series, r.seed) == (&run.series, run.seed);
        // One that was done again for its images alone, and cut short, takes nothing away.
        if run.complete || !self.runs.iter().any(|r| r.complete && same(r)) {
            self.runs.retain(|r| !same(r));
            self.runs.push(run);
        }
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

    /// An image that was kept; `None` if there is none of the study's size that can be read.
    #[must_use]
    pub fn image(&self, name: &str) -> Option<Picture> {
        let picture = read(&self.path(&image_path(name))).ok()?.picture;
        ([picture.width, picture.height] == self.size).then_some(picture)
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
        self.give_up(identity)?;
        self.make_images()?;
        self.write(RUNS, (json(identity) + "\n").as_bytes())?;
        Ok(self)
    }

    fn make_images(&self) -> Result<()> {
        let images = self.path(IMAGES);
        fs::create_dir_all(&images).map_err(|source| file(Action::Write, &images, source))
    }

    /// Removes what an older study wrote, and nothing else.
    fn give_up(&self, identity: &Identity) -> Result<()> {
        let mut old: Vec<PathBuf> = FILES.iter().map(|name| self.path(name)).collect();
        let reference = self.path(REFERENCE);
        // It may be the very file that this study is to be measured against.
        let is_given = match &identity.reference {
            ReferenceIdentity::File { path, .. } => same_file(path, &reference),
            ReferenceIdentity::Own { .. } => false,
        };
        if !is_given {
            old.push(reference);
        }
        let images = self.path(IMAGES);
        let unreadable = |source| file(Action::Read, &images, source);
        match fs::read_dir(&images) {
            Ok(entries) => {
                for entry in entries {
                    let path = entry.map_err(unreadable)?.path();
                    let name = path.file_name().unwrap_or_default();
                    if name.to_string_lossy().ends_with(IMAGE) {
                        old.push(path);
                    }
                }
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Err(error) => return Err(unreadable(error)),
        }
        for path in old {
            match fs::remove_file(&path) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => {
                    return Err(file(Action::Remove, &path, error));
                }
                _ => {}
            }
        }
        Ok(())
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
        let first: Value = lines
            .next()
            .and_then(|(_, line)| serde_json::from_str(line).ok())
            .ok_or_else(|| damaged(1))?;
        if let Some(difference) = identity.differs(&first) {
            return Err(Error::Usage(format!(
                "the directory {} holds a {difference}; choose another directory with -o, or start over \
                 with --fresh",
                self.directory.display()
            )));
        }
        let there: Identity = serde_json::from_value(first).map_err(|_| damaged(1))?;
        for (index, line) in lines {
            let run: Run = serde_json::from_str(line).map_err(|_| damaged(index + 1))?;
            self.count(run);
        }
        let runs = text.split_once('\n').map_or("", |(_, runs)| runs);
        let joined = identity.joined(&there);
        if joined != there {
            self.write(RUNS, format!("{}\n{runs}", json(&joined)).as_bytes())?;
        } else if whole < bytes.len() {
            // What follows must not be joined to the torn line.
            self.write(RUNS, &bytes[..whole])?;
        }
        self.make_images()?;
        Ok(self)
    }

    fn append(&self, line: &str) -> Result<()> {
        let path = self.path(RUNS);
        let appended = OpenOptions::new()
            .append(true)
            .open(&path)
            .and_then(|mut file: File| file.write_all(format!("{line}\n").as_bytes()));
        appended.map_err(|source| file(Action::Write, &path, source))
    }
}

/// What rendered the reference of the study in a directory, if there is one and it is its own.
#[must_use]
pub fn backend_of_reference(directory: &Path) -> Option<String> {
    let bytes = fs::read(directory.join(RUNS)).ok()?;
    let line = bytes.split(|b| *b == b'\n').next()?;
    let identity: Identity = serde_json::from_slice(line).ok()?;
    match identity.reference {
        ReferenceIdentity::Own { backend, .. } => Some(backend),
        ReferenceIdentity::File { .. } => None,
    }
}

fn image_path(name: &str) -> String {
    format!("{IMAGES}/{name}.npy")
}

fn file(action: Action, path: &Path, source: io::Error) -> Error {
    Error::File {
        action,
        path: path.to_owned(),
        source,
    }
}

fn json(value: &impl Serialize) -> String {
    serde_json::to_string(value).expect("names and finite numbers")
}

/// Whether two paths lead to one file that is there.
fn same_file(a: &Path, b: &Path) -> bool {
    let [a, b] = [a, b].map(|path| path.canonicalize().ok());
    a.is_some() && a == b
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::super::run::Point;
    use super::super::series::{BackendKind, Key};
    use super::*;

    fn identity(reference: ReferenceIdentity) -> Identity {
        Identity {
            version: "1".into(),
            scene: "glass".into(),
            scene_hash: "0".into(),
            size: [2, 1],
            spp: 4,
            time: None,
            reference,
            threads: 0,
            gpu: None,
            kernels: BTreeMap::from([("bsdf".to_owned(), "1".to_owned())]),
        }
    }

    fn own() -> ReferenceIdentity {
        ReferenceIdentity::Own {
            backend: "cpu".into(),
            integrator: "bsdf".into(),
            spp: 16,
            seed: u64::MAX,
            max_bounces: 64,
        }
    }

    fn run(complete: bool, spp: u64) -> Run {
        Run {
            series: Key {
                integrator: "bsdf".into(),
                termination: None,
                sampler: "sobol".into(),
                backend: BackendKind::Cpu,
                offset: "exact".into(),
                max_bounces: 64,
                radiance_cache: false,
            },
            seed: 0,
            complete,
            device: "CPU".into(),
            setup: 0.0,
            compile: 0.0,
            non_finite: 0,
            points: vec![Point {
                spp,
                seconds: 1.0,
                mse: 1.0,
                relmse: 1.0,
                bias: 0.0,
                estimated: None,
            }],
        }
    }

    #[test]
    fn a_fresh_study_removes_what_studies_write_and_nothing_else() {
        let folder = tempfile::tempdir().expect("a folder");
        let directory = folder.path().join("s");
        let there = |name: &str| directory.join(name).exists();
        Store::open(&directory, &identity(own()), false).expect("a new study");
        let written = FILES
            .iter()
            .chain(&[REFERENCE, "images/bsdf-seed0-4spp.npy"]);
        let others = ["notes.txt", "images/mine.npy", "images/old/a-4spp.npy"];
        fs::create_dir(directory.join("images/old")).expect("a folder");
        for name in written.clone().copied().chain(others) {
            fs::write(directory.join(name), "old").expect("a file");
        }
        Store::open(&directory, &identity(own()), false).expect("the same study");
        assert!(written.clone().all(|name| there(name)));

        let given = ReferenceIdentity::File {
            path: directory.join(REFERENCE),
            hash: "0".into(),
        };
        Store::open(&directory, &identity(given), true).expect("a fresh study");
        assert!(there(REFERENCE), "it is what errors are measured against");
        Store::open(&directory, &identity(own()), true).expect("a fresh study");
        assert!(!written.clone().any(|name| there(name)));
        assert!(others.iter().all(|name| there(name)));
    }

    #[test]
    fn a_run_that_is_cut_short_replaces_no_whole_one() {
        let folder = tempfile::tempdir().expect("a folder");
        let open = || Store::open(folder.path(), &identity(own()), false).expect("a study");
        let mut store = open();
        for (run, counts) in [
            (run(false, 1), (false, 1)),
            (run(true, 2), (true, 2)),
            (run(false, 3), (true, 2)),
            (run(true, 4), (true, 4)),
        ] {
            store.add(run).expect("written");
            for runs in [&store.runs, &open().runs] {
                assert_eq!(runs.len(), 1);
                assert_eq!((runs[0].complete, runs[0].points[0].spp), counts);
            }
        }
    }

    #[test]
    fn a_gpu_joins_and_another_is_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let open = |gpu: Option<&str>| {
            let gpu = gpu.map(String::from);
            let identity = Identity {
                gpu,
                ..identity(own())
            };
            Store::open(folder.path(), &identity, false).map(|store| store.runs.len())
        };
        let refused = |gpu| open(Some(gpu)).expect_err("another").to_string();
        open(None).expect("a new study");
        let mut store = Store::open(folder.path(), &identity(own()), false).expect("a study");
        store.add(run(true, 4)).expect("written");
        assert_eq!(open(Some("a")).expect("the first GPU"), 1);
        assert!(refused("b").contains("another gpu: a there, b now"));
        assert_eq!(open(None).expect("the CPU alone"), 1);
        assert!(refused("b").contains("another gpu: a there, b now"));
        assert_eq!(open(Some("a")).expect("the same"), 1);
    }

    #[test]
    fn series_join_and_another_kernel_is_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let open = |kernels: &[(&str, &str)]| {
            let owned = |(way, hash): &(&str, &str)| ((*way).to_owned(), (*hash).to_owned());
            let identity = Identity {
                kernels: kernels.iter().map(owned).collect(),
                ..identity(own())
            };
            Store::open(folder.path(), &identity, false).map(drop)
        };
        let refused = |kernels| open(kernels).expect_err("another").to_string();
        open(&[("bsdf", "1")]).expect("a new study");
        assert!(refused(&[("bsdf", "2")]).contains("another kernel for bsdf: 1 there, 2 now"));
        open(&[("nee", "3")]).expect("another series");
        open(&[("bsdf", "1"), ("nee", "3")]).expect("both");
        // That of the series that has joined counts as well.
        let both = refused(&[("bsdf", "1"), ("nee", "4")]);
        assert!(
            both.contains("another kernel for nee: 3 there, 4 now"),
            "{both}"
        );

        let path = folder.path().join(RUNS);
        let text = fs::read_to_string(&path).expect("a file");
        let mut first: Value = serde_json::from_str(&text).expect("one line");
        first.as_object_mut().expect("members").remove("kernels");
        fs::write(&path, format!("{first}\n")).expect("a file");
        let old = refused(&[("bsdf", "1")]);
        assert!(
            old.contains("did not say which kernels") && old.contains("--fresh"),
            "{old}"
        );
    }

    #[test]
    fn images_of_another_size_are_none() {
        let folder = tempfile::tempdir().expect("a folder");
        let store = Store::open(folder.path(), &identity(own()), false).expect("a study");
        for (width, is_there) in [(2, true), (3, false)] {
            let picture = Picture::new(width, 1, vec![[1.0; 3]; width as usize]);
            store
                .write("images/a-4spp.npy", &npy::encode(&picture))
                .expect("written");
            assert_eq!(store.image("a-4spp").is_some(), is_there);
        }
    }
}

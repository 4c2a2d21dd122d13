//! The scene in a film file: what it was made from, and how it is made again.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::error::{Action, Error, Result};
use crate::scene::load::{Loaded, Source, load_str_in};
use crate::scene::particles::look::Look;
use crate::scene::{direct, file_hash};

/// What a scene was made from. The text of a scene file is an entry of its own.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SceneRecord {
    /// Its name.
    pub name: String,
    /// Hash of its content.
    pub hash: String,
    /// The absolute folder from which its files are named; `null` if it names none by a folder.
    pub folder: Option<String>,
    /// The files that it names.
    pub files: Vec<NamedFile>,
    /// How the only one of these, a particle file, is shown; `null` for a scene file.
    pub look: Option<Look>,
    /// The scene file; empty without one.
    #[serde(skip)]
    pub text: Arc<str>,
}

/// A file that a scene names.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NamedFile {
    /// The path, from the scene's folder.
    pub path: String,
    /// Hash of its bytes.
    pub hash: String,
}

impl SceneRecord {
    /// What is kept of a scene.
    ///
    /// # Errors
    /// [`Error::Usage`] if a path is no Unicode text, or a file is a pipe or a device, which cannot be read
    /// again; [`Error::File`] if one cannot be read.
    pub fn of(loaded: &Loaded) -> Result<Self> {
        let (file, look, text) = match &loaded.source {
            Source::Text { text, file } => (file.as_deref(), None, Arc::clone(text)),
            Source::Particles(look) => {
                let file = loaded.files.first().map(PathBuf::as_path);
                (file, Some(look.clone()), Arc::default())
            }
        };
        let folder = file.map(|file| file.parent().unwrap_or(Path::new("")));
        let files = loaded.files.iter().map(|file| {
            // They are named from the folder, unless by an absolute path.
            let path = folder.and_then(|folder| file.strip_prefix(folder).ok());
            NamedFile::of(file, path.unwrap_or(file))
        });
        Ok(Self {
            name: loaded.name.clone(),
            hash: loaded.hash.clone(),
            files: files.collect::<Result<_>>()?,
            folder: folder.map(absolute).transpose()?,
            look,
            text,
        })
    }

    /// Makes the scene again. Its files are looked for in its folder, then `beside` the film file, as where
    /// both came from another machine.
    ///
    /// # Errors
    /// [`Error::Usage`] if one of its files is missing or is another one now, or if this program makes
    /// another scene of them; [`Error::Scene`] if it makes none.
    pub fn load(&self, beside: &Path) -> Result<Loaded> {
        let own = self.folder.as_deref().map(Path::new);
        let there = |folder: &&Path| {
            let mut files = self.files.iter();
            files.all(|file| folder.join(&file.path).exists())
        };
        let known = own.into_iter().chain([beside]).find(there);
        let folder = known.or(own).unwrap_or(beside);
        for file in &self.files {
            file.check(folder, &self.name)?;
        }
        let loaded = match (&self.look, &self.files[..]) {
            (None, _) => load_str_in(&self.name, &self.text, folder)?,
            (Some(look), [file]) => direct::load(&folder.join(&file.path), look)?,
            (Some(_), _) => {
                let text = "the film file names no particle file, or several".to_owned();
                return Err(Error::Usage(text));
            }
        };
        if loaded.hash == self.hash {
            return Ok(loaded);
        }
        Err(Error::Usage(format!(
            "this version of gpu-trace makes another scene of {}: its content has the hash {}, and the samples \
             are of {}; render it anew",
            self.name, loaded.hash, self.hash
        )))
    }
}

impl NamedFile {
    fn of(file: &Path, path: &Path) -> Result<Self> {
        if file.exists() && !file.is_file() {
            return Err(Error::Usage(format!(
                "--checkpoint: {} is no regular file, and cannot be read again when the render goes on",
                file.display()
            )));
        }
        let hash = file_hash(file).map_err(|source| Error::File {
            action: Action::Read,
            path: file.to_owned(),
            source,
        })?;
        let path = unicode(path)?;
        Ok(Self { path, hash })
    }

    /// That the file is there and the same.
    fn check(&self, folder: &Path, scene: &str) -> Result<()> {
        let path = folder.join(&self.path);
        let hash = file_hash(&path).map_err(|error| {
            Error::Usage(format!(
                "cannot read {}, which the scene {scene} names: {error}; it is looked for in the scene's \
                 folder, and beside the film file",
                path.display()
            ))
        })?;
        if hash == self.hash {
            return Ok(());
        }
        Err(Error::Usage(format!(
            "{} has changed: the scene {scene} was rendered with one of the hash {}, and this one has {hash}",
            path.display(),
            self.hash
        )))
    }
}

/// A path that means the same from any folder, as a film file holds it.
///
/// # Errors
/// [`Error::Usage`] if it is no Unicode text.
pub fn absolute(path: &Path) -> Result<String> {
    // Of the file of a scene in this folder, the folder is no path at all.
    let path = if path == Path::new("") {
        Path::new(".")
    } else {
        path
    };
    let absolute = std::path::absolute(path);
    unicode(absolute.as_deref().unwrap_or(path))
}

fn unicode(path: &Path) -> Result<String> {
    path.to_str().map(String::from).ok_or_else(|| {
        Error::Usage(format!(
            "--checkpoint: the path {} cannot be kept in a film file, which holds Unicode text",
            path.display()
        ))
    })
}

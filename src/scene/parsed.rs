//! What is read from a scene file, and where the files are looked at that it names.

use std::path::{Path, PathBuf};

use super::Scene;

/// Where and when the files of a scene are looked at.
#[derive(Clone, Copy)]
pub(super) struct Place<'a> {
    /// The folder from which they are named.
    pub(super) folder: &'a Path,
    /// The frame of those that name none and have several.
    pub(super) frame: Option<u64>,
}

/// What a scene file holds.
pub(super) struct Parsed {
    pub(super) scene: Scene,
    /// See [`Loaded::files`](super::load::Loaded::files).
    pub(super) files: Vec<PathBuf>,
    /// See [`Loaded::frames`](super::load::Loaded::frames).
    pub(super) frames: Option<u64>,
}

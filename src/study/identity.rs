//! What makes a study the same study: only then do its runs say something about each other.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use serde_json::Value;

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

/// The first member in which two identities differ.
pub(super) fn differs<'a>(there: &Value, here: &'a Value) -> Option<&'a str> {
    let members = here.as_object()?;
    members
        .iter()
        .find(|(name, value)| there.get(name) != Some(value))
        .map(|(name, _)| name.as_str())
}

/// A value without JSON's quotes, for messages.
pub(super) fn plain(value: &Value) -> String {
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

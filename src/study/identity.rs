//! What makes a study the same study: only then do its runs say something about each other.

use std::collections::BTreeMap;
use std::hash::Hasher as _;
use std::path::PathBuf;

use fnv::FnvHasher;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::error::Result;
use crate::job::Job;
use crate::shader::{Stage, link};

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
    /// [`kernel_hash`] for each [way](super::series::Series::way) of the series and of the study's own
    /// reference: the version alone does not tell what a build renders. Empty in the files of builds that
    /// did not say.
    #[serde(default)]
    pub kernels: BTreeMap<String, String>,
}

impl Identity {
    /// Says in what the study `there`, the first line of a file, is another one, with both facts; `None`
    /// if it is the same. Runs on a GPU can join those on the CPU, and the other way round; two GPUs differ.
    /// Series can join as well, but none is rendered by two kernels.
    ///
    /// # Panics
    /// Never: no member can fail to serialise.
    pub(super) fn differs(&self, there: &Value) -> Option<String> {
        let here = serde_json::to_value(self).expect("names and numbers");
        let members = here.as_object()?.iter().find(|(name, value)| {
            let there = there.get(name.as_str());
            let joins = value.is_null() || there.is_some_and(Value::is_null);
            match name.as_str() {
                "kernels" => false,
                "gpu" if joins => false,
                _ => there != Some(value),
            }
        });
        if let Some((name, value)) = members {
            return Some(another(name, there.get(name), value));
        }
        let Some(kernels) = there.get("kernels") else {
            return Some("study by a build that did not say which kernels it had".into());
        };
        let (way, value) = here["kernels"].as_object()?.iter().find(|(way, value)| {
            let there = kernels.get(way.as_str());
            there.is_some_and(|there| there != *value)
        })?;
        let name = format!("kernel for {way}");
        Some(another(&name, kernels.get(way), value))
    }

    /// This study together with what has been rendered of it already.
    pub(super) fn joined(&self, there: &Self) -> Self {
        let mut joined = self.clone();
        joined.gpu = joined.gpu.or_else(|| there.gpu.clone());
        joined.kernels.extend(there.kernels.clone());
        joined
    }
}

/// What tells a study from this one.
fn another(name: &str, there: Option<&Value>, here: &Value) -> String {
    let there = there.map_or("nothing".into(), plain);
    format!(
        "study with another {name}: {there} there, {} now",
        plain(here)
    )
}

/// The hash of the kernel that is linked for a scene and its effects.
///
/// # Errors
/// [`Error::Shader`](crate::error::Error::Shader) if it cannot be linked.
pub fn kernel_hash(job: &Job) -> Result<String> {
    let kernel = link(Stage::Path, job.scene(), job.placement(), job.effects())?;
    Ok(hash(kernel.wgsl.as_bytes()))
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
    let mut hasher = FnvHasher::default();
    hasher.write(bytes);
    format!("{:016x}", hasher.finish())
}

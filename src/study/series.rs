//! What is compared: series, each one combination of the ways to render.

use serde::{Deserialize, Serialize};

pub use crate::backend::BackendKind;
use crate::sampler::Sampler;
use crate::settings::{Integrator, Offset, Settings};
use crate::variance::VarianceClass;

/// One way to render; a run is a series with a seed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Series {
    /// The estimator.
    pub integrator: Integrator,
    /// How random numbers are placed.
    pub sampler: Sampler,
    /// What renders.
    pub backend: BackendKind,
    /// How a path leaves a surface.
    pub offset: Offset,
    /// The most scattering events of a path.
    pub max_bounces: u32,
    /// Whether diffuse surfaces reflect by values of cells.
    pub radiance_cache: bool,
}

/// A series and what is known of its variance beforehand.
#[derive(Clone, Copy, Debug)]
pub struct Subject {
    /// The series.
    pub series: Series,
    /// Whether its mean square error has a mean.
    pub variance: VarianceClass,
}

/// A series as files name it: runs belong to the series whose key is the same.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Key {
    /// Name of the integrator.
    pub integrator: String,
    /// Probability of termination of the lecture's estimator.
    pub termination: Option<f64>,
    /// Name of the sampler.
    pub sampler: String,
    /// What renders.
    pub backend: BackendKind,
    /// As in `--offset`.
    pub offset: String,
    /// The most scattering events of a path.
    pub max_bounces: u32,
    /// Whether there was a radiance cache; files from before it was there do not say.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub radiance_cache: bool,
}

impl Series {
    /// The settings of a run; all that a series does not say is as in `base`.
    #[must_use]
    pub fn settings(&self, base: &Settings, seed: u64) -> Settings {
        Settings {
            seed,
            max_bounces: self.max_bounces,
            radiance_cache: self.radiance_cache,
            integrator: self.integrator,
            sampler: self.sampler,
            offset: self.offset,
            ..base.clone()
        }
    }

    /// What names it in files.
    #[must_use]
    pub fn key(&self) -> Key {
        Key {
            integrator: self.integrator.name().into(),
            termination: match self.integrator {
                Integrator::Lecture { termination } => Some(termination),
                _ => None,
            },
            sampler: self.sampler.name().into(),
            backend: self.backend,
            offset: self.offset.to_string(),
            max_bounces: self.max_bounces,
            radiance_cache: self.radiance_cache,
        }
    }

    /// A name that any file system takes, another for each series.
    #[must_use]
    pub fn slug(&self) -> String {
        let Key {
            integrator,
            termination,
            sampler,
            backend,
            offset,
            max_bounces,
            radiance_cache,
        } = self.key();
        let cache = if radiance_cache { "-cache" } else { "" };
        let termination = termination.map_or_else(String::new, |p| format!("-{p:e}"));
        let offset = offset.replace([':', '+'], "");
        let backend = backend.name();
        format!("{integrator}{termination}-{sampler}-{backend}-{offset}-{max_bounces}{cache}")
    }

    /// What decides the kernel: all but what renders, for the f64 twin changes with it.
    #[must_use]
    pub fn way(&self) -> String {
        let Key {
            integrator,
            termination,
            sampler,
            backend: _,
            offset,
            max_bounces,
            radiance_cache,
        } = self.key();
        let cache = if radiance_cache { " cache" } else { "" };
        let termination = termination.map_or_else(String::new, |p| format!(" {p}"));
        format!("{integrator}{termination} {sampler} {offset} {max_bounces}{cache}")
    }

    /// The same paths in f64 without any nudge: what rounding and nudges are told by.
    #[must_use]
    pub fn truth(&self) -> Self {
        Self {
            backend: BackendKind::Cpu,
            offset: Offset::Exact,
            ..*self
        }
    }

    /// What tells series apart, in the order of labels; the usual offset needs no word.
    fn parts(&self) -> [String; 6] {
        [
            self.integrator.name().into(),
            self.sampler.name().into(),
            match self.backend {
                BackendKind::Gpu => "GPU f32".into(),
                BackendKind::Cpu => "CPU f64".into(),
            },
            match self.offset {
                Offset::Exact => String::new(),
                Offset::Back(x) => format!("back:{x:e}"),
                Offset::Out(x) => format!("out:{x:e}"),
                other => other.to_string(),
            },
            match self.max_bounces {
                1 => "1 bounce".into(),
                n => format!("{n} bounces"),
            },
            match self.radiance_cache {
                true => "radiance cache".into(),
                false => String::new(),
            },
        ]
    }
}

/// A short name for each series: only what differs between them.
#[must_use]
pub fn labels(series: &[Series]) -> Vec<String> {
    let parts: Vec<[String; 6]> = series.iter().map(Series::parts).collect();
    let differs = |i: usize| parts.iter().any(|p| p[i] != parts[0][i]);
    let mut shown: Vec<usize> = (0..6).filter(|i| differs(*i)).collect();
    if shown.is_empty() {
        shown = vec![0, 1];
    }
    let label = |p: &[String; 6]| {
        let words = shown.iter().map(|i| p[*i].as_str());
        let words: Vec<&str> = words.filter(|word| !word.is_empty()).collect();
        match words.is_empty() {
            true => "exact".to_owned(),
            false => words.join(" · "),
        }
    };
    parts.iter().map(label).collect()
}

/// All combinations, integrators varying slowest.
#[must_use]
pub fn product(
    integrators: &[Integrator],
    samplers: &[Sampler],
    backends: &[BackendKind],
    offsets: &[Offset],
    max_bounces: &[u32],
    caches: &[bool],
) -> Vec<Series> {
    let mut all = Vec::new();
    for &integrator in integrators {
        for &sampler in samplers {
            for &backend in backends {
                for &offset in offsets {
                    for &max_bounces in max_bounces {
                        all.extend(caches.iter().map(|&radiance_cache| Series {
                            integrator,
                            sampler,
                            backend,
                            offset,
                            max_bounces,
                            radiance_cache,
                        }));
                    }
                }
            }
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all() -> Vec<Series> {
        product(
            &[Integrator::Bsdf, Integrator::Lecture { termination: 0.25 }],
            &[Sampler::Sobol],
            &[BackendKind::Gpu, BackendKind::Cpu],
            &[Offset::Exact],
            &[64],
            &[false],
        )
    }

    #[test]
    fn labels_say_what_differs_and_no_more() {
        assert_eq!(
            labels(&all()),
            [
                "bsdf · GPU f32",
                "bsdf · CPU f64",
                "lecture · GPU f32",
                "lecture · CPU f64"
            ]
        );
        assert_eq!(labels(&all()[..1]), ["bsdf · sobol"]);
        let offsets =
            [Offset::Exact, Offset::Out(1.0e-4)].map(|offset| Series { offset, ..all()[0] });
        assert_eq!(labels(&offsets), ["exact", "out:1e-4"]);
        let cpu = all()[1];
        assert_eq!(
            labels(&[offsets[1], cpu]),
            ["GPU f32 · out:1e-4", "CPU f64"]
        );
    }

    #[test]
    fn keys_survive_files_and_slugs_differ() {
        let all = all();
        for series in &all {
            let text = serde_json::to_string(&series.key()).expect("JSON");
            let key: Key = serde_json::from_str(&text).expect("a key");
            assert_eq!(key, series.key());
        }
        let nudged = Series {
            offset: Offset::Out(1.0e-4),
            ..all[0]
        };
        let ended = Series {
            integrator: Integrator::Lecture { termination: 0.5 },
            ..all[2]
        };
        let cached = Series {
            radiance_cache: true,
            ..all[0]
        };
        let mut slugs: Vec<String> = all
            .iter()
            .chain([&nudged, &ended, &cached])
            .map(Series::slug)
            .collect();
        assert!(
            slugs.iter().all(|s| !s.contains([':', '/', ' '])),
            "{slugs:?}"
        );
        slugs.sort();
        slugs.dedup();
        assert_eq!(slugs.len(), 7);
    }
}

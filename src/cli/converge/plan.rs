//! From options to a study: everything is decided and checked before anything is rendered.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::fs;
use std::path::{Path, PathBuf};

use super::args::ConvergeArgs;
use crate::backend::{Backend, BackendKind};
use crate::cli::choices::Wanted;
use crate::error::{Action, Error, Result};
use crate::input::{Input, read};
use crate::job::prepare;
use crate::memory::{LEAST_PIXEL_BYTES, check_memory};
use crate::sampler::Sampler;
use crate::scene::{Loaded, builtin};
use crate::settings::{DEFAULT_TERMINATION, Integrator, Offset, Rect, Settings};
use crate::study::identity::{Identity, ReferenceIdentity, hash, kernel_hash};
use crate::study::plan::{ReferenceChoice, Study, check_cache, check_reference};
use crate::study::presets::{Preset, preset};
use crate::study::run::Length;
use crate::study::series::{Series, Subject, product};
use crate::study::store::{Store, backend_of_reference};

/// Longer side of an image where nobody says: errors are per pixel, and hardly depend on it.
const SIDE: u32 = 160;
/// Samples a pixel where nobody says.
const SPP: u64 = 1024;
/// Runs of each series where nobody says.
const SEEDS: u64 = 8;
/// The reference's samples are so many times the largest number: its noise is subtracted, so that more
/// would change little.
const LONGER: u64 = 4;
/// The seed of the study's own reference: no run may have it.
const REFERENCE_SEED: u64 = u64::MAX;

/// A study and where it goes.
pub(super) struct Plan {
    pub(super) study: Study,
    pub(super) directory: PathBuf,
}

impl Plan {
    /// All runs.
    pub(super) fn count(&self) -> usize {
        self.study.seeds.clone().count() * self.study.subjects.len()
    }

    /// Runs that an earlier process has finished.
    pub(super) fn already_there(&self, store: &Store) -> usize {
        let study = &self.study;
        let done = |seed| {
            let all = 0..study.subjects.len();
            all.filter(|i| study.is_done(store, *i, seed)).count()
        };
        study.seeds.clone().map(done).sum()
    }
}

/// Decides everything.
pub(super) fn plan(args: &ConvergeArgs, warnings: &mut Vec<String>) -> Result<Plan> {
    let preset = args.study.and_then(preset);
    let scene = args.scene.as_deref().or(preset.map(|p| p.scene));
    let loaded = builtin::resolve(scene)?;
    let bare = |warning: &String| warning.trim_start_matches("warning: ").to_owned();
    warnings.extend(loaded.warnings.iter().map(bare));
    let spp = args.spp.or(preset.map(|p| p.spp)).unwrap_or(SPP);
    let base = base(args, &loaded, preset);
    check_memory(&base.crop, LEAST_PIXEL_BYTES)?;
    let count = args.seeds.or(preset.map(|p| p.seeds)).unwrap_or(SEEDS);
    let end = args.seed.checked_add(count).ok_or_else(|| {
        Error::Usage(format!(
            "--seed {}: {count} seeds from there go beyond 2^64 - 1",
            args.seed
        ))
    })?;
    let seeds = args.seed..end;
    let file = args.reference.as_deref();
    let file = file
        .map(|path| reference_file(path, &loaded, &base, &seeds))
        .transpose()?;
    let backends = backends(args, preset, warnings)?;
    let series = series(args, &base, preset, &backends.kinds)?;
    let mut subjects = Vec::new();
    let mut kernels = BTreeMap::new();
    for series in series {
        let settings = series.settings(&base, args.seed);
        let job = prepare(&loaded.scene, &settings)?;
        match job.cache_obstacle() {
            Some(why) if args.radiance_cache.is_empty() => {
                warnings.push(format!("no radiance cache: {why}"));
                continue;
            }
            _ => check_cache(&loaded, &job)?,
        }
        if let Entry::Vacant(kernel) = kernels.entry(series.way()) {
            kernel.insert(kernel_hash(&job)?);
        }
        subjects.push(Subject {
            series,
            variance: job.variance().class,
        });
    }
    let directory = args.output.clone().unwrap_or_else(|| {
        let what = preset.map_or("converge", |p| p.name);
        PathBuf::from(format!("{}-{what}", loaded.name))
    });
    let (reference, reference_identity) = match file {
        Some((input, hash)) => {
            warnings.extend(
                input
                    .notes
                    .iter()
                    .map(|note| format!("{}: {note}", input.path.display())),
            );
            let identity = ReferenceIdentity::File {
                path: input.path.clone(),
                hash,
            };
            (ReferenceChoice::File(Box::new(input)), identity)
        }
        None => {
            let kind = reference_backend(args, preset, &backends, &directory);
            own_reference(args, preset, &base, &subjects, spp, kind)
        }
    };
    if let ReferenceChoice::Own { series, seed, .. } = &reference
        && let Entry::Vacant(kernel) = kernels.entry(series.way())
    {
        let job = prepare(&loaded.scene, &series.settings(&base, *seed))?;
        kernel.insert(kernel_hash(&job)?);
    }
    let rect = base.crop;
    let identity = Identity {
        version: env!("CARGO_PKG_VERSION").into(),
        scene: loaded.name.clone(),
        scene_hash: loaded.hash.clone(),
        size: [rect.width, rect.height],
        spp,
        time: args.time.map(|t| t.as_secs_f64()),
        reference: reference_identity,
        threads: args.threads.map_or(0, usize::from),
        gpu: backends.gpu,
        kernels,
    };
    let shown = preset.map_or(&[][..], |p| p.shown).iter().copied();
    Ok(Plan {
        study: Study {
            title: preset.map_or("Error against time", |p| p.title).into(),
            subjects,
            seeds,
            length: Length {
                spp,
                seconds: identity.time,
            },
            reference,
            shown: shown.filter(|n| *n <= spp).collect(),
            exposure: args.exposure,
            command: command(),
            identity,
            loaded,
            base,
        },
        directory,
    })
}

fn base(args: &ConvergeArgs, loaded: &Loaded, preset: Option<&Preset>) -> Settings {
    let mut settings = Settings::for_scene(&loaded.scene);
    let side = preset.map_or(SIDE, |p| p.side);
    let (width, height) = (loaded.scene.width, loaded.scene.height);
    let scale = (f64::from(side) / f64::from(width.max(height))).min(1.0);
    let small = |n: u32| ((f64::from(n) * scale).round() as u32).max(1);
    (settings.width, settings.height) = args.size.unwrap_or((small(width), small(height)));
    settings.crop = Rect::whole(settings.width, settings.height);
    settings
}

/// What renders, once it is known what there is.
struct Backends {
    kinds: Vec<BackendKind>,
    /// The GPU's name, if one is used or could be.
    gpu: Option<String>,
}

fn backends(
    args: &ConvergeArgs,
    preset: Option<&Preset>,
    warnings: &mut Vec<String>,
) -> Result<Backends> {
    let wanted: Vec<Wanted> = match preset {
        _ if !args.backends.is_empty() => args.backends.clone(),
        Some(preset) if !preset.backends.is_empty() => {
            preset.backends.iter().copied().map(Wanted::Only).collect()
        }
        _ => vec![Wanted::Auto],
    };
    let is = |kind| move |wanted: &Wanted| *wanted == Wanted::Only(kind);
    if args.device.is_some() && wanted.iter().all(is(BackendKind::Cpu)) {
        return Err(Error::Usage(
            "--device chooses a GPU, --backends cpu uses none".into(),
        ));
    }
    let mut found = Backends {
        kinds: Vec::new(),
        gpu: None,
    };
    let reference = args.reference_backend.filter(is(BackendKind::Gpu));
    for choice in wanted.iter().copied().chain(reference) {
        let opened = Backend::open(&args.choice(choice), warnings)?;
        if let Backend::Gpu(gpu) = &opened {
            found.gpu = Some(gpu.summary.name.clone());
        }
        let kind = opened.kind();
        if !found.kinds.contains(&kind) && found.kinds.len() < wanted.len() {
            found.kinds.push(kind);
        }
    }
    Ok(found)
}

/// The series, without repetitions.
fn series(
    args: &ConvergeArgs,
    base: &Settings,
    preset: Option<&Preset>,
    backends: &[BackendKind],
) -> Result<Vec<Series>> {
    let termination = args.termination.unwrap_or(DEFAULT_TERMINATION);
    let mut integrators: Vec<Integrator> = match preset {
        _ if !args.integrators.is_empty() => args.integrators.clone(),
        Some(preset) if preset.integrators.is_empty() => vec![base.integrator],
        Some(preset) => preset.integrators.to_vec(),
        None => vec![Integrator::Path, Integrator::Lecture { termination }],
    };
    for integrator in &mut integrators {
        *integrator = integrator.with_termination(termination);
    }
    if args.termination.is_some() && !integrators.iter().any(|i| i.is_lecture()) {
        return Err(Error::Usage(
            "--termination is the lecture's: add lecture to --integrators".into(),
        ));
    }
    let samplers = match preset {
        None if args.samplers.is_empty() => Sampler::ALL.to_vec(),
        _ => or(
            args.samplers.clone(),
            preset.map(|p| p.samplers),
            Sampler::default(),
        ),
    };
    let offsets = or(
        args.offsets.clone(),
        preset.map(|p| p.offsets),
        Offset::Exact,
    );
    let bounces = or(args.max_bounces.clone(), None, base.max_bounces);
    let caches = or(args.radiance_cache.clone(), preset.map(|p| p.caches), false);
    let exact_on_cpu = preset.is_some_and(|p| p.exact_on_cpu) && args.backends.is_empty();
    let mut all: Vec<Series> = Vec::new();
    for series in product(
        &integrators,
        &samplers,
        backends,
        &offsets,
        &bounces,
        &caches,
    ) {
        let nudged_cpu =
            exact_on_cpu && series.backend == BackendKind::Cpu && series.offset != Offset::Exact;
        // The cache is that of `path`, and of scrambles.
        let is_other = series.integrator != Integrator::Path || series.sampler != Sampler::Sobol;
        let left_out = nudged_cpu || (series.radiance_cache && is_other);
        if !left_out && !all.contains(&series) {
            all.push(series);
        }
    }
    Ok(all)
}

/// What was given, or the study's, or the one default.
fn or<T: Copy>(given: Vec<T>, preset: Option<&[T]>, default: T) -> Vec<T> {
    match preset {
        _ if !given.is_empty() => given,
        Some(preset) if !preset.is_empty() => preset.to_vec(),
        _ => vec![default],
    }
}

/// What renders the study's own reference, unless somebody says: what rendered the one that is there,
/// so that a study can go on with the GPU where it began without.
fn reference_backend(
    args: &ConvergeArgs,
    preset: Option<&Preset>,
    backends: &Backends,
    directory: &Path,
) -> BackendKind {
    if let Some(kind) = args.reference_backend.and_then(Wanted::kind) {
        return kind;
    }
    if let Some(kind) = preset.and_then(|p| p.reference) {
        return kind;
    }
    let there = match args.fresh {
        true => None,
        false => backend_of_reference(directory),
    };
    match there.and_then(|name| BackendKind::of_name(&name)) {
        Some(kind) => kind,
        None if backends.gpu.is_some() => BackendKind::Gpu,
        None => BackendKind::Cpu,
    }
}

/// The study's own reference: the scene's usual estimator with the best sampler and the most bounces, so
/// that a lower limit shows as the bias that it is.
fn own_reference(
    args: &ConvergeArgs,
    preset: Option<&Preset>,
    base: &Settings,
    subjects: &[Subject],
    spp: u64,
    backend: BackendKind,
) -> (ReferenceChoice, ReferenceIdentity) {
    let bounces = subjects.iter().map(|s| s.series.max_bounces).max();
    let series = Series {
        integrator: base.integrator,
        sampler: Sampler::Sobol,
        backend,
        offset: Offset::Exact,
        max_bounces: base.max_bounces.max(bounces.unwrap_or(0)),
        radiance_cache: false,
    };
    let usual = match preset {
        Some(preset) if args.spp.is_none() => preset.reference_spp,
        _ => spp.saturating_mul(LONGER).max(SPP),
    };
    let spp = args.reference_spp.unwrap_or(usual);
    let seed = REFERENCE_SEED;
    let identity = ReferenceIdentity::Own {
        backend: backend.name().into(),
        integrator: series.integrator.name().into(),
        spp,
        seed,
        max_bounces: series.max_bounces,
    };
    (ReferenceChoice::Own { series, spp, seed }, identity)
}

/// The reference in a file, and the hash of its bytes.
fn reference_file(
    path: &Path,
    loaded: &Loaded,
    base: &Settings,
    seeds: &std::ops::Range<u64>,
) -> Result<(Input, String)> {
    let input = read(path)?;
    check_reference(&input, loaded, base, seeds)?;
    let bytes = fs::read(path).map_err(|source| Error::File {
        action: Action::Read,
        path: path.to_owned(),
        source,
    })?;
    Ok((input, hash(&bytes)))
}

/// What was typed, as a shell takes it.
fn command() -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./:,=%+".contains(c);
    let quoted = |word: String| match !word.is_empty() && word.chars().all(plain) {
        true => word,
        false => format!("'{}'", word.replace('\'', "'\\''")),
    };
    let words = std::env::args_os()
        .skip(1)
        .map(|w| quoted(w.to_string_lossy().into_owned()));
    std::iter::once("gpu-trace".to_owned())
        .chain(words)
        .collect::<Vec<_>>()
        .join(" ")
}

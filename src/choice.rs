//! Which estimator pays on a scene: what `--integrator auto` and `--radiance-cache auto` take.
//!
//! Sampling lights costs time at every vertex, and is worth it where it takes out more variance than that. A pilot of its
//! own, of the f64 reference on a small image with a fixed seed, estimates the variance of a sample with and without,
//! and counts what a sample costs: nothing is timed, so that the same scene chooses the same on every device, at every
//! seed, and in every part of a render. As Grittmann et al., "Efficiency-Aware Multiple Importance Sampling" (SIGGRAPH
//! 2022), choose among techniques; here the kernel then holds what was chosen alone.

use glam::DVec3;

use crate::backend::cpu::ReferenceRenderer;
use crate::effects::{Effect, cache_obstacle};
use crate::error::Result;
use crate::film::{Estimate, Film, LEAST_SAMPLES};
use crate::job::{Job, prepare};
use crate::placement::Placement;
use crate::reference::path::PathTracer;
use crate::reference::state::Cache;
use crate::reference::survey::survey;
use crate::render::render_quietly;
use crate::sampler::Sampler;
use crate::scene::Scene;
use crate::settings::{GeometryChoice, Integrator, Rect, Settings};
use crate::variance::VarianceClass;

/// An estimator to choose from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Candidate {
    /// `path`: the one that is taken in doubt.
    Path,
    /// `bsdf`.
    Bsdf,
    /// `path` with the radiance cache.
    RadianceCache,
}

impl Candidate {
    /// The estimator.
    #[must_use]
    pub fn integrator(self) -> Integrator {
        match self {
            Self::Path | Self::RadianceCache => Integrator::Path,
            Self::Bsdf => Integrator::Bsdf,
        }
    }

    /// Its name in tables and files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::RadianceCache => "path, cache",
            other => other.integrator().name(),
        }
    }

    /// The settings with it.
    #[must_use]
    pub fn settings(self, settings: &Settings) -> Settings {
        Settings {
            integrator: self.integrator(),
            radiance_cache: self == Self::RadianceCache,
            ..settings.clone()
        }
    }
}

/// What is left to the scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Open {
    /// Whether lights are sampled.
    pub integrator: bool,
    /// Whether there is a radiance cache.
    pub radiance_cache: bool,
}

impl Open {
    /// What may be taken in the place of `path`, where `settings` have that for what is left to the scene.
    #[must_use]
    pub fn rivals(self, settings: &Settings) -> Vec<Candidate> {
        // Who says how lights are sampled wants them to be sampled, and the radiance cache and images of lamps are those
        // of `path`.
        let is_path =
            settings.light_sampling.is_some() || settings.radiance_cache || settings.lamp_images;
        let rivals = [
            (Candidate::Bsdf, self.integrator && !is_path),
            (
                Candidate::RadianceCache,
                self.radiance_cache && settings.integrator == Integrator::Path,
            ),
        ];
        let rivals = rivals.into_iter().filter(|(_, is)| *is);
        rivals.map(|(candidate, _)| candidate).collect()
    }
}

/// Samples a pixel of a pilot: from so many on an error is known.
const SAMPLES: u64 = LEAST_SAMPLES;

/// Pixels of a pilot's image, at most and at least: of fewer, too few to tell two variances apart.
const PIXELS: [f64; 2] = [64.0, 1024.0];

/// Rays against spheres that both pilots may test together, some .3 s on two cores.
const TESTS: f64 = 5.0e7;

/// Paths of which rays and connections are counted.
const COUNTED: u32 = 256;

/// What a connection costs, the choice of a light and a direction to it, the BSDF's value and the shadow ray, as a multiple
/// of what a ray costs with all that follows from it where it arrives: with spheres as constants or in a list, and in a
/// tree. Measured (`benches/RESULTS.md`); devices differ, but a choice must not.
const CONNECTION: [f64; 2] = [1.0, 2.0];

/// What it costs to ask a cell for its value and to correct that at times, beside the rays. Measured on two scenes
/// (`benches/RESULTS.md`).
const LOOKUP: f64 = 3.5;

/// Samples of the batch for which pilots of the radiance cache are counted: the second length.
const BATCH: u64 = 16;

/// Standard errors of their difference by which the means of two unbiased pilots may be apart.
const APART: f64 = 3.5;

/// What a pilot has found of an estimator.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// The estimator.
    pub candidate: Candidate,
    /// Variance of a sample over the square of the pixel, averaged over the image as the error is
    /// ([`Estimate::error`]); infinite where the pilot was black.
    pub relative_variance: f64,
    /// Rays a path that go on from a vertex or the camera.
    pub rays: f64,
    /// Connections with lights a path.
    pub connections: f64,
    /// Cells a path that are asked for their values.
    pub lookups: f64,
    /// What a path costs, in units of a ray's.
    pub cost: f64,
    /// Why the variance may be another one than the pilot says; `path` alone is chosen with a doubt.
    pub doubt: Option<String>,
}

impl Trial {
    /// Cost times variance: what an error takes.
    #[must_use]
    pub fn effort(&self) -> f64 {
        self.cost * self.relative_variance
    }
}

/// An estimator, and why.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// The one chosen.
    pub candidate: Candidate,
    /// What was found of each; empty where the scene left no choice.
    pub trials: Vec<Trial>,
    /// Why there was no pilot, if there was none.
    pub without_pilot: Option<&'static str>,
}

impl Choice {
    fn without_pilot(why: &'static str) -> Self {
        Self {
            candidate: Candidate::Path,
            trials: Vec::new(),
            without_pilot: Some(why),
        }
    }
}

/// Chooses for a scene as `settings` would render it: a function of the scene, the image's size, the sampler, and how paths
/// leave surfaces and where they end. Not of the geometry's form, which changes no image. `rivals`: what may be taken in the
/// place of `path`.
///
/// # Errors
/// Those of [`prepare`], and of the reference's threads.
pub fn choose(scene: &Scene, settings: &Settings, rivals: &[Candidate]) -> Result<Choice> {
    let spheres = scene.spheres.len() as f64;
    let affordable = |rays: f64| TESTS / (spheres * rays * (2 * SAMPLES) as f64);
    let too_large = "there are more spheres than a pilot can look at";
    // Before anything is placed, which takes seconds where spheres are many.
    if affordable(1.0) < PIXELS[0] {
        return Ok(Choice::without_pilot(too_large));
    }
    let job = |integrator, pixels: f64| prepare(scene, &pilot(settings, integrator, pixels));
    let whole = job(Integrator::Path, PIXELS[1])?;
    if !whole.effects().samples_light() {
        return Ok(Choice::without_pilot("nothing here is sampled as a light"));
    }
    let counted = counts(&whole, None);
    let Counts {
        rays, connections, ..
    } = counted;
    let pixels = affordable(rays + connections).min(PIXELS[1]);
    if pixels < PIXELS[0] {
        return Ok(Choice::without_pilot(too_large));
    }
    let per_connection = CONNECTION[usize::from(whole.effects().has(Effect::Bvh))];
    let cost = |c: &Counts| c.rays + per_connection * c.connections + LOOKUP * c.lookups;
    let mut trials = Vec::new();
    let mut films: Vec<Film> = Vec::new();
    for &candidate in std::iter::once(&Candidate::Path).chain(rivals) {
        let job = job(candidate.integrator(), pixels)?;
        let (job, values) = match candidate {
            Candidate::RadianceCache => match with_cells(scene, settings, job) {
                None => continue,
                Some((job, values)) => (job, Some(values)),
            },
            _ => (job, None),
        };
        let counts = match candidate {
            Candidate::Path => counted,
            Candidate::Bsdf => Counts {
                connections: 0.0,
                ..counted
            },
            Candidate::RadianceCache => counts(&job, values.as_deref()),
        };
        // A pilot's paths are plain ones.
        let pilots = job.cells().map_or(0.0, |cells| cells.share(BATCH)) * cost(&counted);
        let mut renderer = ReferenceRenderer::new(&job, 0)?;
        if let Some(values) = values {
            renderer = renderer.with_values(values);
        }
        let film = render_quietly(&mut renderer, job.settings())?.film;
        trials.push(Trial {
            candidate,
            relative_variance: relative_variance(&film),
            rays: counts.rays,
            connections: counts.connections,
            lookups: counts.lookups,
            cost: cost(&counts) + pilots,
            doubt: doubt(&job, &film, films.first()),
        });
        films.push(film);
    }
    let sure = trials.iter().skip(1).filter(|trial| trial.doubt.is_none());
    let best = sure.fold(&trials[0], |best, trial| {
        if trial.effort() <= best.effort() {
            trial
        } else {
            best
        }
    });
    Ok(Choice {
        candidate: best.candidate,
        trials,
        without_pilot: None,
    })
}

/// The settings of a pilot on an image of about so many pixels.
fn pilot(settings: &Settings, integrator: Integrator, pixels: f64) -> Settings {
    let [width, height] = [settings.width, settings.height].map(f64::from);
    let scale = (pixels / (width * height)).sqrt().min(1.0);
    let [width, height] = [width, height].map(|side| ((side * scale) as u32).max(1));
    Settings {
        width,
        height,
        crop: Rect::whole(width, height),
        samples: 0..SAMPLES,
        seed: 0,
        integrator,
        radiance_cache: false,
        geometry: GeometryChoice::Auto,
        view: None,
        adaptive: false,
        classes: false,
        features: false,
        error: None,
        time: None,
        ..settings.clone()
    }
}

/// The job of a pilot with the cells that the image as `settings` have it would use, and values for them: the same for all
/// batches, since they are most of what a pilot takes. What they add to the variance, some twentieth, is left out. `None` where there
/// is no radiance cache.
fn with_cells(scene: &Scene, settings: &Settings, job: Job) -> Option<(Job, Vec<DVec3>)> {
    let settings = Candidate::RadianceCache.settings(settings);
    let placement = Placement::new(scene, settings.width, settings.height);
    if cache_obstacle(scene, &placement, &settings).is_some() {
        return None;
    }
    let cells = survey(scene, &placement, &settings);
    let tracer = PathTracer::new(job.scene(), job.placement(), job.settings());
    let (values, _) = tracer.pilot(&cells, 0, Sampler::Sobol.batch(0));
    Some((job.with_cells(cells), values))
}

/// What a path takes, in the mean.
#[derive(Clone, Copy, Debug, Default)]
struct Counts {
    rays: f64,
    connections: f64,
    lookups: f64,
}

/// What paths all over the image take; `values`: of the job's cells.
fn counts(job: &Job, values: Option<&[DVec3]>) -> Counts {
    let settings = job.settings();
    let tracer = PathTracer {
        cache: job
            .cells()
            .zip(values)
            .map(|(cells, values)| Cache { cells, values }),
        ..PathTracer::new(job.scene(), job.placement(), settings)
    };
    let pixels = settings.crop.pixels() as u32;
    let spheres = job.scene().spheres.len() as f64;
    let (mut sums, mut traced) = (Counts::default(), 0.0);
    for i in 0..COUNTED {
        // Paths that never end, as without roulette, are few enough to say that a pilot would take too long.
        if (sums.rays + sums.connections) * spheres > TESTS {
            break;
        }
        traced += 1.0;
        let pixel = (u64::from(i) * u64::from(pixels) / u64::from(COUNTED)) as u32;
        let path = tracer.trace([pixel % settings.width, pixel / settings.width], 0);
        sums.rays += f64::from(path.rays - path.shadow_rays);
        sums.connections += f64::from(path.connections);
        sums.lookups += f64::from(path.lookups);
    }
    Counts {
        rays: sums.rays / traced,
        connections: sums.connections / traced,
        lookups: sums.lookups / traced,
    }
}

fn relative_variance(film: &Film) -> f64 {
    let error = Estimate::of(film).error;
    error.map_or(f64::INFINITY, |error| error * error * SAMPLES as f64)
}

/// Why a film's variance may be another one; `other`: of the same image by a surer way.
fn doubt(job: &Job, film: &Film, other: Option<&Film>) -> Option<String> {
    if job.variance().class != VarianceClass::Finite {
        return Some("samples have a heavy tail".into());
    }
    let Some(trust) = Estimate::of(film).trust else {
        return Some("the pilot is black".into());
    };
    if !trust.is_good() {
        return Some(trust.verdict(false).why.join("; "));
    }
    let [mean, error] = image_mean(film);
    let [truth, more] = image_mean(other?);
    let apart = (mean - truth).abs() > APART * error.hypot(more);
    apart.then(|| "it has missed light that the other has met".into())
}

/// The image's mean over pixels and channels, and its standard error.
fn image_mean(film: &Film) -> [f64; 2] {
    let pixels = film.rect().pixels();
    let mean: f64 = (0..pixels).flat_map(|i| film.mean(i)).sum();
    // Channels of a pixel vary together.
    let deviation = |i: usize| {
        let variance = film.variance_of_mean(i).unwrap_or([f64::INFINITY; 3]);
        variance.map(f64::sqrt).iter().sum::<f64>()
    };
    let variance: f64 = (0..pixels).map(|i| deviation(i).powi(2)).sum();
    let values = 3.0 * pixels as f64;
    [mean / values, variance.sqrt() / values]
}

//! Which estimator pays on a scene: what `--integrator auto` takes.
//!
//! Sampling lights costs time at every vertex, and is worth it where it takes out more variance than that. A pilot of its
//! own, of the f64 reference on a small image with a fixed seed, estimates the variance of a sample with and without,
//! and counts what a sample costs: nothing is timed, so that the same scene chooses the same on every device, at every
//! seed, and in every part of a render. As Grittmann et al., "Efficiency-Aware Multiple Importance Sampling" (SIGGRAPH
//! 2022), choose among techniques; here the kernel then holds what was chosen alone.

use crate::effects::Effect;
use crate::error::Result;
use crate::film::{Estimate, Film, LEAST_SAMPLES};
use crate::job::{Job, prepare};
use crate::reference::path::PathTracer;
use crate::reference::renderer::ReferenceRenderer;
use crate::render::render_quietly;
use crate::scene::Scene;
use crate::settings::{GeometryChoice, Integrator, Rect, Settings};
use crate::variance::VarianceClass;

/// The estimators to choose from, the one that is taken in doubt first.
const CANDIDATES: [Integrator; 2] = [Integrator::Path, Integrator::Bsdf];

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

/// Standard errors of their difference by which the means of two unbiased pilots may be apart.
const APART: f64 = 3.5;

/// What a pilot has found of an estimator.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// The estimator.
    pub integrator: Integrator,
    /// Variance of a sample over the square of the pixel, averaged over the image as the error is
    /// ([`Estimate::error`]); infinite where the pilot was black.
    pub relative_variance: f64,
    /// Rays a path that go on from a vertex or the camera.
    pub rays: f64,
    /// Connections with lights a path.
    pub connections: f64,
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
    pub integrator: Integrator,
    /// What was found of each; empty where the scene left no choice.
    pub trials: Vec<Trial>,
    /// Why there was no pilot, if there was none.
    pub without_pilot: Option<&'static str>,
}

impl Choice {
    fn without_pilot(why: &'static str) -> Self {
        Self {
            integrator: CANDIDATES[0],
            trials: Vec::new(),
            without_pilot: Some(why),
        }
    }
}

/// Chooses for a scene as `settings` would render it: a function of the scene, the image's size, the sampler, and how paths
/// leave surfaces and where they end. Not of the geometry's form, which changes no image.
///
/// # Errors
/// Those of [`prepare`], and of the reference's threads.
pub fn choose(scene: &Scene, settings: &Settings) -> Result<Choice> {
    let spheres = scene.spheres.len() as f64;
    let affordable = |rays: f64| TESTS / (spheres * rays * (2 * SAMPLES) as f64);
    let too_large = "there are more spheres than a pilot can look at";
    // Before anything is placed, which takes seconds where spheres are many.
    if affordable(1.0) < PIXELS[0] {
        return Ok(Choice::without_pilot(too_large));
    }
    let job = |integrator, pixels: f64| prepare(scene, &pilot(settings, integrator, pixels));
    let whole = job(CANDIDATES[0], PIXELS[1])?;
    if !whole.effects().samples_light() {
        return Ok(Choice::without_pilot("nothing here is sampled as a light"));
    }
    let [rays, connections] = counts(&whole);
    let pixels = affordable(rays + connections).min(PIXELS[1]);
    if pixels < PIXELS[0] {
        return Ok(Choice::without_pilot(too_large));
    }
    let per_connection = CONNECTION[usize::from(whole.effects().has(Effect::Bvh))];
    let mut trials = Vec::new();
    let mut films: Vec<Film> = Vec::new();
    for integrator in CANDIDATES {
        let job = job(integrator, pixels)?;
        let mut renderer = ReferenceRenderer::new(&job, 0)?;
        let film = render_quietly(&mut renderer, job.settings())?.film;
        let connections = match integrator {
            Integrator::Path => connections,
            _ => 0.0,
        };
        trials.push(Trial {
            integrator,
            relative_variance: relative_variance(&film),
            rays,
            connections,
            cost: rays + per_connection * connections,
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
        integrator: best.integrator,
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

/// Rays and connections of a path, in the mean over paths all over the image.
fn counts(job: &Job) -> [f64; 2] {
    let settings = job.settings();
    let tracer = PathTracer {
        scene: job.scene(),
        placement: job.placement(),
        settings,
    };
    let pixels = settings.crop.pixels() as u32;
    let spheres = job.scene().spheres.len() as f64;
    let (mut sums, mut traced) = ([0.0; 2], 0.0);
    for i in 0..COUNTED {
        // Paths that never end, as without roulette, are few enough to say that a pilot would take too long.
        if (sums[0] + sums[1]) * spheres > TESTS {
            break;
        }
        traced += 1.0;
        let pixel = (u64::from(i) * u64::from(pixels) / u64::from(COUNTED)) as u32;
        let path = tracer.trace([pixel % settings.width, pixel / settings.width], 0);
        sums[0] += f64::from(path.rays - path.shadow_rays);
        sums[1] += f64::from(path.connections);
    }
    sums.map(|sum| sum / traced)
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

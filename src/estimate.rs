//! Mean and error of a film.

use std::f64::consts::PI;

use crate::film::Film;
use crate::scene::{MaterialKind, Scene};

/// What a film says about the image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Mean over all pixels and channels, W/(sr m²).
    pub mean: f64,
    /// The relative error: sqrt of the mean over pixels and channels of s²/(m² + (0.1 M)²), with
    /// the pixel's mean m and standard error s and the image's mean M. A fraction. `None` while
    /// there are fewer than 16 blocks of samples, and for a black image.
    pub error: Option<f64>,
}

impl Estimate {
    /// The estimate of a film.
    #[must_use]
    pub fn of(film: &Film) -> Self {
        let count = film.rect().pixels();
        let values = (count * 3) as f64;
        let mean = (0..count).flat_map(|i| film.mean(i)).sum::<f64>() / values;
        let floor = (0.1 * mean).powi(2);
        let mut sum = Some(0.0);
        for i in 0..count {
            sum = sum.zip(film.variance_of_mean(i)).map(|(sum, v)| {
                let m = film.mean(i);
                sum + (0..3).map(|c| v[c] / (m[c] * m[c] + floor)).sum::<f64>()
            });
        }
        let error = sum
            .map(|sum| (sum / values).sqrt())
            .filter(|e| e.is_finite() && floor > 0.0);
        Self { mean, error }
    }

    /// Whether nothing has been seen but black.
    #[must_use]
    pub fn is_black(&self) -> bool {
        self.mean == 0.0
    }
}

/// A bound on the share of the image's energy that the bounce limit removed, a fraction; 0 if it cut
/// no path, `None` where no bound is known: some material keeps all light, or adds to it.
///
/// A cut path could still have brought its throughput times the largest radiance that a surface can
/// send, E/(1 - rho) with E the largest emission or environment and rho the largest albedo.
#[must_use]
pub fn energy_cut_at_most(scene: &Scene, film: &Film) -> Option<f64> {
    let tally = film.tally();
    if tally.cut_paths == 0 {
        return Some(0.0);
    }
    let used = || {
        scene
            .spheres
            .iter()
            .map(|sphere| &scene.materials[sphere.material])
    };
    let albedo = used()
        .map(|material| match material.kind {
            MaterialKind::Diffuse { albedo } => albedo.max_element(),
            MaterialKind::Mirror { reflectance } => reflectance.max_element(),
            MaterialKind::Dielectric { .. } => 1.0,
            MaterialKind::Reflective {
                albedo,
                specular,
                epsilon,
                mu,
            } => (albedo + specular * (mu * PI * epsilon * (2.0 - epsilon))).max_element(),
        })
        .fold(0.0, f64::max);
    let emitted = used()
        .map(|material| material.emission.max_element())
        .chain(scene.environment.map(|e| e.max_element()))
        .fold(0.0, f64::max);
    let estimate = Estimate::of(film);
    if albedo >= 1.0 || estimate.is_black() {
        return None;
    }
    let paths = film.samples() as f64 * film.rect().pixels() as f64;
    let removed = tally.cut_throughput / paths * albedo * emitted / (1.0 - albedo);
    Some(removed / estimate.mean)
}

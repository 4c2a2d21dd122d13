//! Images against those of an independent renderer.
//!
//! Three tests an image, after Mitsuba's own `test_renders.py` and without its weaknesses: each
//! pixel's z (Sidak-corrected), the pooled z of the mean, and equivalence: the 99 % interval of the
//! bias of the mean lies within a bound. The power of the last: an image whose albedos are 1 % low
//! fails, as the companion shows.

use gpu_trace::film::Film;
use gpu_trace::image::Picture;
use gpu_trace::materials::{Material, MaterialKind};
use gpu_trace::scene::Scene;
use gpu_trace::statistics::normal_limit;
use gpu_trace::verify::settings;

use crate::common::images::assert_alike;
use crate::common::render_gpu;

/// What another renderer says of a scene.
pub(crate) struct Independent {
    /// Means of all pixels, rows from the top, and the variance of each.
    pub(crate) mean: Vec<[f64; 3]>,
    pub(crate) variance: Vec<[f64; 3]>,
    /// Samples a pixel.
    pub(crate) samples: f64,
}

/// How closely the product is held to it.
#[derive(Clone, Copy)]
pub(crate) struct Demand {
    /// Samples a pixel that the product renders.
    pub(crate) spp: u64,
    /// Bound of the bias of the mean, relative.
    pub(crate) equivalent: f64,
}

/// What the three tests say.
struct Verdict {
    worst_pixel: f64,
    limit: f64,
    pooled: f64,
    /// Largest end of the 99 % interval of the relative bias, over the channels.
    bias: f64,
    equivalent: f64,
}

impl Verdict {
    fn passes(&self) -> bool {
        self.worst_pixel < self.limit && self.pooled < 3.9 && self.bias < self.equivalent
    }
}

fn compare(other: &Independent, film: &Film, demand: Demand) -> Verdict {
    let pixels = film.rect().pixels();
    assert_eq!([other.mean.len(), other.variance.len()], [pixels; 2]);
    let mut worst_pixel = 0.0f64;
    let (mut total, mut difference, mut spread) = ([0.0; 3], [0.0; 3], [0.0; 3]);
    for i in 0..pixels {
        let own = film.mean(i);
        let own_variance = film.variance_of_mean(i).expect("enough blocks");
        for c in 0..3 {
            let (r, v) = (other.mean[i][c], other.variance[i][c]);
            // On a rim a short render may have missed the brighter side, and with it its own
            // variance: take at least what one sample of the other has.
            let own_variance = own_variance[c].max(v * other.samples / demand.spp as f64);
            // Pixels of constant radiance: f32 rounds them.
            let v = own_variance + v + (1.0e-5 * r).powi(2);
            worst_pixel = worst_pixel.max((own[c] - r).abs() / v.sqrt());
            total[c] += r;
            difference[c] += own[c] - r;
            spread[c] += v;
        }
    }
    // A channel without light has no bias.
    let lit = || (0..3).filter(|&c| total[c] > 0.0);
    let z = |c: usize| difference[c].abs() / spread[c].sqrt();
    let bias = |c: usize| (difference[c].abs() + 2.576 * spread[c].sqrt()) / total[c];
    Verdict {
        worst_pixel,
        limit: normal_limit(pixels * 3),
        pooled: lit().map(z).fold(0.0, f64::max),
        bias: lit().map(bias).fold(0.0, f64::max),
        equivalent: demand.equivalent,
    }
}

fn picture(film: &Film, other: &Independent) -> Picture {
    let rect = film.rect();
    let pixels = other.mean.iter().map(|mean| mean.map(|x| x as f32));
    Picture::new(rect.width, rect.height, pixels.collect())
}

/// Fails unless `film` is what `other` says.
#[track_caller]
pub(crate) fn holds(name: &str, film: &Film, other: &Independent, demand: Demand) {
    let verdict = compare(other, film, demand);
    println!(
        "{name}: worst pixel z {:.2} (limit {:.2}), pooled z {:.2}, bias within {:.4} %",
        verdict.worst_pixel,
        verdict.limit,
        verdict.pooled,
        100.0 * verdict.bias
    );
    let reference = picture(film, other);
    let what = "it differs from the reference";
    assert_alike(name, film, &reference, verdict.passes(), what);
}

/// Fails if `film`, in which something is `wrong`, is what `other` says.
#[track_caller]
pub(crate) fn is_found(name: &str, wrong: &str, film: &Film, other: &Independent, demand: Demand) {
    let verdict = compare(other, film, demand);
    assert!(!verdict.passes(), "{name}: {wrong} is not noticed");
}

/// The scene with all albedos 1 % lower that are numbers.
pub(crate) fn darker(scene: &Scene) -> Scene {
    let mut darker = scene.clone();
    // What a texture says is not the material's to change.
    let plain = |material: &&mut Material| material.textures.is_empty();
    for material in darker.materials.iter_mut().filter(plain) {
        match &mut material.kind {
            MaterialKind::Diffuse(m) => m.albedo *= 0.99,
            MaterialKind::Mirror(m) => m.reflectance *= 0.99,
            _ => {}
        }
    }
    darker
}

/// Renders `scene` and holds it to what `other` says of it; then, as the companion, with all albedos 1 % lower.
///
/// # Panics
/// If they differ, or the companion's does not.
pub(crate) fn check(name: &str, scene: &Scene, other: &Independent, demand: Demand) {
    let render = |scene: &Scene| {
        let settings = settings(scene, scene.width, scene.height, demand.spp);
        render_gpu(scene, &settings)
    };
    holds(name, &render(scene), other, demand);
    let film = render(&darker(scene));
    is_found(name, "an albedo 1 % lower", &film, other, demand);
}

//! Images against references of an independent renderer (Mitsuba 3; `tests/references/make.py`).
//!
//! Three tests an image, after Mitsuba's own `test_renders.py` and without its weaknesses: each
//! pixel's z (Sidak-corrected), the pooled z of the mean, and equivalence: the 99 % interval of the
//! bias of the mean lies within 0.1 %. The power of the last: an image whose albedos are 1 % low
//! fails, as the companions show.

mod common;
mod thorough;

use std::path::Path;

use gpu_trace::film::Film;
use gpu_trace::image::Picture;
use gpu_trace::input::read;
use gpu_trace::materials::MaterialKind;
use gpu_trace::scene::Scene;
use gpu_trace::verify::picture_of;

/// Samples a pixel, in the short form and in the long one: the interval of the bias is a twentieth of a
/// percent wide at most, half of what it may be, and with the long form half of that.
const SPP: [u64; 2] = [4096, 16_384];
fn spp() -> u64 {
    SPP[usize::from(thorough::thorough())]
}

/// Bound of the bias of the mean, relative.
const EQUIVALENT: f64 = 1.0e-3;

/// What the three tests say; `None`: passed.
struct Verdict {
    worst_pixel: f64,
    limit: f64,
    pooled: f64,
    /// Largest end of the 99 % interval of the relative bias, over the channels.
    bias: f64,
}

impl Verdict {
    fn passes(&self) -> bool {
        self.worst_pixel < self.limit && self.pooled < 3.9 && self.bias < EQUIVALENT
    }
}

fn folder() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/references")
}

fn reference(name: &str, part: &str) -> Picture {
    let file = folder().join(format!("{name}.{part}.npy"));
    read(&file).unwrap_or_else(|e| panic!("{e}")).picture
}

fn compare(name: &str, film: &Film) -> Verdict {
    let (mean, variance) = (reference(name, "mean"), reference(name, "variance"));
    assert_eq!(
        (mean.width, mean.height),
        (film.rect().width, film.rect().height)
    );
    let mut worst_pixel = 0.0f64;
    let (mut total, mut difference, mut spread) = ([0.0; 3], [0.0; 3], [0.0; 3]);
    for i in 0..film.rect().pixels() {
        let (own, own_variance) = (
            film.mean(i),
            film.variance_of_mean(i).expect("enough blocks"),
        );
        for c in 0..3 {
            let r = f64::from(mean.pixels[i][c]);
            let v = f64::from(variance.pixels[i][c]);
            // On a rim a short render may have missed the brighter side, and with it its own
            // variance: take at least what one sample of the reference has (131072 of them).
            let own_variance = own_variance[c].max(v * 131_072.0 / spp() as f64);
            // Pixels of constant radiance: the reference is rounded to f32.
            let v = own_variance + v + (1.0e-5 * r).powi(2);
            worst_pixel = worst_pixel.max((own[c] - r).abs() / v.sqrt());
            total[c] += r;
            difference[c] += own[c] - r;
            spread[c] += v;
        }
    }
    let z = |c: usize| difference[c].abs() / spread[c].sqrt();
    let bias = |c: usize| (difference[c].abs() + 2.576 * spread[c].sqrt()) / total[c];
    let tests = film.rect().pixels() * 3;
    Verdict {
        worst_pixel,
        limit: gpu_trace::statistics::normal_limit(tests),
        pooled: (0..3).map(z).fold(0.0, f64::max),
        bias: (0..3).map(bias).fold(0.0, f64::max),
    }
}

fn render(scene: &Scene) -> Film {
    let settings = gpu_trace::verify::settings(scene, scene.width, scene.height, spp());
    common::render_gpu(scene, &settings)
}

fn check(name: &str) {
    let scene = common::scene_file(format!("tests/references/{name}.toml"));
    let film = render(&scene);
    let verdict = compare(name, &film);
    println!(
        "{name}: worst pixel z {:.2} (limit {:.2}), pooled z {:.2}, bias within {:.4} %",
        verdict.worst_pixel,
        verdict.limit,
        verdict.pooled,
        100.0 * verdict.bias
    );
    if !verdict.passes() {
        let pictures = (picture_of(&film), reference(name, "mean"));
        let left = common::leave_pictures(name, &pictures.0, &pictures.1);
        panic!("{name} differs from the reference; {left}");
    }
    // The companion: all albedos 1 % lower.
    let mut wrong = scene;
    for material in &mut wrong.materials {
        match &mut material.kind {
            MaterialKind::Diffuse(m) => m.albedo *= 0.99,
            MaterialKind::Mirror(m) => m.reflectance *= 0.99,
            _ => {}
        }
    }
    let verdict = compare(name, &render(&wrong));
    assert!(
        !verdict.passes(),
        "{name}: an albedo 1 % lower is not noticed"
    );
}

macro_rules! references {
    ($($name:ident),*) => { $(#[test] fn $name() { check(stringify!($name)); })* };
}

references!(diffuse, mirror, glass, lens, emitters, mixed);

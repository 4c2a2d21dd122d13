//! `kernel.wgsl` in f64, with any nudge: tells rounding and nudge apart, and with a tiny nudge it is a
//! second opinion on the truth that shares no code with the renderer, random numbers included.

use std::f64::consts::TAU;
use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;

use super::flat::{FlatScene, FlatSphere, Kind};

/// SplitMix64: Steele, Lea and Flood, "Fast Splittable Pseudorandom Number Generators" (OOPSLA 2014).
struct Random(u64);

impl Random {
    /// The numbers of a path.
    fn of(pixel: u32, sample: u32) -> Self {
        let mut first = Self(u64::from(pixel) << 32 | u64::from(sample));
        // Once more, so that no two paths have states that lie close together.
        Self(first.word())
    }

    fn word(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform on [0, 1).
    fn number(&mut self) -> f64 {
        (self.word() >> 11) as f64 / (1u64 << 53) as f64
    }
}

fn intersect(sphere: &FlatSphere, origin: DVec3, direction: DVec3) -> Option<f64> {
    let f = origin - DVec3::from(sphere.center);
    let b = f.dot(direction);
    let c = f.dot(f) - sphere.radius * sphere.radius;
    let discriminant = b * b - c;
    if discriminant < 0.0 {
        return None;
    }
    let root = discriminant.sqrt();
    [-b - root, -b + root].into_iter().find(|&t| t > 0.0)
}

fn fresnel(cos_i: f64, eta: f64) -> f64 {
    let square = 1.0 - (1.0 - cos_i * cos_i) / (eta * eta);
    if square <= 0.0 {
        return 1.0;
    }
    let cos_t = square.sqrt();
    let s = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    let p = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    0.5 * (s * s + p * p)
}

/// Origin and direction of a ray through the film at (`x`, `y`), in pixels.
fn camera_ray(scene: &FlatScene, x: f64, y: f64, random: &mut Random) -> (DVec3, DVec3) {
    let [corner, across, down] = scene.film.map(DVec3::from);
    let forth = corner + x * across + y * down;
    let position = DVec3::from(scene.position);
    let [right, up] = scene.lens.map(DVec3::from);
    if right == DVec3::ZERO {
        return (position, forth.normalize());
    }
    let (r, phi) = (random.number().sqrt(), TAU * random.number());
    let lens = r * (phi.cos() * right + phi.sin() * up);
    (position + lens, (scene.focus * forth - lens).normalize())
}

fn trace(scene: &FlatScene, max_bounces: u32, nudge: f64, pixel: u32, sample: u32) -> DVec3 {
    let mut random = Random::of(pixel, sample);
    let x = f64::from(pixel % scene.width) + random.number();
    let y = f64::from(pixel / scene.width) + random.number();
    let (mut origin, mut direction) = camera_ray(scene, x, y, &mut random);
    let mut throughput = DVec3::ONE;
    // What refraction has taken out of the throughput: roulette must not see it.
    let mut eta_scale = 1.0;
    let mut radiance = DVec3::ZERO;
    for _ in 0..=max_bounces {
        let mut nearest = None;
        for sphere in &scene.spheres {
            if let Some(t) = intersect(sphere, origin, direction)
                && nearest.is_none_or(|(other, _)| t < other)
            {
                nearest = Some((t, sphere));
            }
        }
        let Some((t, sphere)) = nearest else {
            return radiance + throughput * DVec3::from(scene.environment);
        };
        radiance += throughput * DVec3::from(sphere.emission);
        let point = origin + t * direction;
        let outward = (point - DVec3::from(sphere.center)).normalize();
        let inside = outward.dot(direction) > 0.0;
        let normal = if inside { -outward } else { outward };
        let mut side = 1.0;
        match sphere.kind {
            Kind::Diffuse => {
                let z = 1.0 - 2.0 * random.number();
                let r = (1.0 - z * z).max(0.0).sqrt();
                let (sin, cos) = (TAU * random.number()).sin_cos();
                direction = (normal + DVec3::new(r * cos, r * sin, z)).normalize();
            }
            Kind::Mirror => direction = direction.reflect(normal).normalize(),
            Kind::Dielectric => {
                let ior = sphere.ior[0] / sphere.ior[1];
                let eta = if inside { 1.0 / ior } else { ior };
                if random.number() < fresnel(-normal.dot(direction), eta) {
                    direction = direction.reflect(normal).normalize();
                } else {
                    direction = direction.refract(normal, 1.0 / eta).normalize();
                    throughput /= eta * eta;
                    eta_scale *= eta * eta;
                    side = -1.0;
                }
            }
        }
        throughput *= DVec3::from(sphere.color);
        let largest = eta_scale * throughput.max_element();
        let survival = (4.0 * largest).min(1.0);
        if largest <= 0.0 || random.number() >= survival {
            break;
        }
        throughput /= survival;
        origin = point + side * nudge * normal;
    }
    radiance
}

/// Means of all pixels by rows, three channels each, and the variance of each mean.
pub(crate) struct Image {
    pub(crate) mean: Vec<[f64; 3]>,
    pub(crate) variance: Vec<[f64; 3]>,
}

/// Renders the samples `samples` of every pixel, two at least.
pub(crate) fn render(
    scene: &FlatScene,
    max_bounces: u32,
    nudge: f64,
    samples: Range<u32>,
) -> Image {
    let count = f64::from(samples.end - samples.start);
    let pixel = |pixel| {
        let (mut sum, mut squares) = (DVec3::ZERO, DVec3::ZERO);
        for sample in samples.clone() {
            let value = trace(scene, max_bounces, nudge, pixel, sample);
            sum += value;
            squares += value * value;
        }
        let mean = sum / count;
        let spread = (squares / count - mean * mean).max(DVec3::ZERO);
        (mean.to_array(), (spread / (count - 1.0)).to_array())
    };
    let pixels = (0..scene.width * scene.height).into_par_iter();
    let (mean, variance) = pixels.map(pixel).unzip();
    Image { mean, variance }
}

//! `naive.wgsl` in f64, with any nudge: tells rounding and nudge apart, and with a tiny nudge it is a
//! second opinion on the truth that shares no code with the renderer.

use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;

use crate::flat::{FlatScene, FlatSphere, Kind};

fn random4(pixel: [u32; 2], sample: u32, dimension: u32) -> [f64; 4] {
    // PCG4D: Jarzynski and Olano, "Hash Functions for GPU Rendering" (JCGT 9(3), 2020).
    let mut v = [pixel[0] | (pixel[1] << 16), sample, dimension, 0x5eed]
        .map(|x: u32| x.wrapping_mul(1_664_525).wrapping_add(1_013_904_223));
    for round in 0..2 {
        v[0] = v[0].wrapping_add(v[1].wrapping_mul(v[3]));
        v[1] = v[1].wrapping_add(v[2].wrapping_mul(v[0]));
        v[2] = v[2].wrapping_add(v[0].wrapping_mul(v[1]));
        v[3] = v[3].wrapping_add(v[1].wrapping_mul(v[2]));
        if round == 0 {
            v = v.map(|x| x ^ (x >> 16));
        }
    }
    v.map(|x| f64::from(x >> 8) / f64::from(1 << 24))
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

fn trace(scene: &FlatScene, max_bounces: u32, nudge: f64, pixel: [u32; 2], sample: u32) -> DVec3 {
    let u = random4(pixel, sample, 0);
    let [corner, across, down] = scene.film.map(DVec3::from);
    let (x, y) = (f64::from(pixel[0]) + u[0], f64::from(pixel[1]) + u[1]);
    let mut origin = DVec3::from(scene.position);
    let mut direction = (corner + x * across + y * down).normalize();
    let mut throughput = DVec3::ONE;
    let mut compression = 1.0;
    let mut radiance = DVec3::ZERO;
    for bounce in 0..=max_bounces {
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
        let u = random4(pixel, sample, bounce + 1);
        let point = origin + t * direction;
        let outward = (point - DVec3::from(sphere.center)).normalize();
        let inside = outward.dot(direction) > 0.0;
        let normal = if inside { -outward } else { outward };
        let mut side = 1.0;
        match sphere.kind {
            Kind::Diffuse => {
                let z = 1.0 - 2.0 * u[0];
                let r = (1.0 - z * z).max(0.0).sqrt();
                let (sin, cos) = (std::f64::consts::TAU * u[1]).sin_cos();
                direction = (normal + DVec3::new(r * cos, r * sin, z)).normalize();
            }
            Kind::Mirror => direction = direction.reflect(normal).normalize(),
            Kind::Dielectric => {
                let ior = sphere.ior[0] / sphere.ior[1];
                let eta = if inside { 1.0 / ior } else { ior };
                if u[2] < fresnel(-normal.dot(direction), eta) {
                    direction = direction.reflect(normal).normalize();
                } else {
                    direction = direction.refract(normal, 1.0 / eta).normalize();
                    throughput /= eta * eta;
                    compression *= eta * eta;
                    side = -1.0;
                }
            }
        }
        throughput *= DVec3::from(sphere.color);
        let largest = compression * throughput.max_element();
        let survival = (2.0 * largest).min(1.0);
        if largest <= 0.0 || u[3] >= survival {
            break;
        }
        throughput /= survival;
        origin = point + side * nudge * normal;
    }
    radiance
}

/// Mean of the samples `samples` of every pixel, three channels each, by rows.
pub(crate) fn render(
    scene: &FlatScene,
    max_bounces: u32,
    nudge: f64,
    samples: Range<u32>,
) -> Vec<f64> {
    let count = f64::from(samples.end - samples.start);
    (0..scene.width * scene.height)
        .into_par_iter()
        .flat_map_iter(|i| {
            let pixel = [i % scene.width, i / scene.width];
            let sum: DVec3 = samples
                .clone()
                .map(|sample| trace(scene, max_bounces, nudge, pixel, sample))
                .sum();
            (sum / count).to_array()
        })
        .collect()
}

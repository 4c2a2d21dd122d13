//! Twin of `shaders/path.wesl`: the same paths, one at a time, and the renderer around them.

use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;

use super::bsdf::evaluate::{evaluate, has_density};
use super::bsdf::event::{is_specular, next_class};
use super::bsdf::sample::bsdf_sample;
use super::bsdf::scatter::scatter;
use super::core::random::{random4, sample_key};
use super::core::sobol::sobol4;
use super::light::aim::aim_at;
use super::light::environment_radiance;
use super::light::sphere::{light_density, power_weight, sample_light};
use super::scene::camera::camera_ray;
use super::scene::priority::{cross_surface, relative_index};
use super::scene::ray::{Hit, Ray, Vertex, leave, vertex_at};
use super::scene::sphere::closest_hit;
use crate::allocation::Tiles;
use crate::aov::{AovSums, LightClass};
use crate::error::{Error, Result};
use crate::film::{BLOCK, NonFinite, PixelSums, Tally, Window};
use crate::media::Medium;
use crate::placement::Placement;
use crate::render::{Control, Renderer};
use crate::sampler::Sampler;
use crate::scene::{MaterialKind, Scene};
use crate::settings::{Integrator, Rect, Settings, stream_words};

/// Survival is the largest component of the throughput over 1/4.
#[must_use]
pub fn roulette_survival(largest: f64) -> f64 {
    (4.0 * largest).min(1.0)
}

/// Dimension of the numbers for light sampling at the first vertex.
const LIGHT_DIMENSION: u32 = 65_537;

/// What one path found.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PathResult {
    /// W/(sr m²) per channel.
    pub radiance: DVec3,
    /// Rays traced.
    pub rays: u32,
    /// Scattering events.
    pub bounces: u32,
    /// Throughput with which the bounce limit cut the path; zero if it did not.
    pub cut: DVec3,
    /// Its share of what was asked for beside the image.
    pub aovs: AovSums,
}

impl PathResult {
    fn add(&mut self, class: LightClass, radiance: DVec3) {
        self.radiance += radiance;
        let sum = &mut self.aovs.classes[class as usize];
        *sum = (DVec3::from(*sum) + radiance).to_array();
    }
}

/// All that a path needs to know.
#[derive(Clone, Copy, Debug)]
pub struct PathTracer<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// The same, placed.
    pub placement: &'a Placement,
    /// The options.
    pub settings: &'a Settings,
}

impl PathTracer<'_> {
    /// Traces sample `sample` of `pixel`.
    #[must_use]
    pub fn trace(&self, pixel: [u32; 2], sample: u64) -> PathResult {
        let Self {
            scene,
            placement,
            settings,
        } = self;
        let stream = stream_words(settings.seed, (sample >> 32) as u32);
        let (index, last) = (sample as u32, settings.sampler.batch(sample) as u32 - 1);
        let random = |dimension| match settings.sampler {
            Sampler::Independent => random4(sample_key(stream, pixel, index), dimension),
            Sampler::Sobol => {
                let key = sample_key(stream, pixel, index & !last);
                sobol4(key, dimension, index & last, last)
            }
        };
        let lecture = matches!(settings.integrator, Integrator::Lecture { .. });
        let mut ray = camera_ray(&placement.camera, pixel, random(0), &placement.within);
        let mut result = PathResult::default();
        let mut throughput = DVec3::ONE;
        let mut compression = 1.0;
        // pdf of the direction in which the path came; 0: light sampling could not have found it.
        let mut density = 0.0;
        let mut reach = 0.0;
        let mut class = LightClass::Emission;
        loop {
            result.rays += 1;
            let Some(hit) = closest_hit(&ray, &placement.spheres) else {
                result.add(class, throughput * environment_radiance(scene));
                return result;
            };
            let sphere = &placement.spheres[hit.index];
            let material = &scene.materials[sphere.material];
            let share = self.emission_share(&ray, &hit, density, reach);
            result.add(class, throughput * share * material.emission);
            if result.bounces == 0 {
                let normal = vertex_at(&ray, &hit, sphere).normal;
                let depth = hit.t * ray.direction.dot(placement.camera.forward);
                result.aovs.normal = normal.to_array();
                result.aovs.albedo = color(&material.kind).to_array();
                result.aovs.depth = (placement.camera.approach + depth) / placement.scale;
                result.aovs.hits = 1.0;
            }
            if result.bounces == settings.max_bounces {
                result.cut = throughput;
                return result;
            }
            let u = random(result.bounces + 1);
            let vertex = vertex_at(&ray, &hit, sphere);
            let (level, ior) = (sphere.level, material.kind.ior());
            let eta = relative_index(&ray.media, level, ior, hit.inside);
            let s = scatter(
                &material.kind,
                vertex.normal,
                ray.direction,
                eta,
                u,
                lecture,
            );
            if self.samples_lights() {
                let v = random(LIGHT_DIMENSION + result.bounces);
                let found = self.light_from(&ray, &hit, &vertex, v);
                let specular = is_specular(
                    &material.kind,
                    vertex.normal,
                    ray.direction,
                    found.direction,
                );
                result.add(next_class(class, specular), throughput * found.radiance);
                result.rays += found.rays;
                reach = found.reach * vertex.normal.dot(s.direction).max(0.0);
            }
            class = next_class(
                class,
                is_specular(&material.kind, vertex.normal, ray.direction, s.direction),
            );
            density = s.density;
            throughput *= s.weight;
            compression *= s.compression;
            let largest = (throughput * compression).max_element();
            let survival = match settings.integrator {
                Integrator::Lecture { termination } => 1.0 - termination,
                _ if settings.roulette => roulette_survival(largest),
                _ => 1.0,
            };
            if largest <= 0.0 || u[3] >= survival {
                return result;
            }
            throughput /= survival;
            ray = leave(ray, &hit, &vertex, &s, placement.offset);
            if s.crossed {
                let medium = Medium {
                    level,
                    ior,
                    sphere: hit.index,
                };
                cross_surface(&mut ray.media, medium, hit.inside);
            }
            result.bounces += 1;
        }
    }
}

impl PathTracer<'_> {
    /// Whether vertices look for lights.
    fn samples_lights(&self) -> bool {
        matches!(self.settings.integrator, Integrator::Path | Integrator::Nee)
            && !self.placement.lights.table.is_empty()
    }

    /// The share of the emission of a hit that the path counts, which came with `density`: light
    /// sampling has the rest.
    fn emission_share(&self, ray: &Ray, hit: &Hit, density: f64, reach: f64) -> f64 {
        let lights = &self.placement.lights;
        let light = lights.of_sphere(hit.index);
        let rivals = self.samples_lights() && density > 0.0 && !hit.inside;
        let Some(light) = light.filter(|_| rivals) else {
            return 1.0;
        };
        let sphere = &self.placement.spheres[hit.index];
        let aim = aim_at(sphere, ray.anchor, ray.offset);
        let reach = (!lights.from_table(self.settings.light_sampling)).then_some(reach);
        let other = light_density(light, &aim, reach);
        match self.settings.integrator {
            Integrator::Path => power_weight(density, other),
            _ if other > 0.0 => 0.0,
            _ => 1.0,
        }
    }

    /// What one light, chosen at random, sends over a vertex into the path.
    fn light_from(&self, ray: &Ray, hit: &Hit, vertex: &Vertex, u: [f64; 4]) -> LightFound {
        let mut found = LightFound::default();
        let spheres = &self.placement.spheres;
        let material = |index: usize| &self.scene.materials[spheres[index].material];
        let kind = &material(hit.index).kind;
        if !has_density(kind) {
            return found;
        }
        let sampling = self.settings.light_sampling;
        let Some(s) = sample_light(self.placement, sampling, vertex, hit.index, u) else {
            return found;
        };
        found.reach = s.reach;
        found.direction = s.direction;
        let Some((value, other)) = evaluate(kind, vertex.normal, ray.direction, s.direction) else {
            return found;
        };
        if s.density <= 0.0 || other <= 0.0 {
            return found;
        }
        let direction = bsdf_sample(s.direction, DVec3::ONE);
        let shadow = leave(ray.clone(), hit, vertex, &direction, self.placement.offset);
        // A ray that misses the limb by a rounding has seen the light all the same; lights are sampled
        // from outside.
        let hidden = closest_hit(&shadow, spheres).is_some_and(|first| {
            if first.index == s.sphere {
                first.inside
            } else {
                first.t < s.limb
            }
        });
        found.rays = 1;
        if hidden {
            return found;
        }
        let weight = match self.settings.integrator {
            Integrator::Path => power_weight(s.rival, other),
            _ => 1.0,
        };
        found.radiance = weight / s.density * value * material(s.sphere).emission;
        found
    }
}

/// What light sampling found at a vertex.
#[derive(Clone, Copy, Debug, Default)]
struct LightFound {
    direction: DVec3,
    radiance: DVec3,
    rays: u32,
    reach: f64,
}

/// Albedo or reflectance; glass has 1.
fn color(kind: &MaterialKind) -> DVec3 {
    match *kind {
        MaterialKind::Diffuse { albedo } | MaterialKind::Reflective { albedo, .. } => albedo,
        MaterialKind::Mirror { reflectance } => reflectance,
        MaterialKind::Dielectric { .. } => DVec3::ONE,
    }
}

/// Renders windows on the CPU.
#[derive(Debug)]
pub struct ReferenceRenderer {
    scene: Scene,
    placement: Placement,
    settings: Settings,
    threads: rayon::ThreadPool,
}

impl ReferenceRenderer {
    /// A renderer on `threads` threads; 0: one a core.
    ///
    /// # Errors
    /// [`Error::Device`] if the threads do not start.
    pub fn new(
        scene: &Scene,
        placement: &Placement,
        settings: &Settings,
        threads: usize,
    ) -> Result<Self> {
        let threads = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .map_err(|e| Error::Device(format!("cannot start {threads} threads: {e}")))?;
        Ok(Self {
            scene: scene.clone(),
            placement: placement.clone(),
            settings: settings.clone(),
            threads,
        })
    }

    fn pixel(&self, pixel: [u32; 2], samples: &Range<u64>, state: &mut PixelState) {
        let tracer = PathTracer {
            scene: &self.scene,
            placement: &self.placement,
            settings: &self.settings,
        };
        for sample in samples.clone() {
            let path = tracer.trace(pixel, sample);
            state.add(pixel, sample, &path, self.settings.sampler);
        }
    }
}

/// Bytes that a pixel takes in the middle of a window, sums beside the image aside.
pub(crate) const PIXEL_BYTES: usize = size_of::<PixelState>();

/// One pixel's sums in the middle of a window.
#[derive(Clone, Debug, Default)]
struct PixelState {
    sums: PixelSums,
    /// Only if something was asked for: they are large.
    aovs: Option<Box<AovSums>>,
    batch: DVec3,
    in_batch: u64,
    batches: f64,
    batch_mean: DVec3,
    tally: Tally,
}

impl PixelState {
    fn add(&mut self, pixel: [u32; 2], sample: u64, path: &PathResult, sampler: Sampler) {
        self.tally.rays += u64::from(path.rays);
        if path.cut.max_element() > 0.0 {
            self.tally.cut_paths += 1;
            self.tally.cut_throughput += path.cut.element_sum() / 3.0;
        }
        if path.radiance.is_finite() {
            self.batch += path.radiance;
            if let Some(aovs) = &mut self.aovs {
                aovs.add(&path.aovs);
            }
        } else {
            self.tally.non_finite += 1;
            let place = NonFinite {
                pixel,
                sample,
                bounce: path.bounces,
            };
            self.tally.first_non_finite = self.tally.first_non_finite.or(Some(place));
        }
        self.in_batch += 1;
        let length = sampler.batch(sample);
        if (sample + 1).is_multiple_of(length) {
            self.end_batch(self.in_batch == length);
        }
    }

    fn end_batch(&mut self, full: bool) {
        if full {
            // Welford 1962.
            self.batches += 1.0;
            let delta = self.batch - self.batch_mean;
            self.batch_mean += delta / self.batches;
            let m2 = delta * (self.batch - self.batch_mean);
            self.sums.m2 = (DVec3::from(self.sums.m2) + m2).to_array();
        }
        self.sums.sum = (DVec3::from(self.sums.sum) + self.batch).to_array();
        self.batch = DVec3::ZERO;
        self.in_batch = 0;
    }
}

impl Renderer for ReferenceRenderer {
    fn device(&self) -> (String, String, String) {
        let threads = self.threads.current_num_threads();
        (
            format!(
                "CPU reference, f64, {threads} thread{}",
                if threads == 1 { "" } else { "s" }
            ),
            "cpu".into(),
            "none".into(),
        )
    }

    fn render_tiles(
        &mut self,
        samples: Range<u64>,
        tiles: Option<&Tiles>,
        control: &mut dyn Control,
    ) -> Result<Window> {
        let crop: Rect = self.settings.crop;
        let width = crop.width as usize;
        let blank = PixelState {
            aovs: self.settings.has_aovs().then(Box::default),
            ..PixelState::default()
        };
        let mut state = vec![blank; crop.pixels()];
        let chosen = |x: usize, y: usize| tiles.is_none_or(|t| t.has_pixel(x as u32, y as u32));
        let all = (0..crop.pixels()).filter(|i| chosen(i % width, i / width));
        let all = all.count() as u64;
        let mut start = samples.start;
        while start < samples.end {
            // A block at a time over the whole image: then it can stop.
            let end = (start / BLOCK * BLOCK)
                .saturating_add(BLOCK)
                .min(samples.end);
            self.threads.install(|| {
                state
                    .par_chunks_mut(width)
                    .enumerate()
                    .for_each(|(y, row)| {
                        for (x, state) in row.iter_mut().enumerate() {
                            if !chosen(x, y) {
                                continue;
                            }
                            let pixel = [crop.x + x as u32, crop.y + y as u32];
                            self.pixel(pixel, &(start..end), state);
                        }
                    });
            });
            let paths = all * (end - start);
            start = end;
            if !control.proceed(paths) {
                break;
            }
        }
        let mut tally = Tally::default();
        for pixel in &mut state {
            pixel.end_batch(false);
            tally.add(&pixel.tally);
        }
        Ok(Window {
            rect: crop,
            samples: samples.start..start,
            batch: self.settings.sampler.batch(samples.start),
            aovs: match self.settings.has_aovs() {
                // Of known length, so that no room is left over.
                true => state
                    .iter()
                    .map(|s| s.aovs.as_deref().copied().unwrap_or_default())
                    .collect(),
                false => Vec::new(),
            },
            pixels: state.into_iter().map(|s| s.sums).collect(),
            tally,
        })
    }

    fn show(&mut self, crop: Rect) {
        self.settings.crop = crop;
    }

    fn device_bytes(&self) -> u64 {
        0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::load::load_str;

    #[test]
    fn a_lamp_that_is_hit_from_within_keeps_its_emission() {
        let text = "[camera]\nposition = [0, 0, 4]\nlook_at = [0, 0, 0]\nfov = 40.0\n[image]\nwidth = 8\n\
                    height = 8\n[material.lamp]\ntype = \"dielectric\"\nior = 1.5\nemission = [1, 1, 1]\n\
                    [[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = \"lamp\"\n";
        let scene = load_str("test", text).expect("a scene").scene;
        let settings = Settings::for_scene(&scene);
        let placement = Placement::new(&scene, 8, 8);
        let tracer = PathTracer {
            scene: &scene,
            placement: &placement,
            settings: &settings,
        };
        // From a point within that a rounding has put outside.
        let mut ray = camera_ray(&placement.camera, [0, 0], [0.5; 4], &placement.within);
        let sphere = &placement.spheres[0];
        ray.anchor = sphere.anchor;
        ray.offset = (1.0 + 1.0e-9) * sphere.radius * DVec3::X;
        let share = |inside| {
            let hit = Hit {
                t: 1.0,
                index: 0,
                inside,
            };
            tracer.emission_share(&ray, &hit, 0.3, 0.3)
        };
        assert_eq!(share(true), 1.0);
        // From outside light sampling has a part.
        assert!(share(false) < 0.9);
    }
}

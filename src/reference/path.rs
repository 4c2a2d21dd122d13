//! Twin of `shaders/path.wesl` and `shaders/path/`: the same paths, one at a time.

use glam::DVec3;

use super::core::random::{random4, sample_key};
use super::core::sobol::sobol4;
use super::light::aim::aim_at;
use super::light::environment_radiance;
use super::light::sphere::{light_pdf, mis_weight, sample_light};
use super::purpose::{CAMERA, lighting, scattering};
use super::scene::camera::camera_ray;
use super::scene::priority::{cross_surface, index_within, relative_index};
use super::scene::ray::{Hit, Ray, Vertex, leave, vertex_at};
use super::scene::sphere::closest_hit;
use crate::film::{AovSums, LightClass};
use crate::materials::{BsdfSample, Event, MaterialKind, Surface, sample_uniform};
use crate::placement::{Medium, Placement};
use crate::sampler::Sampler;
use crate::scene::{Material, Scene};
use crate::settings::{Integrator, Settings, stream_words};

/// Survival is the largest component of the throughput over 1/4.
#[must_use]
pub fn roulette_survival(largest: f64) -> f64 {
    (4.0 * largest).min(1.0)
}

/// The class of a path that has had one more event: D is a diffuse one, S any other.
#[must_use]
pub fn next_class(class: LightClass, event: Event) -> LightClass {
    match (class, event.is(Event::DIFFUSE)) {
        (LightClass::Emission, true) => LightClass::Direct,
        (LightClass::Emission, false) | (LightClass::Specular, _) => LightClass::Specular,
        (_, true) => LightClass::Indirect,
        (_, false) => LightClass::Caustic,
    }
}

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

/// A path on its way.
struct Path {
    ray: Ray,
    throughput: DVec3,
    /// Product of the index ratios squared of the refractions so far.
    eta_scale: f64,
    departure: Departure,
    class: LightClass,
    found: PathResult,
}

/// What light sampling has left of the path's way to go on from a vertex.
#[derive(Clone, Copy, Debug, Default)]
struct Departure {
    /// With which the BSDF found the direction; 0: light sampling could not have found it.
    pdf: f64,
    /// See [`light_pdf`].
    pdf_per_weight: f64,
}

impl Path {
    fn receive(&mut self, class: LightClass, radiance: DVec3) {
        self.found.radiance += radiance;
        let sum = &mut self.found.aovs.classes[class as usize];
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
        let settings = self.settings;
        let stream = stream_words(settings.seed, (sample >> 32) as u32);
        let (index, last) = (sample as u32, settings.sampler.batch(sample) as u32 - 1);
        let random = |dimension| match settings.sampler {
            Sampler::Independent => random4(sample_key(stream, pixel, index), dimension),
            Sampler::Sobol => {
                let key = sample_key(stream, pixel, index & !last);
                sobol4(key, dimension, index & last, last)
            }
        };
        let placement = self.placement;
        let mut path = Path {
            ray: camera_ray(&placement.camera, pixel, random(CAMERA), &placement.within),
            throughput: DVec3::ONE,
            eta_scale: 1.0,
            departure: Departure::default(),
            class: LightClass::Emission,
            found: PathResult::default(),
        };
        while self.extend(&mut path, &random) {}
        path.found
    }

    /// One step of L = Le + integral of f L cos: extends the path by a ray, takes up what is emitted where
    /// it arrives and what the lamps send there, and lets the BSDF choose where it goes on. Whether it
    /// does.
    fn extend(&self, path: &mut Path, random: &dyn Fn(u32) -> [f64; 4]) -> bool {
        path.found.rays += 1;
        let Some(hit) = closest_hit(&path.ray, &self.placement.spheres) else {
            let sky = environment_radiance(self.scene);
            path.receive(path.class, path.throughput * sky);
            return false;
        };
        let sphere = &self.placement.spheres[hit.index];
        let material = &self.scene.materials[sphere.material];
        let share = self.share_of_emission(&path.ray, &hit, path.departure);
        path.receive(path.class, path.throughput * share * material.emission);
        let vertex = vertex_at(&path.ray, &hit, sphere);
        if path.found.bounces == 0 {
            self.see(path, &hit, &vertex, material);
        }
        if path.found.bounces == self.settings.max_bounces {
            path.found.cut = path.throughput;
            return false;
        }
        let u = random(scattering(path.found.bounces));
        let (media, ior) = (&path.ray.media, material.kind.ior());
        let surface = Surface {
            normal: vertex.normal,
            eta: if material.kind.transmits() {
                relative_index(media, sphere.level, ior, hit.inside)
            } else {
                1.0 / index_within(media)
            },
            offset: sphere.anchor_offset(self.placement.scale)
                + vertex.offset / self.placement.scale,
        };
        let wo = -path.ray.direction;
        if self.samples_lights() {
            let v = random(lighting(path.found.bounces));
            let direct = self.direct_light(&path.ray, &hit, &vertex, &surface, v);
            let class = direct
                .event
                .map_or(path.class, |e| next_class(path.class, e));
            path.receive(class, path.throughput * direct.radiance);
            path.found.rays += direct.rays;
            path.departure.pdf_per_weight = direct.pdf_per_weight;
        }
        let s = self.sample(&material.kind, &surface, wo, u);
        self.go_on(path, &hit, &vertex, &s, u[3])
    }

    /// Takes note of what is seen first.
    fn see(&self, path: &mut Path, hit: &Hit, vertex: &Vertex, material: &Material) {
        let camera = &self.placement.camera;
        let depth = hit.t * path.ray.direction.dot(camera.forward);
        let aovs = &mut path.found.aovs;
        aovs.normal = vertex.normal.to_array();
        aovs.albedo = material.kind.color().to_array();
        aovs.depth = (camera.approach + depth) / self.placement.scale;
        aovs.hits = 1.0;
    }

    /// Lets the material choose a direction; by the lecture's integrator it is uniform but for delta lobes.
    fn sample(
        &self,
        material: &MaterialKind,
        surface: &Surface,
        wo: DVec3,
        u: [f64; 4],
    ) -> BsdfSample {
        match self.settings.integrator {
            Integrator::Lecture { .. } if !material.is_delta() => {
                sample_uniform(&**material, surface, wo, u)
            }
            _ => material.sample(surface, wo, u),
        }
    }

    /// Goes on as the BSDF has chosen, unless the path ends: whether it does. u: uniform, for the roulette.
    fn go_on(&self, path: &mut Path, hit: &Hit, vertex: &Vertex, s: &BsdfSample, u: f64) -> bool {
        path.class = next_class(path.class, s.event);
        path.departure.pdf = s.pdf;
        path.departure.pdf_per_weight *= vertex.normal.dot(s.wi).max(0.0);
        path.throughput *= s.weight;
        path.eta_scale *= s.eta * s.eta;
        let largest = (path.throughput * path.eta_scale).max_element();
        let survival = match self.settings.integrator {
            Integrator::Lecture { termination } => 1.0 - termination,
            _ if self.settings.roulette => roulette_survival(largest),
            _ => 1.0,
        };
        if largest <= 0.0 || u >= survival {
            return false;
        }
        path.throughput /= survival;
        let crossed = s.event.is(Event::TRANSMITTED);
        let arrived = path.ray.clone();
        path.ray = leave(arrived, hit, vertex, s.wi, crossed, self.placement.offset);
        if crossed {
            let sphere = &self.placement.spheres[hit.index];
            let medium = Medium {
                level: sphere.level,
                ior: self.scene.materials[sphere.material].kind.ior(),
                sphere: hit.index,
            };
            cross_surface(&mut path.ray.media, medium, hit.inside);
        }
        path.found.bounces += 1;
        true
    }
}

impl PathTracer<'_> {
    /// Whether vertices look for lights.
    fn samples_lights(&self) -> bool {
        matches!(self.settings.integrator, Integrator::Path | Integrator::Nee)
            && !self.placement.lights.table.is_empty()
    }

    /// The share of a hit's emission that the path counts: light sampling where it came from has the rest.
    fn share_of_emission(&self, ray: &Ray, hit: &Hit, from: Departure) -> f64 {
        let lights = &self.placement.lights;
        let light = lights.of_sphere(hit.index);
        let rivals = self.samples_lights() && from.pdf > 0.0 && !hit.inside;
        let Some(light) = light.filter(|_| rivals) else {
            return 1.0;
        };
        let sphere = &self.placement.spheres[hit.index];
        let aim = aim_at(sphere, ray.anchor, ray.offset);
        let pdf_per_weight =
            (!lights.from_table(self.settings.light_sampling)).then_some(from.pdf_per_weight);
        let other = light_pdf(light, &aim, pdf_per_weight);
        match self.settings.integrator {
            Integrator::Path => mis_weight(from.pdf, other),
            _ if other > 0.0 => 0.0,
            _ => 1.0,
        }
    }

    /// What one lamp, chosen at random, sends over a vertex into the path.
    fn direct_light(
        &self,
        ray: &Ray,
        hit: &Hit,
        vertex: &Vertex,
        surface: &Surface,
        u: [f64; 4],
    ) -> Direct {
        let mut direct = Direct::default();
        let spheres = &self.placement.spheres;
        let material = |index: usize| &self.scene.materials[spheres[index].material];
        let kind = &material(hit.index).kind;
        if kind.is_delta() {
            return direct;
        }
        let sampling = self.settings.light_sampling;
        let Some(s) = sample_light(self.placement, sampling, vertex, hit.index, u) else {
            return direct;
        };
        direct.pdf_per_weight = s.pdf_per_weight;
        let f = kind.evaluate(surface, -ray.direction, s.wi);
        direct.event = Some(f.event);
        if s.pdf <= 0.0 || f.pdf <= 0.0 {
            return direct;
        }
        let shadow = leave(ray.clone(), hit, vertex, s.wi, false, self.placement.offset);
        // A ray that misses the limb by a rounding has seen the lamp all the same; lamps are sampled
        // from outside.
        let hidden = closest_hit(&shadow, spheres).is_some_and(|first| {
            if first.index == s.sphere {
                first.inside
            } else {
                first.t < s.limb
            }
        });
        direct.rays = 1;
        if hidden {
            return direct;
        }
        let share = match self.settings.integrator {
            Integrator::Path => mis_weight(s.mis_pdf, f.pdf),
            _ => 1.0,
        };
        direct.radiance = share / s.pdf * f.f_cos * material(s.sphere).emission;
        direct
    }
}

/// What light sampling found at a vertex.
#[derive(Clone, Copy, Debug, Default)]
struct Direct {
    radiance: DVec3,
    rays: u32,
    pdf_per_weight: f64,
    event: Option<Event>,
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
            let from = Departure {
                pdf: 0.3,
                pdf_per_weight: 0.3,
            };
            tracer.share_of_emission(&ray, &hit, from)
        };
        assert_eq!(share(true), 1.0);
        // From outside light sampling has a part.
        assert!(share(false) < 0.9);
    }
}

//! Twin of `shaders/path.wesl` and `shaders/path/`: the same paths, one at a time.

use super::light::environment::environment_radiance;
use super::scene::absorption::transmittance;
use super::scene::camera::camera_ray;
use super::scene::priority::{Media, cross_surface, filling, index_within, relative_index};
use super::scene::ray::{Hit, Ray, Vertex, leave, vertex_at};
use super::scene::texture::{TexturePoint, emission_at, kind_at};
use super::state::{Cache, Path, PathResult};
use crate::effects::image_obstacle;
use crate::film::LightClass;
use crate::materials::{BsdfSample, Event, MaterialKind, Surface, sample_uniform};
use crate::placement::images::LampImage;
use crate::placement::{Medium, Placement};
use crate::sampler::Sampler;
use crate::sampling::purpose::{CAMERA, TIME, WAVELENGTH, imaging, lighting, scattering};
use crate::sampling::random::{random4, sample_key};
use crate::sampling::sobol::sobol4;
use crate::sampling::spectrum::sample_wavelength;
use crate::scene::Scene;
use crate::settings::{Integrator, Settings, stream_words};
use glam::DVec3;

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

/// The index of a material for a path that keeps a wavelength, or none.
fn index_at(kind: &MaterialKind, wavelength: Option<f64>) -> f64 {
    match (kind.dispersion(), wavelength) {
        (Some(index), Some(wavelength)) => index.at(wavelength),
        _ => kind.ior(),
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
    /// The radiance cache for the batch of the samples that are traced, if there is one.
    pub cache: Option<Cache<'a>>,
    /// The images of lamps that vertices look for.
    pub images: &'a [LampImage],
}

impl<'a> PathTracer<'a> {
    /// One that renders as `settings` say, without a cache.
    #[must_use]
    pub fn new(scene: &'a Scene, placement: &'a Placement, settings: &'a Settings) -> Self {
        let has_images =
            settings.lamp_images && image_obstacle(scene, placement, settings).is_none();
        Self {
            images: placement
                .images
                .as_deref()
                .filter(|_| has_images)
                .unwrap_or_default(),
            scene,
            placement,
            settings,
            cache: None,
        }
    }
}

impl PathTracer<'_> {
    /// Traces sample `sample` of `pixel`.
    #[must_use]
    pub fn trace(&self, pixel: [u32; 2], sample: u64) -> PathResult {
        self.trace_seen(pixel, sample, &mut |_, _| {})
    }

    /// The same; `see` gets to know each ray that arrives at a surface, and where.
    pub(super) fn trace_seen(
        &self,
        pixel: [u32; 2],
        sample: u64,
        see: &mut dyn FnMut(&Ray, &Hit),
    ) -> PathResult {
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
        let ray = camera_ray(&placement.camera, pixel, random(CAMERA), &placement.within);
        let mut path = Path::new(ray, random(TIME)[0] - 0.5);
        self.follow(&mut path, &random, see);
        path.found
    }

    /// Follows a path to its end.
    pub(super) fn follow(
        &self,
        path: &mut Path,
        random: &dyn Fn(u32) -> [f64; 4],
        see: &mut dyn FnMut(&Ray, &Hit),
    ) {
        loop {
            while self.extend(path, random, see) {}
            if !path.go_back() {
                break;
            }
        }
    }

    /// One step of L = Le + integral of f L cos: extends the path by a ray, takes up what is emitted where
    /// it arrives and what the lamps send there, and lets the BSDF choose where it goes on. Whether it
    /// does.
    fn extend(
        &self,
        path: &mut Path,
        random: &dyn Fn(u32) -> [f64; 4],
        see: &mut dyn FnMut(&Ray, &Hit),
    ) -> bool {
        let hit = self.arrival(path);
        if let Some(hit) = &hit {
            see(&path.ray, hit);
        }
        path.throughput *= self.transmittance(&path.ray.media, hit.map(|hit| hit.t));
        let Some(hit) = hit else {
            let w = path.ray.direction;
            let share = self.share_of_sky(w, path.departure);
            let sky = environment_radiance(self.scene, w);
            path.receive(path.class, path.throughput * share * sky);
            return false;
        };
        let sphere = &self.placement.spheres[hit.index];
        let material = &self.scene.materials[sphere.material];
        let vertex = vertex_at(&path.ray, &hit, sphere);
        let point = self.point_at(&hit, &vertex);
        let kind = kind_at(material, &point);
        let kind = &*kind;
        let share = self.share_of_emission(&path.ray, &hit, path.departure)
            * self.share_of_image(path.chain.as_ref(), &hit);
        let emission = emission_at(material, &point);
        path.receive(path.class, path.throughput * share * emission);
        self.keep_wavelength(path, kind, random);
        let vertex = Vertex {
            both_sides: kind.is_translucent(),
            ..vertex
        };
        if path.found.bounces == 0 {
            self.see(path, &hit, &vertex, kind);
        }
        if path.found.bounces == self.settings.max_bounces {
            path.found.cut += path.throughput.abs();
            return false;
        }
        let u = random(scattering(path.found.bounces));
        let ior = index_at(kind, path.wavelength);
        let media = &path.ray.media;
        let surface = Surface {
            normal: vertex.normal,
            eta: if kind.transmits() {
                relative_index(media, sphere.level, ior, hit.inside)
            } else {
                1.0 / index_within(media)
            },
            offset: point.offset,
        };
        let wo = -path.ray.direction;
        if self.samples_lamps() || self.sky().is_some() {
            let v = random(lighting(path.found.bounces));
            let direct = self.direct_light(path, &hit, &vertex, (kind, &surface), v);
            let class = direct
                .event
                .map_or(path.class, |e| next_class(path.class, e));
            path.receive(class, path.throughput * direct.radiance);
            path.found.rays += direct.rays;
            path.found.shadow_rays += direct.rays;
            path.found.connections += u32::from(direct.event.is_some());
            path.departure.pdf_per_weight = direct.pdf_per_weight;
        }
        if !self.images.is_empty() {
            let [.., z, w] = random(imaging(path.found.bounces));
            let found = self.image_light(path, &hit, &vertex, (kind, &surface), [z, w]);
            path.receive(path.class, path.throughput * found.radiance);
            path.found.rays += found.rays;
            path.found.shadow_rays += found.rays;
        }
        let s = self.sample(kind, &surface, wo, u);
        let goes_on = self.go_on(path, &hit, &vertex, &s, u[3]);
        goes_on
            && self
                .cache
                .is_none_or(|cache| !self.use_cell(&cache, path, (u[2], random)))
    }

    /// Where on its sphere a vertex is.
    pub(super) fn point_at(&self, hit: &Hit, vertex: &Vertex) -> TexturePoint {
        let sphere = &self.placement.spheres[hit.index];
        let scale = self.placement.scale;
        TexturePoint {
            offset: sphere.anchor_offset(scale) + vertex.offset / scale,
            normal: if hit.inside {
                -vertex.normal
            } else {
                vertex.normal
            },
        }
    }

    /// What is left of light after a length `t` in what fills the space, `None` for infinitely far.
    pub(super) fn transmittance(&self, media: &Media, t: Option<f64>) -> DVec3 {
        let Some(medium) = filling(media) else {
            return DVec3::ONE;
        };
        let absorption = self.kind_of(medium.sphere).absorption();
        transmittance(absorption / self.placement.scale, t)
    }

    /// Takes note of what is seen first.
    fn see(&self, path: &mut Path, hit: &Hit, vertex: &Vertex, kind: &MaterialKind) {
        let camera = &self.placement.camera;
        let depth = hit.t * path.ray.direction.dot(camera.forward);
        let aovs = &mut path.found.aovs;
        aovs.normal = vertex.normal.to_array();
        aovs.albedo = kind.color().to_array();
        aovs.depth = (camera.approach + depth) / self.placement.scale;
        aovs.hits = 1.0;
    }

    /// Lets the material choose a direction; by the lecture's integrator it is uniform where it is
    /// [hemispherical](crate::materials::Form::is_hemispherical).
    fn sample(
        &self,
        material: &MaterialKind,
        surface: &Surface,
        wo: DVec3,
        u: [f64; 4],
    ) -> BsdfSample {
        match self.settings.integrator {
            Integrator::Lecture { .. } if material.form().is_hemispherical() => {
                sample_uniform(&**material, surface, wo, u)
            }
            _ => material.sample(surface, wo, u),
        }
    }

    /// Goes on as the BSDF has chosen, unless the path ends: whether it does. u: uniform, for the roulette.
    fn go_on(&self, path: &mut Path, hit: &Hit, vertex: &Vertex, s: &BsdfSample, u: f64) -> bool {
        path.class = next_class(path.class, s.event);
        path.departure.pdf = s.pdf;
        self.follow_chain(path, hit, vertex, s);
        if !vertex.both_sides {
            path.departure.pdf_per_weight *= vertex.normal.dot(s.wi).max(0.0);
        }
        path.throughput *= s.weight;
        path.eta_scale *= s.eta * s.eta;
        let largest = (path.throughput.abs() * path.eta_scale).max_element();
        let survival = match self.settings.integrator {
            Integrator::Lecture { termination } => 1.0 - termination,
            _ if self.settings.has_roulette() => roulette_survival(largest),
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
            self.cross(&mut path.ray, hit, path.wavelength);
        }
        path.found.bounces += 1;
        true
    }

    /// Keeps one wavelength from here on, if it does not yet and an index here depends on it. Paths begin without one
    /// in dispersive media, too.
    fn keep_wavelength(
        &self,
        path: &mut Path,
        surface: &MaterialKind,
        random: &dyn Fn(u32) -> [f64; 4],
    ) {
        let mut within = path.ray.media.iter().map(|m| self.kind_of(m.sphere));
        let disperses = |kind: &MaterialKind| kind.dispersion().is_some();
        if path.wavelength.is_some() || !(disperses(surface) || within.any(disperses)) {
            return;
        }
        let spectral = sample_wavelength(random(WAVELENGTH)[1]);
        path.throughput *= spectral.weight;
        path.wavelength = Some(spectral.wavelength);
        for medium in &mut path.ray.media {
            medium.ior = index_at(self.kind_of(medium.sphere), path.wavelength);
        }
    }

    /// The material of a sphere of the placement.
    fn kind_of(&self, sphere: usize) -> &MaterialKind {
        &self.scene.materials[self.placement.spheres[sphere].material].kind
    }

    /// Changes the media of a ray that has crossed the surface.
    pub(super) fn cross(&self, ray: &mut Ray, hit: &Hit, wavelength: Option<f64>) {
        let medium = Medium {
            level: self.placement.spheres[hit.index].level,
            ior: index_at(self.kind_of(hit.index), wavelength),
            sphere: hit.index,
        };
        cross_surface(&mut ray.media, medium, hit.inside);
    }
}

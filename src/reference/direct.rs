//! Twin of `shaders/light/direct.wesl` and `shaders/light/target/`: what a vertex gets from lamps and from an image around
//! all, and what of these has been got that way where a path comes to them.

use glam::DVec3;

use super::light::aim::aim_at;
use super::light::environment::{environment_radiance, sky_place};
use super::light::skylight::{NO_SPHERE, SKY_SHARE, sample_sky, sky_pdf};
use super::light::sphere::{LightSample, light_pdf, mis_weight, sample_light};
use super::path::PathTracer;
use super::scene::ray::{Hit, Ray, Vertex, leave, vertex_at};
use super::scene::sphere::closest_hit;
use super::scene::texture::emission_at;
use super::state::{Departure, Path};
use crate::materials::{Event, MaterialKind, Surface};
use crate::placement::SkyTable;
use crate::scene::{Environment, Sky};
use crate::settings::Integrator;

impl PathTracer<'_> {
    /// Whether vertices look for light.
    fn looks_for_light(&self) -> bool {
        matches!(self.settings.integrator, Integrator::Path | Integrator::Nee)
    }

    /// Whether they look for lamps.
    pub(super) fn samples_lamps(&self) -> bool {
        self.looks_for_light() && !self.placement.lights.table.is_empty()
    }

    /// The image that they look for.
    pub(super) fn sky(&self) -> Option<(&Sky, &SkyTable)> {
        let environment = self.scene.environment.as_ref();
        let sky = environment.and_then(Environment::sky)?;
        let looks = self.looks_for_light() && !self.placement.enclosed;
        looks.then(|| (sky, self.placement.sky_table(sky)))
    }

    /// The share of what a ray meets with the pdf `bsdf_pdf` that the path counts, where light sampling finds it with
    /// the other one.
    fn share_of_hit(&self, bsdf_pdf: f64, light_pdf: f64) -> f64 {
        match self.settings.integrator {
            Integrator::Path => mis_weight(bsdf_pdf, light_pdf),
            _ if light_pdf > 0.0 => 0.0,
            _ => 1.0,
        }
    }

    /// The share of what is seen of the environment that the path counts.
    pub(super) fn share_of_sky(&self, w: DVec3, from: Departure) -> f64 {
        match self.sky().filter(|_| from.pdf > 0.0) {
            None => 1.0,
            Some((sky, table)) => {
                let share = if self.samples_lamps() { SKY_SHARE } else { 1.0 };
                let other = share * sky_pdf(sky, table, sky_place(sky, w));
                self.share_of_hit(from.pdf, other)
            }
        }
    }

    /// The share of a hit's emission that the path counts: light sampling where it came from has the rest.
    pub(super) fn share_of_emission(&self, ray: &Ray, hit: &Hit, from: Departure) -> f64 {
        let lights = &self.placement.lights;
        let lamp = lights.of_sphere(hit.index);
        let rivals = self.samples_lamps() && from.pdf > 0.0 && !hit.inside;
        let Some(lamp) = lamp.filter(|_| rivals) else {
            return 1.0;
        };
        let sphere = &self.placement.spheres[hit.index];
        let aim = aim_at(sphere, ray.anchor, ray.offset, ray.motion, ray.time);
        let pdf_per_weight =
            (!lights.from_table(self.settings.light_sampling())).then_some(from.pdf_per_weight);
        let share = self.sky().map_or(1.0, |_| 1.0 - SKY_SHARE);
        self.share_of_hit(from.pdf, share * light_pdf(lamp, &aim, pdf_per_weight))
    }

    /// A direction to a lamp or to the image.
    fn sample_direction(&self, vertex: &Vertex, own: usize, u: [f64; 4]) -> Option<LightSample> {
        let sampling = self.settings.light_sampling();
        let lamp = |u| sample_light(self.placement, sampling, vertex, own, u);
        let Some((sky, table)) = self.sky() else {
            return lamp(u);
        };
        if !self.samples_lamps() {
            return Some(sample_sky(sky, table, u));
        }
        let to_sky = u[2] < SKY_SHARE;
        let (low, share) = if to_sky {
            (0.0, SKY_SHARE)
        } else {
            (SKY_SHARE, 1.0 - SKY_SHARE)
        };
        let v = [u[0], u[1], (u[2] - low) / share, u[3]];
        let lamp = lamp(v);
        let pdf_per_weight = lamp.map_or(0.0, |s| s.pdf_per_weight);
        let chosen = if to_sky {
            Some(sample_sky(sky, table, v))
        } else {
            lamp
        };
        chosen.map(|s| LightSample {
            pdf: share * s.pdf,
            mis_pdf: share * s.mis_pdf,
            pdf_per_weight,
            ..s
        })
    }

    /// What one lamp, chosen at random, or the image sends over a vertex into the path.
    pub(super) fn direct_light(
        &self,
        path: &Path,
        hit: &Hit,
        vertex: &Vertex,
        (kind, surface): (&MaterialKind, &Surface),
        u: [f64; 4],
    ) -> Direct {
        let mut direct = Direct::default();
        let ray = &path.ray;
        let spheres = &self.placement.spheres;
        if kind.is_delta() {
            return direct;
        }
        let Some(s) = self.sample_direction(vertex, hit.index, u) else {
            return direct;
        };
        direct.pdf_per_weight = s.pdf_per_weight;
        let f = kind.evaluate(surface, -ray.direction, s.wi);
        direct.event = Some(f.event);
        if s.pdf <= 0.0 || f.pdf <= 0.0 {
            return direct;
        }
        let crossed = f.event.is(Event::TRANSMITTED);
        let offset = self.placement.offset;
        let mut shadow = leave(ray.clone(), hit, vertex, s.wi, crossed, offset);
        if crossed {
            self.cross(&mut shadow, hit, path.wavelength);
        }
        // A ray that misses the limb by a rounding has seen the lamp all the same; lamps are sampled
        // from outside.
        let first = closest_hit(&shadow, spheres);
        let hidden = first.is_some_and(|first| {
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
        let radiance = if s.sphere == NO_SPHERE {
            environment_radiance(self.scene, s.wi)
        } else {
            // Where f32 or a rounding lets the ray miss the limb, it is there.
            let met = Hit {
                t: first
                    .filter(|first| first.index == s.sphere)
                    .map_or(s.limb, |first| first.t),
                index: s.sphere,
                inside: false,
            };
            let vertex = vertex_at(&shadow, &met, &spheres[s.sphere]);
            let lamp = &self.scene.materials[spheres[s.sphere].material];
            emission_at(lamp, &self.point_at(&met, &vertex))
        };
        direct.radiance = share / s.pdf * f.f_cos * radiance;
        let length = match first.filter(|first| first.index == s.sphere) {
            Some(first) => Some(first.t),
            None => Some(s.limb).filter(|limb| limb.is_finite()),
        };
        direct.radiance *= self.transmittance(&shadow.media, length);
        direct
    }
}

/// What light sampling found at a vertex.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Direct {
    pub(super) radiance: DVec3,
    pub(super) rays: u32,
    pub(super) pdf_per_weight: f64,
    pub(super) event: Option<Event>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::placement::Placement;
    use crate::reference::scene::camera::camera_ray;
    use crate::scene::load::load_str;
    use crate::settings::Settings;

    #[test]
    fn a_lamp_that_is_hit_from_within_keeps_its_emission() {
        let text = "[camera]\nposition = [0, 0, 4]\nlook_at = [0, 0, 0]\nfov = 40.0\n[image]\nwidth = 8\n\
                    height = 8\n[material.lamp]\ntype = \"dielectric\"\nior = 1.5\nemission = [1, 1, 1]\n\
                    [[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = \"lamp\"\n";
        let scene = load_str("test", text).expect("a scene").scene;
        let settings = Settings::for_scene(&scene);
        let placement = Placement::new(&scene, 8, 8);
        let tracer = PathTracer::new(&scene, &placement, &settings);
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

//! Twin of what `shaders/light/images.wesl` does with a path: light that a vertex gets by images of lamps, and the share
//! of it that is left for a path that comes to a lamp by that very way.

use glam::DVec3;

use super::direct::Direct;
use super::light::images::Sight;
use super::light::sphere::mis_weight;
use super::path::PathTracer;
use super::scene::priority::relative_index;
use super::scene::ray::{Hit, Ray, Vertex, leave, vertex_at};
use super::scene::sphere::closest_hit;
use super::scene::texture::{emission_at, kind_at};
use super::state::{Chain, Path, Stage};
use crate::materials::fresnel::fresnel;
use crate::materials::{BsdfSample, Event, MaterialKind, Surface};
use crate::placement::images::{LampImage, Way};

impl PathTracer<'_> {
    /// What an image counts for at a vertex: how much of it is sent there if nothing is in between, about.
    fn strength(&self, image: &LampImage, anchor: DVec3, offset: DVec3, normal: DVec3) -> f64 {
        let sphere = &self.placement.spheres[image.sphere];
        let way = ((sphere.anchor - anchor) - offset) / sphere.radius;
        let distance = way.length();
        // Positive where any of the sphere is above the horizon.
        let cosine = (normal.dot(way) + 1.0).max(0.0) / distance;
        image.strength * cosine / (distance * distance)
    }

    fn strengths(&self, anchor: DVec3, offset: DVec3, normal: DVec3) -> Vec<f64> {
        let images = self.images.iter();
        images
            .map(|image| self.strength(image, anchor, offset, normal))
            .collect()
    }

    /// The pdf with which a direction that goes `way` by `sphere` to `lamp` is drawn at a vertex, and the share of the light
    /// that goes this way.
    fn image_pdf(&self, chain: &Chain, sphere: usize, way: Way, lamp: usize) -> (f64, f64) {
        let is_it = |i: &LampImage| i.sphere == sphere && i.way == way && i.lamp == lamp;
        let Some(own) = self.images.iter().position(is_it) else {
            return (0.0, 0.0);
        };
        let strengths = self.strengths(chain.anchor, chain.offset, chain.normal);
        let total: f64 = strengths.iter().sum();
        let sight = Sight::new(
            &self.images[own],
            self.placement,
            chain.anchor,
            chain.offset,
        );
        let Some(sight) = sight.filter(|_| strengths[own] > 0.0) else {
            return (0.0, 0.0);
        };
        let (pdf, share) = sight.pdf(chain.direction);
        (strengths[own] / total * pdf, share)
    }

    /// The share of a lamp's emission that a path counts that has come to it by a chain: images have the rest.
    pub(super) fn share_of_image(&self, chain: Option<&Chain>, hit: &Hit) -> f64 {
        let (Some(chain), false) = (chain, hit.inside) else {
            return 1.0;
        };
        let (sphere, way) = match chain.stage {
            Stage::Reflected(sphere) => (sphere, Way::Reflected),
            Stage::Through(sphere) => (sphere, Way::Through),
            Stage::Left | Stage::Entered(_) => return 1.0,
        };
        let (pdf, share) = self.image_pdf(chain, sphere, way, hit.index);
        match pdf > 0.0 {
            true => mis_weight(share * chain.pdf, pdf),
            false => 1.0,
        }
    }

    /// Follows a path on its way by a smooth sphere.
    pub(super) fn follow_chain(&self, path: &mut Path, hit: &Hit, vertex: &Vertex, s: &BsdfSample) {
        if self.images.is_empty() {
            return;
        }
        if s.pdf > 0.0 {
            path.chain = Some(Chain {
                anchor: vertex.anchor,
                offset: vertex.offset,
                normal: vertex.normal,
                direction: s.wi,
                pdf: s.pdf,
                stage: Stage::Left,
            });
            return;
        }
        let crossed = s.event.is(Event::TRANSMITTED);
        path.chain = path.chain.take().and_then(|chain| {
            let stage = match (chain.stage, crossed) {
                (Stage::Left, false) if !hit.inside => Stage::Reflected(hit.index),
                (Stage::Left, true) if !hit.inside => Stage::Entered(hit.index),
                (Stage::Entered(sphere), true) if sphere == hit.index => Stage::Through(sphere),
                _ => return None,
            };
            Some(Chain { stage, ..chain })
        });
    }

    /// What one image of a lamp, chosen at random, sends over a vertex into the path.
    pub(super) fn image_light(
        &self,
        path: &Path,
        hit: &Hit,
        vertex: &Vertex,
        (kind, surface): (&MaterialKind, &Surface),
        u: [f64; 2],
    ) -> Direct {
        let mut found = Direct::default();
        if kind.is_delta() || self.images.is_empty() {
            return found;
        }
        let strengths = self.strengths(vertex.anchor, vertex.offset, vertex.normal);
        let (mut total, mut chosen, mut v) = (0.0, 0, u[0]);
        for (i, strength) in strengths.iter().enumerate().filter(|(_, s)| **s > 0.0) {
            total += strength;
            let share = strength / total;
            if v < share {
                (chosen, v) = (i, v / share);
            } else {
                v = ((v - share) / (1.0 - share)).min(1.0 - f64::EPSILON);
            }
        }
        let image = self.images[chosen];
        // What the limit on bounces would cut of the path's own way there.
        let events = match image.way {
            Way::Reflected => 2,
            Way::Through => 3,
        };
        if total <= 0.0 || path.found.bounces + events > self.settings.max_bounces {
            return found;
        }
        let sight = Sight::new(&image, self.placement, vertex.anchor, vertex.offset);
        let Some(s) = sight.and_then(|sight| sight.sample([v, u[1]])) else {
            return found;
        };
        let f = kind.evaluate(surface, -path.ray.direction, s.wi);
        if f.pdf <= 0.0 {
            return found;
        }
        let ray = path.ray.clone();
        let ray = leave(ray, hit, vertex, s.wi, false, self.placement.offset);
        let Some(radiance) = self.light_by(&image, ray, &mut found.rays) else {
            return found;
        };
        let chain = Chain {
            anchor: vertex.anchor,
            offset: vertex.offset,
            normal: vertex.normal,
            direction: s.wi,
            pdf: f.pdf,
            stage: Stage::Left,
        };
        let (pdf, share) = self.image_pdf(&chain, image.sphere, image.way, image.lamp);
        if pdf > 0.0 {
            let weight = mis_weight(pdf, share * f.pdf);
            found.radiance = weight / (strengths[chosen] / total * s.pdf) * f.f_cos * radiance;
        }
        found
    }

    /// What a ray finds that goes by the sphere of the image: what the lamp emits, with what is left of it on the way; `None`
    /// if it is not the lamp that it comes to. It is the way of paths that the BSDF chooses to go, with the
    /// probability of each choice.
    fn light_by(&self, image: &LampImage, ray: Ray, rays: &mut u32) -> Option<DVec3> {
        let spheres = &self.placement.spheres;
        let mut ray = ray;
        let mut weight = DVec3::ONE;
        let insides: &[bool] = match image.way {
            Way::Reflected => &[false],
            Way::Through => &[false, true],
        };
        for inside in insides {
            *rays += 1;
            let hit = closest_hit(&ray, spheres)?;
            if hit.index != image.sphere || hit.inside != *inside {
                return None;
            }
            let sphere = &spheres[hit.index];
            let vertex = vertex_at(&ray, &hit, sphere);
            let material = &self.scene.materials[sphere.material];
            let kind = kind_at(material, &self.point_at(&hit, &vertex));
            let mut eta = 1.0;
            let wo = -ray.direction;
            let crosses = image.way == Way::Through;
            if kind.transmits() {
                eta = relative_index(&ray.media, sphere.level, kind.ior(), hit.inside);
                let reflected = fresnel(vertex.normal.dot(wo).clamp(0.0, 1.0), eta).reflected;
                weight *= if crosses { 1.0 - reflected } else { reflected };
            }
            let surface = Surface {
                normal: vertex.normal,
                eta,
                offset: DVec3::ZERO,
            };
            // The lobe of this way.
            let lobe = if crosses { 1.0 } else { 0.0 };
            let s = kind.sample(&surface, wo, [0.0, 0.0, lobe, 0.0]);
            weight *= s.weight;
            if weight == DVec3::ZERO {
                return None;
            }
            ray = leave(ray, &hit, &vertex, s.wi, crosses, self.placement.offset);
            if crosses {
                self.cross(&mut ray, &hit, None);
            }
        }
        *rays += 1;
        let hit = closest_hit(&ray, spheres)?;
        if hit.index != image.lamp || hit.inside {
            return None;
        }
        let lamp = &spheres[hit.index];
        let point = self.point_at(&hit, &vertex_at(&ray, &hit, lamp));
        Some(weight * emission_at(&self.scene.materials[lamp.material], &point))
    }
}

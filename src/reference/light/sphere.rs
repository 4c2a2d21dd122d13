//! Twin of `shaders/light/light.wesl`, `weighed.wesl`, `table.wesl` and `mis.wesl`.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::aim::{Aim, aim_at, cone_height};
use super::projected::{cap_seen, sample_cap};
use crate::placement::{Light, Lights, Placement};
use crate::reference::scene::ray::Vertex;
use crate::sampling::directions::cap_direction;
use crate::settings::LightSampling;

/// The light that the alias table gives; `None` if there is none.
#[must_use]
pub fn light_from_table(lights: &Lights, u: [f64; 2]) -> Option<&Light> {
    let count = lights.table.len();
    let place = ((u[0] * count as f64) as usize).min(count.checked_sub(1)?);
    let lamp = &lights.table[place];
    if u[1] < lamp.threshold {
        Some(lamp)
    } else {
        lights.table.get(lamp.alias)
    }
}

/// For MIS, the pdf in solid angle with which light sampling finds a direction to `lamp`; `pdf_per_weight` as
/// in the kernel, `None` where lights are drawn from the table.
#[must_use]
pub fn light_pdf(lamp: &Light, aim: &Aim, pdf_per_weight: Option<f64>) -> f64 {
    if !aim.outside {
        return 0.0;
    }
    match pdf_per_weight {
        Some(pdf_per_weight) => lamp.luminance * pdf_per_weight,
        None => lamp.probability / (TAU * cone_height(aim)),
    }
}

/// The length of the tangent for a direction at the limb.
#[must_use]
pub fn limb_distance(aim: &Aim, direction: DVec3) -> f64 {
    aim.distance * aim.axis.dot(direction)
}

/// A direction to a sphere, uniform in the cone that it fills, and its pdf in solid angle. `None` from
/// within.
#[must_use]
pub fn sample_cone(aim: &Aim, u: DVec2) -> Option<(DVec3, f64)> {
    let height = cone_height(aim);
    let direction = cap_direction(aim.axis, height, u);
    aim.outside.then(|| (direction, 1.0 / (TAU * height)))
}

/// A direction to a light; see the kernel's struct.
#[derive(Clone, Copy, Debug)]
#[expect(missing_docs, reason = "the members are those of the kernel's struct")]
pub struct LightSample {
    pub wi: DVec3,
    pub pdf: f64,
    pub mis_pdf: f64,
    pub limb: f64,
    pub sphere: usize,
    pub pdf_per_weight: f64,
}

/// A direction to a light, for a vertex on the placement's sphere `own`; `None` if it sees none.
#[must_use]
pub fn sample_light(
    placement: &Placement,
    sampling: LightSampling,
    vertex: &Vertex,
    own: usize,
    u: [f64; 4],
) -> Option<LightSample> {
    let lights = &placement.lights;
    let place = DVec2::new(u[0], u[1]);
    let to = |lamp: &Light| {
        let target = &placement.spheres[lamp.sphere];
        aim_at(
            target,
            vertex.anchor,
            vertex.offset,
            vertex.motion,
            vertex.time,
        )
    };
    if !lights.from_table(sampling) {
        return weighed_light(lights, vertex, own, u, &to);
    }
    let lamp = light_from_table(lights, [u[2], u[3]])?;
    let aim = to(lamp);
    let cone = sampling == LightSampling::Cone || vertex.both_sides;
    let (direction, pdf) = if cone {
        sample_cone(&aim, place)?
    } else {
        let cap = cap_seen(&aim, vertex.normal);
        if cap.area <= 0.0 {
            return None;
        }
        let (direction, extent) = sample_cap(&cap, vertex.normal, place);
        (direction, vertex.normal.dot(direction).max(0.0) / extent)
    };
    (lamp.sphere != own).then(|| LightSample {
        wi: direction,
        pdf: lamp.probability * pdf,
        mis_pdf: light_pdf(lamp, &aim, None),
        limb: limb_distance(&aim, direction),
        sphere: lamp.sphere,
        pdf_per_weight: 0.0,
    })
}

/// The same; the light is chosen by the irradiance that it sends if nothing is in between.
fn weighed_light(
    lights: &Lights,
    vertex: &Vertex,
    own: usize,
    u: [f64; 4],
    to: &dyn Fn(&Light) -> Aim,
) -> Option<LightSample> {
    let mut total = 0.0;
    let mut chosen = None;
    let mut v = u[2];
    for lamp in &lights.table {
        let cap = cap_seen(&to(lamp), vertex.normal);
        let area = match vertex.both_sides {
            true if cap.aim.outside => TAU * cone_height(&cap.aim),
            true => 0.0,
            false => cap.area,
        };
        let strength = if lamp.sphere == own {
            0.0
        } else {
            lamp.luminance * area
        };
        total += strength;
        let share = if strength > 0.0 {
            strength / total
        } else {
            0.0
        };
        if v < share {
            v /= share;
            chosen = Some((lamp, cap, strength));
        } else {
            v = ((v - share) / (1.0 - share)).min(1.0 - f64::EPSILON);
        }
    }
    let (lamp, cap, strength) = chosen?;
    let pdf_per_weight = 1.0 / total;
    if vertex.both_sides {
        let (direction, _) = sample_cone(&cap.aim, DVec2::new(u[0], u[1]))?;
        let pdf = lamp.luminance * pdf_per_weight;
        return Some(LightSample {
            wi: direction,
            pdf,
            mis_pdf: pdf,
            limb: limb_distance(&cap.aim, direction),
            sphere: lamp.sphere,
            pdf_per_weight,
        });
    }
    let (direction, extent) = sample_cap(&cap, vertex.normal, DVec2::new(u[0], u[1]));
    let cosine = vertex.normal.dot(direction).max(0.0);
    Some(LightSample {
        wi: direction,
        pdf: strength * pdf_per_weight * cosine / extent,
        mis_pdf: lamp.luminance * pdf_per_weight * cosine,
        limb: limb_distance(&cap.aim, direction),
        sphere: lamp.sphere,
        pdf_per_weight,
    })
}

/// Weight of an estimate whose direction has the pdf `a`, against another way with the pdf `b`.
#[must_use]
pub fn mis_weight(a: f64, b: f64) -> f64 {
    let ratio = b / a;
    1.0 / (1.0 + ratio * ratio)
}

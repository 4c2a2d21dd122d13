//! Twin of `shaders/light/images.wesl`: directions to the image of a lamp that one sphere makes.
//!
//! All in units of that sphere's radius, about the axis from the vertex to its centre. A ray that meets the sphere with the
//! impact parameter s, at the angle theta to the axis, sin theta = s/D, and with the angle of incidence alpha = asin s,
//! leaves it with the same impact parameter, since reflection and refraction on a sphere keep it, in the direction
//!
//! ```text
//! psi = pi + theta - 2 alpha                      reflected,
//! psi = theta - 2 alpha + 2 alpha',               through, sin alpha' = s/n,
//! ```
//!
//! measured from the axis to the side of the ray. In the plane of axis and lamp, with the lamp's centre at `along`
//! and `across`, it misses that by
//!
//! ```text
//! h = across cos psi - along sin psi - s,
//! ```
//!
//! and comes next to it at the length t = along cos psi + across sin psi. Turned about the axis by phi out of that plane,
//! with k = 1 - cos phi, it meets the lamp of radius r where
//!
//! ```text
//! (r - h)(r + h) - 2 b k + c k^2 >= 0,   b = across (s cos psi + t sin psi),   c = (across sin psi)^2,
//! ```
//!
//! if t > 0 there. These are arcs about phi = 0 and, with -across for across, about phi = pi. A direction is drawn by
//! u = s^2, from bins whose weights come from what is seen at their ends, and phi uniformly on the arcs.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DVec2, DVec3};

use crate::materials::fresnel::fresnel;
use crate::placement::Placement;
use crate::placement::images::{LampImage, Way};
use crate::sampling::directions::basis_around;

/// Bins of the square of the impact parameter: their ends are even in the angle of incidence.
pub const BINS: usize = 4;

/// An image as a vertex sees it, lengths in units of the radius of the sphere that makes it.
#[derive(Clone, Copy, Debug)]
#[expect(missing_docs, reason = "the members are those of the kernel's struct")]
pub struct Sight {
    /// Unit length, to the sphere's centre.
    pub axis: DVec3,
    /// To there.
    pub distance: f64,
    /// Unit length, across the axis, to the lamp's side.
    pub sideways: DVec3,
    /// The lamp's centre, from the sphere's.
    pub along: f64,
    pub across: f64,
    /// The lamp's.
    pub radius: f64,
    pub way: Way,
    pub ior: Option<f64>,
}

/// A ray in the plane of the axis that has left the sphere.
#[derive(Clone, Copy, Debug)]
struct Leaving {
    /// Its impact parameter.
    s: f64,
    /// cos and sin of psi.
    psi: DVec2,
    /// The share of the light that goes this way.
    share: f64,
}

/// What is seen of the lamp where s is the same.
#[derive(Clone, Copy, Debug)]
struct Ring {
    /// Half the arcs about phi = 0 and about phi = pi.
    halves: [f64; 2],
    /// See above.
    h: f64,
    b: f64,
    t: f64,
    share: f64,
}

impl Ring {
    /// Of the arcs together.
    fn width(&self) -> f64 {
        2.0 * (self.halves[0] + self.halves[1])
    }
}

/// A direction to an image.
#[derive(Clone, Copy, Debug)]
pub struct ImageSample {
    /// Unit length.
    pub wi: DVec3,
    /// In solid angle, of this image.
    pub pdf: f64,
}

/// u at the ends of bins: sin^2 of angles of incidence.
fn end(i: usize) -> f64 {
    (FRAC_PI_2 * i as f64 / BINS as f64).sin().powi(2)
}

/// Half the width of an arc about its middle, where the lamp is missed by h.
fn half_width(radius: f64, h: f64, b: f64, c: f64, t: f64) -> f64 {
    let a = (radius - h) * (radius + h);
    if a < 0.0 || t <= 0.0 {
        return 0.0;
    }
    let square = b * b - a * c;
    if b <= 0.0 || square < 0.0 {
        return PI;
    }
    let k = a / (b + square.sqrt());
    if k >= 2.0 {
        return PI;
    }
    (k * (2.0 - k)).sqrt().atan2(1.0 - k)
}

impl Sight {
    /// The image from a point at anchor + offset; `None` from within the sphere.
    #[must_use]
    pub fn new(
        image: &LampImage,
        placement: &Placement,
        anchor: DVec3,
        offset: DVec3,
    ) -> Option<Self> {
        let sphere = &placement.spheres[image.sphere];
        let lamp = &placement.spheres[image.lamp];
        let way = ((sphere.anchor - anchor) - offset) / sphere.radius;
        let distance = way.length();
        if distance <= 1.0 {
            return None;
        }
        let axis = way / distance;
        let to_lamp = (lamp.anchor - sphere.anchor) / sphere.radius;
        let along = to_lamp.dot(axis);
        let beside = to_lamp - along * axis;
        let across = beside.length();
        let sideways = match across > 0.0 {
            true => beside / across,
            false => basis_around(axis).tangent,
        };
        Some(Self {
            axis,
            distance,
            sideways,
            along,
            across,
            radius: lamp.radius / sphere.radius,
            way: image.way,
            ior: image.ior,
        })
    }

    fn leaving(&self, u: f64) -> Leaving {
        let s = u.sqrt();
        let cos_a = (1.0 - u).max(0.0).sqrt();
        let sin_t = s / self.distance;
        let cos_t = ((1.0 - sin_t) * (1.0 + sin_t)).sqrt();
        // Of theta - 2 alpha.
        let twice = DVec2::new(1.0 - 2.0 * u, -2.0 * s * cos_a);
        let turn = twice.rotate(DVec2::new(cos_t, sin_t));
        let Some(ior) = self.ior else {
            return Leaving {
                s,
                psi: -turn,
                share: 1.0,
            };
        };
        let reflected = fresnel(cos_a, ior).reflected;
        match self.way {
            Way::Reflected => Leaving {
                s,
                psi: -turn,
                share: reflected,
            },
            Way::Through => {
                let sin_b = s / ior;
                let cos_b = ((1.0 - sin_b) * (1.0 + sin_b)).max(0.0).sqrt();
                let within = DVec2::new(1.0 - 2.0 * sin_b * sin_b, 2.0 * sin_b * cos_b);
                Leaving {
                    s,
                    psi: turn.rotate(within),
                    share: (1.0 - reflected).powi(2),
                }
            }
        }
    }

    fn ring(&self, u: f64) -> Ring {
        let Leaving { s, psi, share } = self.leaving(u);
        let c = (self.across * psi.y).powi(2);
        let [near, far] = [self.across, -self.across].map(|across| {
            let h = across * psi.x - self.along * psi.y - s;
            let t = self.along * psi.x + across * psi.y;
            let b = across * (s * psi.x + t * psi.y);
            (h, b, t)
        });
        let half = |(h, b, t): (f64, f64, f64)| half_width(self.radius, h, b, c, t);
        let halves = [half(near), half(far)];
        Ring {
            // Where both meet all is lamp.
            halves: match halves[0] + halves[1] >= PI {
                true => [PI, 0.0],
                false => halves,
            },
            h: near.0,
            b: near.1,
            t: near.2,
            share,
        }
    }

    /// The weights of the bins.
    ///
    /// By the trapezoid rule; and where the lamp is between the two ends, by its width if it is seen so small: a chord
    /// is pi/4 of a diameter in the mean.
    fn bins(&self) -> [f64; BINS] {
        let mut before = self.ring(0.0);
        std::array::from_fn(|i| {
            let after = self.ring(end(i + 1));
            let seen = [before, after].map(|ring| ring.width() * ring.share);
            let mut mean = 0.5 * (seen[0] + seen[1]);
            if mean <= 0.0 && before.h * after.h < 0.0 && before.t > 0.0 && after.t > 0.0 {
                let b = 0.5 * (before.b + after.b);
                let half = (self.radius / b.max(0.0).sqrt()).min(PI);
                let part = (2.0 * self.radius / (after.h - before.h).abs()).min(1.0);
                mean = 0.25 * PI * 2.0 * half * part * (before.share + after.share);
            }
            let weight = (end(i + 1) - end(i)) * mean;
            before = after;
            weight
        })
    }

    /// The pdf in solid angle of a direction at the angle theta to the axis, by that of u and the width of the arcs.
    fn direction_pdf(&self, u: f64, u_pdf: f64, width: f64) -> f64 {
        let sin_t = u.sqrt() / self.distance;
        let cos_t = ((1.0 - sin_t) * (1.0 + sin_t)).sqrt();
        u_pdf / width * 2.0 * cos_t * self.distance * self.distance
    }

    /// A direction; `None` if the numbers find none.
    #[must_use]
    pub fn sample(&self, u: [f64; 2]) -> Option<ImageSample> {
        let bins = self.bins();
        let total: f64 = bins.iter().sum();
        if total <= 0.0 {
            return None;
        }
        let (mut chosen, mut rest) = (0, u[0] * total);
        while chosen + 1 < BINS && rest >= bins[chosen] {
            rest -= bins[chosen];
            chosen += 1;
        }
        if bins[chosen] <= 0.0 {
            return None;
        }
        let size = end(chosen + 1) - end(chosen);
        let place = (end(chosen) + rest / bins[chosen] * size).min(1.0);
        let ring = self.ring(place);
        let width = ring.width();
        if width <= 0.0 {
            return None;
        }
        let along = u[1] * width;
        let [near, far] = ring.halves;
        let phi = match along < 2.0 * near {
            true => along - near,
            false => PI + (along - 2.0 * near) - far,
        };
        let sin_t = place.sqrt() / self.distance;
        let cos_t = ((1.0 - sin_t) * (1.0 + sin_t)).sqrt();
        let across = phi.cos() * self.sideways + phi.sin() * self.axis.cross(self.sideways);
        Some(ImageSample {
            wi: (cos_t * self.axis + sin_t * across).normalize(),
            pdf: self.direction_pdf(place, bins[chosen] / (total * size), width),
        })
    }

    /// The pdf of a direction that finds the image, and the share of the light that goes this way.
    #[must_use]
    pub fn pdf(&self, direction: DVec3) -> (f64, f64) {
        let cosine = self.axis.dot(direction);
        let across = self.distance * (self.axis - cosine * direction);
        let u = across.length_squared();
        if cosine <= 0.0 || u >= 1.0 {
            return (0.0, 0.0);
        }
        let bins = self.bins();
        let total: f64 = bins.iter().sum();
        let own = (0..BINS).find(|i| u < end(i + 1)).unwrap_or(BINS - 1);
        let ring = self.ring(u);
        let width = ring.width();
        if bins[own] <= 0.0 || width <= 0.0 {
            return (0.0, ring.share);
        }
        let u_pdf = bins[own] / (total * (end(own + 1) - end(own)));
        (self.direction_pdf(u, u_pdf, width), ring.share)
    }
}

#[cfg(test)]
mod tests;

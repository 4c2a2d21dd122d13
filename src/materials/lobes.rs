//! What materials of several lobes share; twin of `shaders/materials/lobes.wesl`.

use glam::DVec3;

use super::ggx::Frame;
use super::{BsdfSample, BsdfValue, Event, luminance};

/// (1 - cosine)^5
#[must_use]
pub fn schlick(cosine: f64) -> f64 {
    (1.0 - cosine).powi(5)
}

/// Where the path came from, in the local frame.
#[must_use]
pub fn arrival(frame: &Frame, wo: DVec3) -> DVec3 {
    let o = frame.to_local(wo);
    o.with_z(o.z.max(0.0))
}

/// In the local frame, two directions, the unit vector halfway between them, and its cosine with both.
#[derive(Clone, Copy, Debug)]
pub struct Pair {
    /// To where the path came from.
    pub o: DVec3,
    /// To where it goes on.
    pub i: DVec3,
    /// Halfway.
    pub h: DVec3,
    /// Its cosine with either.
    pub cos_h: f64,
}

impl Pair {
    /// Of two directions. o.h is half the length of o + i: where both graze, the product is what the lengths of o and
    /// i, which are 1 but for a rounding, make of it, and may be 0.
    #[must_use]
    pub fn between(o: DVec3, i: DVec3) -> Self {
        let sum = o + i;
        let size = sum.length();
        Self {
            o,
            i,
            h: sum / size,
            cos_h: (0.5 * size).min(1.0),
        }
    }

    /// Of a direction and its reflection about `h`.
    #[must_use]
    pub fn about(o: DVec3, h: DVec3) -> Self {
        Self::of(o, h, o.dot(h).min(1.0))
    }

    /// The same where the cosine of the two is known.
    #[must_use]
    pub fn of(o: DVec3, h: DVec3, cos_h: f64) -> Self {
        let i = 2.0 * cos_h * h - o;
        Self { o, i, h, cos_h }
    }
}

/// f cos of both sorts of lobes, and the pdf of the mixture.
#[derive(Clone, Copy, Debug)]
pub struct Lobes {
    /// Of the wide lobes.
    pub diffuse: DVec3,
    /// Of those about a mirror direction.
    pub glossy: DVec3,
    /// In solid angle.
    pub pdf: f64,
}

impl Lobes {
    /// The answer of `evaluate`.
    #[must_use]
    pub fn value(&self, pair: &Pair) -> BsdfValue {
        if pair.i.z <= 0.0 {
            return BsdfValue {
                f_cos: DVec3::ZERO,
                pdf: 0.0,
                event: Event::GLOSSY,
            };
        }
        BsdfValue {
            f_cos: self.diffuse + self.glossy,
            pdf: self.pdf,
            event: self.event(),
        }
    }

    /// What happens: whatever sends the most light.
    #[must_use]
    pub fn event(&self) -> Event {
        let wide = luminance(self.glossy) < luminance(self.diffuse);
        if wide { Event::DIFFUSE } else { Event::GLOSSY }
    }

    /// The answer of `sample`.
    #[must_use]
    pub fn sample(&self, frame: &Frame, pair: &Pair) -> BsdfSample {
        let value = self.value(pair);
        let up = pair.i.z > 0.0;
        BsdfSample {
            wi: frame.to_world(pair.i).normalize(),
            weight: if up {
                value.f_cos / value.pdf
            } else {
                DVec3::ZERO
            },
            pdf: value.pdf,
            event: value.event,
            eta: 1.0,
        }
    }
}

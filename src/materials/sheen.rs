//! Cloth; twin of `shaders/materials/sheen.wesl`, which has the formulas' sources.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::{DVec2, DVec3};
use schemars::JsonSchema;
use serde::Deserialize;

use super::ggx::Frame;
use super::lobes::{Pair, arrival};
use super::powers::{expm1_over, log_of, log1p_over};
use super::{Bsdf, BsdfSample, BsdfValue, Event, Form, Member, MemberValue, Surface, Value};
use crate::sampling::directions::{circle_point, sphere_direction};

#[cfg(test)]
mod tests;

pub(super) const NAME: &str = "sheen";

pub(super) const FORMS: &[Form] = &[Form {
    what: "cloth: fibres that stand up",
    members: &[
        // One over the roughness.
        Member::scalar("sheen_exponent"),
        // How wide it scatters about the plane of incidence: of the lobe that is sampled.
        Member::scalar("sheen_spread"),
    ],
    derives: Some(&["roughness"]),
    ..Form::of(NAME)
}];

/// The least roughness.
const MIN_ROUGHNESS: f64 = 0.05;
/// See the kernel.
const UNIFORM_SHARE: f64 = 0.03;

/// Cloth: fibres that stand up. It has no Fresnel term and no shadowing that balances it: below a roughness of
/// about 0.21 it scatters more light at grazing angles than it receives.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
pub struct Sheen {
    /// Colour of the fibres.
    #[schemars(schema_with = "super::schema::share")]
    pub color: DVec3,
    /// How far they lean.
    #[schemars(range(min = MIN_ROUGHNESS, max = 1.0), transform = super::schema::texture)]
    pub roughness: f64,
}

pub(super) fn cases() -> Vec<Sheen> {
    let case = |color: [f64; 3], roughness| Sheen {
        color: color.into(),
        roughness,
    };
    vec![
        case([0.9, 0.5, 0.2], 0.3),
        case([1.0; 3], 1.0),
        case([0.3, 0.0, 0.6], MIN_ROUGHNESS),
        case([0.5, 0.6, 0.7], 0.1),
    ]
}

/// The lobe that is sampled: of what is scattered a fit, whose pdf is known.
struct SampledLobe {
    a: f64,
    b: f64,
    turned: f64,
}

impl SampledLobe {
    fn pdf(&self, o: DVec3, i: DVec3) -> f64 {
        let log_cos = log_of(i.z.clamp(0.0, 1.0));
        let rest = -self.a * log_cos * expm1_over(self.a * log_cos);
        let power = ((self.a - 1.0) * log_cos + (self.b - 1.0) * log_of(rest)).exp();
        let (w, i) = (self.turned * o.truncate(), i.truncate());
        let square = w.length_squared() * i.length_squared();
        let kernel = (1.0 - square) / (1.0 + square - 2.0 * w.dot(i));
        let fitted = self.a * self.b * power * kernel;
        (fitted + (1.0 - fitted) * UNIFORM_SHARE) / TAU
    }

    fn direction(&self, o: DVec3, u: DVec2) -> DVec3 {
        let log_rest = -u.x * log1p_over(-u.x) / self.b;
        let power = -log_rest * expm1_over(log_rest);
        let cosine = (log_of(power) / self.a).exp().min(1.0);
        let sine = ((1.0 - cosine) * (1.0 + cosine)).sqrt();
        let w = self.turned * sine * o.truncate();
        let z = circle_point(u.y);
        let below = DVec2::new(1.0 + w.dot(z), w.perp_dot(z));
        let above = z + w;
        let turned = DVec2::new(above.dot(below), below.perp_dot(above)) / below.length_squared();
        (sine * turned).extend(cosine)
    }
}

impl Sheen {
    fn exponent(&self) -> f64 {
        1.0 / self.roughness
    }

    fn spread(&self) -> f64 {
        0.15 + 1.85 * self.roughness
    }

    fn sampled_lobe(&self, cos_o: f64) -> SampledLobe {
        let near = self.exponent() - 1.0;
        SampledLobe {
            a: 1.0 + 0.5 * cos_o / (cos_o + 0.1),
            b: 1.0 + near * (0.1 + 0.4 * cos_o.powi(3)),
            turned: (cos_o + 0.15) / (cos_o + 0.15 + self.spread()),
        }
    }

    fn value(&self, o: DVec3, i: DVec3) -> BsdfValue {
        if i.z <= 0.0 {
            return BsdfValue {
                f_cos: DVec3::ZERO,
                pdf: 0.0,
                event: Event::DIFFUSE,
            };
        }
        let h = Pair::between(o, i).h;
        let sine = (0.5 * self.exponent() * log_of(h.truncate().length_squared())).exp();
        let d = (2.0 + self.exponent()) * sine / TAU;
        BsdfValue {
            f_cos: 0.25 * d * i.z / (i.z + o.z * (1.0 - i.z)) * self.color,
            pdf: self.sampled_lobe(o.z).pdf(o, i),
            event: Event::DIFFUSE,
        }
    }

    /// What white cloth scatters of light along the surface, which is the most: there f cos is D/4, and with the
    /// solid angle 4 o.h of wi the albedo is the integral of D o.h over the half vectors on that side,
    /// (2 + p)/pi times that of sin^(p + 2), p being 1/r.
    fn most(&self) -> f64 {
        const POINTS: u32 = 256;
        let p = self.exponent();
        // By the trapezoid rule, to better than 1e-6: the power is flat at both ends.
        let step = FRAC_PI_2 / f64::from(POINTS);
        let inner = (1..POINTS).map(|i| (f64::from(i) * step).sin().powf(p + 2.0));
        (2.0 + p) / PI * step * (inner.sum::<f64>() + 0.5)
    }
}

impl Bsdf for Sheen {
    fn form(&self) -> &'static Form {
        &FORMS[0]
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![
            ("color", Value::Vector(self.color)),
            ("roughness", Value::Number(self.roughness)),
        ]
    }

    fn members(&self) -> Vec<MemberValue> {
        vec![self.exponent().into(), self.spread().into()]
    }

    fn color(&self) -> DVec3 {
        self.color
    }

    fn albedo(&self) -> DVec3 {
        (1.0 + 1.0e-5) * self.most() * self.color
    }

    // The weight 2 pi f cos is at most (2 + p)/4 times the colour, and its mean is the albedo.
    fn moment(&self, channel: usize, k: i32) -> f64 {
        let largest = 0.25 * (2.0 + self.exponent()) * self.color[channel];
        self.albedo()[channel] * largest.powi(k - 1)
    }

    fn sample(&self, surface: &Surface, wo: DVec3, u: [f64; 4]) -> BsdfSample {
        let frame = Frame::about(surface.normal, DVec3::Y);
        let (o, place) = (arrival(&frame, wo), DVec2::new(u[0], u[1]));
        let i = if u[2] >= UNIFORM_SHARE {
            self.sampled_lobe(o.z).direction(o, place)
        } else {
            let w = sphere_direction(place);
            w.with_z(w.z.abs())
        };
        let value = self.value(o, i);
        BsdfSample {
            wi: frame.to_world(i).normalize(),
            weight: if i.z > 0.0 {
                value.f_cos / value.pdf
            } else {
                DVec3::ZERO
            },
            pdf: value.pdf,
            event: Event::DIFFUSE,
            eta: 1.0,
        }
    }

    fn evaluate(&self, surface: &Surface, wo: DVec3, wi: DVec3) -> BsdfValue {
        let frame = Frame::about(surface.normal, DVec3::Y);
        self.value(arrival(&frame, wo), frame.to_local(wi))
    }

    fn warning(&self) -> Option<[String; 2]> {
        let most = self.most() * self.color.max_element();
        (most > 1.0 + 1.0e-5).then(|| {
            [
                format!("gains energy: at grazing angles it scatters {most:.2} times the light"),
                "use a darker `color`, or a larger `roughness`".into(),
            ]
        })
    }
}

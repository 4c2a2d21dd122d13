//! A smooth coat over a paint; twin of the same in `shaders/materials/car_paint.wesl`.

use glam::DVec3;
use schemars::JsonSchema;
use serde::Deserialize;

use super::dielectric::fresnel;
use super::paint::{Paint, mean_weight};
use super::schema::MAX_MAGNITUDE;
use super::{BsdfSample, BsdfValue, Event};

/// A clear coat.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Clearcoat {
    /// Absolute refractive index (vacuum 1).
    #[schemars(range(max = MAX_MAGNITUDE), extend("exclusiveMinimum" = 0.0))]
    pub ior: f64,
}

/// A clear coat over a paint, for light from a direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Coat {
    /// Its index over that before the surface.
    eta: f64,
    /// 1 - F(cos_o)
    through: f64,
    /// What the coat and the paint below reflect, about.
    kept: f64,
    /// Probability of reflection, and what is left of 1.
    pub(super) share: f64,
    beneath: f64,
}

fn coat_transmits(cos_i: f64, eta: f64) -> f64 {
    if cos_i <= 0.0 {
        return 0.0;
    }
    1.0 - fresnel(cos_i.min(1.0), eta).reflected
}

impl Coat {
    /// Chosen in proportion to what each reflects, about.
    pub(super) fn over(paint: &Paint, eta: f64, wo: DVec3) -> Self {
        let cos_o = paint.normal.dot(wo).clamp(0.0, 1.0);
        let through = coat_transmits(cos_o, eta);
        let reflected = 1.0 - through;
        let below = through * paint.strengths(wo).iter().sum::<f64>().min(1.0);
        let kept = reflected + below;
        let [share, beneath] = if kept > 0.0 {
            [reflected / kept, below / kept]
        } else {
            [0.0, 1.0]
        };
        Self {
            eta,
            through,
            kept,
            share,
            beneath,
        }
    }

    pub(super) fn sample(&self, paint: &Paint, wo: DVec3, u: [f64; 3]) -> BsdfSample {
        if u[2] < self.share {
            return BsdfSample {
                wi: (-wo).reflect(paint.normal).normalize(),
                weight: DVec3::splat(self.kept),
                pdf: 0.0,
                event: Event::DELTA,
                eta: 1.0,
            };
        }
        let s = paint.sample(wo, [u[0], u[1], (u[2] - self.share) / self.beneath]);
        let back = coat_transmits(paint.normal.dot(s.wi), self.eta);
        BsdfSample {
            weight: self.through * back / self.beneath * s.weight,
            pdf: self.beneath * s.pdf,
            ..s
        }
    }

    pub(super) fn evaluate(&self, paint: &Paint, wo: DVec3, wi: DVec3) -> BsdfValue {
        let value = paint.evaluate(wo, wi);
        let back = coat_transmits(paint.normal.dot(wi), self.eta);
        BsdfValue {
            f_cos: self.through * back * value.f_cos,
            pdf: self.beneath * value.pdf,
            ..value
        }
    }
}

/// The share of light along the normal that comes back from the paint and that the coat does not let out.
pub(super) fn lost_below(paint: &Paint, ior: f64) -> f64 {
    let kept = |wo, u| {
        let s = paint.sample(wo, u);
        (1.0 - coat_transmits(paint.normal.dot(s.wi), ior)) * s.weight
    };
    let kept = mean_weight(paint.normal, 1.0, kept).max_element();
    coat_transmits(1.0, ior) * kept
}

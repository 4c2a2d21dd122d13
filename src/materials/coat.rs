//! A smooth coat over a paint; twin of the same in `shaders/materials/car_paint.wesl`.

use glam::DVec3;
use schemars::JsonSchema;
use serde::Deserialize;

use super::fresnel::fresnel;
use super::paint::{Paint, Weights, choosable};
use super::scattered::mean_over;
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
    /// Probability of reflection, its weight, and what is left of the probability.
    pub(super) share: f64,
    weight: f64,
    beneath: f64,
    /// In proportion to what the parts below are chosen.
    weights: [f64; 4],
}

fn coat_transmits(cos_i: f64, eta: f64) -> f64 {
    if cos_i <= 0.0 {
        return 0.0;
    }
    1.0 - fresnel(cos_i.min(1.0), eta).reflected
}

impl Coat {
    /// What it reflects is one of the parts.
    pub(super) fn over(paint: &Paint, eta: f64, wo: DVec3) -> Self {
        let through = coat_transmits(paint.frame.normal().dot(wo).clamp(0.0, 1.0), eta);
        let parts = paint.parts(wo).map(|part| through * part);
        let chosen = Weights::of(parts, 1.0 - through);
        let below: f64 = chosen.parts.iter().sum();
        let all = chosen.coat + below;
        let [share, beneath] = if below > 0.0 {
            [chosen.coat / all, below / all]
        } else if chosen.coat > 0.0 {
            [1.0, 0.0]
        } else {
            [0.0, 1.0]
        };
        Self {
            eta,
            through,
            share,
            weight: chosen.least * all,
            beneath,
            weights: choosable(chosen.parts),
        }
    }

    pub(super) fn sample(&self, paint: &Paint, wo: DVec3, u: [f64; 3]) -> BsdfSample {
        let normal = paint.frame.normal();
        if u[2] < self.share {
            return BsdfSample {
                wi: (-wo).reflect(normal).normalize(),
                weight: DVec3::splat(self.weight),
                pdf: 0.0,
                event: Event::DELTA,
                eta: 1.0,
            };
        }
        let u = [u[0], u[1], (u[2] - self.share) / self.beneath];
        let s = paint.sample(&self.weights, wo, u);
        let back = coat_transmits(normal.dot(s.wi), self.eta);
        BsdfSample {
            weight: self.through * back / self.beneath * s.weight,
            pdf: self.beneath * s.pdf,
            ..s
        }
    }

    pub(super) fn evaluate(&self, paint: &Paint, wo: DVec3, wi: DVec3) -> BsdfValue {
        let value = paint.evaluate(&self.weights, wo, wi);
        let back = coat_transmits(paint.frame.normal().dot(wi), self.eta);
        BsdfValue {
            f_cos: self.through * back * value.f_cos,
            pdf: self.beneath * value.pdf,
            ..value
        }
    }
}

/// The share of light along the normal that comes back from the paint and that the coat does not let out.
pub(super) fn lost_below(paint: &Paint, ior: f64) -> f64 {
    let normal = paint.frame.normal();
    let weights = paint.weights(normal);
    let kept = mean_over(|[x, y, z, _]| {
        let s = paint.sample(&weights, normal, [x, y, z]);
        (1.0 - coat_transmits(normal.dot(s.wi), ior)) * s.weight
    });
    coat_transmits(1.0, ior) * kept.max_element()
}

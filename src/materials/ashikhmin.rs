//! Ashikhmin's and Shirley's anisotropic Phong model; twin of `shaders/materials/ashikhmin.wesl`, which has the
//! formulas' sources.

use std::f64::consts::{FRAC_1_PI, TAU};

use glam::{DVec2, DVec3};
use schemars::JsonSchema;
use serde::Deserialize;

use super::ggx::Frame;
use super::lobes::{Lobes, Pair, arrival, schlick};
use super::powers::{expm1_over, log_of, log1p_over};
use super::{
    Bsdf, BsdfSample, BsdfValue, Form, Member, MemberValue, Mistake, Surface, Value, luminance,
    schema,
};
use crate::sampling::directions::{circle_point, cosine_direction};

#[cfg(test)]
mod tests;

pub(super) const NAME: &str = "ashikhmin";

pub(super) const FORMS: &[Form] = &[Form {
    what: "Ashikhmin's and Shirley's anisotropic Phong model",
    members: &[
        Member::vector("specular"),
        Member::scalar("nu"),
        Member::scalar("nv"),
        Member::vector("axis"),
    ],
    ..Form::of(NAME)
}];

/// Largest exponent: a lobe as narrow as that of the least roughness of metals.
const MAX_EXPONENT: f64 = 1.0e6;

/// Ashikhmin's and Shirley's anisotropic Phong model: a lobe with Fresnel's term about half vectors, over a
/// diffuse term that gets what the lobe leaves. It loses light by design, most at grazing incidence.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
pub struct Ashikhmin {
    /// Colour of the diffuse term.
    #[schemars(schema_with = "super::schema::share")]
    pub diffuse: DVec3,
    /// What the lobe reflects at normal incidence.
    #[schemars(schema_with = "super::schema::share")]
    pub specular: DVec3,
    /// Exponent along the tangent axis × normal.
    #[schemars(range(min = 0.0, max = MAX_EXPONENT))]
    pub nu: f64,
    /// Exponent across it.
    #[schemars(range(min = 0.0, max = MAX_EXPONENT))]
    pub nv: f64,
    /// The axis about which surfaces are brushed.
    #[serde(default = "schema::up")]
    #[schemars(schema_with = "schema::axis")]
    pub axis: DVec3,
}

pub(super) fn cases() -> Vec<Ashikhmin> {
    let case = |diffuse: [f64; 3], specular: [f64; 3], [nu, nv]: [f64; 2], axis: DVec3| Ashikhmin {
        diffuse: diffuse.into(),
        specular: specular.into(),
        nu,
        nv,
        axis,
    };
    let tilted = DVec3::new(1.0, 2.0, -2.0) / 3.0;
    vec![
        // That of the known albedo, both limits of the exponents, each term alone, and all at once.
        case([1.0; 3], [0.04; 3], [100.0; 2], DVec3::Y),
        case([0.0; 3], [0.9, 0.6, 0.3], [0.0; 2], DVec3::Y),
        case([0.3, 0.4, 0.5], [0.5, 0.6, 0.7], [1.0e6; 2], DVec3::Y),
        case([0.7, 0.5, 0.3], [0.0; 3], [10.0; 2], tilted),
        case([0.0; 3], [1.0, 0.8, 0.5], [10.0, 1000.0], tilted),
        case([0.5, 0.3, 0.2], [0.2, 0.2, 0.1], [1000.0, 20.0], tilted),
    ]
}

/// 1 - (1 - c/2)^5
fn away_from_grazing(cosine: f64) -> f64 {
    1.0 - (1.0 - 0.5 * cosine).powi(5)
}

impl Ashikhmin {
    fn frame(&self, surface: &Surface) -> Frame {
        Frame::about(surface.normal, schema::along(self.axis))
    }

    fn exponents(&self) -> DVec2 {
        DVec2::new(self.nu, self.nv)
    }

    fn sharpness(&self) -> f64 {
        ((self.nu + 1.0) * (self.nv + 1.0)).sqrt()
    }

    fn half_vector_pdf(&self, h: DVec3) -> f64 {
        let square = h.truncate() * h.truncate();
        let sine2 = square.x + square.y;
        let slope = if sine2 < 0.5 {
            -log1p_over(-sine2)
        } else {
            log_of(h.z * h.z) / sine2
        };
        let power = (0.5 * self.exponents().dot(square) * slope).exp();
        self.sharpness() / TAU * power
    }

    fn half_vector(&self, u: DVec2) -> DVec3 {
        let widths = DVec2::new(self.nv + 1.0, self.nu + 1.0);
        let widths = DVec2::new(widths.x.sqrt(), widths.y.sqrt());
        let turn = (widths * circle_point(u.y)).normalize();
        let exponent = self.exponents().dot(turn * turn);
        let log_cos = -u.x * log1p_over(-u.x) / (exponent + 1.0);
        let sine2 = -2.0 * log_cos * expm1_over(2.0 * log_cos);
        (sine2.sqrt() * turn).extend(log_cos.exp())
    }

    fn reflectance(&self, cos_h: f64) -> DVec3 {
        self.specular + (1.0 - self.specular) * schlick(cos_h)
    }

    /// What the lobe leaves to the diffuse term.
    fn below(&self) -> DVec3 {
        self.diffuse * (1.0 - self.specular)
    }

    fn shares(&self, cos_o: f64) -> [f64; 2] {
        let glossy = luminance(self.reflectance(cos_o));
        let dull = luminance(self.below()) * away_from_grazing(cos_o);
        let total = glossy + dull;
        let sharp = (self.sharpness() / 6.0).powi(3);
        let wide = glossy / (1.0 + sharp);
        if total > 0.0 {
            [sharp * wide / total, (dull + wide) / total]
        } else {
            [0.0, 1.0]
        }
    }

    fn lobes(&self, pair: &Pair) -> Lobes {
        let (cos_o, cos_i) = (pair.o.z, pair.i.z);
        let quarter = 0.25 * self.half_vector_pdf(pair.h) / pair.cos_h;
        let glossy = quarter * cos_i / cos_i.max(cos_o) * self.reflectance(pair.cos_h);
        let dull = 28.0 / 23.0 * FRAC_1_PI * cos_i;
        let dull = dull * away_from_grazing(cos_i) * away_from_grazing(cos_o);
        let [half_vectors, cosine] = self.shares(cos_o);
        Lobes {
            diffuse: dull * self.below(),
            glossy,
            pdf: half_vectors * quarter + cosine * cos_i * FRAC_1_PI,
        }
    }
}

impl Bsdf for Ashikhmin {
    fn form(&self) -> &'static Form {
        &FORMS[0]
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![
            ("diffuse", Value::Vector(self.diffuse)),
            ("specular", Value::Vector(self.specular)),
            ("nu", Value::Number(self.nu)),
            ("nv", Value::Number(self.nv)),
            ("axis", Value::Vector(self.axis)),
        ]
    }

    fn mistake(&self) -> Option<Mistake> {
        schema::axis_mistake(self.axis)
    }

    fn members(&self) -> Vec<MemberValue> {
        vec![
            self.specular.into(),
            self.nu.into(),
            self.nv.into(),
            schema::along(self.axis).into(),
        ]
    }

    fn color(&self) -> DVec3 {
        self.diffuse
    }

    // Everything, at grazing incidence: the lobe's albedo is at most Rs + (1 - Rs) B, where B, the mean of
    // Schlick's fifth power, is at most (1 - c/2)^5, which is what the diffuse term leaves of 1 - Rs (the tests
    // look at B).
    fn albedo(&self) -> DVec3 {
        DVec3::ONE
    }

    // Of directions opposite to a grazing one the value goes as 1 over its distance from them: over all
    // incidences only the mean has a bound.
    fn moment(&self, _: usize, k: i32) -> f64 {
        if k > 1 { f64::INFINITY } else { 1.0 }
    }

    fn sample(&self, surface: &Surface, wo: DVec3, u: [f64; 4]) -> BsdfSample {
        let frame = self.frame(surface);
        let (o, place) = (arrival(&frame, wo), DVec2::new(u[0], u[1]));
        let pair = if u[2] < self.shares(o.z)[0] {
            Pair::about(o, self.half_vector(place))
        } else {
            Pair::between(o, cosine_direction(DVec3::Z, place))
        };
        self.lobes(&pair).sample(&frame, &pair)
    }

    fn evaluate(&self, surface: &Surface, wo: DVec3, wi: DVec3) -> BsdfValue {
        let frame = self.frame(surface);
        let pair = Pair::between(arrival(&frame, wo), frame.to_local(wi));
        self.lobes(&pair).value(&pair)
    }
}

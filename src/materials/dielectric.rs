//! Glass, smooth or rough; twin of `shaders/materials/dielectric.wesl`.

mod index;
mod rough;

use glam::{DVec2, DVec3};
use schemars::JsonSchema;
use serde::Deserialize;

pub use index::{Glass, Index, Sellmeier};

use super::fresnel::fresnel;
use super::ggx::alpha;
use super::schema::MAX_MAGNITUDE;
use super::{
    Bsdf, BsdfSample, BsdfValue, Event, Form, Imaging, MaterialKind, Member, MemberValue, Mistake,
    Surface, Value, schema,
};

pub(super) const NAME: &str = "dielectric";

pub(super) const FORMS: &[Form] = &[
    Form {
        what: "smooth glass: Fresnel reflection and refraction",
        delta: true,
        transmits: true,
        imaging: Some(Imaging::Refracts),
        members: &[Member::scalar("ior")],
        ..Form::of(NAME)
    },
    Form {
        name: "rough_dielectric",
        what: "rough glass: the same about GGX microfacets",
        transmits: true,
        members: &[Member::scalar("ior"), Member::scalar("alpha")],
        derives: Some(&["roughness"]),
        ..Form::of(NAME)
    },
];

/// Glass, smooth or rough.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
pub struct Dielectric {
    /// Absolute refractive index (vacuum 1), of all light.
    #[serde(default)]
    #[schemars(with = "f64", range(max = MAX_MAGNITUDE), extend("exclusiveMinimum" = 0.0))]
    pub ior: Option<f64>,
    /// The index of a medium, in the place of `ior`.
    #[serde(default)]
    #[schemars(with = "Glass")]
    pub preset: Option<Glass>,
    /// A and B of the index A + B/l², l the wavelength in micrometres, in the place of `ior`.
    #[serde(default)]
    #[schemars(schema_with = "index::cauchy")]
    pub cauchy: Option<DVec2>,
    /// Sellmeier's terms of the index, in the place of `ior`.
    #[serde(default)]
    #[schemars(with = "Sellmeier")]
    pub sellmeier: Option<Sellmeier>,
    /// 0 is smooth; the square of it is the GGX alpha.
    #[serde(default)]
    #[schemars(
        range(min = 0.0, max = 1.0),
        extend("default" = 0.0),
        transform = schema::texture
    )]
    pub roughness: f64,
    /// What is absorbed of light inside, per unit length and channel.
    #[serde(default)]
    #[schemars(schema_with = "schema::absorption")]
    pub absorption: DVec3,
}

pub(super) fn cases() -> Vec<Dielectric> {
    let smooth = [1.5, 1.0, 2.4].map(Dielectric::smooth);
    let tinted = Dielectric {
        absorption: DVec3::new(0.1, 0.0, 2.0),
        ..Dielectric::smooth(1.5)
    };
    // The narrowest lobes, wide ones, and an index next to 1.
    let rough = [
        (1.5, 0.03),
        (1.33, 0.2),
        (1.01, 0.4),
        (1.5, 0.6),
        (2.4, 1.0),
    ];
    let rough = rough.map(|(ior, roughness)| Dielectric {
        roughness,
        ..Dielectric::smooth(ior)
    });
    // As a scene file has it that was written from its parameters: a preset is an index.
    let dispersive = Dielectric {
        ior: None,
        sellmeier: match Glass::BK7.index() {
            Index::Sellmeier(index) => Some(index),
            _ => None,
        },
        ..Dielectric::smooth(1.5)
    };
    let cauchy = Dielectric {
        ior: None,
        cauchy: Some(DVec2::new(1.4, 0.01)),
        roughness: 0.5,
        ..Dielectric::smooth(1.5)
    };
    [&smooth[..], &[tinted, dispersive], &rough, &[cauchy]].concat()
}

impl Dielectric {
    /// Smooth glass.
    #[must_use]
    pub const fn smooth(ior: f64) -> Self {
        Self {
            ior: Some(ior),
            preset: None,
            cauchy: None,
            sellmeier: None,
            roughness: 0.0,
            absorption: DVec3::ZERO,
        }
    }

    /// Of the keys that give it the first counts.
    fn index(&self) -> Index {
        let given = [
            self.ior.map(Index::Constant),
            self.preset.map(Glass::index),
            self.cauchy.map(Index::Cauchy),
            self.sellmeier.map(Index::Sellmeier),
        ];
        let mut given = given.into_iter().flatten();
        given.next().unwrap_or(Index::Constant(1.0))
    }

    fn alpha(&self) -> f64 {
        alpha(self.roughness, 0.0).x
    }
}

impl Bsdf for Dielectric {
    fn form(&self) -> &'static Form {
        &FORMS[usize::from(self.roughness > 0.0)]
    }

    // What is not given does not count: scenes of before keep their hash.
    fn parameters(&self) -> Vec<(&'static str, Value)> {
        let mut parameters = vec![self.index().parameter()];
        if self.roughness != 0.0 {
            parameters.push(("roughness", Value::Number(self.roughness)));
        }
        if self.absorption != DVec3::ZERO {
            parameters.push(("absorption", Value::Vector(self.absorption)));
        }
        parameters
    }

    fn mistake(&self) -> Option<Mistake> {
        let given = [
            ("ior", self.ior.is_some()),
            ("preset", self.preset.is_some()),
            ("cauchy", self.cauchy.is_some()),
            ("sellmeier", self.sellmeier.is_some()),
        ];
        let keys: Vec<_> = given.iter().filter(|(_, given)| *given).collect();
        let (key, what) = match keys[..] {
            [] => ("type", "a dielectric needs its index"),
            [_] => return self.index().mistake(),
            [_, (key, _), ..] => (*key, "the index is given more than once"),
        };
        Some(Mistake {
            key,
            what,
            help: "give one of `ior`, `preset`, `cauchy` and `sellmeier`",
        })
    }

    // Of Cauchy's index it is A.
    fn members(&self) -> Vec<MemberValue> {
        let ior = match self.index() {
            Index::Cauchy(terms) => terms.x,
            index => index.named(),
        };
        if self.roughness == 0.0 {
            return vec![ior.into()];
        }
        vec![ior.into(), self.alpha().into()]
    }

    fn color(&self) -> DVec3 {
        DVec3::ONE
    }

    fn albedo(&self) -> DVec3 {
        DVec3::ONE
    }

    // The weight is at most 1, G2/G1 where it is rough.
    fn moment(&self, _: usize, _: i32) -> f64 {
        1.0
    }

    // Chooses a lobe with its share of the light; radiance is scaled by 1/eta^2 on refraction.
    fn sample(&self, surface: &Surface, wo: DVec3, u: [f64; 4]) -> BsdfSample {
        if self.roughness > 0.0 {
            return rough::sample(self.alpha(), surface, wo, u);
        }
        let (normal, eta) = (surface.normal, surface.eta);
        let cos_i = normal.dot(wo).clamp(0.0, 1.0);
        let f = fresnel(cos_i, eta);
        if u[2] < f.reflected {
            return BsdfSample {
                wi: (2.0 * cos_i * normal - wo).normalize(),
                weight: DVec3::ONE,
                pdf: 0.0,
                event: Event::DELTA,
                eta: 1.0,
            };
        }
        BsdfSample {
            wi: ((cos_i / eta - f.cos_t) * normal - wo / eta).normalize(),
            weight: DVec3::splat(1.0 / (eta * eta)),
            pdf: 0.0,
            event: Event::DELTA | Event::TRANSMITTED,
            eta,
        }
    }

    fn evaluate(&self, surface: &Surface, wo: DVec3, wi: DVec3) -> BsdfValue {
        if self.roughness > 0.0 {
            rough::evaluate(self.alpha(), surface, wo, wi)
        } else {
            BsdfValue::NONE
        }
    }

    fn ior(&self) -> f64 {
        self.index().named()
    }

    fn dispersion(&self) -> Option<Index> {
        Some(self.index()).filter(Index::is_dispersive)
    }

    fn absorption(&self) -> DVec3 {
        self.absorption
    }

    fn clear(&self) -> Option<MaterialKind> {
        let clear = || Self {
            absorption: DVec3::ZERO,
            ..self.clone()
        };
        (self.absorption != DVec3::ZERO).then(|| clear().into())
    }

    fn of_one_index(&self) -> Option<MaterialKind> {
        let of_one = |index: Index| Self {
            absorption: self.absorption,
            roughness: self.roughness,
            ..Self::smooth(index.named())
        };
        self.dispersion().map(|index| of_one(index).into())
    }
}

//! Refractive indices: constant, or by the wavelength.

use glam::{DVec2, DVec3};
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::Deserialize;

use crate::materials::schema::{MAX_MAGNITUDE, vector};
use crate::materials::{Mistake, Value};
use crate::sampling::spectrum::{LONGEST, SHORTEST};

/// Media by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[expect(missing_docs, reason = "the names say it")]
pub enum Glass {
    BK7,
    SF10,
    #[serde(rename = "diamond")]
    Diamond,
    #[serde(rename = "water")]
    Water,
}

impl Glass {
    /// Its index; of the glasses as their makers give it.
    #[must_use]
    pub const fn index(self) -> Index {
        let (b, c) = match self {
            Self::BK7 => (
                DVec3::new(1.039_612_12, 0.231_792_344, 1.010_469_45),
                DVec3::new(0.006_000_698_67, 0.020_017_914_4, 103.560_653),
            ),
            Self::SF10 => (
                DVec3::new(1.621_539_02, 0.256_287_842, 1.644_475_52),
                DVec3::new(0.012_224_145_7, 0.059_573_677_5, 147.468_793),
            ),
            Self::Diamond => (
                DVec3::new(0.3306, 4.3356, 0.0),
                DVec3::new(0.030_625, 0.011_236, 1.0),
            ),
            Self::Water => return Index::Constant(1.333),
        };
        Index::Sellmeier(Sellmeier { b, c })
    }
}

/// Sellmeier's terms: n² = 1 + sum of b l²/(l² - c), l the wavelength in micrometres.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Sellmeier {
    /// The terms' strengths.
    #[schemars(schema_with = "terms")]
    pub b: DVec3,
    /// The squares of the wavelengths of their resonances, in square micrometres.
    #[schemars(schema_with = "terms")]
    pub c: DVec3,
}

fn terms(_: &mut SchemaGenerator) -> Schema {
    vector(-MAX_MAGNITUDE, MAX_MAGNITUDE)
}

/// A and B of n = A + B/l², l the wavelength in micrometres.
pub(super) fn cauchy(generator: &mut SchemaGenerator) -> Schema {
    let mut schema = terms(generator);
    schema.insert("minItems".into(), 2.into());
    schema.insert("maxItems".into(), 2.into());
    schema
}

/// The wavelength at which an index is named: of the sodium lines, in nm.
const NAMED_AT: f64 = 589.3;

/// An absolute refractive index.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Index {
    /// Of all light.
    Constant(f64),
    /// n = A + B/l², l the wavelength in micrometres.
    Cauchy(DVec2),
    /// By its terms.
    Sellmeier(Sellmeier),
}

impl Index {
    /// At a wavelength in nm.
    #[must_use]
    pub fn at(&self, wavelength: f64) -> f64 {
        let square = (1.0e-3 * wavelength).powi(2);
        match self {
            Self::Constant(ior) => *ior,
            Self::Cauchy(terms) => terms.x + terms.y / square,
            Self::Sellmeier(Sellmeier { b, c }) => {
                let term = |i: usize| match b[i] {
                    0.0 => 0.0,
                    b => b * square / (square - c[i]),
                };
                (1.0 + term(0) + term(1) + term(2)).sqrt()
            }
        }
    }

    /// In a word.
    pub(super) fn named(&self) -> f64 {
        self.at(NAMED_AT)
    }

    /// Whether it depends on the wavelength.
    #[must_use]
    pub fn is_dispersive(&self) -> bool {
        match self {
            Self::Constant(_) => false,
            Self::Cauchy(terms) => terms.y != 0.0,
            Self::Sellmeier(terms) => terms.b != DVec3::ZERO,
        }
    }

    /// Its key and value in a scene file.
    pub(super) fn parameter(&self) -> (&'static str, Value) {
        match self {
            Self::Constant(ior) => ("ior", Value::Number(*ior)),
            Self::Cauchy(terms) => ("cauchy", Value::Pair(*terms)),
            Self::Sellmeier(Sellmeier { b, c }) => {
                let terms = vec![("b", Value::Vector(*b)), ("c", Value::Vector(*c))];
                ("sellmeier", Value::Table(terms))
            }
        }
    }

    /// Whether it is an index for all wavelengths: positive, and no resonance is among them.
    fn is_sound(&self) -> bool {
        let steps = (SHORTEST as u32..=LONGEST as u32).map(f64::from);
        let positive = steps.map(|l| self.at(l)).all(|n| n > 0.0 && n <= MOST);
        let Self::Sellmeier(Sellmeier { b, c }) = self else {
            return positive;
        };
        let visible = (1.0e-3 * SHORTEST).powi(2)..=(1.0e-3 * LONGEST).powi(2);
        positive && (0..3).all(|i| b[i] == 0.0 || !visible.contains(&c[i]))
    }

    /// What is wrong with it.
    pub(super) fn mistake(&self) -> Option<Mistake> {
        let (key, _) = self.parameter();
        let what = match key {
            "cauchy" => "`cauchy` is no index at some wavelength from 360 to 830 nm",
            _ => "`sellmeier` is no index at some wavelength from 360 to 830 nm",
        };
        (self.is_dispersive() && !self.is_sound()).then_some(Mistake {
            key,
            what,
            help: "an index is above 0 and at most 1e6, and l is in micrometres",
        })
    }
}

/// The largest index that depends on the wavelength: its square is an f32, with room to compute.
const MOST: f64 = 1.0e6;

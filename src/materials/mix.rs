//! Mixes of materials; twin of `shaders/materials/mix.wesl`.

use glam::DVec3;
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::Deserialize;

use super::lobes::Lobes;
use super::{
    Bsdf, BsdfSample, BsdfValue, Event, Form, Material, MaterialKind, Member, MemberValue, Surface,
    Texture, Value,
};

pub(super) const NAME: &str = "mix";

/// Where the parts of a material begin and end among those of all: the scene's to say (`records/mix.rs`).
pub const PARTS: [Member; 2] = [Member::word("first_part"), Member::word("end_part")];

pub(super) const FORMS: &[Form] = &[Form {
    what: "other materials, each by a weight",
    // Of some parts, or of none.
    part_delta: true,
    derives: Some(&["weight"]),
    members: &[
        PARTS[0],
        PARTS[1],
        Member::scalar("key_weight"),
        // 1 less that.
        Member::scalar("first_weight"),
    ],
    ..Form::of(NAME)
}];

/// Whether it has others as its parts.
#[must_use]
pub fn is_mix(form: &Form) -> bool {
    form.material == NAME
}

/// The most parts of a mix, those of mixes in it among them.
pub const MOST_PARTS: usize = 64;

/// What the parts' weights may be off 1 by rounding.
const SLACK: f64 = 1e-9;

/// Two materials: (1 - weight) f of the first and weight f of the second.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
pub struct Mix {
    /// The names of both.
    #[schemars(schema_with = "two_names")]
    pub materials: [String; 2],
    /// The share of the second one.
    #[schemars(range(min = 0.0, max = 1.0), transform = super::schema::texture)]
    pub weight: f64,
    /// What both are, without mixes; nothing before the scene is put together.
    #[serde(skip)]
    #[schemars(skip)]
    pub parts: Vec<Part>,
}

/// A material of a mix that is no mix itself.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// How it scatters light; what it emits does not count.
    pub material: Material,
    /// Whether it is of the second of the two.
    pub second: bool,
    /// Of mixes in the mix: the shares by which theirs is multiplied.
    pub inner: Vec<Factor>,
}

/// The share of one of the two of a mix that is in another one.
#[derive(Clone, Debug, PartialEq)]
pub struct Factor {
    /// Whether it is that of the second.
    pub second: bool,
    /// That mix's weight.
    pub weight: Weight,
}

/// The weight of a mix in another one.
#[derive(Clone, Debug, PartialEq)]
pub enum Weight {
    /// The same everywhere.
    Number(f64),
    /// A value of its red channel.
    Texture(Texture),
}

fn two_names(_: &mut SchemaGenerator) -> Schema {
    schemars::json_schema!({
        "type": "array",
        "items": { "type": "string" },
        "minItems": 2,
        "maxItems": 2,
    })
}

impl Weight {
    /// It, or the largest value that it has.
    fn most(&self) -> f64 {
        match self {
            Self::Number(number) => *number,
            Self::Texture(texture) => texture.largest().x,
        }
    }

    fn least(&self) -> f64 {
        match self {
            Self::Number(number) => *number,
            Self::Texture(texture) => texture.least().x,
        }
    }
}

impl Factor {
    /// The least and the largest share.
    fn range(&self) -> [f64; 2] {
        let [least, most] = [self.weight.least(), self.weight.most()];
        match self.second {
            true => [least, most],
            false => [1.0 - most, 1.0 - least],
        }
    }

    /// The share for textures' largest values.
    fn share(&self) -> f64 {
        match self.second {
            true => self.weight.most(),
            false => 1.0 - self.weight.most(),
        }
    }
}

impl Part {
    /// Its texture, if that is one.
    pub fn texture_weights(&self) -> impl Iterator<Item = (bool, &Texture)> {
        self.inner.iter().filter_map(|factor| match &factor.weight {
            Weight::Texture(texture) => Some((factor.second, texture)),
            Weight::Number(_) => None,
        })
    }

    /// The product of the shares that are numbers.
    #[must_use]
    pub fn number(&self) -> f64 {
        let numbers = self.inner.iter();
        let numbers = numbers.filter(|factor| matches!(factor.weight, Weight::Number(_)));
        numbers.map(Factor::share).product()
    }
}

pub(super) fn cases() -> Vec<Mix> {
    let all = |name: &str| {
        let ty = super::ALL.iter().find(|material| material.name == name);
        ty.map_or_else(Vec::new, |ty| (ty.cases)())
    };
    let kind = |name: &str, case: usize| all(name).swap_remove(case);
    let part = |kind: &MaterialKind, second: bool| Part {
        material: Material::new(kind.name(), kind.clone()),
        second,
        inner: Vec::new(),
    };
    let two = |a: MaterialKind, b: MaterialKind, weight: f64| Mix {
        materials: [&a, &b].map(|kind| kind.name().to_owned()),
        weight,
        parts: vec![part(&a, false), part(&b, true)],
    };
    let within = |kind: MaterialKind, second: bool, weight: f64| Part {
        inner: vec![Factor {
            second,
            weight: Weight::Number(weight),
        }],
        ..part(&kind, true)
    };
    // Two that are alike in all but a colour; a mirror beside a dull colour; rough metal and cloth; a clear coat and a
    // mix of three others; a part that has no share.
    vec![
        two(kind("diffuse", 0), kind("diffuse", 2), 0.25),
        two(kind("diffuse", 0), kind("mirror", 0), 0.375),
        two(kind("conductor", 3), kind("sheen", 0), 0.75),
        Mix {
            materials: ["car-paint", "another"].map(str::to_owned),
            weight: 0.625,
            parts: vec![
                part(&kind("car-paint", 1), false),
                within(kind("nylon", 1), false, 0.5),
                within(kind("disney", 1), true, 0.5),
            ],
        },
        two(kind("conductor", 0), kind("ashikhmin", 0), 1.0),
    ]
}

/// Which part a direction is drawn from, and the number that is left for it to choose a lobe by.
struct Chosen<'a> {
    place: usize,
    kind: &'a MaterialKind,
    z: f64,
}

/// Below 1, as uniform numbers are.
const BELOW_ONE: f64 = 1.0 - 0.5 * f32::EPSILON as f64;

impl Mix {
    /// The parts' weights, which add up to 1.
    #[must_use]
    pub fn weights(&self) -> Vec<f64> {
        let parts = self.parts.iter();
        parts
            .map(|part| {
                let own = if part.second {
                    self.weight
                } else {
                    1.0 - self.weight
                };
                own * part.inner.iter().map(Factor::share).product::<f64>()
            })
            .collect()
    }

    fn weighed(&self) -> impl Iterator<Item = (f64, &MaterialKind)> {
        let parts = self.parts.iter().map(|part| &part.material.kind);
        self.weights().into_iter().zip(parts)
    }

    /// The largest mean of `value` over the parts that their weights allow, textures being independent.
    fn at_most(&self, value: impl Fn(&Material) -> f64) -> f64 {
        let mut parts: Vec<([f64; 2], f64)> = self
            .parts
            .iter()
            .map(|part| {
                let own = if part.second {
                    self.weight
                } else {
                    1.0 - self.weight
                };
                let inner = part.inner.iter().map(Factor::range);
                let range = inner.fold([own; 2], |[a, b], [c, d]| [a * c, b * d]);
                (range, value(&part.material))
            })
            .filter(|([_, most], _)| *most > 0.0)
            .collect();
        parts.sort_by(|(_, a), (_, b)| b.total_cmp(a));
        // Each has the least that it must, and the largest values the rest.
        let mut rest = 1.0 - parts.iter().map(|([least, _], _)| least).sum::<f64>();
        let mut sum = 0.0;
        for ([least, most], value) in parts {
            let more = (most - least).min(rest.max(0.0));
            rest -= more;
            if least + more > 0.0 {
                sum += (least + more) * value;
            }
        }
        sum
    }

    fn choose(&self, surface: &Surface, wo: DVec3, z: f64) -> Option<Chosen<'_>> {
        let shares = self.weighed().map(|(weight, kind)| {
            let delta = match kind.is_delta() {
                true => 1.0,
                false => kind.delta_share(surface, wo),
            };
            (weight, delta, kind)
        });
        let shares: Vec<_> = shares.collect();
        // The number decides first whether it is a delta lobe, of which part, and then of which part the others are.
        let mut left = z;
        for (place, &(weight, delta, kind)) in shares.iter().enumerate() {
            if left < weight * delta {
                let z = left / weight;
                return Some(Chosen { place, kind, z });
            }
            left -= weight * delta;
        }
        let mut last = None;
        for (place, &(weight, delta, kind)) in shares.iter().enumerate() {
            let share = weight * (1.0 - delta);
            if share > 0.0 {
                let z = (delta + left / weight).min(BELOW_ONE);
                last = Some(Chosen { place, kind, z });
                if left < share {
                    break;
                }
                left -= share;
            }
        }
        last
    }
}

/// Adds what a part sends somewhere.
fn add(sum: &mut Lobes, weight: f64, value: &BsdfValue) {
    match value.event.is(Event::DIFFUSE) {
        true => sum.diffuse += weight * value.f_cos,
        false => sum.glossy += weight * value.f_cos,
    }
    sum.pdf += weight * value.pdf;
}

const NOTHING: Lobes = Lobes {
    diffuse: DVec3::ZERO,
    glossy: DVec3::ZERO,
    pdf: 0.0,
};

impl Bsdf for Mix {
    fn form(&self) -> &'static Form {
        &FORMS[0]
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        vec![
            ("materials", Value::Names(self.materials.to_vec())),
            ("weight", Value::Number(self.weight)),
        ]
    }

    fn with_files_of(mut self, other: &Self) -> Self {
        self.parts.clone_from(&other.parts);
        self
    }

    fn lacking(&self) -> Option<&'static str> {
        let parts = || self.parts.iter().map(|part| &part.material.kind);
        // Each half is a mix whose weights add up to 1.
        let sum: f64 = self.weights().iter().sum();
        if self.parts.is_empty() {
            Some("the parts of a mix are not there")
        } else if self.parts.len() > MOST_PARTS {
            Some("a mix has too many parts")
        } else if parts().any(|kind| kind.transmits()) {
            Some("a part of a mix is a dielectric")
        } else if parts().any(|kind| is_mix(kind.form())) {
            Some("a part of a mix is a mix, which would have its own parts there")
        } else if sum.is_nan() || (sum - 1.0).abs() > SLACK {
            Some("the weights of a mix's parts do not add up to 1")
        } else {
            None
        }
    }

    fn parts(&self) -> &[Part] {
        &self.parts
    }

    fn members(&self) -> Vec<MemberValue> {
        vec![
            MemberValue::Word(0),
            MemberValue::Word(0),
            self.weight.into(),
            (1.0 - self.weight).into(),
        ]
    }

    fn color(&self) -> DVec3 {
        self.weighed()
            .map(|(weight, kind)| weight * kind.color())
            .sum()
    }

    fn albedo(&self) -> DVec3 {
        let channel = |c: usize| self.at_most(|part| part.albedo()[c]);
        DVec3::new(channel(0), channel(1), channel(2))
    }

    // Of a weighted mean the k-th power is at most the mean of the k-th powers; and what is left of the choice beside
    // delta lobes weighs the parts' own weights by what each has left.
    fn moment(&self, channel: usize, k: i32) -> f64 {
        self.at_most(|part| part.moment(channel, k))
    }

    fn sample(&self, surface: &Surface, wo: DVec3, u: [f64; 4]) -> BsdfSample {
        let chosen = self.choose(surface, wo, u[2]);
        let Chosen { place, kind, z } = chosen.expect("a mix has parts, whose weights add up to 1");
        let s = kind.sample(surface, wo, [u[0], u[1], z, u[3]]);
        if s.pdf <= 0.0 {
            return s;
        }
        let mut sum = NOTHING;
        for (at, (weight, other)) in self.weighed().enumerate() {
            let value = match at == place {
                true => BsdfValue {
                    f_cos: s.pdf * s.weight,
                    pdf: s.pdf,
                    event: s.event,
                },
                false => other.evaluate(surface, wo, s.wi),
            };
            add(&mut sum, weight, &value);
        }
        BsdfSample {
            weight: (sum.diffuse + sum.glossy) / sum.pdf,
            pdf: sum.pdf,
            event: sum.event(),
            ..s
        }
    }

    fn delta_share(&self, surface: &Surface, wo: DVec3) -> f64 {
        self.weighed()
            .map(|(weight, kind)| match kind.is_delta() {
                true => weight,
                false => weight * kind.delta_share(surface, wo),
            })
            .sum()
    }

    fn evaluate(&self, surface: &Surface, wo: DVec3, wi: DVec3) -> BsdfValue {
        let mut sum = NOTHING;
        for (weight, kind) in self.weighed() {
            add(&mut sum, weight, &kind.evaluate(surface, wo, wi));
        }
        BsdfValue {
            f_cos: sum.diffuse + sum.glossy,
            pdf: sum.pdf,
            event: sum.event(),
        }
    }
}

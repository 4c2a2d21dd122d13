//! What every material has to pass, whatever it is: [`crate::materials::ALL`] and their test cases, on a
//! device through the dispatch, with the records that a render has.
//!
//! [`twin`]: the device says what the f64 twin says. [`draw`]: what is drawn follows the pdf, and its mean
//! weight is the light that is scattered. [`pairs`]: sample and evaluate agree, and so do both ways.

pub mod draw;
pub mod pairs;
pub mod twin;

use std::collections::BTreeMap;

use glam::DVec3;

use crate::error::Result;
use crate::gpu::bsdf_probe::{BsdfInput, BsdfProbe, Evaluated, Sampled};
use crate::gpu::device::Gpu;
use crate::materials::fresnel::fresnel;
use crate::materials::{
    ALL, BsdfSample, BsdfValue, Material, MaterialKind, Surface, Texture, Value, sample_uniform,
};
use crate::settings::Integrator;
use crate::verify::{Random, ULP};

/// Materials on a device, and their twins.
#[derive(Debug)]
pub struct Subjects {
    kinds: Vec<MaterialKind>,
    /// The place of the first of them among all cases.
    first: usize,
    lecture: bool,
    probe: BsdfProbe,
}

impl Subjects {
    /// All cases of all materials.
    #[must_use]
    pub fn all(gpu: &Gpu, integrator: Integrator) -> Self {
        let kinds = ALL.iter().flat_map(|material| (material.cases)());
        Self::of(gpu, kinds.collect(), integrator)
    }

    /// The same, those of each material in a kernel without the others: drivers that execute all sides of a branch draw
    /// many samples from it in a fraction of the time.
    #[must_use]
    pub fn each(gpu: &Gpu, integrator: Integrator) -> Vec<Self> {
        let mut all = Vec::new();
        let mut first = 0;
        for material in ALL {
            let subjects = Self {
                first,
                ..Self::of(gpu, (material.cases)(), integrator)
            };
            first += subjects.kinds.len();
            all.push(subjects);
        }
        all
    }

    /// These.
    #[must_use]
    pub fn of(gpu: &Gpu, kinds: Vec<MaterialKind>, integrator: Integrator) -> Self {
        Self {
            probe: BsdfProbe::new(gpu, &kinds, integrator),
            first: 0,
            lecture: matches!(integrator, Integrator::Lecture { .. }),
            kinds,
        }
    }

    /// All cases of all materials, on the device with textures of one value each for all that may be one: a record
    /// of other values, in whose place these come. Without textures, `with_textures` being false, the other values
    /// are what it has.
    #[must_use]
    pub fn textured(gpu: &Gpu, with_textures: bool) -> Self {
        let kinds: Vec<MaterialKind> = ALL.iter().flat_map(|material| (material.cases)()).collect();
        let materials = kinds.iter().map(|kind| match with_textures {
            true => disguised(kind),
            false => Material {
                textures: Vec::new(),
                ..disguised(kind)
            },
        });
        Self {
            probe: BsdfProbe::of(gpu, materials.collect(), Integrator::Bsdf),
            first: 0,
            lecture: false,
            kinds,
        }
    }

    /// The materials; a question names one by its place.
    #[must_use]
    pub fn kinds(&self) -> &[MaterialKind] {
        &self.kinds
    }

    /// The places of the first `most` cases of each form.
    pub fn first_of_each_form(&self, most: usize) -> impl Iterator<Item = usize> + '_ {
        let mut taken: BTreeMap<&str, usize> = BTreeMap::new();
        let all = self.kinds.iter().enumerate();
        all.filter_map(move |(subject, kind)| {
            let taken = taken.entry(kind.form().name).or_default();
            *taken += 1;
            (*taken <= most).then_some(subject)
        })
    }

    /// Whether they are sampled uniformly, but for delta lobes.
    #[must_use]
    pub fn is_uniform(&self, subject: usize) -> bool {
        self.lecture && self.kinds[subject].form().is_hemispherical()
    }

    /// What the device makes of uniform numbers.
    ///
    /// # Errors
    /// If the device fails.
    pub fn sample(&self, inputs: &[BsdfInput]) -> Result<Vec<Sampled>> {
        self.probe.sample(inputs)
    }

    /// What the device says of directions.
    ///
    /// # Errors
    /// If the device fails.
    pub fn evaluate(&self, inputs: &[BsdfInput]) -> Result<Vec<Evaluated>> {
        self.probe.evaluate(inputs)
    }

    /// The next case of the same type of material: one that it must not be taken for.
    fn next(&self, subject: usize) -> usize {
        let name = self.kinds[subject].name();
        let after = (subject + 1..self.kinds.len()).find(|i| self.kinds[*i].name() == name);
        let first = self.kinds.iter().position(|kind| kind.name() == name);
        after.or(first).unwrap_or(subject)
    }

    fn twin_sample(&self, subject: usize, q: &Question) -> BsdfSample {
        let kind = &self.kinds[subject];
        if self.is_uniform(subject) {
            sample_uniform(&**kind, &q.surface, q.wo, q.u)
        } else {
            kind.sample(&q.surface, q.wo, q.u)
        }
    }

    fn twin_evaluate(&self, subject: usize, q: &Question) -> BsdfValue {
        self.kinds[subject].evaluate(&q.surface, q.wo, DVec3::new(q.u[0], q.u[1], q.u[2]))
    }

    /// Questions to `subject`; their last row is uniform numbers.
    fn questions(&self, random: &mut Random, subject: usize, count: usize) -> Vec<BsdfInput> {
        let kind = &self.kinds[subject];
        (0..count)
            .map(|i| {
                let normal = normal(random, i);
                let wo = arrival(random, normal, i);
                let surface = Surface {
                    normal,
                    eta: eta(random, kind, i),
                    // On a ball; nothing is drawn where nothing looks.
                    offset: match kind.form().offset {
                        true => random.direction(),
                        false => DVec3::ZERO,
                    },
                };
                BsdfInput::new(subject, &surface, wo, random.unit4())
            })
            .collect()
    }

    /// The same with a direction as the last row, half of them near the mirror direction or, every other one of
    /// these where light is scattered through the surface, near the refracted one.
    fn directions(&self, random: &mut Random, subject: usize, count: usize) -> Vec<BsdfInput> {
        let mut inputs = self.questions(random, subject, count);
        for (i, input) in inputs.iter_mut().enumerate() {
            let Surface { normal, eta, .. } = input.surface();
            let near = if self.kinds[subject].is_translucent() && i % 4 == 0 {
                let cosine = normal.dot(input.wo()).clamp(0.0, 1.0);
                (cosine / eta - fresnel(cosine, eta).cos_t) * normal - input.wo() / eta
            } else {
                (-input.wo()).reflect(normal)
            };
            let wi = match i % 2 {
                0 => near + random.magnitude(-3.0, 0.5) * random.direction(),
                _ => random.direction(),
            };
            input.u = super::to_row(wi.normalize(), 0.0);
        }
        inputs
    }
}

/// A material that is this one by its textures, and another one without.
fn disguised(kind: &MaterialKind) -> Material {
    let mut material = Material::new("disguised", kind.clone());
    let mut others = Vec::new();
    for key in kind.form().texturable() {
        let own = kind
            .parameters()
            .into_iter()
            .find(|(name, _)| *name == key.key);
        let (value, other) = match own.map(|(_, value)| value) {
            Some(Value::Vector(v)) => (v, Value::Vector(0.25 + 0.5 * (1.0 - v))),
            Some(Value::Number(x)) if x >= 0.5 => (DVec3::splat(x), Value::Number(0.33)),
            Some(Value::Number(x)) => (DVec3::splat(x), Value::Number(0.77)),
            // What is 0 need not be said.
            _ => (DVec3::ZERO, Value::Number(0.77)),
        };
        let (values, size) = ([value; 2], 0.5);
        material = material.with_texture(key, Texture::Checker { values, size });
        others.push((key.key, other));
    }
    material.kind = kind.with(&others);
    material
}

/// A question as the twin takes it: the numbers of a [`BsdfInput`].
#[derive(Clone, Copy, Debug)]
struct Question {
    surface: Surface,
    wo: DVec3,
    u: [f64; 4],
}

impl Question {
    fn of(input: &BsdfInput) -> Self {
        Self {
            surface: input.surface(),
            wo: input.wo(),
            u: input.u.map(f64::from),
        }
    }

    /// All numbers off by up to [`INPUTS`].
    fn perturbed(&self, random: &mut Random) -> Self {
        let mut off = || {
            let [x, y, z, w] = random.unit4().map(|x| (2.0 * f64::from(x) - 1.0) * INPUTS);
            (DVec3::new(x, y, z), w)
        };
        let ((normal, eta), (wo, w), (u, _)) = (off(), off(), off());
        let offset = match self.surface.offset == DVec3::ZERO {
            true => DVec3::ZERO,
            false => off().0,
        };
        Self {
            surface: Surface {
                normal: self.surface.normal + normal,
                eta: self.surface.eta * (1.0 + eta),
                offset: self.surface.offset + offset,
            },
            wo: self.wo + wo,
            u: [
                self.u[0] + u.x,
                self.u[1] + u.y,
                self.u[2] + u.z,
                self.u[3] + w,
            ],
        }
    }
}

/// What arithmetic in f32 makes of a formula is what the formula makes of inputs that are slightly off: by so
/// much, for some 16 operations one after another. What that does is found from [`PERTURBED`] random ones;
/// besides, there are the roundings of the last steps and of the parameters, [`ROUNDINGS`]. The largest of a few random
/// ones is an estimate and no bound: of 256314 weights of a rough metal one is off by 1.009 of it, at a cosine of 0.002.
const INPUTS: f64 = 16.0 * ULP;
const PERTURBED: usize = 8;
const ROUNDINGS: f64 = 16.0 * ULP;

/// Where the allowance is beyond this share of the value, a case says nothing: an edge of a lobe, or the
/// border of total reflection.
const EDGE: f64 = 1.0e-2;

fn normal(random: &mut Random, i: usize) -> DVec3 {
    const SPECIAL: [DVec3; 4] = [DVec3::Z, DVec3::NEG_Z, DVec3::X, DVec3::NEG_Y];
    match i % 16 {
        0 => SPECIAL[i / 16 % SPECIAL.len()],
        _ => random.direction(),
    }
}

/// A direction on the normal's side; along it and grazing ones among them.
fn arrival(random: &mut Random, normal: DVec3, i: usize) -> DVec3 {
    let wo = random.direction();
    let wo = if wo.dot(normal) < 0.0 { -wo } else { wo };
    let cosine = match i % 8 {
        1 => random.magnitude(-4.0, -1.0),
        2 => return normal,
        _ => wo.dot(normal).max(1.0e-4),
    };
    (wo + (cosine - wo.dot(normal)) * normal).normalize()
}

fn eta(random: &mut Random, kind: &MaterialKind, i: usize) -> f64 {
    let ior = kind.ior();
    let choices = if kind.is_translucent() {
        // At 1 there is no surface, next to it there is one.
        [
            ior,
            1.0 / ior,
            1.0 / random.range(0.5, 0.95),
            random.range(0.4, 0.95),
        ]
    } else if kind.transmits() {
        [ior, 1.0 / ior, 1.0, random.range(0.4, 2.5)]
    } else {
        // In air, or in glass.
        [1.0, 1.0, 1.0 / 1.5, 1.0 / random.range(1.0, 2.5)]
    };
    choices[i / 3 % 4]
}

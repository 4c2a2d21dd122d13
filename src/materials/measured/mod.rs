//! Measured materials: tables of the MERL database; twin of `shaders/materials/measured.wesl`, which has the formulas'
//! sources.

use std::f64::consts::{FRAC_1_PI, TAU};
use std::sync::Arc;

use glam::{DVec2, DVec3};
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::{Deserialize, Deserializer};

use super::ggx::{Frame, ggx_normal, ggx_pdf};
use super::lobes::{Lobes, Pair, arrival};
use super::scattered::{MARGIN, gains_energy};
use super::{Bsdf, BsdfSample, BsdfValue, Form, Member, MemberValue, Surface, Value};
use crate::sampling::directions::cosine_direction;

mod cases;
mod fit;
mod merl;
mod table;

pub(super) use cases::cases;
pub use fit::Lobe;
pub use merl::{MERL_BYTES, MERL_SIZES, parse};
pub use table::{BrdfTable, directions};

pub(super) const NAME: &str = "measured";

/// Where the material's table begins in the kernel's texture of all tables: the scene's to say (`records/measured.rs`).
pub const START: Member = Member::word("measured_start");

pub(super) const FORMS: &[Form] = &[Form {
    what: "measured materials: tables by half and difference angles",
    members: &[
        START,
        // How many entries by theta_h, theta_d and phi_d.
        Member::vector("measured_sizes"),
        Member::vector("measured_scale"),
        // Of the lobe that is sampled: its alpha, and the shares of it and of the cosine by o.n.
        Member::scalar("measured_alpha"),
        Member::vector("measured_lobe_low"),
        Member::vector("measured_lobe_high"),
        Member::vector("measured_cosine_low"),
        Member::vector("measured_cosine_high"),
    ],
    ..Form::of(NAME)
}];

/// Whether it looks up a table.
#[must_use]
pub fn is_tabled(form: &Form) -> bool {
    form.material == NAME
}

/// The largest factor: with the largest entry the product is an f32.
const MAX_SCALE: f64 = 1.0e10;

/// A measured isotropic material: a file of the MERL database.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
pub struct Measured {
    /// The `.binary` file; relative to the scene file's folder.
    pub file: String,
    /// What its values are multiplied by: a number, or one for each channel.
    #[serde(default = "one", deserialize_with = "scale")]
    #[schemars(schema_with = "scale_schema")]
    pub scale: DVec3,
    /// What is in the file; `None` before it has been read.
    #[serde(skip)]
    #[schemars(skip)]
    pub table: Option<Arc<BrdfTable>>,
}

fn one() -> DVec3 {
    DVec3::ONE
}

fn scale<'de, D: Deserializer<'de>>(deserializer: D) -> Result<DVec3, D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged)]
    enum Scale {
        Number(f64),
        Channels([f64; 3]),
    }
    Ok(match Scale::deserialize(deserializer)? {
        Scale::Number(number) => DVec3::splat(number),
        Scale::Channels(channels) => channels.into(),
    })
}

fn scale_schema(_: &mut SchemaGenerator) -> Schema {
    schemars::json_schema!({
        "type": ["number", "array"],
        "minimum": 0.0,
        "maximum": MAX_SCALE,
        "items": { "type": "number", "minimum": 0.0, "maximum": MAX_SCALE },
        "minItems": 3,
        "maxItems": 3,
        "default": 1.0,
    })
}

impl Measured {
    /// A material by a table, which messages call `file`.
    #[must_use]
    pub fn of(file: &str, table: Arc<BrdfTable>, scale: DVec3) -> Self {
        Self {
            file: file.to_owned(),
            scale,
            table: Some(table),
        }
    }

    fn known(&self) -> &Arc<BrdfTable> {
        let table = self.table.as_ref();
        table.expect("a scene is loaded with the tables that it names")
    }

    /// The light that is scattered at most, by channel, about.
    fn most(&self) -> DVec3 {
        self.scale * self.known().most()
    }

    fn lobes(&self, pair: &Pair) -> Lobes {
        let table = self.known();
        let Lobe { alpha, .. } = table.lobe();
        let [lobe, cosine] = table.lobe().shares(pair.o.z);
        let bright = lobe * ggx_pdf(pair.o, pair.h, DVec2::splat(alpha));
        let dull = cosine * FRAC_1_PI * pair.i.z;
        let pdf = bright + dull;
        let f_cos = pair.i.z / pdf * self.scale * table.value(pair);
        Lobes {
            diffuse: dull * f_cos,
            glossy: bright * f_cos,
            pdf,
        }
    }
}

impl Bsdf for Measured {
    fn form(&self) -> &'static Form {
        &FORMS[0]
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        let content = self.table.as_ref().map_or(0, |table| table.content());
        vec![
            (
                "file",
                Value::File {
                    name: self.file.clone(),
                    content,
                },
            ),
            ("scale", Value::Vector(self.scale)),
        ]
    }

    fn with_files_of(mut self, other: &Self) -> Self {
        self.table.clone_from(&other.table);
        self
    }

    fn lacking(&self) -> Option<&'static str> {
        let is_there = self.table.is_some();
        (!is_there).then_some("the table of a measured material has not been read")
    }

    fn table(&self) -> Option<&Arc<BrdfTable>> {
        self.table.as_ref()
    }

    fn members(&self) -> Vec<MemberValue> {
        let table = self.known();
        let Lobe {
            alpha,
            lobe,
            cosine,
        } = table.lobe();
        let part = |all: [f64; 6], from: usize| MemberValue::from(DVec3::from_slice(&all[from..]));
        let sizes = table.sizes().map(|size| size as f64);
        vec![
            MemberValue::Word(0),
            DVec3::from(sizes).into(),
            self.scale.into(),
            alpha.into(),
            part(lobe, 0),
            part(lobe, 3),
            part(cosine, 0),
            part(cosine, 3),
        ]
    }

    fn color(&self) -> DVec3 {
        self.scale * self.known().color()
    }

    fn albedo(&self) -> DVec3 {
        MARGIN * self.most()
    }

    // The weight 2 pi f cos is at most 2 pi times the largest entry, and its mean is the albedo.
    fn moment(&self, channel: usize, k: i32) -> f64 {
        let largest = TAU * self.scale[channel] * self.known().largest()[channel];
        self.albedo()[channel] * largest.powi(k - 1)
    }

    fn sample(&self, surface: &Surface, wo: DVec3, u: [f64; 4]) -> BsdfSample {
        let frame = Frame::about(surface.normal, DVec3::Y);
        let (o, place) = (arrival(&frame, wo), DVec2::new(u[0], u[1]));
        let lobe = self.known().lobe();
        let pair = if u[2] < lobe.shares(o.z)[0] {
            let (h, cos_h) = ggx_normal(o, DVec2::splat(lobe.alpha), place);
            Pair::of(o, h, cos_h.min(1.0))
        } else {
            Pair::between(o, cosine_direction(DVec3::Z, place))
        };
        self.lobes(&pair).sample(&frame, &pair)
    }

    fn evaluate(&self, surface: &Surface, wo: DVec3, wi: DVec3) -> BsdfValue {
        let frame = Frame::about(surface.normal, DVec3::Y);
        let pair = Pair::between(arrival(&frame, wo), frame.to_local(wi));
        self.lobes(&pair).value(&pair)
    }

    fn warning(&self) -> Option<[String; 2]> {
        gains_energy(self.most(), "so its data have it: lower `scale`")
    }
}

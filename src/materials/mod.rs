//! Materials: how surfaces scatter light, one file each here and in `shaders/materials/`.
//!
//! A material is two files and one line, in the list below. Its file here has its parameters as in the
//! scene file, its forms in the kernel, its f64 twin and its test cases; its file in `shaders/materials/`
//! the functions of its forms. Schema, validation, hash, kernel members, kind codes, both dispatches, the
//! rows of the effects and the tests that every material has to pass follow from the line.
//!
//! What a material brings beside its parameters is more: the table of `measured` and the parts of `mix` have records
//! of their own (`src/records/`), and whatever reads, links and binds these.

pub mod beckmann;
pub mod coat;
mod contract;
pub mod flakes;
mod form;
pub mod fresnel;
pub mod ggx;
#[cfg(test)]
mod hemisphere;
pub mod lattice;
pub mod lobes;
pub mod material;
mod paint;
pub mod powers;
mod scattered;
pub mod schema;
pub mod texturable;
pub mod texture;
mod uniform;
mod value;

use std::ops::Deref;
use std::sync::{Arc, LazyLock};

use glam::DVec3;
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::Deserialize;

use dielectric::Index;
use measured::BrdfTable;
use mix::Part;

pub use contract::{BsdfSample, BsdfValue, Event, Surface};
pub use form::{Form, Imaging, Member, MemberKind, MemberValue};
pub use material::Material;
pub use texturable::Texturable;
pub use texture::{Texture, TextureImage, Textured};
pub use uniform::sample_uniform;
pub use value::Value;

/// What a material says and does. The optics are the twin of `shaders/materials/NAME.wesl`, where the
/// contract is stated (`contract.wesl`); `wo` is on the side of the surface's normal.
pub trait Bsdf {
    /// Which of its forms it has in the kernel.
    fn form(&self) -> &'static Form;

    /// Its parameters, by their keys in the scene file, in a fixed order.
    fn parameters(&self) -> Vec<(&'static str, Value)>;

    /// The values of its form's members.
    fn members(&self) -> Vec<MemberValue>;

    /// The values of its form's anchored members, for a sphere whose pole is at `anchor` from its centre, in scene
    /// units.
    fn anchored(&self, _: DVec3) -> Vec<MemberValue> {
        Vec::new()
    }

    /// Its colour, for the layer `albedo`: about the share of the light that it scatters.
    fn color(&self) -> DVec3;

    /// The share of the light that it scatters, at most, by channel.
    fn albedo(&self) -> DVec3;

    /// The k-th moment of the weight of a direction drawn uniformly from the hemisphere, or of a delta
    /// lobe's, or of both where there are both ([`sample_uniform`]), in a channel, at most: what the lecture's
    /// variance law needs. Infinite if there is no bound.
    fn moment(&self, channel: usize, k: i32) -> f64;

    /// Chooses where a path goes on, from uniform numbers.
    fn sample(&self, surface: &Surface, wo: DVec3, u: [f64; 4]) -> BsdfSample;

    /// The probability of its delta lobe beside others: `sample` chooses it where `u[2]` is below.
    fn delta_share(&self, _: &Surface, _: DVec3) -> f64 {
        0.0
    }

    /// f cos of `wi` and the pdf with which [`sample`](Self::sample) finds it, without delta lobes.
    fn evaluate(&self, surface: &Surface, wo: DVec3, wi: DVec3) -> BsdfValue;

    /// Absolute refractive index of the inner side, in a word; 1 where paths do not cross the surface.
    fn ior(&self) -> f64 {
        1.0
    }

    /// The index by the wavelength, where it depends on it.
    fn dispersion(&self) -> Option<Index> {
        None
    }

    /// What is absorbed of light on its inner side, per unit length of the scene, by channel.
    fn absorption(&self) -> DVec3 {
        DVec3::ZERO
    }

    /// What was measured, of one that is a table.
    fn table(&self) -> Option<&Arc<BrdfTable>> {
        None
    }

    /// What it is a mix of.
    fn parts(&self) -> &[Part] {
        &[]
    }

    /// The same without absorption, where it absorbs.
    fn clear(&self) -> Option<MaterialKind> {
        None
    }

    /// The same with one index for all wavelengths, where it has several.
    fn of_one_index(&self) -> Option<MaterialKind> {
        None
    }

    /// The same with what does not follow from its parameters, as files' content, from the one that it was made of.
    #[must_use]
    fn with_files_of(self, _: &Self) -> Self
    where
        Self: Sized,
    {
        self
    }

    /// What is wrong with its parameters together.
    fn mistake(&self) -> Option<Mistake> {
        None
    }

    /// What has to be put to it beside its parameters, by who makes a scene of it, and is not there or not right.
    fn lacking(&self) -> Option<&'static str> {
        None
    }

    /// What is legal and probably not meant: what it does, and what to change.
    fn warning(&self) -> Option<[String; 2]> {
        None
    }
}

/// Parameters of which each is right, but not all together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mistake {
    /// The key to show; `type` if something is missing.
    pub key: &'static str,
    /// What is wrong.
    pub what: &'static str,
    /// What to do about it.
    pub help: &'static str,
}

/// A type of materials.
pub struct MaterialType {
    /// The `type` in scene files, and the name of its files.
    pub name: &'static str,
    /// Its module's name: that with underscores.
    pub module: &'static str,
    /// Its forms in the kernel.
    pub forms: &'static [Form],
    /// The text of its file in `shaders/materials/`.
    pub wesl: &'static str,
    /// Its parameters' schema.
    schema: fn(&mut SchemaGenerator) -> Schema,
    /// Parameters with which it is tested, so many that each form and each limit occurs.
    pub cases: fn() -> Vec<MaterialKind>,
}

impl MaterialType {
    /// The key of its colour, if that is all that it must be told.
    fn color_key(&self) -> Option<String> {
        let schema = (self.schema)(&mut SchemaGenerator::default());
        let [key] = schema.get("required")?.as_array()?.as_slice() else {
            return None;
        };
        let key = key.as_str()?;
        let items = &schema.get("properties")?[key]["items"];
        // A share of the light.
        (items["maximum"] == 1.0).then(|| key.to_owned())
    }

    /// Whether there is a material of this type for each colour.
    #[must_use]
    pub fn has_colors(&self) -> bool {
        self.color_key().is_some()
    }

    /// The material of this type with that colour; `None` if it must be told more.
    #[must_use]
    pub fn of_color(&self, color: DVec3) -> Option<MaterialKind> {
        let table = serde_json::json!({ "type": self.name, self.color_key()?: color.to_array() });
        serde_json::from_value(table).ok()
    }
}

macro_rules! materials {
    ($($module:ident :: $Type:ident),* $(,)?) => {
        $(pub mod $module;)*

        /// How a surface scatters light: a type of materials, with parameters.
        #[derive(Clone, Debug, PartialEq, Deserialize)]
        #[serde(tag = "type", rename_all = "kebab-case")]
        #[expect(missing_docs, reason = "each is described where it is defined")]
        pub enum MaterialKind {
            $($Type($module::$Type)),*
        }

        impl Deref for MaterialKind {
            type Target = dyn Bsdf;

            fn deref(&self) -> &(dyn Bsdf + 'static) {
                match self {
                    $(Self::$Type(material) => material),*
                }
            }
        }

        impl MaterialKind {
            /// The same material with other values of some of its parameters.
            #[must_use]
            pub fn with(&self, changes: &[(&'static str, Value)]) -> Self {
                let parameters = self.parameters();
                match self {
                    $(Self::$Type(own) => {
                        let made: $module::$Type = value::made_of(parameters, changes);
                        Self::$Type(made.with_files_of(own))
                    }),*
                }
            }
        }

        $(impl From<$module::$Type> for MaterialKind {
            fn from(material: $module::$Type) -> Self {
                Self::$Type(material)
            }
        })*

        /// All types of materials.
        pub const ALL: &[MaterialType] = &[
            $(MaterialType {
                name: $module::NAME,
                module: stringify!($module),
                forms: $module::FORMS,
                wesl: include_str!(concat!("../../shaders/materials/", stringify!($module), ".wesl")),
                schema: $module::$Type::json_schema,
                cases: || $module::cases().into_iter().map(MaterialKind::from).collect(),
            }),*
        ];
    };
}

materials! {
    diffuse::Diffuse,
    mirror::Mirror,
    dielectric::Dielectric,
    reflective::Reflective,
    conductor::Conductor,
    ashikhmin::Ashikhmin,
    disney::Disney,
    sheen::Sheen,
    nylon::Nylon,
    car_paint::CarPaint,
    measured::Measured,
    mix::Mix,
}

impl MaterialKind {
    /// The name of its type in a scene file.
    #[must_use]
    pub fn name(&self) -> &'static str {
        let form = self.form();
        form.material
    }

    /// Whether paths cross the surface, so that there is a medium on its inner side.
    #[must_use]
    pub fn transmits(&self) -> bool {
        self.form().transmits
    }

    /// Whether it scatters light in delta lobes alone.
    #[must_use]
    pub fn is_delta(&self) -> bool {
        self.form().delta
    }

    /// Whether it scatters light through the surface.
    #[must_use]
    pub fn is_translucent(&self) -> bool {
        self.form().is_translucent()
    }

    /// Whether it has a delta lobe beside others.
    #[must_use]
    pub fn is_part_delta(&self) -> bool {
        self.form().part_delta
    }
}

/// All forms of all materials; the place of one is its code in the kernel.
pub fn forms() -> &'static [&'static Form] {
    static FORMS: LazyLock<Vec<&'static Form>> = LazyLock::new(|| {
        let mut forms: Vec<&Form> = ALL.iter().flat_map(|material| material.forms).collect();
        // Rough glass after those that were there before it, and what came later after it: so these keep their codes, and
        // kernels their text.
        let is_later = |form: &Form| measured::is_tabled(form) || mix::is_mix(form);
        forms.sort_by_key(|form| (is_later(form), form.is_translucent()));
        forms
    });
    &FORMS
}

/// The schemas of all materials, without what all have in common.
pub fn schemas(generator: &mut SchemaGenerator) -> Vec<(&'static str, Schema)> {
    ALL.iter()
        .map(|material| (material.name, (material.schema)(generator)))
        .collect()
}

/// Relative luminance of linear RGB (ITU-R BT.709).
#[must_use]
pub fn luminance(v: DVec3) -> f64 {
    v.dot(DVec3::new(0.2126, 0.7152, 0.0722))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn those_that_need_a_colour_alone_have_one() {
        let color = DVec3::new(0.25, 0.5, 0.75);
        let colored: Vec<_> = ALL
            .iter()
            .filter(|material| material.has_colors())
            .collect();
        let names: Vec<_> = colored.iter().map(|material| material.name).collect();
        assert_eq!(names, ["diffuse", "mirror", "disney"]);
        for material in colored {
            let made = material.of_color(color).expect(material.name);
            assert_eq!((made.name(), made.color()), (material.name, color));
        }
    }
}

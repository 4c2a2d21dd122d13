//! Which effects a scene asks for: the one place that looks at a scene and decides.
//!
//! An effect that nothing asks for is not in the kernel: no function, type, member or binding of it. The
//! kernel's sources (`shaders/`) name effects in `@if(...)`, and modules that play a role ([`Role`]) are
//! chosen by them.
//!
//! The table's rows stand where the stages are that bring them, in the order of the data flow: geometry,
//! samples, materials, textures, light, ends of paths.

mod asked;
mod geometry;
mod light;
mod obstacle;
mod paths;
mod role;
mod row;
mod rules;
mod samples;
mod shared;
mod surfaces;
mod table;
mod textures;

use std::collections::BTreeSet;

use crate::materials::texturable::textured_keys;
use crate::materials::{Form, flakes, forms, measured, mix};
use crate::placement::Placement;
use crate::scene::Scene;
use crate::settings::Settings;

pub use asked::Asked;
pub use geometry::{BAKED_LIMIT, BAKED_MOST};
pub use obstacle::{cache_obstacle, image_obstacle};
pub use role::Role;
pub use row::{Effect, Row, Why};
pub use rules::{completed, conflict};
pub use shared::Shared;
pub use table::table;

use asked::when;

/// The effects of a kernel, with what asked for each.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Effects {
    /// By the table's rows; empty for what nothing asked for.
    reasons: Vec<Vec<String>>,
    /// Whether microfacets shadow and mask independently of each other: no scene and no option asks for that.
    separable: bool,
}

impl Effects {
    /// Derives the effects of `scene` as `placement` and `settings` have it.
    #[must_use]
    pub fn derive(scene: &Scene, placement: &Placement, settings: &Settings) -> Self {
        let asked = Asked {
            scene,
            placement,
            settings,
        };
        let reasons = table().iter().map(|row| (row.why)(&asked)).collect();
        Self {
            reasons,
            separable: false,
        }
    }

    /// The same and `more`, for the reason `why`.
    #[must_use]
    pub fn with(&self, more: &[Effect], why: &str) -> Self {
        let mut with = self.clone();
        for (row, reasons) in table().iter().zip(&mut with.reasons) {
            if more.contains(&row.effect) {
                reasons.push(why.to_owned());
            }
        }
        with
    }

    /// The same with G1(o) G1(i) for the shadowing and masking of GGX microfacets in the kernel, for comparisons with
    /// renderers that have it so. The reference in f64 does not.
    #[doc(hidden)]
    #[must_use]
    pub fn with_separable_shadowing(self) -> Self {
        Self {
            separable: true,
            ..self
        }
    }

    /// Exactly these effects, for tests of the linker.
    #[must_use]
    pub fn of(effects: &[Effect]) -> Self {
        let reasons = table()
            .iter()
            .map(|row| when(effects.contains(&row.effect), || "asked for".to_owned()));
        Self {
            reasons: reasons.collect(),
            separable: false,
        }
    }

    /// Exactly the effects of these names, for tests of the linker.
    ///
    /// # Panics
    /// If a name is not an effect's.
    #[must_use]
    pub fn named(names: &[&str]) -> Self {
        let named = |name: &&str| {
            Effect::named(name).unwrap_or_else(|| panic!("no effect is called {name}"))
        };
        Self::of(&names.iter().map(named).collect::<Vec<_>>())
    }

    /// All effects, used or not, with what asked for each.
    pub fn rows(&self) -> impl Iterator<Item = (&'static Row, &[String])> {
        table().iter().zip(self.reasons.iter().map(Vec::as_slice))
    }

    /// What asked for an effect; empty if nothing did.
    #[must_use]
    pub fn reasons(&self, effect: Effect) -> &[String] {
        let mut rows = self.rows();
        let own = rows.find(|(row, _)| row.effect == effect);
        own.map_or(&[][..], |(_, reasons)| reasons)
    }

    /// The effects in use.
    pub fn used(&self) -> impl Iterator<Item = Effect> {
        let used = self.rows().filter(|(_, reasons)| !reasons.is_empty());
        used.map(|(row, _)| row.effect)
    }

    /// The names of the effects in use.
    pub fn names(&self) -> impl Iterator<Item = &'static str> {
        self.used().map(Effect::name)
    }

    /// Whether an effect is in use.
    #[must_use]
    pub fn has(&self, effect: Effect) -> bool {
        self.used().any(|used| used == effect)
    }

    /// The forms of materials in use, with their codes.
    pub fn forms(&self) -> impl Iterator<Item = (u32, &'static Form)> {
        self.used().filter_map(|effect| match effect {
            Effect::Form(code) => Some((code, forms()[code as usize])),
            _ => None,
        })
    }

    /// Whether paths can cross a surface.
    #[must_use]
    pub fn transmits(&self) -> bool {
        self.forms().any(|(_, form)| form.transmits)
    }

    /// Whether a surface that no path crosses can be in a medium whose index it looks at.
    #[must_use]
    pub fn looks_at_index(&self) -> bool {
        self.transmits() && self.forms().any(|(_, form)| form.relative)
    }

    /// Whether a material looks at where on its sphere a point is.
    #[must_use]
    pub fn looks_at_offset(&self) -> bool {
        self.forms().any(|(_, form)| form.offset)
    }

    /// Whether values of materials depend on where on their sphere a point is.
    #[must_use]
    pub fn has_textures(&self) -> bool {
        self.has_patterns() || self.has(Effect::TextureImage)
    }

    /// Whether some of these are patterns on the offset from the sphere's centre.
    #[must_use]
    pub fn has_patterns(&self) -> bool {
        self.has(Effect::TextureChecker) || self.has(Effect::TextureNoise)
    }

    /// The keys that are textures.
    pub fn textured_keys(&self) -> impl Iterator<Item = &'static str> {
        self.used().filter_map(|effect| match effect {
            Effect::Textured(number) => Some(textured_keys()[number as usize]),
            _ => None,
        })
    }

    /// Whether a paint has flakes.
    #[must_use]
    pub fn has_flakes(&self) -> bool {
        self.forms().any(|(_, form)| flakes::are_in(form))
    }

    /// Whether a material is a table.
    #[must_use]
    pub fn has_tables(&self) -> bool {
        self.forms().any(|(_, form)| measured::is_tabled(form))
    }

    /// Whether a material is a mix of others.
    #[must_use]
    pub fn has_mixes(&self) -> bool {
        self.forms().any(|(_, form)| mix::is_mix(form))
    }

    /// Whether a material that a mix may have in it has delta lobes.
    #[must_use]
    pub fn mixes_deltas(&self) -> bool {
        let has_delta = |form: &Form| form.part_delta || form.delta && !form.transmits;
        let mut parts = self.forms().filter(|(_, form)| !mix::is_mix(form));
        self.has_mixes() && parts.any(|(_, form)| has_delta(form))
    }

    /// Whether lights are weighed at each vertex.
    #[must_use]
    pub fn weighs_lights(&self) -> bool {
        self.has(Effect::Lights) && !self.has(Effect::Table)
    }

    /// Whether vertices look for lamps or for an image around all.
    #[must_use]
    pub fn samples_light(&self) -> bool {
        self.has(Effect::Lights) || self.has(Effect::Skylight)
    }

    /// Whether light sampling looks for lamps on both sides of a surface.
    #[must_use]
    pub fn looks_through(&self) -> bool {
        self.has(Effect::Lights) && self.is_translucent()
    }

    /// Whether a surface scatters light to its other side.
    fn is_translucent(&self) -> bool {
        self.forms().any(|(_, form)| form.is_translucent())
    }

    /// Name and state of every flag that the kernel's sources may ask for: effects, and what follows from
    /// them.
    pub fn flags(&self) -> impl Iterator<Item = (&'static str, bool)> {
        let used: BTreeSet<Effect> = self.used().collect();
        let effects = table()
            .iter()
            .map(move |row| (row.name, used.contains(&row.effect)));
        effects.chain([
            ("transmits", self.transmits()),
            ("relative", self.looks_at_index()),
            ("offset", self.looks_at_offset()),
            ("textured", self.has_textures()),
            ("patterned", self.has_patterns()),
            ("flaked", self.has_flakes()),
            ("mixes", self.has_mixes()),
            ("recorded", self.reads_records()),
            ("lamps", self.reads_lamps()),
            ("mix_deltas", self.mixes_deltas()),
            ("mixed_textures", self.has_mixes() && self.has_textures()),
            ("weighed", self.weighs_lights()),
            ("sampled", self.samples_light()),
            ("separable", self.separable),
            (
                "signed",
                self.has(Effect::Dispersion) || self.has(Effect::RadianceCache),
            ),
            ("through", self.looks_through()),
            ("crossing", self.samples_light() && self.is_translucent()),
        ])
    }

    /// Whether spheres are in textures, not in the kernel.
    #[must_use]
    pub fn keeps_spheres(&self) -> bool {
        !self.has(Effect::Baked)
    }

    /// Whether the kernel reads records of textures, mixes, lamps, and of spheres about their poles or with charts.
    #[must_use]
    pub fn reads_records(&self) -> bool {
        let of_spheres = self.has(Effect::Pole) || self.has(Effect::RadianceCache);
        self.has_textures()
            || self.has_mixes()
            || self.reads_lamps()
            || self.keeps_spheres() && of_spheres
    }

    /// Whether it reads records of lamps.
    #[must_use]
    pub fn reads_lamps(&self) -> bool {
        self.has(Effect::Lights) && (self.keeps_spheres() || self.has(Effect::Table))
    }

    /// The form of the geometry: `baked`, `list` or `bvh`.
    #[must_use]
    pub fn geometry(&self) -> &'static str {
        let forms = [Effect::Baked, Effect::Bvh];
        let form = forms.into_iter().find(|form| self.has(*form));
        form.unwrap_or(Effect::List).name()
    }
}

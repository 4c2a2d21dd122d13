//! Which effects a scene asks for: the one place that looks at a scene and decides.
//!
//! An effect that nothing asks for is not in the kernel: no function, type, member or binding of it. The
//! kernel's sources (`shaders/`) name effects in `@if(...)`, and modules that play a role ([`Role`]) are
//! chosen by them.
//!
//! The table's rows stand where the stages are that bring them, in the order of the data flow: geometry,
//! samples, materials, light, ends of paths.

mod geometry;
mod light;
mod obstacle;
mod paths;
mod role;
mod rules;
mod samples;
mod surfaces;
mod textures;

use std::collections::BTreeSet;
use std::sync::LazyLock;

use crate::materials::texturable::textured_keys;
use crate::materials::{Form, Material, flakes, forms, measured, mix};
use crate::placement::{PlacedSphere, Placement};
use crate::scene::Scene;
use crate::settings::Settings;

pub use geometry::{BAKED_LIMIT, BAKED_MOST};
pub use obstacle::cache_obstacle;
pub use role::Role;
pub use rules::{completed, conflict};

/// An effect: something that a kernel can have or not.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Effect {
    /// Spheres as constants in the kernel.
    Baked,
    /// A loop over spheres in a storage buffer.
    List,
    /// A tree over spheres.
    Bvh,
    /// Frames at the poles of large spheres.
    Pole,
    /// Paths inside spheres.
    Interior,
    /// Sides of surfaces that only a sign tells.
    Straddle,
    /// Surfaces just within those of dielectrics.
    Nested,
    /// Hits as points, moved by a distance.
    Nudge,
    /// Hits as points, moved by some ulp.
    Ulp,
    /// A thin lens.
    Lens,
    /// Spheres that move while the shutter is open.
    Motion,
    /// Scrambled Sobol' sequences.
    Sobol,
    /// Light by the kind of its path.
    Classes,
    /// What is seen first.
    Features,
    /// Steps through the tree in the place of light.
    BvhCost,
    /// Some tiles only.
    Adaptive,
    /// A form of a material, by its code.
    Form(u32),
    /// Dielectrics that share points.
    Priority,
    /// Light that dielectrics absorb.
    Absorption,
    /// Refractive indices by the wavelength.
    Dispersion,
    /// Values in the cells of a lattice.
    TextureChecker,
    /// Values by a noise.
    TextureNoise,
    /// Values by images.
    TextureImage,
    /// A key of materials that may be a texture, by its place among all of them, where it is one.
    Textured(u32),
    /// Surfaces that emit.
    Emission,
    /// A constant environment.
    Environment,
    /// An environment of three colours by height.
    Gradient,
    /// An image around all.
    Sky,
    /// The lecture's estimator.
    Lecture,
    /// Light sampling of lamps.
    Lights,
    /// Light sampling of an image around all.
    Skylight,
    /// Light sampling by projected solid angle.
    Projected,
    /// Lights drawn from a table.
    Table,
    /// Multiple importance sampling.
    Mis,
    /// Russian roulette on the throughput.
    Roulette,
    /// Values of cells in the place of paths.
    RadianceCache,
}

/// What asks for an effect.
pub type Why = Box<dyn Fn(&Asked<'_>) -> Vec<String> + Send + Sync>;

/// What the table says of an effect.
pub struct Row {
    /// The effect.
    pub effect: Effect,
    /// Its name: in the scene file, in the kernel, and in every output.
    pub name: &'static str,
    /// What it adds, in a few words.
    pub what: &'static str,
    /// The first objects or options that ask for it; empty if nothing does.
    pub why: Why,
    /// Of each of these lists one at least is in use where the effect is.
    pub needs: Vec<Vec<Effect>>,
    /// None of these is in use where the effect is.
    pub excludes: Vec<Effect>,
    /// Names in the kernel that are the effect's own: of functions, types, members, bindings and whatever else
    /// is declared, or parts of them, as [`is_marked`](Self::is_marked) has it. The kernel has some of them if
    /// the effect is in use, and else none.
    pub marks: Vec<String>,
}

impl Row {
    fn new(
        effect: Effect,
        name: &'static str,
        what: &'static str,
        why: impl Fn(&Asked<'_>) -> Vec<String> + Send + Sync + 'static,
    ) -> Self {
        Self {
            effect,
            name,
            what,
            why: Box::new(why),
            needs: Vec::new(),
            excludes: Vec::new(),
            marks: Vec::new(),
        }
    }

    fn needs(mut self, any_of: impl Into<Vec<Effect>>) -> Self {
        self.needs.push(any_of.into());
        self
    }

    fn excludes(mut self, effects: impl Into<Vec<Effect>>) -> Self {
        self.excludes.extend(effects.into());
        self
    }

    fn marks<S: Into<String>>(mut self, names: impl IntoIterator<Item = S>) -> Self {
        self.marks.extend(names.into_iter().map(Into::into));
        self
    }
}

impl Row {
    /// Whether a name that a kernel declares, with its modules, is one of the effect's own: a mark is the name, a
    /// type whose member it is, a module that it is in, or a few of these with `::`.
    #[must_use]
    pub fn is_marked(&self, name: &str) -> bool {
        // Names are many and marks are some: nothing is allocated here.
        let is_part = |mark: &str, at: usize| {
            let (before, after) = (&name[..at], &name[at + mark.len()..]);
            (before.is_empty() || before.ends_with("::"))
                && (after.is_empty() || after.starts_with("::"))
        };
        let found = |mark: &String| {
            let mut places = name.match_indices(mark.as_str());
            places.any(|(at, _)| is_part(mark, at))
        };
        self.marks.iter().any(found)
    }
}

/// All effects that the program has, in the order of the data flow.
pub fn table() -> &'static [Row] {
    static TABLE: LazyLock<Vec<Row>> = LazyLock::new(|| {
        let groups = [
            geometry::rows(),
            samples::rows(),
            surfaces::rows(),
            textures::rows(),
            light::rows(),
            paths::rows(),
        ];
        groups.into_iter().flatten().collect()
    });
    &TABLE
}

impl Effect {
    /// Its row of the table.
    ///
    /// # Panics
    /// If the table lacks it.
    #[must_use]
    pub fn row(self) -> &'static Row {
        let row = table().iter().find(|row| row.effect == self);
        row.unwrap_or_else(|| panic!("{self:?} is not in the table"))
    }

    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.row().name
    }

    /// The effect of that name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        let row = table().iter().find(|row| row.name == name);
        row.map(|row| row.effect)
    }

    /// That of a form of a material.
    #[must_use]
    pub fn of_form(form: &Form) -> Option<Self> {
        let code = forms().iter().position(|f| *f == form)?;
        Some(Self::Form(code as u32))
    }
}

/// What effects are asked for by.
pub struct Asked<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// The same, placed.
    pub placement: &'a Placement,
    /// The options.
    pub settings: &'a Settings,
}

/// Reasons listed for one effect; the rest is counted.
const REASONS: usize = 3;

impl Asked<'_> {
    fn material(&self, sphere: &PlacedSphere) -> &Material {
        &self.scene.materials[sphere.material]
    }

    /// The first of the spheres, in scene order, whose materials are `wanted`.
    fn surfaces(&self, wanted: impl Fn(&Material) -> bool) -> Vec<String> {
        let mut spheres: Vec<&PlacedSphere> = self.placement.spheres.iter().collect();
        spheres.retain(|sphere| wanted(self.material(sphere)));
        spheres.sort_by_key(|s| s.source);
        self.listed(spheres.into_iter().map(|sphere| (sphere, "")))
    }

    /// The first of the placed spheres that are `wanted`, with why.
    fn placed(&self, wanted: impl Fn(&PlacedSphere) -> Option<&'static str>) -> Vec<String> {
        let spheres = self.placement.spheres.iter();
        self.listed(spheres.filter_map(|sphere| Some((sphere, wanted(sphere)?))))
    }

    fn listed<'a>(
        &self,
        all: impl Iterator<Item = (&'a PlacedSphere, &'static str)>,
    ) -> Vec<String> {
        let mut reasons = Vec::new();
        let mut more = 0;
        for (sphere, why) in all {
            if reasons.len() < REASONS {
                let name = &self.material(sphere).name;
                reasons.push(format!("sphere {} ({name}){why}", sphere.source + 1));
            } else {
                more += 1;
            }
        }
        if more > 0 {
            reasons.push(format!("and {more} more"));
        }
        reasons
    }
}

/// One reason, if there is one.
fn when(condition: bool, reason: impl FnOnce() -> String) -> Vec<String> {
    if condition { vec![reason()] } else { vec![] }
}

/// The effects of a kernel, with what asked for each.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Effects {
    /// By the table's rows; empty for what nothing asked for.
    reasons: Vec<Vec<String>>,
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
        Self { reasons }
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

    /// Exactly these effects, for tests of the linker.
    #[must_use]
    pub fn of(effects: &[Effect]) -> Self {
        let reasons = table()
            .iter()
            .map(|row| when(effects.contains(&row.effect), || "asked for".to_owned()));
        Self {
            reasons: reasons.collect(),
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
            ("mix_deltas", self.mixes_deltas()),
            ("mixed_textures", self.has_mixes() && self.has_textures()),
            ("weighed", self.weighs_lights()),
            ("sampled", self.samples_light()),
            (
                "signed",
                self.has(Effect::Dispersion) || self.has(Effect::RadianceCache),
            ),
            ("through", self.looks_through()),
            ("crossing", self.samples_light() && self.is_translucent()),
        ])
    }

    /// Whether spheres are in buffers, not in the kernel.
    #[must_use]
    pub fn keeps_spheres(&self) -> bool {
        !self.has(Effect::Baked)
    }

    /// The form of the geometry: `baked`, `list` or `bvh`.
    #[must_use]
    pub fn geometry(&self) -> &'static str {
        let forms = [Effect::Baked, Effect::Bvh];
        let form = forms.into_iter().find(|form| self.has(*form));
        form.unwrap_or(Effect::List).name()
    }
}

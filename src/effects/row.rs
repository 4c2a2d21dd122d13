//! What is said of an effect: what it adds, what asks for it, what it needs and excludes, and its names in the kernel.

use super::asked::Asked;

/// An effect: something that a kernel can have or not.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Effect {
    /// Spheres as constants in the kernel.
    Baked,
    /// A loop over spheres in a texture.
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
    /// Light sampling of images of lamps.
    LampImages,
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
    /// Its name: in conditions of the kernel's sources, and in every output.
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
    pub(super) fn new(
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

    pub(super) fn needs(mut self, any_of: impl Into<Vec<Effect>>) -> Self {
        self.needs.push(any_of.into());
        self
    }

    pub(super) fn excludes(mut self, effects: impl Into<Vec<Effect>>) -> Self {
        self.excludes.extend(effects.into());
        self
    }

    pub(super) fn marks<S: Into<String>>(mut self, names: impl IntoIterator<Item = S>) -> Self {
        self.marks.extend(names.into_iter().map(Into::into));
        self
    }
}

impl Row {
    /// Whether a name that a kernel declares, with its modules, is one of the effect's own: a mark is the name, a
    /// type whose member it is, a module that it is in, or a few of these with `::`.
    #[must_use]
    pub fn is_marked(&self, name: &str) -> bool {
        self.marks.iter().any(|mark| is_marked(name, mark))
    }
}

/// Whether one mark says so. Names are many and marks are some: nothing is allocated here, nor is a search prepared.
pub(super) fn is_marked(name: &str, mark: &str) -> bool {
    let mut rest = name;
    loop {
        let after = rest.strip_prefix(mark);
        if after.is_some_and(|after| after.is_empty() || after.starts_with("::")) {
            return true;
        }
        match rest.find(':') {
            Some(end) => rest = rest[end..].trim_start_matches(':'),
            None => return false,
        }
    }
}

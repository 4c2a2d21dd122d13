//! The table of all effects, and those of a name or of a material.

use std::sync::LazyLock;

use super::row::{Effect, Row};
use super::{geometry, light, paths, samples, surfaces, textures};
use crate::materials::{MaterialKind, forms};

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

    /// That of the form which a material has.
    ///
    /// # Panics
    /// Never: every form is in the list.
    #[must_use]
    pub fn of_material(kind: impl Into<MaterialKind>) -> Self {
        let form = kind.into().form();
        let code = forms().iter().position(|other| *other == form);
        Self::Form(code.expect("every form is in the list") as u32)
    }
}

//! The table of all effects, and those of a name or of a form of a material.

use std::sync::LazyLock;

use super::row::{Effect, Row};
use super::{geometry, light, paths, samples, surfaces, textures};
use crate::materials::{Form, forms};

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

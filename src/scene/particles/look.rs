//! How a particle file is shown without a scene file.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::Coloring;
use crate::scene::color_map::Map;

/// How the file is shown.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Look {
    /// `element` or a column; `None`: elements where the file has them, else one colour.
    pub color_by: Option<String>,
    /// A number, a column, `vdw` or `covalent`.
    pub radius_by: Option<String>,
    /// The colour map of a column.
    pub map: Option<Map>,
    /// Radiance of the background.
    pub background: Option<DVec3>,
}

impl Look {
    /// The first option that was given.
    #[must_use]
    pub fn given(&self) -> Option<&'static str> {
        match self {
            Self {
                color_by: Some(_), ..
            } => Some("--color-by"),
            Self {
                radius_by: Some(_), ..
            } => Some("--radius-by"),
            Self { map: Some(_), .. } => Some("--map"),
            Self {
                background: Some(_),
                ..
            } => Some("--background"),
            _ => None,
        }
    }

    pub(in crate::scene) fn coloring(&self) -> Option<Coloring> {
        Some(match self.color_by.as_deref()? {
            "element" => Coloring::Element,
            name => Coloring::Column {
                name: name.to_owned(),
                map: self.map.unwrap_or_default(),
                range: None,
            },
        })
    }
}

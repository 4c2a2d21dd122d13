//! Names in a file: where those of keys of materials are, and what is said of one that no material has.

use std::collections::HashMap;
use std::ops::Range;

use toml::de::DeTable;

use super::report::Problem;
use super::suggest::{list, nearest};
use crate::materials::Material;

/// At most so many material names are listed in a message.
const NAMES_LISTED: usize = 12;

/// Where each key of each material is.
pub(super) type MaterialKeys = HashMap<(String, String), Range<usize>>;

/// Where each key of each material of a file is.
pub(super) fn material_keys(root: &DeTable<'_>) -> MaterialKeys {
    let materials = root.get("material").and_then(|m| m.get_ref().as_table());
    let mut keys = HashMap::new();
    for (name, material) in materials.into_iter().flatten() {
        for (key, _) in material.get_ref().as_table().into_iter().flatten() {
            let place = (name.get_ref().to_string(), key.get_ref().to_string());
            keys.insert(place, key.span());
        }
    }
    keys
}

/// What is wrong with a name that none of these has.
pub(super) fn unknown_material(name: &str, materials: &[Material]) -> Problem {
    let names = || materials.iter().map(|material| material.name.as_str());
    let label =
        nearest(name, names()).map_or_else(String::new, |near| format!("did you mean \"{near}\"?"));
    let message = format!("unknown material \"{}\"", name.escape_debug());
    let more = materials.len().saturating_sub(NAMES_LISTED);
    let help = match (materials.len(), more) {
        (0, _) => format!("no material is defined; add a table `[material.{name}]`"),
        (1, _) => format!("the only material here is {}", list(names(), "")),
        (_, 0) => format!("the materials here are {}", list(names(), "and")),
        _ => format!(
            "the materials here are {} and {more} more",
            names().take(NAMES_LISTED).collect::<Vec<_>>().join(", ")
        ),
    };
    Problem::new(0..0, message, label).help(help)
}

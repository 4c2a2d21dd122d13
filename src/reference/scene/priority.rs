//! Twin of `shaders/scene/media/nested.wesl`: nested dielectrics after Schmidt and Budge (2002).

use crate::placement::Medium;

/// The dielectrics that a path is in; `sphere` is the index into the placement's spheres.
pub type Media = Vec<Medium>;

/// Index beyond the surface over the index on the side of arrival; 1 where a dielectric of higher
/// precedence hides the surface.
#[must_use]
pub fn relative_index(media: &Media, level: u32, ior: f64, inside: bool) -> f64 {
    let others = media.iter().filter(|m| m.level != level);
    let top = others.max_by_key(|m| m.level);
    if top.is_some_and(|top| top.level > level) {
        return 1.0;
    }
    let outer = top.map_or(1.0, |top| top.ior);
    if inside { outer / ior } else { ior / outer }
}

/// What fills the space where the path is.
#[must_use]
pub fn filling(media: &Media) -> Option<&Medium> {
    media.iter().max_by_key(|m| m.level)
}

/// Index of what the path is in.
#[must_use]
pub fn index_within(media: &Media) -> f64 {
    filling(media).map_or(1.0, |top| top.ior)
}

/// Whether the path is in the dielectric `sphere`.
#[must_use]
pub fn is_within(media: &Media, sphere: usize) -> bool {
    media.iter().any(|m| m.sphere == sphere)
}

/// The set after the surface of `medium` was crossed.
pub fn cross_surface(media: &mut Media, medium: Medium, inside: bool) {
    media.retain(|m| m.level != medium.level);
    if !inside {
        media.push(medium);
    }
}

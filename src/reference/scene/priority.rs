//! Twin of `shaders/scene/priority.wesl`: nested dielectrics after Schmidt and Budge (2002).

/// The dielectrics that a path is in: refractive index by level.
pub type Media = Vec<(u32, f64)>;

/// Index beyond the surface over the index on the side of arrival; 1 where a dielectric of higher
/// precedence hides the surface.
#[must_use]
pub fn relative_index(media: &Media, level: u32, ior: f64, inside: bool) -> f64 {
    let others = media.iter().filter(|(l, _)| *l != level);
    let (top, outer) = others
        .max_by_key(|(l, _)| *l)
        .map_or((None, 1.0), |(l, n)| (Some(*l), *n));
    if top.is_some_and(|top| top > level) {
        return 1.0;
    }
    if inside { outer / ior } else { ior / outer }
}

/// The set after the surface was crossed.
pub fn cross_surface(media: &mut Media, level: u32, ior: f64, inside: bool) {
    media.retain(|(l, _)| *l != level);
    if !inside {
        media.push((level, ior));
    }
}

//! Twin of `shaders/bsdf/event.wesl`.

use glam::DVec3;

use crate::film::LightClass;
use crate::scene::MaterialKind;

/// Whether a path that goes on in direction `w` does so by a delta lobe or within the lobe of a
/// reflective material.
#[must_use]
pub fn is_specular(kind: &MaterialKind, normal: DVec3, arrival: DVec3, w: DVec3) -> bool {
    match kind {
        MaterialKind::Diffuse { .. } => false,
        MaterialKind::Mirror { .. } | MaterialKind::Dielectric { .. } => true,
        MaterialKind::Reflective { epsilon, .. } => {
            let d_r = arrival.reflect(normal).normalize();
            (w - d_r).length_squared() < 2.0 * epsilon
        }
    }
}

/// The class of a path that has had one more event.
#[must_use]
pub fn next_class(class: LightClass, specular: bool) -> LightClass {
    match (class, specular) {
        (LightClass::Emission, false) => LightClass::Direct,
        (LightClass::Emission, true) | (LightClass::Specular, _) => LightClass::Specular,
        (_, false) => LightClass::Indirect,
        (_, true) => LightClass::Caustic,
    }
}

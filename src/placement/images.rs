//! Images of lamps that one sphere makes: by reflection on it, or through it, as its material's form says.
//!
//! Part of the placement: decided once, for both renderers.

use super::lights::Lights;
use super::sphere::{PlacedSphere, Side};
use crate::materials::fresnel::fresnel;
use crate::materials::{Imaging, luminance};
use crate::scene::Scene;

/// Images up to which each is weighed at each vertex. A limit on the work there, not tuned.
pub const MOST_IMAGES: usize = 16;

/// How light goes by the sphere.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Way {
    /// Reflected on its outside.
    Reflected = 0,
    /// Refracted into it, and out of it.
    Through = 1,
}

/// An image of a lamp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LampImage {
    /// The sphere that makes it, an index into the placement's.
    pub sphere: usize,
    /// How.
    pub way: Way,
    /// The lamp's sphere.
    pub lamp: usize,
    /// Refractive index of a sphere that refracts; `None` for one that reflects alone.
    pub ior: Option<f64>,
    /// What it counts for when one is chosen, but for where the vertex is: in the mean over all directions the
    /// luminance times the solid angle that the image has at the distance of the sphere's radius.
    pub strength: f64,
}

/// How far apart lamp and sphere are at least, as a share of the distance of their centres: beyond what rounding to f32
/// does to either, so that all of the lamp is outside the sphere, and all of the sphere outside the lamp, for both
/// renderers.
const APART: f64 = 1.0e-5;

/// The share of parallel light on a sphere of this index that it reflects: by the midpoint rule over the square of the
/// impact parameter.
fn mean_reflected(ior: f64) -> f64 {
    const STEPS: i32 = 64;
    let middles = (0..STEPS).map(|i| (f64::from(i) + 0.5) / f64::from(STEPS));
    let sum: f64 = middles
        .map(|u| fresnel((1.0 - u).sqrt(), ior).reflected)
        .sum();
    sum / f64::from(STEPS)
}

/// All images of lamps that are sampled; `None` if there are more than [`MOST_IMAGES`].
///
/// Only spheres about their centres make any, or are seen in them, and only where they are apart.
#[must_use]
pub(super) fn of(
    scene: &Scene,
    spheres: &[PlacedSphere],
    lights: &Lights,
) -> Option<Vec<LampImage>> {
    let small =
        |s: &PlacedSphere| s.pole.is_none() && matches!(s.side, Side::Outside | Side::Tracked);
    let makers = spheres.iter().enumerate().filter_map(|(i, sphere)| {
        let kind = &scene.materials[sphere.material].kind;
        let imaging = kind.form().imaging.filter(|_| small(sphere))?;
        Some((i, sphere, kind, imaging))
    });
    // Walls have none in any sphere.
    let lamps: Vec<_> = (lights.table.iter())
        .filter(|light| small(&spheres[light.sphere]))
        .collect();
    let mut images = Vec::new();
    for (index, sphere, kind, imaging) in makers {
        for light in &lamps {
            let lamp = &spheres[light.sphere];
            let distance = lamp.anchor.distance(sphere.anchor);
            let apart = (1.0 - APART) * distance > sphere.radius + lamp.radius;
            if light.sphere == index || !apart {
                continue;
            }
            let (ior, ways) = match imaging {
                Imaging::Reflects => (None, vec![(Way::Reflected, luminance(kind.color()))]),
                Imaging::Refracts => {
                    let share = mean_reflected(kind.ior());
                    let ways = vec![(Way::Reflected, share), (Way::Through, 1.0 - share)];
                    (Some(kind.ior()), ways)
                }
            };
            // Reflected evenly in all directions (for parallel light on a mirror it is just so): over 4 pi R^2 in the place
            // of pi R^2. The lamp's solid angle is pi (r/distance)^2.
            let sent =
                light.luminance * (lamp.radius / distance).powi(2) * std::f64::consts::PI / 4.0;
            for (way, share) in ways {
                if images.len() == MOST_IMAGES {
                    return None;
                }
                images.push(LampImage {
                    sphere: index,
                    way,
                    lamp: light.sphere,
                    ior,
                    strength: sent * share,
                });
            }
        }
    }
    Some(images)
}

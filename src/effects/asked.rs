//! What rows of the table look at, and how they list what they find.

use crate::materials::Material;
use crate::placement::{PlacedSphere, Placement};
use crate::scene::Scene;
use crate::settings::Settings;

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
    pub(super) fn material(&self, sphere: &PlacedSphere) -> &Material {
        &self.scene.materials[sphere.material]
    }

    /// The first of the spheres, in scene order, whose materials are `wanted`.
    pub(super) fn surfaces(&self, wanted: impl Fn(&Material) -> bool) -> Vec<String> {
        let mut spheres: Vec<&PlacedSphere> = self.placement.spheres.iter().collect();
        spheres.retain(|sphere| wanted(self.material(sphere)));
        spheres.sort_by_key(|s| s.source);
        self.listed(spheres.into_iter().map(|sphere| (sphere, "")))
    }

    /// The first of the placed spheres that are `wanted`, with why.
    pub(super) fn placed(
        &self,
        wanted: impl Fn(&PlacedSphere) -> Option<&'static str>,
    ) -> Vec<String> {
        let spheres = self.placement.spheres.iter();
        self.listed(spheres.filter_map(|sphere| Some((sphere, wanted(sphere)?))))
    }

    pub(super) fn listed<'a>(
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
pub(super) fn when(condition: bool, reason: impl FnOnce() -> String) -> Vec<String> {
    if condition { vec![reason()] } else { vec![] }
}

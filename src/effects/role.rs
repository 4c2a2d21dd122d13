//! Roles: modules of the kernel that several files can play.

use super::{Effect, Effects};

/// A module name that the kernel's sources import, and the file that stands for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Role {
    /// Its name: `package::NAME`.
    pub name: &'static str,
    /// The file below `shaders/`, without extension; `None`: written for the scene, or nothing asks for it.
    pub file: Option<&'static str>,
}

impl Effects {
    /// Which file plays which role.
    #[must_use]
    pub fn roles(&self) -> [Role; 10] {
        let has = |effect| self.has(effect);
        let geometry = match (self.keeps_spheres(), has(Effect::Bvh)) {
            (false, _) => None,
            (true, false) => Some("scene/list"),
            (true, true) => Some("scene/bvh"),
        };
        let attributes = self.keeps_spheres().then_some("scene/attributes");
        let media = match (self.transmits(), has(Effect::Priority)) {
            (false, _) => None,
            (true, false) => Some("scene/media/single"),
            (true, true) => Some("scene/media/nested"),
        };
        let sampler = match has(Effect::Sobol) {
            true => "sampler/sobol",
            false => "sampler/independent",
        };
        let lights = match (has(Effect::Lights), has(Effect::Table)) {
            (false, _) => None,
            (true, false) => Some("light/weighed"),
            (true, true) => Some("light/table"),
        };
        let target = match (has(Effect::Lights), has(Effect::Skylight)) {
            (false, false) => None,
            (true, false) => Some("light/target/lamps"),
            (false, true) => Some("light/target/sky"),
            (true, true) => Some("light/target/both"),
        };
        let share = match (self.samples_light(), has(Effect::Mis)) {
            (false, _) => None,
            (true, false) => Some("light/nee"),
            (true, true) => Some("light/mis"),
        };
        let surround = [
            (Effect::Environment, "light/surround/constant"),
            (Effect::Gradient, "light/surround/gradient"),
            (Effect::Sky, "light/surround/sky"),
        ];
        let surround = surround.into_iter().find(|(effect, _)| has(*effect));
        let surround = surround.map_or("light/surround/none", |(_, file)| file);
        let continuation = match has(Effect::RadianceCache) {
            true => "cache/cells",
            false => "path/continuation/traced",
        };
        let termination = match (has(Effect::Lecture), has(Effect::Roulette)) {
            (true, _) => "path/termination/constant",
            (false, true) => "path/termination/throughput",
            (false, false) => "path/termination/never",
        };
        [
            ("geometry", geometry),
            ("attributes", attributes),
            ("media", media),
            ("sampler", Some(sampler)),
            ("lights", lights),
            ("target", target),
            ("share", share),
            ("surround", Some(surround)),
            ("continuation", Some(continuation)),
            ("termination", Some(termination)),
        ]
        .map(|(name, file)| Role { name, file })
    }
}

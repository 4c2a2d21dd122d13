//! Mixes of materials: what their parts are.

use std::collections::{BTreeSet, HashMap};
use std::ops::Range;

use glam::DVec3;

use super::names::{MaterialKeys, unknown_material};
use super::report::{Problem, Report};
use crate::materials::mix::{Factor, MOST_PARTS, Part, Weight};
use crate::materials::texturable::{EMISSION, WEIGHT};
use crate::materials::{Material, MaterialKind};

/// Gives mixes their parts, of materials that are whole; mixes of mixes have those of all. What else is used where a used
/// one is comes into `used`.
pub(super) fn apply(
    materials: &mut [Material],
    keys: &MaterialKeys,
    used: &mut BTreeSet<usize>,
    report: &mut Report,
) {
    let is_mix = |material: &Material| matches!(material.kind, MaterialKind::Mix(_));
    let mixes: Vec<usize> = (0..materials.len())
        .filter(|i| is_mix(&materials[*i]))
        .collect();
    let names = (0..).zip(materials.iter());
    let names: HashMap<&str, usize> = names.map(|(i, m)| (m.name.as_str(), i)).collect();
    let mut all = Vec::new();
    for index in mixes {
        let mut walk = Walk {
            materials,
            names: &names,
            keys,
            way: Vec::new(),
            met: BTreeSet::new(),
        };
        match walk.parts(index) {
            Ok(parts) => all.push((index, parts)),
            Err(problem) => report.errors.push(*problem),
        }
        if used.contains(&index) {
            used.extend(walk.met);
        }
    }
    for (index, parts) in all {
        if let MaterialKind::Mix(mix) = &mut materials[index].kind {
            mix.parts = parts;
        }
    }
}

/// Through mixes of mixes.
struct Walk<'a> {
    materials: &'a [Material],
    names: &'a HashMap<&'a str, usize>,
    keys: &'a MaterialKeys,
    /// From the first mix to this one.
    way: Vec<usize>,
    /// All that were met.
    met: BTreeSet<usize>,
}

impl Walk<'_> {
    /// Where the names are of what a mix is made of.
    fn place(&self, index: usize) -> Range<usize> {
        let key = (self.materials[index].name.clone(), "materials".to_owned());
        self.keys.get(&key).cloned().unwrap_or_default()
    }

    fn wrong(&self, index: usize, message: String) -> Problem {
        Problem::new(self.place(index), message, "")
    }

    fn parts(&mut self, index: usize) -> Result<Vec<Part>, Box<Problem>> {
        let material = &self.materials[index];
        let MaterialKind::Mix(mix) = &material.kind else {
            return Ok(Vec::new());
        };
        let shown = material.name.escape_debug();
        if self.way.contains(&index) {
            let names = self.way.iter().chain([&index]);
            let names: Vec<String> = names
                .map(|i| format!("\"{}\"", self.materials[*i].name.escape_debug()))
                .collect();
            let message = format!(
                "material \"{shown}\" is a mix of itself: {}",
                names.join(", of ")
            );
            let problem = self.wrong(index, message);
            return Err(problem
                .help("a mix is of materials that are not made of it")
                .into());
        }
        // Each mix on the way has another material at least.
        let too_many = || format!("the mix \"{shown}\" is of more than {MOST_PARTS} materials");
        if self.way.len() == MOST_PARTS {
            return Err(self.wrong(index, too_many()).into());
        }
        self.way.push(index);
        let mut parts = Vec::new();
        for (name, second) in mix.materials.iter().zip([false, true]) {
            let Some(&found) = self.names.get(name.as_str()) else {
                let problem = unknown_material(name, self.materials);
                let span = self.place(index);
                return Err(Problem { span, ..problem }.into());
            };
            self.met.insert(found);
            parts.extend(self.half(index, found, second)?);
            if parts.len() > MOST_PARTS {
                return Err(self.wrong(index, too_many()).into());
            }
        }
        self.way.pop();
        Ok(parts)
    }

    /// The parts that one of the two materials of the mix `index` is.
    fn half(
        &mut self,
        index: usize,
        found: usize,
        second: bool,
    ) -> Result<Vec<Part>, Box<Problem>> {
        let own = &self.materials[found];
        if own.kind.transmits() {
            let message = format!(
                "\"{}\" is a dielectric, and no part of a mix",
                own.name.escape_debug()
            );
            let problem = self.wrong(index, message);
            return Err(problem
                .help("a mix is of materials that no light goes through")
                .into());
        }
        let MaterialKind::Mix(inner) = &own.kind else {
            let mut material = own.clone();
            // The mix's own counts.
            material.emission = DVec3::ZERO;
            material.textures.retain(|t| t.key.key != EMISSION);
            return Ok(vec![Part {
                material,
                second,
                inner: Vec::new(),
            }]);
        };
        let weight = match own.texture(WEIGHT) {
            Some(texture) => Weight::Texture(texture.clone()),
            None => Weight::Number(inner.weight),
        };
        let mut parts = self.parts(found)?;
        for part in &mut parts {
            let factor = Factor {
                second: part.second,
                weight: weight.clone(),
            };
            part.inner.insert(0, factor);
            part.second = second;
        }
        Ok(parts)
    }
}

//! Mixes as the kernel reads them: `MixPart` and `PartWeight` of `shaders/scene/data.wesl`.

use std::collections::BTreeMap;

use crate::materials::Material;
use crate::materials::measured::START;
use crate::placement::{PlacedSphere, Placement};
use crate::records::material::{MaterialRecord, anchored_spheres};
use crate::records::measured::MeasuredTables;
use crate::records::textures::{PartNumbers, TextureTable};
use crate::scene::Scene;

/// A part of a mix.
#[derive(Clone, Debug)]
struct PartRecord {
    material: MaterialRecord,
    weight: f32,
    second: u32,
    /// Of its weights that are textures.
    weights: [u32; 2],
}

/// The parts of all mixes of a scene's spheres.
#[derive(Clone, Debug, Default)]
pub struct MixTable {
    parts: Vec<PartRecord>,
    /// The number of a texture, and whether it is the share of the second.
    weights: Vec<[u32; 2]>,
    /// Where those of each material begin and end.
    of_materials: Vec<[u32; 2]>,
    of_spheres: BTreeMap<usize, [u32; 2]>,
}

impl MixTable {
    /// Those of `scene` as it is placed. A sphere about its pole has its own parts where one looks at the offset.
    #[must_use]
    pub fn new(
        scene: &Scene,
        placement: &Placement,
        textures: &TextureTable,
        tables: &MeasuredTables,
    ) -> Self {
        let mut all = Self::default();
        if scene.materials.iter().all(|m| m.kind.parts().is_empty()) {
            all.of_materials = vec![[0; 2]; scene.materials.len()];
            return all;
        }
        for (index, material) in scene.materials.iter().enumerate() {
            let record = |part: &Material| {
                MaterialRecord::new(part, placement.radiance_scale, placement.scale)
            };
            let range = all.add(material, textures.parts_of_material(index), tables, record);
            all.of_materials.push(range);
        }
        for index in anchored_spheres(scene, placement) {
            let sphere: &PlacedSphere = &placement.spheres[index];
            let record = |part: &Material| MaterialRecord::of_sphere(part, sphere, placement);
            let numbers = textures.parts_of_sphere(index, placement);
            let range = all.add(&scene.materials[sphere.material], numbers, tables, record);
            all.of_spheres.insert(index, range);
        }
        all
    }

    fn add(
        &mut self,
        material: &Material,
        numbers: &[PartNumbers],
        tables: &MeasuredTables,
        record: impl Fn(&Material) -> MaterialRecord,
    ) -> [u32; 2] {
        let first = self.parts.len() as u32;
        for (part, numbers) in material.kind.parts().iter().zip(numbers) {
            let begin = self.weights.len() as u32;
            self.weights.extend(&numbers.weights);
            let start = tables.start(&part.material.kind);
            self.parts.push(PartRecord {
                material: record(&part.material)
                    .with_word(START, start)
                    .with_textures(&part.material, &numbers.own),
                weight: part.number() as f32,
                second: part.second.into(),
                weights: [begin, self.weights.len() as u32],
            });
        }
        [first, self.parts.len() as u32]
    }

    /// Where the parts of a material begin and end, for spheres about their centres.
    #[must_use]
    pub fn of_material(&self, index: usize) -> [u32; 2] {
        self.of_materials[index]
    }

    /// Those of a sphere of the placement.
    #[must_use]
    pub fn of_sphere(&self, index: usize, placement: &Placement) -> [u32; 2] {
        let own = self.of_spheres.get(&index).copied();
        own.unwrap_or_else(|| self.of_materials[placement.spheres[index].material])
    }

    /// How many parts there are.
    #[must_use]
    pub fn parts(&self) -> usize {
        self.parts.len()
    }

    /// The material of each.
    pub fn materials(&self) -> impl Iterator<Item = &MaterialRecord> {
        self.parts.iter().map(|part| &part.material)
    }

    /// How many of their weights are textures.
    #[must_use]
    pub fn weights(&self) -> &[[u32; 2]] {
        &self.weights
    }

    /// All parts as `MixPart`: its weight, of which of the two it is, and where its weights begin and end.
    pub fn part_texels(&self) -> impl Iterator<Item = [u32; 4]> {
        let parts = self.parts.iter();
        parts.map(|part| {
            let [first, end] = part.weights;
            [part.weight.to_bits(), part.second, first, end]
        })
    }

    /// All weights that are textures as `PartWeight`: the texture, and of which of the two.
    pub fn weight_texels(&self) -> impl Iterator<Item = [u32; 4]> {
        let weights = self.weights.iter();
        weights.map(|&[number, second]| [number, second, 0, 0])
    }
}

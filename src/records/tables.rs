//! All that a kernel's records of materials refer to by numbers.

use crate::effects::{Effect, Effects};
use crate::materials::Material;
use crate::materials::measured::START;
use crate::materials::mix::PARTS;
use crate::placement::Placement;
use crate::records::material::{MaterialRecord, Numbers, anchored_spheres};
use crate::records::measured::MeasuredTables;
use crate::records::mix::MixTable;
use crate::records::textures::{ImageRecord, TextureTable};
use crate::scene::Scene;

/// Columns of the texture `material_texels` of `shaders/scene/data.wesl`.
pub const MATERIALS_WIDTH: u32 = 1024;

/// Columns of the texture `record_texels` there.
pub const RECORDS_WIDTH: u32 = 1024;

/// A texel of it.
type Texel = [u32; 4];

/// Textures, tables of measured materials and parts of mixes.
#[derive(Clone, Debug)]
pub struct SceneTables {
    /// Textures.
    pub textures: TextureTable,
    /// Tables of measured materials.
    pub measured: MeasuredTables,
    /// Parts of mixes.
    pub mixes: MixTable,
}

impl SceneTables {
    /// Those of `scene` as it is placed.
    #[must_use]
    pub fn new(scene: &Scene, placement: &Placement) -> Self {
        let textures = TextureTable::new(scene, placement);
        let measured = MeasuredTables::new(scene, placement);
        let mixes = MixTable::new(scene, placement, &textures, &measured);
        Self {
            textures,
            measured,
            mixes,
        }
    }

    /// The texture `record_texels` but for the zeros that fill its last row: patterns, images, parts of mixes, and their
    /// weights.
    #[must_use]
    pub fn texels(&self, effects: &Effects) -> Vec<Texel> {
        let mut texels = Vec::new();
        for pattern in self.textures.patterns() {
            let whole: &[Texel] = bytemuck::cast_slice(std::slice::from_ref(pattern));
            texels.extend(&whole[..pattern_texels(effects)]);
        }
        texels.extend::<&[Texel]>(bytemuck::cast_slice(self.textures.images()));
        texels.extend(self.mixes.part_texels());
        let weights = self.mixes.weights().iter();
        texels.extend(weights.map(|&[number, second]| [number, second, 0, 0]));
        texels
    }

    /// Its texels at which images, parts and weights begin.
    #[must_use]
    pub fn firsts(&self, effects: &Effects) -> [usize; 3] {
        let image = pattern_texels(effects) * self.textures.patterns().len();
        let part =
            image + size_of::<ImageRecord>() / size_of::<Texel>() * self.textures.images().len();
        [image, part, part + self.mixes.parts()]
    }

    /// The record of a material of the scene, for spheres about their centres.
    #[must_use]
    pub fn of_material(
        &self,
        index: usize,
        scene: &Scene,
        placement: &Placement,
    ) -> MaterialRecord {
        let material = &scene.materials[index];
        let record = MaterialRecord::new(material, placement.radiance_scale, placement.scale);
        let numbers = self.textures.of_material(index);
        self.complete(record, material, numbers, self.mixes.of_material(index))
    }

    /// The records that a kernel with spheres in buffers reads: of the scene's materials, of spheres with one of their
    /// own, and of the parts of mixes, in this order.
    #[must_use]
    pub fn records(&self, scene: &Scene, placement: &Placement) -> Vec<MaterialRecord> {
        let shared = (0..scene.materials.len()).map(|i| self.of_material(i, scene, placement));
        let anchored = anchored_spheres(scene, placement);
        let anchored = anchored.map(|i| self.of_sphere(i, scene, placement));
        let parts = self.mixes.materials().cloned();
        shared.chain(anchored).chain(parts).collect()
    }

    /// The record of the material of a sphere of the placement.
    #[must_use]
    pub fn of_sphere(&self, index: usize, scene: &Scene, placement: &Placement) -> MaterialRecord {
        let sphere = &placement.spheres[index];
        let material = &scene.materials[sphere.material];
        let record = MaterialRecord::of_sphere(material, sphere, placement);
        let numbers = self.textures.of_sphere(index, placement);
        self.complete(
            record,
            material,
            numbers,
            self.mixes.of_sphere(index, placement),
        )
    }

    fn complete(
        &self,
        record: MaterialRecord,
        material: &Material,
        numbers: &Numbers,
        [first, end]: [u32; 2],
    ) -> MaterialRecord {
        record
            .with_word(START, self.measured.start(&material.kind))
            .with_word(PARTS[0], first)
            .with_word(PARTS[1], end)
            .with_textures(material, numbers)
    }
}

/// Texels of a pattern: what is for pole frames ends the record.
fn pattern_texels(effects: &Effects) -> usize {
    if effects.has(Effect::Pole) { 4 } else { 2 }
}

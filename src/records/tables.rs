//! All that a kernel's records of materials refer to by numbers.

use bytemuck::Pod;

use crate::effects::{Effect, Effects};
use crate::materials::Material;
use crate::materials::measured::START;
use crate::materials::mix::PARTS;
use crate::placement::{Light, PlacedSphere, Placement};
use crate::records::layout::{ChartRecord, LightRecord, PoleRecord};
use crate::records::material::{MaterialRecord, Numbers, anchored_spheres};
use crate::records::measured::MeasuredTables;
use crate::records::mix::MixTable;
use crate::records::textures::TextureTable;
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

    /// The lists of the texture `record_texels`, in their order.
    #[must_use]
    pub fn lists(&self, placement: &Placement, effects: &Effects) -> [List; 7] {
        let [pole, motion, charts] =
            [Effect::Pole, Effect::Motion, Effect::RadianceCache].map(|e| effects.has(e));
        let kept = |count: usize, asked: bool| match asked && effects.keeps_spheres() {
            true => count,
            false => 0,
        };
        let lamps = match effects.reads_lamps() {
            true => placement.lights.table.len(),
            false => 0,
        };
        // What only some scenes ask for ends a record.
        let of_lamp = match (motion, pole) {
            (true, _) => 4,
            (false, true) => 3,
            (false, false) => 2,
        };
        [
            (
                "FIRST_PATTERN",
                self.textures.patterns().len(),
                if pole { 4 } else { 2 },
            ),
            ("FIRST_IMAGE", self.textures.images().len(), 4),
            ("FIRST_PART", self.mixes.parts(), 1),
            ("FIRST_WEIGHT", self.mixes.weights().len(), 1),
            (
                "FIRST_POLE",
                kept(placement.poles, pole),
                if motion { 3 } else { 2 },
            ),
            ("FIRST_CHART", kept(placement.spheres.len(), charts), 3),
            ("FIRST_LIGHT", lamps, of_lamp),
        ]
        .map(|(first, count, texels)| List {
            first,
            count,
            texels,
        })
    }

    /// The texture `record_texels` but for the zeros that fill its last row.
    #[must_use]
    pub fn texels(&self, placement: &Placement, effects: &Effects) -> Vec<Texel> {
        let [patterns, images, parts, weights, poles, charts, lamps] =
            self.lists(placement, effects);
        let spheres = &placement.spheres;
        let of_pole = |sphere: &PlacedSphere| Some(PoleRecord::new(sphere, sphere.pole?));
        let of_chart = |index: usize| ChartRecord::new(&placement.chart(index));
        let of_lamp = |light: &Light| LightRecord::new(light, placement, effects);
        let mut texels = Vec::new();
        patterns.write(&mut texels, self.textures.patterns().iter().copied());
        images.write(&mut texels, self.textures.images().iter().copied());
        parts.write(&mut texels, self.mixes.part_texels());
        weights.write(&mut texels, self.mixes.weight_texels());
        poles.write(&mut texels, spheres.iter().filter_map(of_pole));
        charts.write(&mut texels, (0..spheres.len()).map(of_chart));
        lamps.write(&mut texels, placement.lights.table.iter().map(of_lamp));
        texels
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

/// A list of records in `record_texels`.
#[derive(Clone, Copy, Debug)]
pub struct List {
    /// The constant of the kernel that says at which texel it begins.
    pub first: &'static str,
    /// How many records it has.
    pub count: usize,
    /// How many texels each has: the first of those of the host's record.
    pub texels: usize,
}

impl List {
    /// How many texels it takes.
    #[must_use]
    pub fn size(&self) -> usize {
        self.count * self.texels
    }

    /// Appends it: the starts of its records.
    fn write<T: Pod>(&self, texels: &mut Vec<Texel>, records: impl Iterator<Item = T>) {
        for record in records.take(self.count) {
            let whole: &[Texel] = bytemuck::cast_slice(bytemuck::bytes_of(&record));
            texels.extend(&whole[..self.texels]);
        }
    }
}

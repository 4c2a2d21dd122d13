//! Textures as the kernel reads them: `Pattern` and `Image` of `shaders/scene/data.wesl`, and the texels of all images.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use crate::image::Picture;
use crate::materials::lattice::LatticePoint;
use crate::materials::texturable::EMISSION;
use crate::materials::{Material, Texture, TextureImage, Textured};
use crate::placement::Placement;
use crate::records::material::{Numbers, anchored_spheres};
use crate::scene::Scene;

/// Columns of the texture `image_texels` of `shaders/scene/texture.wesl`.
pub const IMAGE_WIDTH: u32 = 4096;

/// `Pattern`. Without pole frames a record ends before what is for them.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
#[expect(missing_docs, reason = "the members are those of the kernel's struct")]
pub struct PatternRecord {
    pub first: [f32; 3],
    pub cells: f32,
    pub second: [f32; 3],
    pub octaves: u32,
    pub place: [f32; 3],
    pub unused: u32,
    pub cell: [u32; 3],
    pub unused1: u32,
}

/// `Image`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
#[expect(missing_docs, reason = "the members are those of the kernel's struct")]
pub struct ImageRecord {
    pub x: [f32; 3],
    pub width: u32,
    pub y: [f32; 3],
    pub height: u32,
    pub z: [f32; 3],
    pub start: u32,
    pub scale: f32,
    pub unused: [u32; 3],
}

/// Those of a part of a mix.
#[derive(Clone, Debug, Default)]
pub struct PartNumbers {
    /// Of its own keys.
    pub own: Numbers,
    /// Of the weights of mixes in the mix, and whether each is the share of the second of the two.
    pub weights: Vec<[u32; 2]>,
}

/// All textures of a scene's spheres.
#[derive(Clone, Debug, Default)]
pub struct TextureTable {
    patterns: Vec<PatternRecord>,
    images: Vec<ImageRecord>,
    /// Each once, with the place of its first texel.
    pictures: Vec<(Arc<Picture>, u64)>,
    texels: u64,
    of_materials: Vec<(Numbers, Vec<PartNumbers>)>,
    of_spheres: BTreeMap<usize, (Numbers, Vec<PartNumbers>)>,
}

impl TextureTable {
    /// Those of `scene` as it is placed. A sphere about its pole has its own patterns.
    #[must_use]
    pub fn new(scene: &Scene, placement: &Placement) -> Self {
        let mut table = Self::default();
        let without = |material: &Material| {
            let parts = vec![PartNumbers::default(); material.kind.parts().len()];
            (Numbers::new(), parts)
        };
        if scene.materials.iter().all(|m| m.looked_up().is_empty()) {
            table.of_materials = scene.materials.iter().map(without).collect();
            return table;
        }
        let used: BTreeSet<usize> = placement.spheres.iter().map(|s| s.material).collect();
        for (index, material) in scene.materials.iter().enumerate() {
            let numbers = match used.contains(&index) {
                true => table.add_all(material, DVec3::ZERO, placement),
                false => without(material),
            };
            table.of_materials.push(numbers);
        }
        for index in anchored_spheres(scene, placement) {
            let sphere = &placement.spheres[index];
            let material = &scene.materials[sphere.material];
            let numbers = match material.has_patterns() {
                true => table.add_all(material, sphere.anchor_offset(placement.scale), placement),
                false => table.of_materials[sphere.material].clone(),
            };
            table.of_spheres.insert(index, numbers);
        }
        table
    }

    /// Adds the textures of a material and of its parts for spheres whose anchor is there.
    fn add_all(
        &mut self,
        material: &Material,
        anchor: DVec3,
        placement: &Placement,
    ) -> (Numbers, Vec<PartNumbers>) {
        let own = self.add(material, anchor, placement);
        let parts = material.kind.parts().iter().map(|part| PartNumbers {
            own: self.add(&part.material, anchor, placement),
            weights: part
                .texture_weights()
                .map(|(second, texture)| [self.number(texture, anchor, 1.0), second.into()])
                .collect(),
        });
        (own, parts.collect())
    }

    /// Adds the textures of a material for spheres whose anchor is there.
    fn add(&mut self, material: &Material, anchor: DVec3, placement: &Placement) -> Numbers {
        let number = |Textured { key, texture }: &Textured| {
            let unit = match key.key {
                EMISSION => placement.radiance_scale,
                _ => 1.0,
            };
            (key.key, self.number(texture, anchor, unit))
        };
        material.textures.iter().map(number).collect()
    }

    /// Adds a texture whose values are multiplied by `unit`.
    fn number(&mut self, texture: &Texture, anchor: DVec3, unit: f64) -> u32 {
        let (kind, place) = match texture {
            Texture::Checker { values, size } => (1, self.pattern(*values, *size, 0, anchor, unit)),
            Texture::Noise {
                values,
                size,
                octaves,
            } => (2, self.pattern(*values, *size, *octaves, anchor, unit)),
            Texture::Image(image) => (3, self.image(image, unit)),
        };
        (place as u32) << 2 | kind
    }

    fn pattern(
        &mut self,
        values: [DVec3; 2],
        size: f64,
        octaves: u32,
        anchor: DVec3,
        unit: f64,
    ) -> usize {
        let cells = 1.0 / size;
        let point = LatticePoint::by_corner(anchor, cells);
        let value = |v: DVec3| (unit * v).as_vec3().to_array();
        self.patterns.push(PatternRecord {
            first: value(values[0]),
            cells: cells as f32,
            second: value(values[1]),
            octaves,
            place: point.place.as_vec3().to_array(),
            cell: point.cell,
            ..PatternRecord::zeroed()
        });
        self.patterns.len() - 1
    }

    fn image(&mut self, image: &TextureImage, unit: f64) -> usize {
        let picture = image.image();
        let known = self.pictures.iter().find(|(p, _)| Arc::ptr_eq(p, picture));
        let start = match known {
            Some((_, start)) => *start,
            None => {
                let start = self.texels;
                self.pictures.push((Arc::clone(picture), start));
                self.texels += picture.pixels.len() as u64;
                start
            }
        };
        let rows = image.rotation().transpose();
        let row = |v: DVec3| v.as_vec3().to_array();
        self.images.push(ImageRecord {
            x: row(rows.x_axis),
            width: picture.width,
            y: row(rows.y_axis),
            height: picture.height,
            z: row(rows.z_axis),
            // A scene with more has been refused.
            start: start as u32,
            scale: unit as f32,
            ..ImageRecord::zeroed()
        });
        self.images.len() - 1
    }

    /// All patterns.
    #[must_use]
    pub fn patterns(&self) -> &[PatternRecord] {
        &self.patterns
    }

    /// All images.
    #[must_use]
    pub fn images(&self) -> &[ImageRecord] {
        &self.images
    }

    /// The textures of a material, for spheres about their centres.
    #[must_use]
    pub fn of_material(&self, index: usize) -> &Numbers {
        &self.of_materials[index].0
    }

    /// Those of its parts.
    #[must_use]
    pub fn parts_of_material(&self, index: usize) -> &[PartNumbers] {
        &self.of_materials[index].1
    }

    /// Those of a sphere of the placement.
    #[must_use]
    pub fn of_sphere(&self, index: usize, placement: &Placement) -> &Numbers {
        &self.all_of_sphere(index, placement).0
    }

    /// Those of the parts of its material.
    #[must_use]
    pub fn parts_of_sphere(&self, index: usize, placement: &Placement) -> &[PartNumbers] {
        &self.all_of_sphere(index, placement).1
    }

    fn all_of_sphere(&self, index: usize, placement: &Placement) -> &(Numbers, Vec<PartNumbers>) {
        let own = self.of_spheres.get(&index);
        own.unwrap_or(&self.of_materials[placement.spheres[index].material])
    }

    /// Rows of the texture of all texels, at least one.
    #[must_use]
    pub fn rows(&self) -> u64 {
        self.texels.div_ceil(IMAGE_WIDTH.into()).max(1)
    }

    /// The texels of that texture.
    #[must_use]
    pub fn texels(&self) -> Vec<[f32; 4]> {
        let all = self
            .pictures
            .iter()
            .flat_map(|(picture, _)| &picture.pixels);
        let mut texels: Vec<[f32; 4]> = all.map(|[r, g, b]| [*r, *g, *b, 0.0]).collect();
        texels.resize((self.rows() * u64::from(IMAGE_WIDTH)) as usize, [0.0; 4]);
        texels
    }
}

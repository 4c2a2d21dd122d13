//! What the kernel reads of a scene, in textures: records (`shaders/scene/data.wesl`), the tree, the sky, images and
//! tables.

use bytemuck::Pod;

use crate::bvh::WIDTH;
use crate::effects::{Effect, Effects};
use crate::error::{Error, Result};
use crate::gpu::engine::{Pass, Recording};
use crate::image::Picture;
use crate::placement::Placement;
use crate::placement::containment::MOST_CORES;
use crate::records::layout::{
    ATTRIBUTES_WIDTH, SKY_TABLE_WIDTH, SPHERES_WIDTH, SphereRecord, light_weight, sky_table,
};
use crate::records::material::anchored_spheres;
use crate::records::measured::{MEASURED_WIDTH, MeasuredTables};
use crate::records::tables::{List, MATERIALS_WIDTH, RECORDS_WIDTH, SceneTables};
use crate::records::textures::{IMAGE_WIDTH, TextureTable};
use crate::scene::{Environment, Scene, Sky};
use crate::shader::material_record;

/// Names of the textures.
const TREE: &str = "tree";
const RECORDS: &str = "record_texels";
const SPHERES: &str = "sphere_texels";
const ATTRIBUTES: &str = "attribute_texels";
const MATERIALS: &str = "material_texels";
const SKY: &str = "sky";
const SKY_TABLE: &str = "sky_table";
const IMAGES: &str = "image_texels";
const MEASURED: &str = "measured_texels";

/// Bytes of a texel of all of them.
const TEXEL: usize = 16;

/// Whether the device takes the tree.
///
/// # Errors
/// [`Error::DeviceLimit`] if it has too many rows of texels.
pub(super) fn check_tree(limits: &wgpu::Limits, placement: &Placement) -> Result<()> {
    let (rows, most) = (placement.tree().rows(), limits.max_texture_dimension_2d);
    if rows.max(WIDTH) > most {
        return Err(Error::DeviceLimit(format!(
            "the tree over the spheres needs a texture of {WIDTH} x {rows} texels, more than the device's \
             limit of {most}; --backend cpu has no such limit"
        )));
    }
    Ok(())
}

/// Whether the device takes the image around the scene.
///
/// # Errors
/// [`Error::DeviceLimit`] if it is too wide or too high.
pub(super) fn check_sky(limits: &wgpu::Limits, sky: &Sky) -> Result<()> {
    let Picture { width, height, .. } = *sky.image();
    let most = limits.max_texture_dimension_2d;
    let table = table_rows(width, height).max(SKY_TABLE_WIDTH.into());
    if width.max(height) > most || table > most.into() {
        return Err(Error::DeviceLimit(format!(
            "the environment's image {} has {width} x {height} texels, more than the device's limit of {most} \
             a side; --backend cpu has no such limit",
            sky.name()
        )));
    }
    Ok(())
}

/// Whether the device takes a texture of `width` x `rows` texels, of which the `what` are.
fn check_rows(limits: &wgpu::Limits, what: &str, width: u32, rows: u64) -> Result<()> {
    let most = limits.max_texture_dimension_2d;
    if rows > most.into() || width > most {
        return Err(Error::DeviceLimit(format!(
            "the {what} need {width} x {rows} texels, more than the device's limit of {most} a side; --backend cpu has \
             no such limit"
        )));
    }
    Ok(())
}

/// Whether the device takes what is known of each sphere, and the spheres of a loop over all.
///
/// # Errors
/// [`Error::DeviceLimit`] if there are too many.
pub(super) fn check_spheres(
    limits: &wgpu::Limits,
    placement: &Placement,
    effects: &Effects,
) -> Result<()> {
    let rows = |texels: usize, width: u32| {
        let all = placement.spheres.len() * texels;
        (all as u64).div_ceil(width.into())
    };
    let attributes = rows(attribute_texels(effects), ATTRIBUTES_WIDTH);
    check_rows(
        limits,
        "attributes of spheres",
        ATTRIBUTES_WIDTH,
        attributes,
    )?;
    match effects.has(Effect::List) {
        true => check_rows(
            limits,
            "spheres",
            SPHERES_WIDTH,
            rows(sphere_texels(effects), SPHERES_WIDTH),
        ),
        false => Ok(()),
    }
}

/// Whether the device takes the records of materials.
///
/// # Errors
/// [`Error::DeviceLimit`] if there are too many.
pub(super) fn check_materials(
    limits: &wgpu::Limits,
    scene: &Scene,
    placement: &Placement,
    effects: &Effects,
) -> Result<()> {
    let (_, size) = material_record(effects);
    let records = SceneTables::new(scene, placement).records(scene, placement);
    let texels = records.len() as u64 * u64::from(size) / TEXEL as u64;
    let rows = texels.div_ceil(MATERIALS_WIDTH.into());
    check_rows(limits, "materials", MATERIALS_WIDTH, rows)
}

/// Whether the device takes the records of textures, mixes, lamps and of what else there is of few spheres.
///
/// # Errors
/// [`Error::DeviceLimit`] if there are too many.
pub(super) fn check_records(
    limits: &wgpu::Limits,
    scene: &Scene,
    placement: &Placement,
    effects: &Effects,
) -> Result<()> {
    let lists = SceneTables::new(scene, placement).lists(placement, effects);
    let texels: usize = lists.iter().map(List::size).sum();
    let rows = (texels as u64).div_ceil(RECORDS_WIDTH.into());
    check_rows(limits, "textures, mixes and lamps", RECORDS_WIDTH, rows)
}

/// Whether the device takes the images of textures.
///
/// # Errors
/// [`Error::DeviceLimit`] if they have too many texels together.
pub(super) fn check_images(
    limits: &wgpu::Limits,
    scene: &Scene,
    placement: &Placement,
) -> Result<()> {
    let rows = TextureTable::new(scene, placement).rows();
    check_rows(limits, "images of textures", IMAGE_WIDTH, rows)
}

/// Whether the device takes the tables of measured materials.
///
/// # Errors
/// [`Error::DeviceLimit`] if they have too many entries together.
pub(super) fn check_tables(
    limits: &wgpu::Limits,
    scene: &Scene,
    placement: &Placement,
) -> Result<()> {
    let rows = MeasuredTables::new(scene, placement).rows();
    check_rows(limits, "tables of measured materials", MEASURED_WIDTH, rows)
}

/// What the device holds of a scene.
#[derive(Debug)]
pub(super) struct SceneBytes {
    textures: Vec<Texels>,
}

/// A texture that the kernel reads: its name, its texels row by row, and its columns.
#[derive(Debug)]
struct Texels {
    name: &'static str,
    bytes: Vec<u8>,
    width: u32,
}

impl SceneBytes {
    /// What a kernel with `effects` reads.
    pub(super) fn new(scene: &Scene, placement: &Placement, effects: &Effects) -> Self {
        let tables = SceneTables::new(scene, placement);
        let mut textures = Vec::new();
        let mut add = |name, bytes, width| textures.push(Texels { name, bytes, width });
        if effects.keeps_spheres() {
            let texels = materials(scene, placement, effects, &tables);
            add(MATERIALS, texels, MATERIALS_WIDTH);
            let texels = attributes(scene, placement, effects);
            add(ATTRIBUTES, texels, ATTRIBUTES_WIDTH);
        }
        if effects.has(Effect::List) {
            add(SPHERES, spheres(placement, effects), SPHERES_WIDTH);
        }
        if effects.has(Effect::Bvh) {
            let texels = &placement.tree().texels;
            add(TREE, bytemuck::cast_slice(texels).to_vec(), WIDTH);
        }
        if effects.reads_records() {
            let texels = bytemuck::cast_slice(&tables.texels(placement, effects)).to_vec();
            add(RECORDS, in_rows(texels, RECORDS_WIDTH), RECORDS_WIDTH);
        }
        if effects.has(Effect::TextureImage) {
            let texels = tables.textures.texels();
            add(IMAGES, bytemuck::cast_slice(&texels).to_vec(), IMAGE_WIDTH);
        }
        if effects.has_tables() {
            let texels = tables.measured.texels();
            let bytes = bytemuck::cast_slice(&texels).to_vec();
            add(MEASURED, bytes, MEASURED_WIDTH);
        }
        if let Some(sky) = sky_of(scene, effects) {
            let (texels, width) = sky_texels(sky, placement, effects);
            add(SKY, texels, width);
            if effects.has(Effect::Skylight) {
                let texels = sky_table(placement.sky_table(sky));
                let bytes = bytemuck::cast_slice(&texels).to_vec();
                add(SKY_TABLE, bytes, SKY_TABLE_WIDTH);
            }
        }
        Self { textures }
    }

    /// Uploads what `pass` binds.
    pub(super) fn upload<'a>(&'a self, recording: &mut Recording<'a>, pass: &Pass) {
        for texture in self.textures.iter().filter(|t| pass.binds(t.name)) {
            recording.upload_texels(texture.name, &texture.bytes, texture.width);
        }
    }
}

/// The image that a kernel with these effects looks up.
pub(super) fn sky_of<'a>(scene: &'a Scene, effects: &Effects) -> Option<&'a Sky> {
    let environment = scene.environment.as_ref();
    environment
        .and_then(Environment::sky)
        .filter(|_| effects.has(Effect::Sky))
}

/// `sky` of `shaders/light/sky.wesl`, with its width.
fn sky_texels(sky: &Sky, placement: &Placement, effects: &Effects) -> (Vec<u8>, u32) {
    let Picture { width, height, .. } = *sky.image();
    let table = effects
        .has(Effect::Skylight)
        .then(|| placement.sky_table(sky));
    let texel = |(column, row)| {
        let radiance = sky.texel(column, row) * placement.radiance_scale;
        let pdf = table.map_or(0.0, |table| table.pdf(column, row));
        radiance.as_vec3().extend(pdf as f32).to_array()
    };
    let places = (0..height).flat_map(|row| (0..width).map(move |column| (column, row)));
    (bytes_of(places.map(texel)), width)
}

/// Rows of the texture `sky_table`.
fn table_rows(width: u32, height: u32) -> u64 {
    let [width, height] = [width, height].map(u64::from);
    let texels = height + (width * height).div_ceil(4);
    texels.div_ceil(SKY_TABLE_WIDTH.into())
}

fn bytes_of<T: Pod>(records: impl Iterator<Item = T>) -> Vec<u8> {
    let records: Vec<T> = records.collect();
    bytemuck::cast_slice(&records).to_vec()
}

/// The texture `sphere_texels`.
fn spheres(placement: &Placement, effects: &Effects) -> Vec<u8> {
    let texels = sphere_texels(effects);
    let centered = placement.spheres[placement.poles..].iter();
    let records = centered.map(SphereRecord::new);
    let bytes = records.flat_map(|r| bytemuck::bytes_of(&r)[..texels * TEXEL].to_vec());
    in_rows(bytes.collect(), SPHERES_WIDTH)
}

/// Texels of a sphere there: its way while the shutter is open is the second.
fn sphere_texels(effects: &Effects) -> usize {
    1 + usize::from(effects.has(Effect::Motion))
}

/// With zeros up to whole rows of texels, at least one.
fn in_rows(mut bytes: Vec<u8>, width: u32) -> Vec<u8> {
    let row = width as usize * TEXEL;
    bytes.resize(bytes.len().next_multiple_of(row).max(row), 0);
    bytes
}

/// The texture `attribute_texels`: records of `attributes_of` in `shaders/scene/data.wesl`.
fn attributes(scene: &Scene, placement: &Placement, effects: &Effects) -> Vec<u8> {
    let texels = attribute_texels(effects);
    let mut anchored = anchored_spheres(scene, placement)
        .zip(scene.materials.len()..)
        .peekable();
    let number = |sphere: Option<usize>| sphere.map_or(u32::MAX, |i| i as u32);
    let records = placement
        .spheres
        .iter()
        .enumerate()
        .flat_map(|(i, sphere)| {
            let own = anchored.next_if(|(own, _)| *own == i);
            let material = own.map_or(sphere.material, |(_, record)| record) as u32;
            let place = match i.checked_sub(placement.poles) {
                Some(centered) if effects.has(Effect::Bvh) => placement.tree().places[centered],
                _ => 0,
            };
            let light = match effects.has(Effect::Lights) {
                true => (light_weight(i, placement, effects) as f32).to_bits(),
                false => 0,
            };
            let cores: [u32; MOST_CORES] =
                std::array::from_fn(|n| number(sphere.cores.get(n).copied()));
            let record = [
                [material, sphere.side as u32, place, light],
                [sphere.level, number(sphere.container), 0, 0],
                cores,
            ];
            record.into_iter().take(texels)
        });
    in_rows(bytes_of(records), ATTRIBUTES_WIDTH)
}

/// Texels of such a record: the last ones are for dielectrics that touch, and for spheres just within these.
fn attribute_texels(effects: &Effects) -> usize {
    match (effects.has(Effect::Nested), effects.has(Effect::Priority)) {
        (true, _) => 3,
        (false, true) => 2,
        (false, false) => 1,
    }
}

/// The texture `material_texels`.
fn materials(
    scene: &Scene,
    placement: &Placement,
    effects: &Effects,
    tables: &SceneTables,
) -> Vec<u8> {
    let (members, size) = material_record(effects);
    let records = tables.records(scene, placement).into_iter();
    let bytes = records.flat_map(|r| r.bytes(&members, size)).collect();
    in_rows(bytes, MATERIALS_WIDTH)
}

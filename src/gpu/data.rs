//! What the kernel reads of a scene, as it lies in its buffer: `SceneData` of `shaders/scene/data.wesl`.

use bytemuck::Pod;

use crate::effects::{Effect, Effects};
use crate::error::{Error, Result};
use crate::gpu::layout::{LightRecord, MaterialRecord, PoleRecord, SphereRecord, light_weight};
use crate::materials::Member;
use crate::placement::Placement;
use crate::placement::containment::MOST_CORES;
use crate::scene::Scene;
use crate::shader::{Kernel, material_members};

/// Name of the buffer.
pub(super) const SCENE: &str = "scene";

/// Whether the device takes the scene's data, and `partials` bytes of partial sums.
///
/// # Errors
/// [`Error::DeviceLimit`] if one of these is too large for it.
pub(super) fn check(limits: &wgpu::Limits, kernel: &Kernel, partials: u64) -> Result<()> {
    let most = limits
        .max_storage_buffer_binding_size
        .min(limits.max_buffer_size);
    let data = kernel.struct_members("SceneData");
    let data = data.map_or(0, |(_, size)| u64::from(size));
    for (name, size) in [("scene's data", data), ("partial sums", partials)] {
        if size > most {
            return Err(Error::DeviceLimit(format!(
                "the {name} need {size} bytes, more than the device's limit of {most} for one \
                 buffer; --backend cpu has no such limit"
            )));
        }
    }
    Ok(())
}

/// The bytes that `kernel` reads; `None` if it reads nothing of the scene.
pub(super) fn scene_data(
    kernel: &Kernel,
    scene: &Scene,
    placement: &Placement,
    effects: &Effects,
) -> Option<Vec<u8>> {
    let (members, size) = kernel.struct_members("SceneData")?;
    let mut bytes = vec![0; size as usize];
    let ends = members.iter().skip(1).map(|(_, offset)| *offset);
    for ((name, offset), end) in members.iter().zip(ends.chain([size])) {
        let array = match name.as_str() {
            "spheres" => spheres(placement),
            "poles" => poles(placement),
            "attributes" => attributes(placement, effects),
            "materials" => materials(kernel, scene, placement, effects),
            "lights" => lights(kernel, placement, effects),
            other => unreachable!("no scene data {other}"),
        };
        bytes[*offset as usize..end as usize][..array.len()].copy_from_slice(&array);
    }
    Some(bytes)
}

fn bytes_of<T: Pod>(records: impl Iterator<Item = T>) -> Vec<u8> {
    let records: Vec<T> = records.collect();
    bytemuck::cast_slice(&records).to_vec()
}

fn spheres(placement: &Placement) -> Vec<u8> {
    let centered = &placement.spheres[placement.poles..];
    bytes_of(centered.iter().map(SphereRecord::new))
}

fn poles(placement: &Placement) -> Vec<u8> {
    let poles = placement.spheres[..placement.poles].iter();
    bytes_of(poles.filter_map(|s| Some(PoleRecord::new(s, s.pole?))))
}

fn attributes(placement: &Placement, effects: &Effects) -> Vec<u8> {
    let mut words: Vec<u32> = Vec::new();
    for (index, sphere) in placement.spheres.iter().enumerate() {
        words.push(sphere.material as u32);
        if effects.has(Effect::Interior) {
            words.push(sphere.side as u32);
        }
        if effects.has(Effect::Priority) {
            words.push(sphere.level);
        }
        if effects.has(Effect::Nested) {
            let core = |i: usize| sphere.cores.get(i).copied();
            let cores = (0..MOST_CORES).map(core);
            for other in std::iter::once(sphere.container).chain(cores) {
                words.push(other.map_or(u32::MAX, |i| i as u32));
            }
        }
        if effects.has(Effect::Lights) {
            words.push((light_weight(index, placement, effects) as f32).to_bits());
        }
    }
    bytes_of(words.into_iter())
}

fn materials(kernel: &Kernel, scene: &Scene, placement: &Placement, effects: &Effects) -> Vec<u8> {
    let (offsets, size) = kernel.struct_members("Material").unwrap_or_default();
    let members: Vec<(Member, u32)> = std::iter::zip(material_members(effects), offsets)
        .map(|(member, (_, offset))| (member, offset))
        .collect();
    let record = |m| MaterialRecord::new(m, placement.radiance_scale);
    let materials = scene.materials.iter();
    materials
        .flat_map(|m| record(m).bytes(&members, size))
        .collect()
}

fn lights(kernel: &Kernel, placement: &Placement, effects: &Effects) -> Vec<u8> {
    let (_, size) = kernel.struct_members("Light").unwrap_or_default();
    let mut bytes = Vec::new();
    for light in &placement.lights.table {
        let record = LightRecord::new(light, placement, effects);
        bytes.extend_from_slice(&bytemuck::bytes_of(&record)[..size as usize]);
    }
    bytes
}

//! The scene's way to the device: storage buffers of the geometry form `list`.

use wgpu::util::DeviceExt as _;

use crate::containment::MOST_CORES;
use crate::effects::Effects;
use crate::error::{Error, Result};
use crate::gpu::layout::{LightRecord, MaterialRecord, PoleRecord, SphereRecord, light_weight};
use crate::placement::Placement;
use crate::scene::Scene;
use crate::shader::Kernel;

/// The scene's storage buffers, before they are on the device.
pub(super) struct Uploads(Vec<(u32, &'static str, Vec<u8>)>);

impl Uploads {
    /// What `kernel` binds.
    pub(super) fn new(
        kernel: &Kernel,
        scene: &Scene,
        placement: &Placement,
        effects: &Effects,
    ) -> Self {
        let mut all: Vec<(u32, &'static str, Vec<u8>)> = Vec::new();
        if kernel.has_binding(14) {
            let (_, size) = kernel.struct_members("Light").expect("of binding 14");
            let mut bytes = Vec::new();
            for light in &placement.lights.table {
                let record = LightRecord::new(light, placement, effects);
                bytes.extend_from_slice(&bytemuck::bytes_of(&record)[..size as usize]);
            }
            all.push((14, "lights", bytes));
        }
        if effects.has("baked") {
            return Self(all);
        }
        let (poles, centered) = placement.spheres.split_at(placement.poles);
        let spheres: Vec<SphereRecord> = centered.iter().map(SphereRecord::new).collect();
        let poles: Vec<PoleRecord> = poles
            .iter()
            .filter_map(|s| Some(PoleRecord::new(s, s.pole?)))
            .collect();
        let mut attributes: Vec<u32> = Vec::new();
        for (index, sphere) in placement.spheres.iter().enumerate() {
            attributes.push(sphere.material as u32);
            if effects.has("interior") {
                attributes.push(sphere.side as u32);
            }
            if effects.has("priority") {
                attributes.push(sphere.level);
            }
            if effects.has("nested") {
                let core = |i: usize| sphere.cores.get(i).copied();
                let cores = (0..MOST_CORES).map(core);
                for other in std::iter::once(sphere.container).chain(cores) {
                    attributes.push(other.map_or(u32::MAX, |i| i as u32));
                }
            }
            if effects.has("lights") {
                attributes.push((light_weight(index, placement, effects) as f32).to_bits());
            }
        }
        all.push((0, "spheres", bytemuck::cast_slice(&spheres).to_vec()));
        all.push((1, "poles", bytemuck::cast_slice(&poles).to_vec()));
        all.push((2, "attributes", bytemuck::cast_slice(&attributes).to_vec()));
        if let Some((members, size)) = kernel.struct_members("Material") {
            let materials = scene.materials.iter();
            let record = |m| MaterialRecord::new(m, placement.light);
            let bytes = materials.flat_map(|m| record(m).bytes(&members, size));
            all.push((3, "materials", bytes.collect()));
        }
        // A binding of size zero is not allowed; what it holds is never read.
        for (_, _, bytes) in &mut all {
            if bytes.is_empty() {
                bytes.resize(64, 0);
            }
        }
        Self(all)
    }

    /// Whether the device takes them, and `partials` bytes of partial sums.
    pub(super) fn check(&self, limits: &wgpu::Limits, partials: u64) -> Result<()> {
        let most = limits
            .max_storage_buffer_binding_size
            .min(limits.max_buffer_size);
        let sizes = self
            .0
            .iter()
            .map(|(_, name, bytes)| (*name, bytes.len() as u64));
        for (name, size) in sizes.chain([("partial sums", partials)]) {
            if size > most {
                return Err(Error::DeviceLimit(format!(
                    "the {name} need {size} bytes, more than the device's limit of {most} for one \
                     buffer; --backend cpu has no such limit"
                )));
            }
        }
        Ok(())
    }

    /// Puts them on the device; binding and buffer.
    pub(super) fn create(&self, device: &wgpu::Device) -> Vec<(u32, wgpu::Buffer)> {
        let create = |(binding, label, contents): &(u32, &'static str, Vec<u8>)| {
            let buffer = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some(label),
                contents,
                usage: wgpu::BufferUsages::STORAGE,
            });
            (*binding, buffer)
        };
        self.0.iter().map(create).collect()
    }
}

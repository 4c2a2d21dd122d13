//! Host of `kernel.wgsl`.

use bytemuck::{Pod, Zeroable};
use gpu_trace::gpu::device::{self, DeviceChoice, Gpu};
use wgpu::util::DeviceExt as _;

use super::flat::FlatScene;

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Sphere {
    center: [f32; 3],
    radius: f32,
    color: [f32; 3],
    kind: u32,
    emission: [f32; 3],
    ior: f32,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Work {
    size: [u32; 2],
    samples: [u32; 2],
    position: [f32; 3],
    max_bounces: u32,
    film: [[f32; 4]; 3],
    environment: [f32; 4],
}

fn three(v: [f64; 3]) -> [f32; 3] {
    v.map(|x| x as f32)
}

fn four(v: [f64; 3]) -> [f32; 4] {
    [v[0] as f32, v[1] as f32, v[2] as f32, 0.0]
}

/// The kernel with a scene.
pub(crate) struct Kernel {
    gpu: Gpu,
    pipeline: wgpu::ComputePipeline,
    bind_group: wgpu::BindGroup,
    work: Work,
    work_buffer: wgpu::Buffer,
    sums: wgpu::Buffer,
    staging: wgpu::Buffer,
}

impl Kernel {
    /// # Panics
    /// Without a device, and for a scene with a lens.
    pub(crate) fn new(scene: &FlatScene, max_bounces: u32) -> Self {
        assert_eq!(scene.lens, [[0.0; 3]; 2], "the kernel has a pinhole");
        let gpu = device::open(&DeviceChoice::Best).unwrap_or_else(|e| panic!("{e}"));
        let spheres: Vec<Sphere> = scene
            .spheres
            .iter()
            .map(|s| Sphere {
                center: three(s.center),
                radius: s.radius as f32,
                color: three(s.color),
                kind: s.kind as u32,
                emission: three(s.emission),
                ior: (s.ior[0] / s.ior[1]) as f32,
            })
            .collect();
        let work = Work {
            size: [scene.width, scene.height],
            samples: [0, 0],
            position: three(scene.position),
            max_bounces,
            film: scene.film.map(four),
            environment: four(scene.environment),
        };
        let device = &gpu.device;
        let init = |contents: &[u8], usage| {
            device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: None,
                contents,
                usage,
            })
        };
        let zero = vec![0; scene.width as usize * scene.height as usize * 16];
        let storage = wgpu::BufferUsages::STORAGE;
        let sphere_buffer = init(bytemuck::cast_slice(&spheres), storage);
        let uniform = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
        let work_buffer = init(bytemuck::bytes_of(&work), uniform);
        let sums = init(&zero, storage | wgpu::BufferUsages::COPY_SRC);
        let staging = init(
            &zero,
            wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        );
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("naive"),
            source: wgpu::ShaderSource::Wgsl(include_str!("kernel.wgsl").into()),
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("naive"),
            layout: None,
            module: &module,
            entry_point: Some("render"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        });
        let entries: Vec<_> = (0..)
            .zip([&sphere_buffer, &work_buffer, &sums])
            .map(|(binding, b)| wgpu::BindGroupEntry {
                binding,
                resource: b.as_entire_binding(),
            })
            .collect();
        let bind_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        Self {
            gpu,
            pipeline,
            bind_group,
            work,
            work_buffer,
            sums,
            staging,
        }
    }

    /// Mean of the samples `samples` of every pixel, three channels each, by rows.
    pub(crate) fn render(&mut self, samples: std::ops::Range<u32>) -> Vec<f64> {
        // Short dispatches: some systems stop long ones.
        const STEP: usize = 32;
        let mut total = vec![0.0; self.work.size[0] as usize * self.work.size[1] as usize * 3];
        for first in samples.clone().step_by(STEP) {
            self.work.samples = [first, (first + STEP as u32).min(samples.end)];
            self.dispatch();
            let slice = self.staging.slice(..);
            slice.map_async(wgpu::MapMode::Read, |mapped| {
                mapped.unwrap_or_else(|e| panic!("{e}"));
            });
            self.gpu.wait().unwrap_or_else(|e| panic!("{e}"));
            let bytes = slice
                .get_mapped_range()
                .expect("the buffer is mapped")
                .to_vec();
            self.staging.unmap();
            for (total, sum) in total.chunks_mut(3).zip(bytes.chunks(16)) {
                for (c, total) in total.iter_mut().enumerate() {
                    let part: [u8; 4] = sum[4 * c..][..4].try_into().expect("four bytes");
                    *total += f64::from(f32::from_le_bytes(part));
                }
            }
        }
        let count = f64::from(samples.end - samples.start);
        total.iter().map(|x| x / count).collect()
    }

    fn dispatch(&self) {
        let queue = &self.gpu.queue;
        queue.write_buffer(&self.work_buffer, 0, bytemuck::bytes_of(&self.work));
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &self.bind_group, &[]);
            let [width, height] = self.work.size;
            pass.dispatch_workgroups(width.div_ceil(8), height.div_ceil(8), 1);
        }
        encoder.copy_buffer_to_buffer(&self.sums, 0, &self.staging, 0, self.sums.size());
        queue.submit([encoder.finish()]);
    }
}

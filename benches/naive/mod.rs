//! Host of the baseline kernel `naive.wgsl`.

use std::time::Instant;

use bytemuck::{Pod, Zeroable};
use glam::DVec3;
use gpu_trace::gpu::device::{self, DeviceChoice};
use gpu_trace::materials::MaterialKind;
use gpu_trace::scene::{Handedness, Scene};
use wgpu::util::DeviceExt as _;

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Sphere {
    center: [f32; 3],
    radius: f32,
    albedo: [f32; 4],
    emission: [f32; 4],
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Work {
    size: [u32; 2],
    samples: [u32; 2],
    position: [f32; 3],
    max_bounces: u32,
    corner: [f32; 4],
    across: [f32; 4],
    down: [f32; 4],
}

fn four(v: DVec3) -> [f32; 4] {
    v.as_vec3().extend(0.0).to_array()
}

/// Renders `spp` samples of `scene`, whose materials are diffuse, in dispatches of the whole image.
pub(crate) fn contestant(scene: &Scene, spp: u64) -> Box<dyn FnMut() -> (f64, f64)> {
    let gpu = device::open(&DeviceChoice::Best).unwrap_or_else(|e| panic!("{e}"));
    let spheres: Vec<Sphere> = scene
        .spheres
        .iter()
        .map(|sphere| {
            let material = &scene.materials[sphere.material];
            let MaterialKind::Diffuse(diffuse) = &material.kind else {
                panic!("the baseline knows diffuse materials only")
            };
            Sphere {
                center: sphere.center.as_vec3().to_array(),
                radius: sphere.radius as f32,
                albedo: four(diffuse.albedo),
                emission: four(material.emission),
            }
        })
        .collect();
    let camera = &scene.camera;
    let forward = (camera.look_at - camera.position).normalize();
    let right = match camera.handedness {
        Handedness::Right => forward.cross(camera.up),
        Handedness::Left => camera.up.cross(forward),
    }
    .normalize();
    let up = (camera.up - camera.up.dot(forward) * forward).normalize();
    let pixel = 2.0 * (0.5 * camera.fov.to_radians()).tan() / f64::from(scene.height);
    let (across, down) = (pixel * right, -pixel * up);
    let (width, height) = (scene.width, scene.height);
    let corner = forward - 0.5 * (f64::from(width) * across + f64::from(height) * down);
    let mut work = Work {
        size: [width, height],
        samples: [0, 0],
        position: camera.position.as_vec3().to_array(),
        max_bounces: 64,
        corner: four(corner),
        across: four(across),
        down: four(down),
    };
    let device = &gpu.device;
    let init = |contents: &[u8], usage| {
        device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: None,
            contents,
            usage,
        })
    };
    let sphere_buffer = init(bytemuck::cast_slice(&spheres), wgpu::BufferUsages::STORAGE);
    let uniform = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
    let work_buffer = init(bytemuck::bytes_of(&work), uniform);
    let zero = vec![0; width as usize * height as usize * 16];
    let sums = init(&zero, wgpu::BufferUsages::STORAGE);
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("naive"),
        source: wgpu::ShaderSource::Wgsl(include_str!("../naive.wgsl").into()),
    });
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some("naive"),
        layout: None,
        module: &module,
        entry_point: Some("render"),
        compilation_options: wgpu::PipelineCompilationOptions::default(),
        cache: None,
    });
    let buffers = [&sphere_buffer, &work_buffer, &sums];
    let entries: Vec<_> = (0..)
        .zip(buffers)
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
    Box::new(move || {
        let begin = Instant::now();
        let step = 16;
        for first in (0..spp as u32).step_by(step) {
            work.samples = [first, (first + step as u32).min(spp as u32)];
            gpu.queue
                .write_buffer(&work_buffer, 0, bytemuck::bytes_of(&work));
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            {
                let mut pass = encoder.begin_compute_pass(&Default::default());
                pass.set_pipeline(&pipeline);
                pass.set_bind_group(0, &bind_group, &[]);
                pass.dispatch_workgroups(width.div_ceil(8), height.div_ceil(8), 1);
            }
            gpu.queue.submit([encoder.finish()]);
            gpu.wait().unwrap_or_else(|e| panic!("{e}"));
        }
        let paths = f64::from(width) * f64::from(height) * spp as f64;
        (paths, begin.elapsed().as_secs_f64())
    })
}

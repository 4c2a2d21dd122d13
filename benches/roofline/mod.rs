//! The peak of the ray-sphere test on the device, and what share of it scenes reach.

use std::time::Instant;

use gpu_trace::gpu::device::{self, DeviceChoice};
use gpu_trace::gpu::renderer::GpuRenderer;
use gpu_trace::job::prepare;
use gpu_trace::render::render_quietly;
use gpu_trace::scene::Scene;
use gpu_trace::settings::{GeometryChoice, Settings, View};

use crate::trees::crowd;
use crate::{ROUNDS, film_of, median, scene};

/// Invocations of the kernel, its turns, and the spheres of a turn.
const TESTS: f64 = (INVOCATIONS * 2048 * 8) as f64;
const INVOCATIONS: u64 = 1 << 16;

/// Prints a table.
pub(crate) fn run() {
    let peak = peak();
    println!(
        "peak: {:.0} million tests of a ray against a sphere a second\n",
        peak * 1e-6
    );
    println!("| scene | form | Mrays/s | tests a ray | million tests/s | of the peak |");
    println!("|---|---|---|---|---|---|");
    let crowd = |count| (format!("{count} balls at random"), crowd(count), 4);
    let named = |name: &str| (name.to_owned(), scene(name), 32);
    for (name, scene, spp) in [
        named("lecture"),
        named("glass"),
        named("field"),
        crowd(32_768),
        crowd(1_000_000),
    ] {
        let forms = match scene.spheres.len() {
            0..64 => vec![GeometryChoice::Baked, GeometryChoice::Bvh],
            64..1024 => vec![GeometryChoice::Bvh, GeometryChoice::List],
            _ => vec![GeometryChoice::Bvh],
        };
        for form in forms {
            row(&name, &scene, spp, form, peak);
        }
    }
}

fn row(name: &str, scene: &Scene, spp: u64, geometry: GeometryChoice, peak: f64) {
    let settings = Settings {
        samples: 0..spp,
        geometry,
        ..Settings::for_scene(scene)
    };
    let job = prepare(scene, &settings).unwrap_or_else(|e| panic!("{e}"));
    let gpu = device::open(&DeviceChoice::Best).unwrap_or_else(|e| panic!("{e}"));
    let mut renderer = GpuRenderer::new(gpu, &job).unwrap_or_else(|e| panic!("{e}"));
    let mut turn = || {
        let begin = Instant::now();
        let outcome = render_quietly(&mut renderer, &settings).unwrap_or_else(|e| panic!("{e}"));
        outcome.film.tally().rays as f64 / begin.elapsed().as_secs_f64()
    };
    // The first one compiles.
    turn();
    let rate = median((0..ROUNDS).map(|_| turn()).collect());
    let tests = match geometry {
        GeometryChoice::Bvh => {
            let view = Settings {
                view: Some(View::BvhCost),
                ..settings
            };
            let film = film_of(scene, &view);
            let rays = film.tally().rays as f64;
            let pixels = film.pixels();
            let steps: f64 = pixels.iter().map(|pixel| f64::from(pixel[0])).sum();
            // A step is a node's four boxes, a leaf's four spheres, or both.
            4.0 * steps * spp as f64 / rays
        }
        _ => job.placement().spheres.len() as f64,
    };
    println!(
        "| {name} | {} | {:.2} | {tests:.1} | {:.0} | {:.2} |",
        geometry.name(),
        rate * 1e-6,
        rate * tests * 1e-6,
        rate * tests / peak
    );
}

/// Tests a second of a kernel of nothing else.
fn peak() -> f64 {
    let gpu = device::open(&DeviceChoice::Best).unwrap_or_else(|e| panic!("{e}"));
    let device = &gpu.device;
    let found = device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: 8 * INVOCATIONS,
        usage: wgpu::BufferUsages::STORAGE,
        mapped_at_creation: false,
    });
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("roofline"),
        source: wgpu::ShaderSource::Wgsl(include_str!("kernel.wgsl").into()),
    });
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some("roofline"),
        layout: None,
        module: &module,
        entry_point: Some("main"),
        compilation_options: wgpu::PipelineCompilationOptions::default(),
        cache: None,
    });
    let bind_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &pipeline.get_bind_group_layout(0),
        entries: &[wgpu::BindGroupEntry {
            binding: 0,
            resource: found.as_entire_binding(),
        }],
    });
    let turn = || {
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &bind_group, &[]);
        pass.dispatch_workgroups((INVOCATIONS / 64) as u32, 1, 1);
        drop(pass);
        let begin = Instant::now();
        gpu.queue.submit([encoder.finish()]);
        gpu.wait().unwrap_or_else(|e| panic!("{e}"));
        TESTS / begin.elapsed().as_secs_f64()
    };
    // The first one compiles.
    turn();
    median((0..ROUNDS).map(|_| turn()).collect())
}

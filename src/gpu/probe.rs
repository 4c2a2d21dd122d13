//! Single functions of the kernel on a device: for tests, and for the hazard suite.
//!
//! Every function has an entry point `probe_<function>` in `shaders/probe.wesl`, where its rows are
//! listed. An invocation reads a few rows of four 32-bit words and writes a few; here a row is
//! `[f32; 4]` or `[u32; 4]`, and an invocation's rows are an array or a `repr(C)` struct of these.

use bytemuck::{Pod, Zeroable};
use wgpu::util::DeviceExt as _;

use crate::effects::Effects;
use crate::error::{Error, Result};
use crate::gpu::device::Gpu;
use crate::gpu::layout::CameraRecord;
use crate::placement::Placement;
use crate::scene::Scene;
use crate::shader::{Kernel, Stage, link};

/// Bytes of a row.
const ROW: usize = 16;
/// Invocations of a workgroup.
const WORKGROUP: usize = 64;
/// Invocations of a dispatch: well within the workgroups that every device allows, and short.
const DISPATCH: usize = 1 << 18;

/// `Shape` of `shaders/probe.wesl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct ShapeRecord {
    /// Invocations that have work.
    pub count: u32,
    /// Rows that an invocation reads.
    pub inputs: u32,
    /// Rows that it writes.
    pub outputs: u32,
    /// Always 0, which no shader compiler knows.
    pub zero: u32,
}

/// The kernel's functions, ready to be called.
#[derive(Debug)]
pub struct Probe {
    gpu: Gpu,
    kernel: Kernel,
    module: wgpu::ShaderModule,
    layout: wgpu::BindGroupLayout,
    camera: wgpu::Buffer,
}

impl Probe {
    /// Links the functions that `effects` bring; `scene` and `placement` give camera and
    /// environment.
    ///
    /// # Errors
    /// [`Error::Shader`] if they do not link, [`Error::Gpu`] if the device refuses them.
    pub fn new(gpu: &Gpu, scene: &Scene, placement: &Placement, effects: &Effects) -> Result<Self> {
        let kernel = link(Stage::Probe, scene, placement, effects)?;
        let module = gpu
            .device
            .create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some("probe"),
                source: wgpu::ShaderSource::Wgsl(kernel.wgsl.as_str().into()),
            });
        let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer {
                ty,
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        };
        // The same for all functions: a layout may have more than an entry point uses.
        let layout = gpu
            .device
            .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                label: Some("probe"),
                entries: &[
                    entry(4, wgpu::BufferBindingType::Uniform),
                    entry(11, wgpu::BufferBindingType::Storage { read_only: true }),
                    entry(12, wgpu::BufferBindingType::Storage { read_only: false }),
                    entry(13, wgpu::BufferBindingType::Uniform),
                ],
            });
        let camera = gpu
            .device
            .create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some("camera"),
                contents: bytemuck::bytes_of(&CameraRecord::new(&placement.camera)),
                usage: wgpu::BufferUsages::UNIFORM,
            });
        gpu.check()?;
        Ok(Self {
            gpu: gpu.clone(),
            kernel,
            module,
            layout,
            camera,
        })
    }

    /// The kernel in use.
    #[must_use]
    pub fn kernel(&self) -> &Kernel {
        &self.kernel
    }

    /// Calls `function` once for each of `inputs`.
    ///
    /// # Errors
    /// [`Error::Gpu`] if the device fails, [`Error::Shader`] if no effect in use brings `function`.
    ///
    /// # Panics
    /// If an input or an output is not a whole number of rows.
    pub fn call<I: Pod, O: Pod>(&self, function: &str, inputs: &[I]) -> Result<Vec<O>> {
        assert_eq!(
            size_of::<I>() % ROW,
            0,
            "inputs of {function} are not whole rows"
        );
        assert_eq!(
            size_of::<O>() % ROW,
            0,
            "outputs of {function} are not whole rows"
        );
        let entry = format!("probe_{function}");
        if !self
            .kernel
            .module
            .entry_points
            .iter()
            .any(|e| e.name == entry)
        {
            return Err(Error::Shader(format!(
                "the kernel has no function {function}"
            )));
        }
        let device = &self.gpu.device;
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(function),
            bind_group_layouts: &[Some(&self.layout)],
            immediate_size: 0,
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(function),
            layout: Some(&layout),
            module: &self.module,
            entry_point: Some(&entry),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        });
        self.gpu.check()?;
        let mut outputs = Vec::with_capacity(inputs.len());
        for part in inputs.chunks(DISPATCH) {
            self.dispatch(&pipeline, part, &mut outputs)?;
        }
        Ok(outputs)
    }

    fn dispatch<I: Pod, O: Pod>(
        &self,
        pipeline: &wgpu::ComputePipeline,
        inputs: &[I],
        outputs: &mut Vec<O>,
    ) -> Result<()> {
        let device = &self.gpu.device;
        let shape = ShapeRecord {
            count: inputs.len() as u32,
            inputs: (size_of::<I>() / ROW) as u32,
            outputs: (size_of::<O>() / ROW) as u32,
            zero: 0,
        };
        let upload = |label, contents: &[u8], usage| {
            device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some(label),
                contents,
                usage,
            })
        };
        let shape = upload(
            "shape",
            bytemuck::bytes_of(&shape),
            wgpu::BufferUsages::UNIFORM,
        );
        let input = upload(
            "inputs",
            bytemuck::cast_slice(inputs),
            wgpu::BufferUsages::STORAGE,
        );
        let size = size_of_val(inputs) / size_of::<I>() * size_of::<O>();
        let buffer = |label, usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: size as u64,
                usage,
                mapped_at_creation: false,
            })
        };
        let output = buffer(
            "outputs",
            wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
        );
        let staging = buffer(
            "staging",
            wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        );
        let bind_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("probe"),
            layout: &self.layout,
            entries: &[(4, &self.camera), (11, &input), (12, &output), (13, &shape)].map(
                |(binding, buffer)| wgpu::BindGroupEntry {
                    binding,
                    resource: buffer.as_entire_binding(),
                },
            ),
        });
        let mut encoder = device.create_command_encoder(&Default::default());
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &bind_group, &[]);
            pass.dispatch_workgroups(inputs.len().div_ceil(WORKGROUP) as u32, 1, 1);
        }
        encoder.copy_buffer_to_buffer(&output, 0, &staging, 0, size as u64);
        self.gpu.queue.submit([encoder.finish()]);
        // Whether it worked shows when the range is taken.
        staging.map_async(wgpu::MapMode::Read, .., |_| ());
        self.gpu.wait()?;
        let bytes = staging.get_mapped_range(..).map_err(|e| {
            Error::Gpu(format!("{}: no data came back: {e}", self.gpu.summary.name))
        })?;
        outputs.extend(
            bytes
                .chunks_exact(size_of::<O>())
                .map(bytemuck::pod_read_unaligned::<O>),
        );
        Ok(())
    }
}

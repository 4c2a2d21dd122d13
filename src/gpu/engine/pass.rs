//! Kernels on a device, and their entry points.

use crate::error::{Error, Result};
use crate::gpu::device::Gpu;
use crate::shader::Kernel;

/// A kernel on the device.
#[derive(Debug)]
pub(in crate::gpu) struct Program {
    kernel: Kernel,
    module: wgpu::ShaderModule,
}

/// An entry point of a kernel, compiled, and what it binds.
#[derive(Debug)]
pub(in crate::gpu) struct Pass {
    label: String,
    pipeline: wgpu::ComputePipeline,
    /// Number and name.
    bindings: Vec<(u32, String)>,
}

impl Program {
    /// Puts `kernel` on the device.
    pub(in crate::gpu) fn new(gpu: &Gpu, label: &str, kernel: Kernel) -> Self {
        let module = gpu
            .device
            .create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(label),
                source: wgpu::ShaderSource::Wgsl(kernel.wgsl.as_str().into()),
            });
        Self { kernel, module }
    }

    /// The kernel.
    pub(in crate::gpu) fn kernel(&self) -> &Kernel {
        &self.kernel
    }

    /// Compiles the entry point `entry` with these values of the kernel's `override`s.
    ///
    /// # Errors
    /// [`Error::Shader`] if there is no such entry point, [`Error::Gpu`] if the device refuses it.
    pub(in crate::gpu) fn pass(
        &self,
        gpu: &Gpu,
        entry: &str,
        constants: &[(&str, f64)],
    ) -> Result<Pass> {
        let mut entries = self.kernel.module.entry_points.iter();
        if !entries.any(|e| e.name == entry) {
            return Err(Error::Shader(format!(
                "the kernel has no entry point {entry}"
            )));
        }
        let pipeline = gpu
            .device
            .create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(entry),
                layout: None,
                module: &self.module,
                entry_point: Some(entry),
                compilation_options: wgpu::PipelineCompilationOptions {
                    constants,
                    ..Default::default()
                },
                cache: None,
            });
        gpu.check()?;
        let bindings = self.kernel.bindings(entry);
        Ok(Pass {
            label: entry.to_owned(),
            pipeline,
            bindings: bindings.into_iter().map(|b| (b.number, b.name)).collect(),
        })
    }
}

impl Pass {
    /// Whether it binds a buffer or texture `name`.
    pub(in crate::gpu) fn binds(&self, name: &str) -> bool {
        self.bindings.iter().any(|(_, bound)| bound == name)
    }

    /// Number and name of all that it binds.
    pub(super) fn bindings(&self) -> &[(u32, String)] {
        &self.bindings
    }

    pub(super) fn group(
        &self,
        device: &wgpu::Device,
        entries: &[wgpu::BindGroupEntry<'_>],
    ) -> wgpu::BindGroup {
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(&self.label),
            layout: &self.pipeline.get_bind_group_layout(0),
            entries,
        })
    }

    /// Dispatches `workgroups`, at most `most` in a row.
    pub(super) fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        group: &wgpu::BindGroup,
        workgroups: u32,
        most: u32,
    ) {
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, group, &[]);
        let across = workgroups.min(most);
        pass.dispatch_workgroups(across, workgroups.div_ceil(across), 1);
    }
}

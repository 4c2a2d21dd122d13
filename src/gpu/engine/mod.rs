//! Executes what is recorded, on a device.
//!
//! Three things are apart, as in vello: kernels, which name what they bind ([`crate::shader`]); a
//! [`Recording`], which says what happens in which order and is plain data; and the [`Engine`], which has
//! the buffers and textures of these names and does it. What one pass writes, another reads under the
//! same name. The numbers of bindings are the linker's, and nobody else's.

mod pass;
mod reading;
mod recording;
mod resource;

use std::collections::BTreeMap;

use crate::error::{Error, Result};
use crate::gpu::device::Gpu;

pub(super) use pass::{Pass, Program};
pub(super) use reading::{Reading, Readings};
pub(super) use recording::Recording;

use recording::Command;
use resource::{Content, Resource};

/// The buffers and textures of some passes.
#[derive(Debug)]
pub(super) struct Engine {
    gpu: Gpu,
    resources: BTreeMap<&'static str, Resource>,
}

impl Engine {
    /// An engine without buffers and textures.
    pub(super) fn new(gpu: Gpu) -> Self {
        Self {
            gpu,
            resources: BTreeMap::new(),
        }
    }

    /// The device.
    pub(super) fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// Makes the buffer `name`, of `size` bytes, more than 0. It replaces any of that name, and is all zeros.
    pub(super) fn buffer(&mut self, name: &'static str, size: u64) {
        let buffer = Resource::buffer(&self.gpu.device, name, size);
        self.resources.insert(name, buffer);
    }

    /// Makes the texture `name` of rgba32float texels.
    pub(super) fn texture(&mut self, name: &'static str, width: u32, height: u32) {
        let texture = Resource::texture(&self.gpu.device, name, width, height);
        self.resources.insert(name, texture);
    }

    /// Makes room to read `name` back. Whoever wants to know beforehand whether there is memory for that
    /// asks for it; else it is made when it is needed.
    ///
    /// # Errors
    /// [`Error::Shader`] if there is no such buffer or texture.
    pub(super) fn stage(&mut self, name: &'static str) -> Result<()> {
        let device = &self.gpu.device;
        let resource = self.resources.get_mut(name).ok_or_else(|| absent(name))?;
        resource.stage(device);
        Ok(())
    }

    /// Bytes of all buffers and textures, those to read back among them.
    pub(super) fn bytes(&self) -> u64 {
        self.resources.values().map(Resource::bytes).sum()
    }

    /// Executes the commands in their order, waits, and hands over what was read.
    ///
    /// # Errors
    /// [`Error::Gpu`] if the device fails, [`Error::Shader`] if there is no buffer or texture of a name that
    /// is read, cleared, or bound by a pass.
    pub(super) fn run(&mut self, recording: Recording<'_>) -> Result<Readings> {
        let device = self.gpu.device.clone();
        let encoder = || device.create_command_encoder(&Default::default());
        // None: nothing is waiting to be submitted.
        let mut pending: Option<wgpu::CommandEncoder> = None;
        let mut reads = Vec::new();
        for command in recording.commands {
            match command {
                Command::Upload { name, bytes } => {
                    // Uploads come before what is submitted later.
                    self.submit(pending.take());
                    self.upload(name, bytes);
                }
                Command::UploadTexels {
                    name,
                    texels,
                    width,
                } => {
                    self.submit(pending.take());
                    let texture = Resource::texels(&self.gpu, name, texels, width);
                    self.resources.insert(name, texture);
                }
                Command::Clear { name, from } => {
                    let buffer = self
                        .resource(name)?
                        .as_buffer()
                        .ok_or_else(|| absent(name))?;
                    let encoder = pending.get_or_insert_with(encoder);
                    encoder.clear_buffer(buffer, from, None);
                }
                Command::Dispatch { pass, workgroups } => {
                    let group = self.bind(pass)?;
                    let most = self.gpu.limits.max_compute_workgroups_per_dimension;
                    pass.encode(
                        pending.get_or_insert_with(encoder),
                        &group,
                        workgroups,
                        most,
                    );
                }
                Command::Copy { from, to } => {
                    let encoder = pending.get_or_insert_with(encoder);
                    self.resource(from)?
                        .copy_to_texels(encoder, self.resource(to)?);
                }
                Command::Read { name, part } => {
                    self.stage(name)?;
                    let encoder = pending.get_or_insert_with(encoder);
                    let (staging, rows) = self.resource(name)?.copy(encoder, part);
                    reads.push((name, staging, rows));
                }
            }
        }
        self.submit(pending);
        for (_, staging, _) in &reads {
            // Whether it worked shows when the range is taken.
            staging.map_async(wgpu::MapMode::Read, .., |_| ());
        }
        self.gpu.wait()?;
        let mut readings = Readings::default();
        for (name, staging, rows) in reads {
            let reading = Reading::new(staging, rows).map_err(|e| {
                Error::Gpu(format!("{}: no data came back: {e}", self.gpu.summary.name))
            })?;
            readings.add(name, reading);
        }
        Ok(readings)
    }

    fn submit(&self, encoder: Option<wgpu::CommandEncoder>) {
        if let Some(encoder) = encoder {
            self.gpu.queue.submit([encoder.finish()]);
        }
    }

    fn resource(&self, name: &str) -> Result<&Resource> {
        self.resources.get(name).ok_or_else(|| absent(name))
    }

    fn upload(&mut self, name: &'static str, bytes: &[u8]) {
        let fits = |r: &Resource| {
            r.as_buffer()
                .is_some_and(|b| b.size() == bytes.len() as u64)
        };
        if !self.resources.get(name).is_some_and(fits) {
            self.buffer(name, bytes.len() as u64);
        }
        if let Content::Buffer(buffer) = &self.resources[name].content {
            self.gpu.queue.write_buffer(buffer, 0, bytes);
        }
    }

    /// What `pass` binds, by the names in its kernel.
    fn bind(&self, pass: &Pass) -> Result<wgpu::BindGroup> {
        let entry = |(number, name): &(u32, String)| {
            Ok(wgpu::BindGroupEntry {
                binding: *number,
                resource: self.resource(name)?.binding(),
            })
        };
        let entries: Vec<_> = pass.bindings().iter().map(entry).collect::<Result<_>>()?;
        Ok(pass.group(&self.gpu.device, &entries))
    }
}

fn absent(name: &str) -> Error {
    Error::Shader(format!("there is no buffer or texture {name}"))
}

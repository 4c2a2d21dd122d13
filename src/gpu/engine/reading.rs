//! What came back from a device.

use std::collections::BTreeMap;
use std::ops::Index;

/// How a texture's rows lie in a buffer, in bytes; a buffer has one row.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rows {
    length: usize,
    stride: usize,
    count: usize,
}

impl Rows {
    pub(super) fn new(length: u32, stride: u32, count: u32) -> Self {
        Self {
            length: length as usize,
            stride: stride as usize,
            count: count as usize,
        }
    }

    pub(super) fn one(length: u64) -> Self {
        Self {
            length: length as usize,
            stride: length as usize,
            count: 1,
        }
    }
}

/// The bytes of one buffer or texture, where the driver has put them.
#[derive(Debug)]
pub(in crate::gpu) struct Reading {
    staging: wgpu::Buffer,
    /// Until it is dropped.
    view: Option<wgpu::BufferView>,
    rows: Rows,
}

impl Reading {
    pub(super) fn new(staging: wgpu::Buffer, rows: Rows) -> Result<Self, wgpu::MapRangeError> {
        let view = Some(staging.get_mapped_range(..)?);
        Ok(Self {
            staging,
            view,
            rows,
        })
    }

    /// The rows of texels.
    pub(in crate::gpu) fn rows(&self) -> impl Iterator<Item = &[u8]> {
        let bytes: &[u8] = self.view.as_deref().unwrap_or_default();
        let rows = bytes.chunks(self.rows.stride).take(self.rows.count);
        rows.map(|row| &row[..self.rows.length])
    }

    /// The bytes of a buffer.
    pub(in crate::gpu) fn bytes(&self) -> &[u8] {
        self.rows().next().unwrap_or_default()
    }
}

impl Drop for Reading {
    fn drop(&mut self) {
        self.view = None;
        self.staging.unmap();
    }
}

/// All that a recording has read.
#[derive(Debug, Default)]
pub(in crate::gpu) struct Readings(BTreeMap<&'static str, Reading>);

impl Readings {
    pub(super) fn add(&mut self, name: &'static str, reading: Reading) {
        self.0.insert(name, reading);
    }
}

impl Index<&str> for Readings {
    type Output = Reading;

    /// What was read of `name`.
    ///
    /// # Panics
    /// If the recording did not say so.
    fn index(&self, name: &str) -> &Reading {
        &self.0[name]
    }
}

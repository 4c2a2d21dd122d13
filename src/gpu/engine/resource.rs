//! One buffer or texture, and the buffer through which it is read back.

use super::reading::Rows;
use crate::gpu::device::Gpu;

/// Bytes of a texel.
const TEXEL: u32 = 16;

/// What a name stands for.
#[derive(Debug)]
pub(super) enum Content {
    Buffer(wgpu::Buffer),
    Texture(wgpu::Texture, wgpu::TextureView),
}

/// A buffer or texture of an [`Engine`](super::Engine).
#[derive(Debug)]
pub(super) struct Resource {
    pub(super) content: Content,
    staging: Option<wgpu::Buffer>,
}

impl Resource {
    pub(super) fn buffer(device: &wgpu::Device, name: &str, size: u64) -> Self {
        // Which of these a pass needs is the pass's affair.
        let usage = wgpu::BufferUsages::UNIFORM
            | wgpu::BufferUsages::STORAGE
            | wgpu::BufferUsages::COPY_SRC
            | wgpu::BufferUsages::COPY_DST;
        Self {
            content: Content::Buffer(device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(name),
                size,
                usage,
                mapped_at_creation: false,
            })),
            staging: None,
        }
    }

    pub(super) fn texture(device: &wgpu::Device, name: &str, width: u32, height: u32) -> Self {
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some(name),
            size: extent([width, height]),
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba32Float,
            usage: wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        Self {
            content: Content::Texture(texture, view),
            staging: None,
        }
    }

    /// A texture that passes only read.
    pub(super) fn texels(gpu: &Gpu, name: &str, texels: &[u8], width: u32) -> Self {
        let size = extent([width, texels.len() as u32 / (width * TEXEL)]);
        let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some(name),
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba32Uint,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(width * TEXEL),
            rows_per_image: None,
        };
        gpu.queue
            .write_texture(texture.as_image_copy(), texels, layout, size);
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        Self {
            content: Content::Texture(texture, view),
            staging: None,
        }
    }

    pub(super) fn as_buffer(&self) -> Option<&wgpu::Buffer> {
        match &self.content {
            Content::Buffer(buffer) => Some(buffer),
            Content::Texture(..) => None,
        }
    }

    pub(super) fn binding(&self) -> wgpu::BindingResource<'_> {
        match &self.content {
            Content::Buffer(buffer) => buffer.as_entire_binding(),
            Content::Texture(_, view) => wgpu::BindingResource::TextureView(view),
        }
    }

    /// Bytes on the device.
    pub(super) fn bytes(&self) -> u64 {
        let content = match &self.content {
            Content::Buffer(buffer) => buffer.size(),
            Content::Texture(t, _) => {
                u64::from(t.width()) * u64::from(t.height()) * u64::from(TEXEL)
            }
        };
        content + self.staging.as_ref().map_or(0, wgpu::Buffer::size)
    }

    /// Makes the buffer to read it through, unless it is there.
    pub(super) fn stage(&mut self, device: &wgpu::Device) {
        let size = match &self.content {
            Content::Buffer(buffer) => buffer.size(),
            Content::Texture(t, _) => u64::from(stride(t.width())) * u64::from(t.height()),
        };
        self.staging.get_or_insert_with(|| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("staging"),
                size,
                usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
                mapped_at_creation: false,
            })
        });
    }

    /// Records the copy of a buffer's start to all of a texture that passes only read, whose rows it has.
    pub(super) fn copy_to_texels(&self, encoder: &mut wgpu::CommandEncoder, to: &Self) {
        if let (Content::Buffer(buffer), Content::Texture(texture, _)) =
            (&self.content, &to.content)
        {
            let layout = wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(texture.width() * TEXEL),
                rows_per_image: None,
            };
            let from = wgpu::TexelCopyBufferInfo { buffer, layout };
            encoder.copy_buffer_to_texture(from, texture.as_image_copy(), texture.size());
        }
    }

    /// Records the copy of a buffer, or of `part` of a texture, to what [`Resource::stage`] has made.
    pub(super) fn copy(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        part: Option<[u32; 2]>,
    ) -> (wgpu::Buffer, Rows) {
        let staging = self.staging.clone().expect("staged before");
        let rows = match &self.content {
            Content::Buffer(buffer) => {
                encoder.copy_buffer_to_buffer(buffer, 0, &staging, 0, staging.size());
                Rows::one(staging.size())
            }
            Content::Texture(texture, _) => {
                let part = part.unwrap_or([texture.width(), texture.height()]);
                let stride = stride(part[0]);
                encoder.copy_texture_to_buffer(
                    texture.as_image_copy(),
                    wgpu::TexelCopyBufferInfo {
                        buffer: &staging,
                        layout: wgpu::TexelCopyBufferLayout {
                            offset: 0,
                            bytes_per_row: Some(stride),
                            rows_per_image: None,
                        },
                    },
                    extent(part),
                );
                Rows::new(part[0] * TEXEL, stride, part[1])
            }
        };
        (staging, rows)
    }
}

fn extent([width, height]: [u32; 2]) -> wgpu::Extent3d {
    wgpu::Extent3d {
        width,
        height,
        depth_or_array_layers: 1,
    }
}

/// Bytes from a row of texels to the next in a buffer.
fn stride(width: u32) -> u32 {
    (width * TEXEL).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT)
}

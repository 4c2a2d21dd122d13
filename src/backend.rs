//! What renders: an opened GPU, or the CPU reference.

use crate::effects::Effects;
use crate::error::{Error, Result};
use crate::film::AovSums;
use crate::gpu::device::Gpu;
use crate::gpu::renderer::GpuRenderer;
use crate::numbers::significant;
use crate::placement::Placement;
use crate::reference::path::ReferenceRenderer;
use crate::render::Renderer;
use crate::scene::Scene;
use crate::settings::{Rect, Settings};

/// A device that is ready: any number of renderers can be made on it.
#[derive(Clone)]
pub enum Backend {
    /// A GPU, in f32.
    Gpu(Box<Gpu>),
    /// The CPU reference, in f64.
    Cpu {
        /// Threads; 0 is one a core.
        threads: usize,
    },
}

impl Backend {
    /// `gpu` or `cpu`.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Gpu(_) => "gpu",
            Self::Cpu { .. } => "cpu",
        }
    }

    /// A renderer of the scene. On a GPU that links and compiles the kernel, which takes its time.
    ///
    /// # Errors
    /// If the device fails or has not enough memory.
    pub fn renderer(
        &self,
        scene: &Scene,
        placement: &Placement,
        effects: &Effects,
        settings: &Settings,
    ) -> Result<Box<dyn Renderer>> {
        let renderer: Box<dyn Renderer> = match self {
            Self::Gpu(gpu) => Box::new(GpuRenderer::new(
                Gpu::clone(gpu),
                scene,
                placement,
                effects,
                settings,
            )?),
            Self::Cpu { threads } => Box::new(ReferenceRenderer::new(
                scene, placement, settings, *threads,
            )?),
        };
        // After the driver has taken its part.
        check_memory(&settings.crop, self.pixel_bytes(settings))?;
        Ok(renderer)
    }

    /// Bytes of this program's memory that a pixel takes in a render, at most.
    #[must_use]
    pub fn pixel_bytes(&self, settings: &Settings) -> usize {
        let image = match self {
            // 96 in the film, 48 in the window, and room for the files.
            Self::Gpu(_) => LEAST_PIXEL_BYTES,
            // The reference's sums in the middle of a window are larger.
            Self::Cpu { .. } => 2 * LEAST_PIXEL_BYTES,
        };
        // The pilot has a film of its own.
        let pilot = if settings.adaptive { 96 } else { 0 };
        // In film, window and renderer, and in the files.
        let aovs = if settings.has_aovs() {
            4 * size_of::<AovSums>()
        } else {
            0
        };
        image + pilot + aovs
    }
}

/// What a pixel takes on any device.
pub const LEAST_PIXEL_BYTES: usize = 176;

/// Refuses an image that would end the program in the middle for want of memory.
///
/// # Errors
/// [`Error::Usage`] if there is less than `pixel_bytes` for each pixel of `crop`.
pub fn check_memory(crop: &Rect, pixel_bytes: usize) -> Result<()> {
    let bytes = crop.pixels().saturating_mul(pixel_bytes);
    let mut room: Vec<u8> = Vec::new();
    let there = room.try_reserve_exact(bytes).is_ok();
    // Without this, the compiler may leave the allocation out and assume that it works.
    std::hint::black_box(&room);
    if there {
        return Ok(());
    }
    Err(Error::Usage(format!(
        "{}x{} pixels need {} GiB of memory, more than there is: choose a smaller --size, or \
         render parts of the image with --crop",
        crop.width,
        crop.height,
        significant(bytes as f64 / f64::from(1 << 30)),
    )))
}

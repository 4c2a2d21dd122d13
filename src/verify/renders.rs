//! Renders of a scene, on a device and in f64.

use crate::backend::cpu::ReferenceRenderer;
use crate::error::Result;
use crate::film::Film;
use crate::gpu::device::Gpu;
use crate::gpu::renderer::GpuRenderer;
use crate::job::prepare;
use crate::render::render_quietly;
use crate::scene::Scene;
use crate::settings::{Rect, Settings};

/// The settings of `scene` at another size and number of samples.
#[must_use]
pub fn settings(scene: &Scene, width: u32, height: u32, spp: u64) -> Settings {
    Settings {
        width,
        height,
        crop: Rect::whole(width, height),
        samples: 0..spp,
        ..Settings::for_scene(scene)
    }
}

/// A renderer on a device.
///
/// # Errors
/// If the device fails.
pub fn renderer_on(gpu: &Gpu, scene: &Scene, settings: &Settings) -> Result<GpuRenderer> {
    GpuRenderer::new(gpu.clone(), &prepare(scene, settings)?)
}

/// Renders on a device.
///
/// # Errors
/// If the device fails.
pub fn render_on(gpu: &Gpu, scene: &Scene, settings: &Settings) -> Result<Film> {
    let mut renderer = renderer_on(gpu, scene, settings)?;
    Ok(render_quietly(&mut renderer, settings)?.film)
}

/// A renderer of the same paths in f64.
///
/// # Errors
/// If the threads do not start.
pub fn reference_renderer(scene: &Scene, settings: &Settings) -> Result<ReferenceRenderer> {
    ReferenceRenderer::new(&prepare(scene, settings)?, 0)
}

/// Renders the same paths in f64.
///
/// # Errors
/// If the threads do not start.
pub fn render_in_f64(scene: &Scene, settings: &Settings) -> Result<Film> {
    let mut renderer = reference_renderer(scene, settings)?;
    Ok(render_quietly(&mut renderer, settings)?.film)
}

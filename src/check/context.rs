//! What a case works with: a device, kernels of its functions, and renders.

use super::Options;
use crate::effects::{Effect, Effects};
use crate::error::Result;
use crate::film::Film;
use crate::gpu::bsdf_probe::BsdfProbe;
use crate::gpu::device::Gpu;
use crate::gpu::probe::Probe;
use crate::materials::MaterialKind;
use crate::placement::Placement;
use crate::scene::Scene;
use crate::scene::load::load_str;
use crate::settings::{Integrator, Offset, Settings};
use crate::verify::{EMPTY, render_in_f64, render_on, settings};

/// A device and the options of the suite.
#[derive(Debug)]
pub struct Context {
    /// The device.
    pub gpu: Gpu,
    /// The options.
    pub options: Options,
}

impl Context {
    /// `quick` in the quick form, else `full`.
    #[must_use]
    pub fn size<T>(&self, quick: T, full: T) -> T {
        if self.options.quick { quick } else { full }
    }

    /// 1, or with [`Options::disturb`] a little more: a factor for the truth.
    #[must_use]
    pub fn disturbed(&self, by: f64) -> f64 {
        if self.options.disturb { 1.0 + by } else { 1.0 }
    }

    /// The functions that exactly `effects` bring, and those of the way to leave surfaces.
    ///
    /// # Errors
    /// If the device fails.
    pub fn probe(&self, effects: &[Effect]) -> Result<Probe> {
        let offset = self.options.offset;
        let exits: &[Effect] = match offset {
            Offset::Exact => &[],
            Offset::Ulp => &[Effect::Interior, Effect::Straddle, Effect::Ulp],
            Offset::None | Offset::Back(_) | Offset::Out(_) => {
                &[Effect::Interior, Effect::Straddle, Effect::Nudge]
            }
        };
        let scene = self.scene(EMPTY)?;
        let settings = Settings::for_scene(&scene);
        let placement = Placement::with_offset(&scene, settings.width, settings.height, offset);
        let effects = Effects::of(&[effects, exits, &[Effect::Baked]].concat());
        Ok(Probe::new(&self.gpu, &scene, &placement, &effects))
    }

    /// These materials.
    #[must_use]
    pub fn materials(&self, materials: &[MaterialKind], integrator: Integrator) -> BsdfProbe {
        BsdfProbe::new(&self.gpu, materials, integrator)
    }

    /// A scene from its file's text.
    ///
    /// # Errors
    /// If the text is no scene.
    pub fn scene(&self, text: &str) -> Result<Scene> {
        Ok(load_str("check", text)?.scene)
    }

    /// Settings for `scene` at this size and number of samples.
    #[must_use]
    pub fn settings(&self, scene: &Scene, side: u32, spp: u64) -> Settings {
        Settings {
            offset: self.options.offset,
            ..settings(scene, side, side, spp)
        }
    }

    /// Renders on the device.
    ///
    /// # Errors
    /// If the device fails.
    pub fn render(&self, scene: &Scene, settings: &Settings) -> Result<Film> {
        render_on(&self.gpu, scene, settings)
    }

    /// Renders the same paths in f64; they leave surfaces exactly, whatever the suite's option.
    ///
    /// # Errors
    /// If the threads do not start.
    pub fn reference(&self, scene: &Scene, settings: &Settings) -> Result<Film> {
        let settings = Settings {
            offset: Offset::Exact,
            ..settings.clone()
        };
        render_in_f64(scene, &settings)
    }
}

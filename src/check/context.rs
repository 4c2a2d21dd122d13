//! What a case works with: a device, kernels of its functions, and renders.

use std::fmt::Write as _;

use super::Options;
use crate::effects::Effects;
use crate::error::Result;
use crate::film::Film;
use crate::gpu::bsdf_probe::BsdfProbe;
use crate::gpu::device::Gpu;
use crate::gpu::probe::Probe;
use crate::gpu::renderer::GpuRenderer;
use crate::job::prepare;
use crate::materials::MaterialKind;
use crate::placement::Placement;
use crate::reference::renderer::ReferenceRenderer;
use crate::render::render_quietly;
use crate::scene::Scene;
use crate::scene::load::load_str;
use crate::settings::{Integrator, Offset, Rect, Settings};

/// A device and the options of the suite.
#[derive(Debug)]
pub struct Context {
    /// The device.
    pub gpu: Gpu,
    /// The options.
    pub options: Options,
}

/// A scene that asks for no effect.
const EMPTY: &str = "[camera]\nposition = [0, 0, 4]\nlook_at = [0, 0, 0]\nfov = 36.0\n\
                     [image]\nwidth = 16\nheight = 16\n";

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
    pub fn probe(&self, effects: &[&str]) -> Result<Probe> {
        let offset = self.options.offset;
        let exits: &[&str] = match offset {
            Offset::Exact => &[],
            Offset::Ulp => &["interior", "straddle", "ulp"],
            Offset::None | Offset::Back(_) | Offset::Out(_) => &["interior", "straddle", "nudge"],
        };
        let scene = self.scene(EMPTY)?;
        let settings = Settings::for_scene(&scene);
        let placement = Placement::with_offset(&scene, settings.width, settings.height, offset);
        let effects = Effects::named(&[effects, exits, &["baked"]].concat());
        Probe::new(&self.gpu, &scene, &placement, &effects)
    }

    /// These materials.
    ///
    /// # Errors
    /// If the device fails.
    pub fn materials(
        &self,
        materials: &[MaterialKind],
        integrator: Integrator,
    ) -> Result<BsdfProbe> {
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
            width: side,
            height: side,
            crop: Rect {
                x: 0,
                y: 0,
                width: side,
                height: side,
            },
            samples: 0..spp,
            offset: self.options.offset,
            ..Settings::for_scene(scene)
        }
    }

    /// Renders on the device.
    ///
    /// # Errors
    /// If the device fails.
    pub fn render(&self, scene: &Scene, settings: &Settings) -> Result<Film> {
        let job = prepare(scene, settings)?;
        let mut renderer = GpuRenderer::new(self.gpu.clone(), &job)?;
        Ok(render_quietly(&mut renderer, settings)?.film)
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
        let mut renderer = ReferenceRenderer::new(&prepare(scene, &settings)?, 0)?;
        Ok(render_quietly(&mut renderer, &settings)?.film)
    }
}

/// The text of a scene, piece by piece.
#[derive(Clone, Debug, Default)]
pub(super) struct SceneText(String);

impl SceneText {
    /// A camera at `position` that looks at `look_at` with a field of view of 36 degrees.
    pub(super) fn new(position: [f64; 3], look_at: [f64; 3]) -> Self {
        Self(format!(
            "[camera]\nposition = {position:?}\nlook_at = {look_at:?}\nfov = 36.0\n\
             [image]\nwidth = 16\nheight = 16\n"
        ))
    }

    /// The same in a constant environment of radiance `gray`.
    pub(super) fn environment(mut self, gray: f64) -> Self {
        let _ = writeln!(self.0, "[environment]\nradiance = {:?}", [gray; 3]);
        self
    }

    /// With a material; `members` are lines of the scene file.
    pub(super) fn material(mut self, name: &str, members: &str) -> Self {
        let _ = writeln!(self.0, "[material.{name}]\n{members}");
        self
    }

    /// With a gray diffuse material.
    pub(super) fn diffuse(self, name: &str, albedo: f64, emission: f64) -> Self {
        let (albedo, emission) = ([albedo; 3], [emission; 3]);
        self.material(
            name,
            &format!("type = \"diffuse\"\nalbedo = {albedo:?}\nemission = {emission:?}"),
        )
    }

    /// With glass.
    pub(super) fn dielectric(self, name: &str, ior: f64) -> Self {
        self.material(name, &format!("type = \"dielectric\"\nior = {ior:?}"))
    }

    /// With a sphere.
    pub(super) fn sphere(mut self, center: [f64; 3], radius: f64, material: &str) -> Self {
        let _ = writeln!(
            self.0,
            "[[sphere]]\ncenter = {center:?}\nradius = {radius:?}\nmaterial = \"{material}\""
        );
        self
    }

    /// The scene.
    pub(super) fn load(&self, context: &Context) -> Result<Scene> {
        context.scene(&self.0)
    }
}

/// The means of all pixels and channels, rows from the top.
pub(super) fn means(film: &Film) -> Vec<f64> {
    (0..film.rect().pixels())
        .flat_map(|i| film.mean(i))
        .collect()
}

/// The bits of the image that a film gives.
pub(super) fn image_bits(film: &Film) -> Vec<u32> {
    let pixels = film.pixels();
    pixels.as_flattened().iter().map(|x| x.to_bits()).collect()
}

/// Share of the values of `film` that are off from the reference's by more than 0.1 %.
pub(super) fn share_off(film: &Film, reference: &Film) -> f64 {
    let (a, b) = (means(film), means(reference));
    let near = |(x, y): &(&f64, &f64)| (*x - *y).abs() <= 1.0e-3 * y.abs();
    1.0 - a.iter().zip(&b).filter(near).count() as f64 / a.len() as f64
}

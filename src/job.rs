//! A job: a scene and the settings to render it with, placed and checked.
//!
//! Every check of the two is here, and renderers are made of jobs only: nothing can be rendered, priced or
//! compared that a check refuses. What only a device or the memory can tell is left to the
//! [backend](crate::backend).

use crate::claims::Claims;
use crate::effects::{BAKED_MOST, Effect, Effects, cache_obstacle, conflict, image_obstacle};
use crate::error::{Error, Result};
use crate::film::PILOT_SAMPLES;
use crate::placement::cells::Cells;
use crate::placement::media::MAX_LEVELS;
use crate::placement::{Placement, Side};
use crate::reference::survey::survey;
use crate::scene::{MAX_BOUNCES, MAX_SIDE, MAX_SPP, Scene};
use crate::settings::{GeometryChoice, Integrator, Offset, Settings, TERMINATIONS, View};
use crate::variance::{VarianceReport, variance_class};

/// What will be rendered: it has passed all checks.
#[derive(Clone, Debug)]
pub struct Job {
    scene: Scene,
    settings: Settings,
    placement: Placement,
    effects: Effects,
    variance: VarianceReport,
}

/// Checks `scene` and `settings`, by themselves and together, and prepares them for renderers. Touches no
/// device.
///
/// # Errors
/// [`Error::Usage`] where settings are out of range or contradict each other or the scene;
/// [`Error::Placement`] for a scene that no scene file could hold, or that the kernel cannot render in this way.
pub fn prepare(scene: &Scene, settings: &Settings) -> Result<Job> {
    scene.check()?;
    check_image(settings)?;
    check_samples(settings)?;
    check_transport(settings)?;
    check_geometry(scene, settings)?;
    let placement = Placement::with_offset(scene, settings.width, settings.height, settings.offset);
    check_levels(&placement)?;
    check_magnitudes(scene, &placement)?;
    check_lens(scene, &placement)?;
    let effects = Effects::derive(scene, &placement, settings);
    check_view(settings, &effects)?;
    let placement = match effects.has(Effect::RadianceCache) {
        true => {
            let cells = survey(scene, &placement, settings);
            placement.with_cells(cells)
        }
        false => placement,
    };
    Ok(Job {
        effects,
        variance: variance_class(scene, &placement, settings),
        scene: scene.clone(),
        settings: settings.clone(),
        placement,
    })
}

impl Job {
    /// The scene.
    #[must_use]
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The settings.
    #[must_use]
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The scene, placed.
    #[must_use]
    pub fn placement(&self) -> &Placement {
        &self.placement
    }

    /// What the kernel holds.
    #[must_use]
    pub fn effects(&self) -> &Effects {
        &self.effects
    }

    /// The cells of the radiance cache, if it is used.
    #[must_use]
    pub fn cells(&self) -> Option<&Cells> {
        self.placement.cells().map(AsRef::as_ref)
    }

    /// Why there is no radiance cache, where one is asked for.
    #[must_use]
    pub fn cache_obstacle(&self) -> Option<&'static str> {
        let is_asked_for = self.settings.radiance_cache && self.cells().is_none();
        let why = || cache_obstacle(&self.scene, &self.placement, &self.settings);
        is_asked_for.then(why).flatten()
    }

    /// Why vertices look for no images of lamps, where they are asked to.
    #[must_use]
    pub fn image_obstacle(&self) -> Option<&'static str> {
        let why = || image_obstacle(&self.scene, &self.placement, &self.settings);
        self.settings.lamp_images.then(why).flatten()
    }

    /// What is known of a sample's variance.
    #[must_use]
    pub fn variance(&self) -> &VarianceReport {
        &self.variance
    }

    /// What its estimator claims.
    #[must_use]
    pub fn claims(&self) -> Claims {
        Claims::of(&self.settings, self.variance.class, self.cells().is_some())
    }

    /// The same with a radiance cache of these cells, whatever its settings.
    #[must_use]
    pub(crate) fn with_cells(mut self, cells: Cells) -> Self {
        self.placement = self.placement.with_cells(cells);
        self
    }

    /// The same with [separable shadowing](Effects::with_separable_shadowing) in the kernel.
    #[doc(hidden)]
    #[must_use]
    pub fn with_separable_shadowing(mut self) -> Self {
        self.effects = self.effects.with_separable_shadowing();
        self
    }

    /// The same with effects in the kernel that nothing asks for, to measure what they cost; `why` is the reason
    /// given for them.
    ///
    /// # Errors
    /// [`Error::Usage`] if they cannot be in one kernel with those that are there, or lack what they need.
    pub fn with_effects(mut self, more: &[Effect], why: &str) -> Result<Self> {
        let used: Vec<Effect> = self.effects.used().collect();
        if let Some(conflict) = conflict(&used, more) {
            return Err(Error::Usage(conflict));
        }
        if more.contains(&Effect::LampImages) {
            self.placement.images = Some(Vec::new());
        }
        self.effects = self.effects.with(more, why);
        if self.effects.has(Effect::RadianceCache) && self.cells().is_none() {
            let none = Cells::none(self.placement.spheres.len());
            self.placement = self.placement.with_cells(none);
        }
        Ok(self)
    }
}

fn usage(text: String) -> Result<()> {
    Err(Error::Usage(text))
}

fn check_image(settings: &Settings) -> Result<()> {
    let Settings {
        width,
        height,
        crop,
        ..
    } = settings;
    let side = 1..=MAX_SIDE;
    if !side.contains(width) || !side.contains(height) {
        return usage(format!(
            "--size {width}x{height}: an image has 1 to {MAX_SIDE} pixels a side"
        ));
    }
    let fits = |at: u32, size: u32, all: u32| u64::from(at) + u64::from(size) <= u64::from(all);
    if !fits(crop.x, crop.width, *width) || !fits(crop.y, crop.height, *height) {
        return usage(format!(
            "--crop {},{},{}x{} reaches beyond the image of {width}x{height} pixels",
            crop.x, crop.y, crop.width, crop.height
        ));
    }
    if crop.pixels() == 0 {
        return usage("--crop: an image has at least one pixel".into());
    }
    Ok(())
}

fn check_samples(settings: &Settings) -> Result<()> {
    let samples = &settings.samples;
    if samples.is_empty() || samples.end > MAX_SPP {
        return usage(format!(
            "--sample-range {}..{}: no sample lies in it, or some lie beyond 2^48",
            samples.start, samples.end
        ));
    }
    if settings.adaptive && samples.start > 0 {
        return usage("--adaptive begins at sample 0: it takes no --sample-range".into());
    }
    let least = 2 * PILOT_SAMPLES;
    if settings.adaptive && samples.end < least {
        return usage(format!(
            "--adaptive needs at least {least} samples a pixel: {PILOT_SAMPLES} of them decide where \
             the others go, and are in no pixel"
        ));
    }
    if settings.error.is_some_and(|e| !(e.is_finite() && e > 0.0)) {
        return usage("--error: an error to reach is above 0".into());
    }
    if settings.time.is_some_and(|time| time.is_zero()) {
        return usage("--time: no time at all".into());
    }
    Ok(())
}

fn check_transport(settings: &Settings) -> Result<()> {
    if settings.max_bounces > MAX_BOUNCES {
        return usage(format!(
            "--max-bounces {}: at most {MAX_BOUNCES}",
            settings.max_bounces
        ));
    }
    if let Integrator::Lecture { termination } = settings.integrator
        && !TERMINATIONS.contains(&termination)
    {
        return usage(format!(
            "--termination {termination}: a probability from 0 to below 1"
        ));
    }
    let integrator = settings.integrator;
    if settings.light_sampling.is_some() && !integrator.samples_lights() {
        return usage(format!(
            "--light-sampling says how path and nee sample lights: --integrator {} does not",
            integrator.name()
        ));
    }
    if settings.roulette.is_some() && integrator.is_lecture() {
        return usage(
            "--integrator lecture has its own roulette: --termination 0 turns it off".into(),
        );
    }
    if !settings.offset.is_valid() {
        return usage(format!(
            "--offset {}: a distance from 0 to 1e20",
            settings.offset
        ));
    }
    Ok(())
}

fn check_geometry(scene: &Scene, settings: &Settings) -> Result<()> {
    if settings.geometry == GeometryChoice::Baked && scene.spheres.len() > BAKED_MOST {
        return usage(format!(
            "--geometry baked takes up to {BAKED_MOST} spheres, the scene has {}: leave it to \
             auto, or use list or bvh",
            scene.spheres.len()
        ));
    }
    Ok(())
}

/// Refuses views of what is not in the kernel.
fn check_view(settings: &Settings, effects: &Effects) -> Result<()> {
    if settings.view == Some(View::BvhCost) && !effects.has(Effect::Bvh) {
        return usage(format!(
            "--view bvh-cost counts steps through a tree, and the geometry is {}: add --geometry bvh",
            effects.geometry()
        ));
    }
    if settings.view.is_some() && settings.classes {
        return usage("--view: the layers of light are none of its image".into());
    }
    Ok(())
}

fn check_levels(placement: &Placement) -> Result<()> {
    if placement.media.levels > MAX_LEVELS {
        return Err(Error::Placement(format!(
            "dielectrics that touch, nest or overlap need {} levels of priority, more than \
             {MAX_LEVELS}",
            placement.media.levels
        )));
    }
    Ok(())
}

/// Refuses what the kernel's f32 cannot hold in the scene's own unit: next to a sphere of radius 1e20,
/// one of radius 1e-20 has no size left.
fn check_magnitudes(scene: &Scene, placement: &Placement) -> Result<()> {
    let refuse = |what: &str| {
        Err(Error::Placement(format!(
            "{what} in units of the whole scene is a number that the device cannot hold: the \
             scene's lengths lie too many orders of magnitude apart"
        )))
    };
    for sphere in &placement.spheres {
        let radius = sphere.radius as f32;
        // The kernel needs the inverse, too.
        if !radius.is_normal() || !radius.recip().is_normal() {
            return refuse(&format!("the radius of sphere {}", sphere.source + 1));
        }
        if !sphere.anchor.as_vec3().is_finite() {
            return refuse(&format!("the center of sphere {}", sphere.source + 1));
        }
        if !sphere.motion.as_vec3().is_finite() {
            return refuse(&format!("the way of sphere {}", sphere.source + 1));
        }
        let absorption = scene.materials[sphere.material].kind.absorption();
        if !(absorption / placement.scale).as_vec3().is_finite() {
            return refuse(&format!("the absorption in sphere {}", sphere.source + 1));
        }
    }
    if let Some(distances) = placement.offset.distances()
        && !distances.iter().all(|x| (*x as f32).is_finite())
    {
        return refuse("the distance of --offset");
    }
    if !placement.radiance_scale.is_finite() {
        return Err(Error::Placement(
            "the brightest light of the scene is too dark to compute with".into(),
        ));
    }
    let camera = &placement.camera;
    if !(camera.approach as f32).is_finite() {
        return refuse("the camera's distance from the scene");
    }
    let lens = [camera.lens_across, camera.lens_down].map(|axis| axis.as_vec3());
    let focus = [camera.focus as f32, camera.lens_share as f32];
    if !lens.iter().all(|axis| axis.is_finite()) || !focus.iter().all(|x| x.is_finite()) {
        return refuse("the camera's lens");
    }
    Ok(())
}

/// Refuses a lens that straddles one of several dielectrics that share points: the points of the lens
/// would be in different media, and paths start in one.
fn check_lens(scene: &Scene, placement: &Placement) -> Result<()> {
    if placement.media.levels == 0 || placement.offset != Offset::Exact {
        return Ok(());
    }
    let straddled = placement
        .spheres
        .iter()
        .find(|s| s.side == Side::Sign && scene.materials[s.material].kind.transmits());
    match straddled {
        None => Ok(()),
        Some(sphere) => Err(Error::Placement(format!(
            "the lens lies on both sides of sphere {}, a dielectric, in a scene where dielectrics \
             share points: make `aperture_radius` smaller, or move the camera",
            sphere.source + 1
        ))),
    }
}

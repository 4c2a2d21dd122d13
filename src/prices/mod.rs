//! What each effect of a kernel costs on a device, measured: samples with it and samples with its
//! [alternative] in turns.
//!
//! An effect that is left out costs nothing where the kernel is, byte for byte, the one that is linked without
//! the effect's sources. What it costs linked in and unused is a figure of its own.

mod alternative;
mod forced;
mod standard;
mod turns;

use crate::backend::Backend;
use crate::effects::{Effect, table};
use crate::error::Result;
use crate::job::{Job, prepare};
use crate::scene::Scene;
use crate::settings::{Rect, Settings};
use crate::shader::{Stage, link, link_without};

pub use alternative::{Alternative, alternative};
pub use forced::forced;
pub use standard::standard;
pub use turns::{Cost, Effort};

use turns::{Bench, Meter};

/// The longer side of images that are measured, where no size is asked for.
const SIDE: u32 = 160;

/// A figure, or why there is none.
pub type Told<T> = std::result::Result<T, String>;

/// What is known of an effect's price.
#[derive(Clone, Debug)]
pub struct Price {
    /// The effect.
    pub effect: Effect,
    /// What asks for it; empty if it is left out.
    pub reasons: Vec<String>,
    /// Of what is in the kernel: against its alternative.
    pub against: Option<Told<Against>>,
    /// Of what is left out: whether the kernel is the one that is linked without the effect's sources.
    pub absent: Option<bool>,
    /// Of what is left out: linked in and unused.
    pub forced: Option<Told<Difference>>,
}

/// An effect, and what stands in its place.
#[derive(Clone, Debug)]
pub struct Against {
    /// What stands in its place.
    pub what: String,
    /// Other effects that go with it.
    pub without: Vec<&'static str>,
    /// Other effects that come in its place.
    pub instead: Vec<&'static str>,
    /// What it comes to.
    pub difference: Difference,
}

/// How far two kernels are apart.
#[derive(Clone, Copy, Debug)]
pub struct Difference {
    /// Of a sample.
    pub cost: Cost,
    /// Lines of the kernel.
    pub kernel_lines: i64,
    /// Seconds of linking and compiling, as the driver takes them: some keep what they have compiled before.
    pub compile_seconds: f64,
}

/// What the effects of a scene cost, or those of the program.
#[derive(Clone, Debug)]
pub struct PriceList {
    /// Name, interface and driver of the device.
    pub device: (String, String, String),
    /// The scene's own kernel; `None` where each effect has a scene of its own.
    pub kernel: Option<Measured>,
    /// A row for each effect.
    pub prices: Vec<Price>,
    /// Turns of each of two kernels.
    pub rounds: u64,
    /// Whether it was stopped before all was measured.
    pub interrupted: bool,
}

/// A kernel by itself.
#[derive(Clone, Copy, Debug)]
pub struct Measured {
    /// Width and height of the image.
    pub size: [u32; 2],
    /// Samples a pixel of a turn.
    pub spp: u64,
    /// Seconds of a million samples.
    pub seconds_per_megasample: f64,
    /// Its lines.
    pub lines: usize,
    /// Seconds to link and compile it.
    pub compile_seconds: f64,
}

/// Told what is measured next, and asked whether to go on.
pub trait Watch {
    /// `part` is next; so many of all are done.
    fn begin(&mut self, part: &str, done: usize, all: usize);
    /// Whether to go on.
    fn goes_on(&self) -> bool;
}

/// As `settings`, with an image small enough to be rendered many times.
#[must_use]
pub fn smaller(settings: &Settings) -> Settings {
    let longer = settings.width.max(settings.height);
    let side = |n: u32| match longer {
        ..=SIDE => n,
        _ => (u64::from(n) * u64::from(SIDE)).div_ceil(u64::from(longer)) as u32,
    };
    let (width, height) = (side(settings.width), side(settings.height));
    Settings {
        width,
        height,
        crop: Rect::whole(width, height),
        ..settings.clone()
    }
}

/// The job that is measured: its turns have the same samples everywhere, and end with them.
fn prepare_measured(scene: &Scene, settings: &Settings) -> Result<Job> {
    let asked = prepare(scene, settings)?;
    let job = prepare(
        scene,
        &Settings {
            adaptive: false,
            // What is asked for decides whether there is one.
            radiance_cache: asked.cells().is_some(),
            error: None,
            time: None,
            ..settings.clone()
        },
    )?;
    // All tiles get samples here: what it costs to ask is the same.
    match settings.adaptive {
        true => job.with_effects(&[Effect::Adaptive], "--adaptive"),
        false => Ok(job),
    }
}

/// Measures the effects that `scene` asks for with `settings`; with `left_out`, the others too.
///
/// # Errors
/// If the scene's own kernel cannot be rendered, or the device fails.
pub fn measure(
    backend: &Backend,
    scene: &Scene,
    settings: &Settings,
    left_out: bool,
    effort: Effort,
    watch: &mut dyn Watch,
) -> Result<PriceList> {
    let job = prepare_measured(scene, settings)?;
    let mut own = Bench::new(backend, &job)?;
    let meter = Meter::new(&mut own, effort)?;
    let mut list = PriceList {
        device: own.device(),
        kernel: Some(meter.kernel(&own)),
        prices: Vec::new(),
        rounds: effort.rounds,
        interrupted: false,
    };
    let is_measured = |reasons: &[String]| left_out || !reasons.is_empty();
    let rows = || job.effects().rows();
    let all = rows().filter(|(_, reasons)| is_measured(reasons)).count();
    let mut done = 0;
    for (row, reasons) in rows() {
        let mut price = Price::of(row.effect, reasons);
        if is_measured(reasons) && watch.goes_on() {
            watch.begin(row.name, done, all);
            done += 1;
            if reasons.is_empty() {
                price.absent = Some(is_absent(&job, row.effect)?);
                price.forced = force(backend, &job, row.effect, &mut own, meter, watch)?;
            } else {
                price.against = replace(backend, &job, row.effect, &mut own, meter, watch)?;
            }
        }
        list.prices.push(price);
    }
    list.interrupted = !watch.goes_on();
    Ok(list)
}

/// Measures every effect of the program on its [standard] scene; one that has no alternative as it is linked
/// into the plain scene's kernel, unused.
///
/// # Errors
/// If a standard scene cannot be rendered, or the device fails.
pub fn measure_all(backend: &Backend, effort: Effort, watch: &mut dyn Watch) -> Result<PriceList> {
    let mut prices = Vec::new();
    let mut device = None;
    for (done, row) in table().iter().enumerate() {
        watch.begin(row.name, done, table().len());
        let (scene, settings) = standard(row.effect);
        let job = prepare_measured(&scene, &settings)?;
        let reasons = job.effects().reasons(row.effect).to_vec();
        let mut own = Bench::new(backend, &job)?;
        device.get_or_insert_with(|| own.device());
        let meter = Meter::new(&mut own, effort)?;
        let mut price = Price::of(row.effect, &reasons);
        if reasons.is_empty() {
            price.forced = force(backend, &job, row.effect, &mut own, meter, watch)?;
        } else {
            price.against = replace(backend, &job, row.effect, &mut own, meter, watch)?;
        }
        prices.push(price);
        if !watch.goes_on() {
            break;
        }
    }
    Ok(PriceList {
        device: device.unwrap_or_default(),
        kernel: None,
        rounds: effort.rounds,
        interrupted: prices.len() < table().len(),
        prices,
    })
}

impl Price {
    fn of(effect: Effect, reasons: &[String]) -> Self {
        Self {
            effect,
            reasons: reasons.to_vec(),
            against: None,
            absent: None,
            forced: None,
        }
    }
}

/// Measures an effect in use against its alternative; `None` if that was stopped.
fn replace(
    backend: &Backend,
    job: &Job,
    effect: Effect,
    own: &mut Bench,
    meter: Meter,
    watch: &dyn Watch,
) -> Result<Option<Told<Against>>> {
    let other = match alternative(job, effect) {
        Ok(other) => other,
        Err(why) => return Ok(Some(Err(why))),
    };
    let mut bench = match Bench::new(backend, &other.job) {
        Ok(bench) => bench,
        Err(error) => return Ok(Some(Err(error.to_string()))),
    };
    let beside = |of: &Job, but: &Job| {
        let used = of.effects().used();
        let beside = used.filter(|e| *e != effect && !but.effects().has(*e));
        beside.map(Effect::name).collect()
    };
    let difference = meter.difference(own, &mut bench, watch)?;
    Ok(difference.map(|difference| {
        Ok(Against {
            without: beside(job, &other.job),
            instead: beside(&other.job, job),
            what: other.what,
            difference,
        })
    }))
}

/// Measures an effect that nothing asks for, linked in; `None` if that was stopped.
fn force(
    backend: &Backend,
    job: &Job,
    effect: Effect,
    own: &mut Bench,
    meter: Meter,
    watch: &dyn Watch,
) -> Result<Option<Told<Difference>>> {
    let mut bench = match forced(job, effect) {
        Ok(job) => Bench::new(backend, &job)?,
        Err(why) => return Ok(Some(Err(why))),
    };
    Ok(meter.difference(&mut bench, own, watch)?.map(Ok))
}

/// Whether the kernel of `job` is, byte for byte, the one that is linked without the sources of `effect`.
///
/// # Errors
/// If one of the two does not link.
pub fn is_absent(job: &Job, effect: Effect) -> Result<bool> {
    let (scene, placement, effects) = (job.scene(), job.placement(), job.effects());
    let own = link(Stage::Path, scene, placement, effects)?;
    let without = link_without(effect, scene, placement, effects)?;
    Ok(own.wgsl == without.wgsl)
}

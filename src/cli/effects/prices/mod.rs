//! `gpu-trace effects --measure`: what each effect costs on this device.

mod show;

use std::time::{Duration, Instant};

use super::super::args::RenderArgs;
use super::super::print;
use super::super::signals::Signals;
use super::{EffectsArgs, print_json};
use crate::backend::Backend;
use crate::error::{Error, Result};
use crate::output::{Progress, Snapshot};
use crate::prices::{self, Effort, PriceList, Watch, measure, measure_all};
use crate::scene::Loaded;
use crate::settings::Settings;

pub(in super::super) use show::shares_text;
use show::{document, text};

/// Measures the effects of a scene.
pub(super) fn of_scene(args: &EffectsArgs, loaded: &Loaded, settings: &Settings) -> Result<()> {
    let settings = match args.render.size {
        Some(_) => settings.clone(),
        None => prices::smaller(settings),
    };
    let list = run(&args.render, |backend, watch| {
        measure(
            backend,
            &loaded.scene,
            &settings,
            true,
            Effort::default(),
            watch,
        )
    })?;
    show(args, &loaded.name, list)
}

/// Measures all effects of the program.
pub(super) fn all(args: &EffectsArgs) -> Result<()> {
    let list = run(&args.render, |backend, watch| {
        measure_all(backend, Effort::default(), watch)
    })?;
    show(args, "each effect on a ball of its own", list)
}

/// What the time of a sample goes to, for `price`.
pub(in super::super) fn shares(
    backend: &Backend,
    loaded: &Loaded,
    settings: &Settings,
    signals: &Signals,
    progress: &Progress,
) -> Result<PriceList> {
    let mut display = Display::new(signals, progress);
    measure(
        backend,
        &loaded.scene,
        settings,
        false,
        Effort::default(),
        &mut display,
    )
}

/// A list, and how the signals left it.
struct Ended {
    list: PriceList,
    signal: Option<i32>,
}

fn run(
    render: &RenderArgs,
    measure: impl FnOnce(&Backend, &mut dyn Watch) -> Result<PriceList>,
) -> Result<Ended> {
    let signals = Signals::listen()?;
    let progress = Progress::new(render.progress, render.quiet);
    let mut warnings = Vec::new();
    let backend = Backend::open(&render.backend_choice(), &mut warnings)?;
    for warning in &warnings {
        progress.warning(warning);
    }
    let mut display = Display::new(&signals, &progress);
    let list = measure(&backend, &mut display)?;
    progress.finish();
    Ok(Ended {
        list,
        signal: signals.code(),
    })
}

/// Prints what there is, be it all or not.
fn show(args: &EffectsArgs, name: &str, ended: Ended) -> Result<()> {
    let Ended { list, signal } = ended;
    if args.json {
        print_json(&document(name, &list))?;
    } else {
        print(&text(name, &list))?;
    }
    match signal {
        Some(code) if list.interrupted => Err(Error::Interrupted(code)),
        _ => Ok(()),
    }
}

/// Progress, an effect a part.
struct Display<'a> {
    signals: &'a Signals,
    progress: &'a Progress,
    begin: Instant,
}

impl<'a> Display<'a> {
    fn new(signals: &'a Signals, progress: &'a Progress) -> Self {
        Self {
            signals,
            progress,
            begin: Instant::now(),
        }
    }
}

impl Watch for Display<'_> {
    fn begin(&mut self, part: &str, done: usize, all: usize) {
        let elapsed = self.begin.elapsed();
        let left = |done: usize| elapsed.mul_f64((all - done) as f64 / done as f64);
        self.progress.part(part);
        self.progress.update(&Snapshot {
            fraction: done as f64 / all as f64,
            elapsed,
            remaining: (elapsed > Duration::from_secs(2) && done > 0).then(|| left(done)),
            ..Snapshot::default()
        });
    }

    fn goes_on(&self) -> bool {
        self.signals.code().is_none()
    }
}

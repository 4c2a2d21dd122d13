//! Devices, progress and signals for a study.

use std::time::Instant;

use super::args::ConvergeArgs;
use crate::backend::Backend;
use crate::cli::args::BackendArg;
use crate::cli::derive;
use crate::cli::device::{Choice, open};
use crate::cli::signals::Signals;
use crate::error::Result;
use crate::output::{Progress, Snapshot};
use crate::scene::Scene;
use crate::settings::Settings;
use crate::study::host::{Host, Opened};
use crate::study::series::{BackendKind, Series};

/// This machine.
pub(super) struct Machine<'a> {
    args: &'a ConvergeArgs,
    scene: &'a Scene,
    progress: &'a Progress,
    signals: &'a Signals,
}

impl<'a> Machine<'a> {
    pub(super) fn new(
        args: &'a ConvergeArgs,
        scene: &'a Scene,
        progress: &'a Progress,
        signals: &'a Signals,
    ) -> Self {
        Self {
            args,
            scene,
            progress,
            signals,
        }
    }
}

/// How a device is opened.
pub(super) fn choice(args: &ConvergeArgs, backend: BackendArg) -> Choice<'_> {
    Choice {
        backend,
        device: args.device.as_deref(),
        threads: args.threads,
    }
}

impl Host for Machine<'_> {
    fn open(&mut self, series: &Series, settings: &Settings) -> Result<Opened> {
        let begin = Instant::now();
        let backend = match series.backend {
            BackendKind::Gpu => BackendArg::Gpu,
            BackendKind::Cpu => BackendArg::Cpu,
        };
        // What there is to warn of was said when the study was planned.
        let backend = open(&choice(self.args, backend), &mut Vec::new())?;
        let (placement, effects) = derive(self.scene, settings)?;
        let compiling = Instant::now();
        let renderer = backend.renderer(self.scene, &placement, &effects, settings)?;
        let compile = match backend {
            Backend::Gpu(_) => compiling.elapsed().as_secs_f64(),
            Backend::Cpu { .. } => 0.0,
        };
        Ok(Opened {
            renderer,
            setup: begin.elapsed().as_secs_f64() - compile,
            compile,
        })
    }

    fn begin(&mut self, part: &str) {
        self.progress.part(part);
    }

    fn progress(&mut self, snapshot: &Snapshot) {
        self.progress.update(snapshot);
    }

    fn interrupted(&self) -> bool {
        self.signals.code().is_some()
    }
}

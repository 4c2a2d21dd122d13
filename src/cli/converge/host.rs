//! Devices, progress and signals for a study.

use std::time::Instant;

use super::args::ConvergeArgs;
use crate::backend::{Backend, BackendKind};
use crate::cli::choices::Wanted;
use crate::cli::signals::Signals;
use crate::error::Result;
use crate::job::prepare;
use crate::output::{Progress, Snapshot};
use crate::scene::Scene;
use crate::settings::Settings;
use crate::study::host::{Host, Opened};
use crate::study::series::Series;

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

impl Host for Machine<'_> {
    fn open(&mut self, series: &Series, settings: &Settings) -> Result<Opened> {
        let begin = Instant::now();
        // What there is to warn of was said when the study was planned.
        let choice = self.args.choice(Wanted::Only(series.backend));
        let backend = Backend::open(&choice, &mut Vec::new())?;
        let job = prepare(self.scene, settings)?;
        let compiling = Instant::now();
        let renderer = backend.renderer(&job)?;
        let compile = match backend.kind() {
            BackendKind::Gpu => compiling.elapsed().as_secs_f64(),
            BackendKind::Cpu => 0.0,
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

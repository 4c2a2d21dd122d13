//! Renders on one device, one after the other.

use std::cell::RefCell;
use std::collections::HashSet;
use std::time::{Duration, Instant};

use super::checkpoint::{self, Checkpoint};
use super::display::{Display, Series};
use super::statistics::statistics;
use super::summary::{left_out, no_stderr, not_finite, observations, without_effect};
use super::{Request, check_finite, failed, finish, write_file};
use crate::backend::{Backend, BackendKind};
use crate::cli::args::RenderArgs;
use crate::cli::fault::Faulty;
use crate::cli::signals::Signals;
use crate::error::{Error, Result};
use crate::gpu::device::Gpu;
use crate::job::Job;
use crate::ledger::{self, Entry};
use crate::output::stats::{Device, Seconds};
use crate::output::{Progress, Stats};
use crate::render::{Keep, Outcome, Renderer, StoppedBy, go_on};
use crate::shader::{Stage, link};

/// The device, signals and messages of one command.
pub(super) struct Session {
    pub(super) signals: Signals,
    pub(super) progress: Progress,
    backend: Backend,
    /// How long the device took to open.
    opened: Duration,
    /// What opening it warned of.
    warnings: Vec<String>,
    /// The warnings that were shown.
    said: RefCell<HashSet<String>>,
}

impl Session {
    /// Opens the device.
    ///
    /// # Errors
    /// If there is none, or signals cannot be waited for.
    pub(super) fn open(args: &RenderArgs) -> Result<Self> {
        let signals = Signals::listen()?;
        let progress = Progress::new(args.progress, args.quiet);
        let mut warnings = Vec::new();
        let opening = Instant::now();
        let backend = Backend::open(&args.backend_choice(), &mut warnings)?;
        Ok(Self {
            signals,
            progress,
            backend,
            opened: opening.elapsed(),
            warnings,
            said: RefCell::default(),
        })
    }

    /// Renders what was decided, which `series` says the place of.
    ///
    /// # Errors
    /// If the device fails, files cannot be written, samples are not finite or a signal came; what there is then
    /// is written.
    pub(super) fn perform(
        &self,
        args: &RenderArgs,
        request: &Request,
        series: Series,
    ) -> Result<()> {
        let begin = series.begin;
        let job = &request.job;
        let bare = |warning: &String| warning.trim_start_matches("warning: ").to_owned();
        let mut warnings: Vec<String> = request.loaded.warnings.iter().map(bare).collect();
        warnings.extend(job.variance().warning.clone());
        warnings.extend(left_out(job.placement()));
        warnings.extend(without_effect(job));
        warnings.extend_from_slice(&self.warnings);
        if let Some(path) = &args.dump_wgsl {
            let kernel = link(Stage::Path, job.scene(), job.placement(), job.effects())?;
            write_file(path, kernel.wgsl.as_bytes())?;
        }
        let compiling = Instant::now();
        let mut renderer = renderer(&self.backend, args, job)?;
        let compile = match self.backend.kind() {
            BackendKind::Gpu => compiling.elapsed(),
            BackendKind::Cpu => Duration::ZERO,
        };
        let setup = begin.elapsed().saturating_sub(compile);
        let device = self.device(args, renderer.as_ref(), job);
        // Once the renderer has its memory, in whose account the film is.
        let begun = request.before.as_ref().map(|before| before.begun(job));
        let begun = begun.transpose()?;
        let finished = begun.as_ref().is_some_and(|b| b.finished.is_some());
        let mut checkpoint = match &args.checkpoint {
            Some(path) if finished => {
                let text = format!("{} is complete: nothing is added", path.display());
                self.progress.message(&text);
                None
            }
            Some(path) => {
                let kind = self.backend.kind();
                let about = checkpoint::about(args, request, kind, &device, &mut warnings)?;
                Some(Checkpoint::new(path, about, &self.progress))
            }
            None => None,
        };
        self.warn(&warnings);
        let mut watch = Display::new(&self.progress, &self.signals, job.settings(), series);
        let keep = checkpoint.as_mut().map(|c| c as &mut dyn Keep);
        let outcome = go_on(renderer.as_mut(), job, &mut watch, begun, keep);
        self.progress.finish();
        let kept = checkpoint.map_or(Ok(()), |checkpoint| checkpoint.end(&outcome, &mut warnings));
        // Its memory is needed again.
        drop(renderer);
        let auditing = Instant::now();
        let ledger = self.audit(job, &outcome, &mut warnings);
        let auditing = auditing.elapsed();

        warnings.extend(observations(&outcome, job.settings()));
        warnings.extend(no_stderr(args, &outcome));
        if args.allow_non_finite {
            warnings.extend(not_finite(&outcome));
        }
        self.warn(&warnings);
        let stats = statistics(&request.loaded, job, &outcome, self.backend.kind(), device);
        let stats = Stats {
            seconds: Seconds {
                total: begin.elapsed().as_secs_f64(),
                setup: setup.as_secs_f64(),
                compile: compile.as_secs_f64(),
                render: outcome.elapsed.as_secs_f64(),
                ledger: auditing.as_secs_f64(),
            },
            ledger,
            warnings,
            ..stats
        };
        let written = finish(args, request, &outcome, &stats);
        self.end(args, request, &outcome, kept, written)
    }

    /// What renders, also as a message to those who want to know more.
    fn device(&self, args: &RenderArgs, renderer: &dyn Renderer, job: &Job) -> Device {
        let (name, interface, driver) = renderer.device();
        if args.verbose {
            self.progress.message(&format!(
                "device: {name} ({interface}, {driver}), open in {:.2?}",
                self.opened
            ));
            self.progress.message(&format!(
                "effects: {}",
                job.effects().names().collect::<Vec<_>>().join(", ")
            ));
        }
        Device {
            name,
            backend: interface,
            driver,
        }
    }

    /// Shows those of the warnings that were not shown yet: renders of one command have most in common.
    fn warn(&self, warnings: &[String]) {
        let mut said = self.said.borrow_mut();
        for warning in warnings {
            if said.insert(warning.clone()) {
                self.progress.warning(warning);
            }
        }
    }

    /// What inexact settings took from the light, unless the render failed or was interrupted. That it cannot
    /// be known is no failure of the render.
    fn audit(
        &self,
        job: &Job,
        outcome: &Outcome,
        warnings: &mut Vec<String>,
    ) -> Option<Vec<Entry>> {
        if is_cut(outcome) || job.settings().view.is_some() {
            return None;
        }
        let go_on = || self.signals.code().is_none();
        let entries = ledger::audit(&self.backend, job, &outcome.film, &go_on);
        let entries = entries.unwrap_or_else(|error| {
            warnings.push(format!("what inexact settings took is unknown: {error}"));
            None
        });
        warnings.extend(entries.iter().flatten().filter_map(Entry::warning));
        entries
    }

    /// Whether all went well, once the film file was `kept` and the images `written`.
    fn end(
        &self,
        args: &RenderArgs,
        request: &Request,
        outcome: &Outcome,
        kept: Result<()>,
        written: Result<()>,
    ) -> Result<()> {
        let film = args.checkpoint.as_ref();
        if let Some(path) = film.filter(|path| is_cut(outcome) && path.exists()) {
            let text = format!("gpu-trace resume {} goes on", path.display());
            self.progress.message(&text);
        }
        if outcome.failure.is_some() || written.is_err() {
            // What is said last is another error.
            if let Err(error) = &kept {
                self.progress.warning(&error.to_string());
            }
        }
        if let Some(failure) = &outcome.failure {
            return Err(failed(failure, outcome, &request.files(args), written));
        }
        written?;
        kept?;
        check_finite(outcome, args.allow_non_finite)?;
        self.signals
            .code()
            .map_or(Ok(()), |code| Err(Error::Interrupted(code)))
    }
}

/// Whether a failure or a signal ended the render.
fn is_cut(outcome: &Outcome) -> bool {
    matches!(
        outcome.stopped_by,
        StoppedBy::Failure | StoppedBy::Interrupt
    )
}

/// A renderer for the job, which fails as `--inject-fault` says.
fn renderer(backend: &Backend, args: &RenderArgs, job: &Job) -> Result<Box<dyn Renderer>> {
    let renderer = backend.renderer(job)?;
    let Some(fault) = args.inject_fault else {
        return Ok(renderer);
    };
    let device = match backend {
        Backend::Gpu(gpu) => Some(Gpu::clone(gpu)),
        Backend::Cpu { .. } => None,
    };
    Ok(Box::new(Faulty::new(renderer, device, fault)?))
}

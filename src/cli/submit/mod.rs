//! `gpu-trace submit slurm`: a render on many machines.

mod options;
mod scripts;

use std::fs;
use std::ops::Range;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::Duration;

use clap::builder::Resettable;
use clap::{Args, Id};

use self::options::Passed;
use self::scripts::{JOBS, Plan, SUBMIT, quote};
use super::args::RenderArgs;
use super::choices::{Caching, Estimator, Wanted};
use super::format::{duration, percent};
use super::signals::Signals;
use super::{print, values};
use crate::backend::{Backend, BackendChoice, BackendKind};
use crate::error::{Action, Error, Result};
use crate::film::cut;
use crate::forecast;
use crate::job::{Job, prepare};
use crate::memory::{LEAST_PIXEL_BYTES, check_memory};
use crate::output::{Progress, Target, check_all, check_layers};
use crate::scene::Loaded;
use crate::scene::load::Source;
use crate::settings::MAXIMUM_SPP;

pub(super) const AFTER_HELP: &str = "\
Writes submit.sh, task.sh and merge.sh to a new folder beside the image, OUTPUT.slurm, and
submits them. Parts and logs go there too: the folder, the scene and this program have to be where
all machines find them. A task that fails, is preempted or runs out of time is put in the queue
again and goes on from its film file; `sh OUTPUT.slurm/submit.sh` submits again what is not done.
The image is that of one render.

Examples:
  gpu-trace submit slurm my.toml --tasks 8 --error 1% -- --partition=gpu --time=1:00:00
  gpu-trace submit slurm my.toml --tasks 64 --spp 65536 -o my.exr --at-once 16 -- --account=physics
  gpu-trace submit slurm my.toml --tasks 4 --gpus-per-task 0 --cpus-per-task 16   on lavapipe
  gpu-trace submit slurm my.toml --tasks 8 --dry-run                              shows the scripts

What comes after -- goes to sbatch as it is, for the tasks and for the merge.";

/// How long the pilot is if nobody says.
const PILOT: Duration = Duration::from_secs(5);

/// The options of `submit slurm`.
#[derive(Clone, Debug, Args)]
#[command(
    mut_arg("dump_wgsl", |a| a.hide(true)),
    mut_arg("checkpoint", |a| a.hide(true)),
    mut_arg("adaptive", |a| a.hide(true)),
    mut_arg("time", |a| a.hide(true)),
    mut_arg("view", |a| a.hide(true)),
    mut_arg("frames", |a| a.hide(true)),
    // Each part has a film file without being asked.
    mut_arg("checkpoint_every", |a| a.requires(Resettable::<Id>::Reset)
        .help("How often to write the film files of parts [default: 60s]")),
    mut_arg("error", |a| a.help("Reach this error: 1% or 0.01; a pilot here decides on the samples")),
    mut_arg("stats", |a| a.help("Let the merge write statistics as JSON")),
    mut_arg("sample_range", |a| a.help("Render only the sample indices A up to B - 1")),
    mut_arg("progress", |a| a.help("Progress in the logs of parts: plain, json, none [default: none]")),
)]
pub(super) struct SlurmArgs {
    #[command(flatten)]
    pub(super) render: RenderArgs,
    /// The number of parts, each a task of the array.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000),
          allow_negative_numbers = true, help_heading = "Slurm")]
    tasks: u32,
    /// GPUs of a task: 0 or 1 [default: 1, 0 with --backend cpu]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=1),
          allow_negative_numbers = true, help_heading = "Slurm")]
    gpus_per_task: Option<u32>,
    /// Processors of a task: threads of lavapipe and of the CPU reference [default: Slurm's]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024),
          allow_negative_numbers = true, help_heading = "Slurm")]
    cpus_per_task: Option<u32>,
    /// The most tasks that run at a time [default: as Slurm has room]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..),
          allow_negative_numbers = true, help_heading = "Slurm")]
    at_once: Option<u32>,
    /// How long the pilot for --error is to measure [default: 5s]
    #[arg(long, value_name = "TIME", value_parser = values::time, requires = "error", help_heading = "Slurm")]
    pilot: Option<Duration>,
    /// Only print the scripts: nothing is written or submitted.
    #[arg(long, help_heading = "Slurm")]
    dry_run: bool,
    /// Options of sbatch, as in -- --partition=gpu --time=1:00:00
    #[arg(last = true, value_name = "SBATCH OPTION", help_heading = "Slurm")]
    sbatch: Vec<String>,
}

/// Runs `submit slurm`.
pub(super) fn run(args: &SlurmArgs) -> Result<()> {
    let render = &args.render;
    let Passed {
        mut begin,
        always,
        mut merge,
    } = Passed::of(render)?;
    check_sbatch(&args.sbatch)?;
    let loaded = render.load()?;
    let job = prepare(&loaded.scene, &render.settings(&loaded.scene)?)?;
    let targets = targets(args, &loaded)?;
    let mut outputs: Vec<&Path> = targets.iter().map(|target| target.path.as_path()).collect();
    outputs.extend(render.stats.as_deref());
    check_all(&outputs, &loaded.inputs())?;
    let folder = absolute(&targets[0].path.with_extension("slurm"))?;
    if folder.contains(['%', '\\']) {
        return Err(Error::Usage(format!(
            "Slurm takes % and \\ in the path of a log for something else, and the logs would be in {folder}: let the \
             image have another path"
        )));
    }
    if Path::new(&folder).exists() {
        let shown = quote(&folder);
        return Err(Error::Usage(format!(
            "{folder} is there already: sh {shown}/{SUBMIT} submits again what is not done there; or remove it, or \
             name another image"
        )));
    }
    if !args.dry_run && !there("sbatch") {
        return Err(Error::Slurm(
            "Slurm is not here: no sbatch is in any folder of PATH. Submit where it is, as on a cluster's login \
             node; --dry-run prints the scripts without it"
                .into(),
        ));
    }

    let progress = Progress::new(render.progress, render.quiet);
    for warning in &loaded.warnings {
        progress.warning(warning.trim_start_matches("warning: "));
    }
    if let Some(warning) = &job.variance().warning {
        progress.warning(warning);
    }
    let (samples, why) = samples(args, &job, &progress)?;
    let parts = cut(samples.clone(), args.tasks);
    if parts.len() < args.tasks as usize {
        progress.warning(&format!(
            "{} parts, not {}: parts end at the samples 16, 64, 128, 256 and every 256 from there",
            parts.len(),
            args.tasks
        ));
    }
    let gpu = match args.gpus_per_task {
        Some(gpus) => gpus > 0,
        None => render.backend != Wanted::Only(BackendKind::Cpu),
    };
    if gpu && render.backend == Wanted::Auto {
        // A node without a driver must not go on with the CPU reference in its place.
        begin.push("--backend=gpu".into());
    }
    if render.integrator == Estimator::Auto {
        // Chosen once, not by every part.
        begin.push(format!("--integrator={}", job.settings().integrator.name()));
    }
    if render.radiance_cache == Some(Caching::Auto) {
        let word = if job.settings().radiance_cache {
            "on"
        } else {
            "off"
        };
        begin.push(format!("--radiance-cache={word}"));
    }
    if let Some(limit) = render.error {
        merge.push(format!("--error={limit}"));
    }
    for target in &targets {
        merge.push(format!("--output={}", absolute(&target.path)?));
    }
    if let Some(stats) = &render.stats {
        merge.push(format!("--stats={}", absolute(stats)?));
    }
    let plan = Plan {
        program: absolute(&std::env::current_exe().map_err(|source| Error::File {
            action: Action::Read,
            path: "the program".into(),
            source,
        })?)?,
        name: loaded.name.clone(),
        scene: scene(&loaded)?,
        folder,
        parts,
        why,
        begin,
        always,
        merge,
        gpu,
        cpus: args.cpus_per_task,
        at_once: args.at_once,
        sbatch: args.sbatch.clone(),
    };
    let said = said(&plan, &samples);
    if args.dry_run {
        let mut text = said;
        for (name, script) in plan.scripts() {
            text += &format!("\n==> {}/{name} <==\n{script}", plan.folder);
        }
        return print(&text);
    }
    let jobs = submit(&plan, &progress)?;
    if render.quiet {
        return Ok(());
    }
    print(&format!(
        "{said}{jobs}scripts, logs and parts: {}\n",
        plan.folder
    ))
}

/// Refuses options of `sbatch` that would take the place of ours.
fn check_sbatch(options: &[String]) -> Result<()> {
    let owned = [
        "--array",
        "-a",
        "--dependency",
        "-d",
        "--wrap",
        "--chdir",
        "-D",
    ];
    for option in options {
        let is = |name: &&&str| match name.starts_with("--") {
            true => option.split('=').next() == Some(name),
            false => option.starts_with(**name),
        };
        if let Some(name) = owned.iter().find(is) {
            return Err(Error::Usage(format!(
                "{name} after --: the scripts have their own (--tasks and --at-once say how many tasks there are)"
            )));
        }
    }
    Ok(())
}

/// The images.
fn targets(args: &SlurmArgs, loaded: &Loaded) -> Result<Vec<Target>> {
    let typed = &args.render.output;
    let targets: Vec<Target> = match typed.is_empty() {
        true => vec![Target::parse(format!("{}.png", loaded.name))?],
        false => typed.iter().map(Target::parse).collect::<Result<_>>()?,
    };
    check_layers(&args.render.aov, &targets)?;
    Ok(targets)
}

/// The scene as a task finds it: a file by its path, a built-in one by its name.
fn scene(loaded: &Loaded) -> Result<String> {
    match &loaded.source {
        Source::Text { file: None, .. } => Ok(loaded.name.clone()),
        Source::Text {
            file: Some(file), ..
        } => absolute(file),
        Source::Particles(_) => loaded
            .files
            .first()
            .map_or(Ok(String::new()), |file| absolute(file)),
    }
}

/// A path that means the same on all machines, as scripts hold it.
fn absolute(path: &Path) -> Result<String> {
    let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    absolute.into_os_string().into_string().map_err(|path| {
        Error::Usage(format!(
            "the path {} is no Unicode text, which scripts and film files need",
            Path::new(&path).display()
        ))
    })
}

/// Whether a command is in a folder of `PATH`.
fn there(command: &str) -> bool {
    let folders = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&folders).any(|folder| folder.join(command).is_file())
}

/// The samples to render and, where a pilot has chosen them, why so many.
fn samples(
    args: &SlurmArgs,
    job: &Job,
    progress: &Progress,
) -> Result<(Range<u64>, Option<String>)> {
    let settings = job.settings();
    let Range { start, end } = settings.samples;
    let Some(limit) = args.render.error else {
        return Ok((start..end, None));
    };
    forecast::check(job)?;
    check_memory(&settings.crop, LEAST_PIXEL_BYTES)?;
    let signals = Signals::listen()?;
    let mut warnings = Vec::new();
    // On whatever is here: the variance is the same on any device.
    let kind = args
        .render
        .backend
        .kind()
        .filter(|kind| *kind == BackendKind::Cpu);
    let choice = BackendChoice {
        kind,
        device: None,
        threads: args.render.threads.map_or(0, usize::from),
    };
    let backend = Backend::open(&choice, &mut warnings)?;
    let mut renderer = backend.renderer(job)?;
    let (device, ..) = renderer.device();
    let go_on = || signals.code().is_none();
    let pilot = forecast::run(renderer.as_mut(), job, args.pilot.unwrap_or(PILOT), &go_on)?;
    let Some(pilot) = pilot else {
        return Err(Error::Interrupted(signals.code().unwrap_or_default()));
    };
    for warning in &warnings {
        progress.warning(warning);
    }
    // Any number that can be given.
    let most = crate::scene::MAX_SPP;
    let known = pilot
        .to_error(limit, most)
        .zip(pilot.sure_samples(limit, most));
    let Some((likely, sure)) = known else {
        return Err(Error::Usage(format!(
            "--error {}: a pilot on {device} has seen too little light to tell how many samples that takes; give \
             --spp",
            percent(limit)
        )));
    };
    let capped = args.render.spp.is_some() || args.render.sample_range.is_some();
    if !capped && sure > MAXIMUM_SPP {
        return Err(Error::Usage(format!(
            "--error {} takes {sure} samples a pixel, beyond the default cap: give --spp {sure}",
            percent(limit)
        )));
    }
    let spp = sure.min(end - start);
    let taken = match spp < sure {
        true => format!(
            "no more than {spp} are asked for, with some {}",
            percent(pilot.to_samples(spp).error)
        ),
        false => "these are taken".into(),
    };
    let part = pilot.to_samples(spp.div_ceil(u64::from(args.tasks)).max(1));
    let why = format!(
        "an error of {} takes some {} samples a pixel, and {sure} in 97.5 % of all renders: {taken} (pilot of {} on \
         {device}, where a part would take {})",
        percent(limit),
        likely.spp,
        duration(pilot.seconds),
        duration(part.seconds)
    );
    Ok((start..start + spp, Some(why)))
}

/// What will be rendered, for people.
fn said(plan: &Plan, samples: &Range<u64>) -> String {
    let lengths = || plan.parts.iter().map(|part| part.end - part.start);
    let [least, most] = [lengths().min(), lengths().max()].map(Option::unwrap_or_default);
    let each = match least == most {
        true => most.to_string(),
        false => format!("{least} to {most}"),
    };
    let why = plan.why.iter().map(|why| format!("{why}\n"));
    let why: String = why.collect();
    format!(
        "{why}{}: {} samples a pixel in {} parts of {each}\n",
        plan.name,
        samples.end - samples.start,
        plan.parts.len()
    )
}

/// Writes the scripts and starts the first; returns what it says of the jobs. Where that fails, the folder is gone
/// again.
fn submit(plan: &Plan, progress: &Progress) -> Result<String> {
    let folder = Path::new(&plan.folder);
    fs::create_dir(folder).map_err(|source| unwritten(folder, source))?;
    let done = write_and_submit(plan, folder);
    if done.is_err() {
        // Only what was written here: a part that began is kept.
        let names = plan.scripts().map(|(name, _)| name);
        for name in names.into_iter().chain([JOBS]) {
            let _ = fs::remove_file(folder.join(name));
        }
        let _ = fs::remove_dir(folder);
    }
    let output = done?;
    for line in String::from_utf8_lossy(&output.stderr).lines() {
        progress.warning(line);
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

fn write_and_submit(plan: &Plan, folder: &Path) -> Result<Output> {
    for (name, script) in plan.scripts() {
        let path = folder.join(name);
        fs::write(&path, script).map_err(|source| unwritten(&path, source))?;
    }
    let mut command = Command::new("sh");
    command.arg(folder.join(SUBMIT)).stdin(Stdio::null());
    let output = command.output();
    let output = output.map_err(|error| Error::Slurm(format!("cannot start sh: {error}")))?;
    if output.status.success() {
        return Ok(output);
    }
    let words = String::from_utf8_lossy(&output.stderr);
    Err(Error::Slurm(format!(
        "nothing was submitted; sbatch says:\n{}",
        words.trim_end()
    )))
}

fn unwritten(path: &Path, source: std::io::Error) -> Error {
    let path = path.to_owned();
    Error::File {
        action: Action::Write,
        path,
        source,
    }
}

//! What was typed. One file a subcommand; each turns its options into what the stages take.

mod args;
mod check;
mod choices;
mod compare;
mod converge;
mod devices;
#[cfg(test)]
mod documented;
mod effects;
mod fault;
mod format;
mod heap;
mod price;
mod render;
mod scene;
mod shell;
mod signals;
mod submit;
mod values;

use std::io::Write as _;
use std::path::{Path, PathBuf};

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{CommandFactory as _, Parser, Subcommand};

use crate::error::{Action, Error, Result};

pub use args::RenderArgs;

const AFTER_HELP: &str = "\
Examples:
  gpu-trace                                     the built-in lecture scene, to lecture.png
  gpu-trace glass --spp 1024 -o glass.exr       another scene, linear floats
  gpu-trace my.toml --error 1% --time 2m        until the error is 1 % or two minutes are over
  gpu-trace resume my.film                      go on with what --checkpoint my.film kept
  gpu-trace submit slurm my.toml --tasks 8      render on eight machines of a cluster
  gpu-trace price my.toml                       what will 1 % cost, in seconds?
  gpu-trace effects my.toml                     what the kernel will hold, and why
  gpu-trace check --quick                       does this adapter stand the hard cases?
  gpu-trace compare a.exr b.exr --tolerance 1%  is image a within 1 % of reference b?
  gpu-trace converge --study cpu-gpu            error against time, as a report with plots

Exit codes: 0 done; 1 failed; 2 wrong usage or a bad scene; 3 a check failed; 129, 130 or 143 ended
by a signal, with what there was written.";

/// Path-traces scenes made of spheres on a GPU, without a display.
///
/// Without a GPU it runs on Mesa's lavapipe, and without that on its own CPU reference.
#[derive(Debug, Parser)]
#[command(
    name = "gpu-trace",
    version,
    after_help = AFTER_HELP,
    args_conflicts_with_subcommands = true,
    subcommand_precedence_over_arg = true,
    max_term_width = 100
)]
pub struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    render: RenderArgs,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Render a scene (the same as without a subcommand).
    Render(Box<RenderArgs>),
    /// Go on with a render from its film file (--checkpoint): to its end, or to a new one.
    Resume(Box<render::ResumeArgs>),
    /// Join the film files of parts (--sample-range) to one image.
    Merge(Box<render::MergeArgs>),
    /// Render on many machines: write a job of many tasks and the merge after them, and submit both.
    #[command(subcommand)]
    Submit(SubmitCommand),
    /// List what the kernel of a scene holds, which object asked for it, what is left out, and what each costs.
    #[command(after_help = effects::AFTER_HELP)]
    Effects(Box<effects::EffectsArgs>),
    /// Forecast the samples and seconds that an error will cost, from a short pilot.
    #[command(after_help = price::AFTER_HELP)]
    Price(Box<price::PriceArgs>),
    /// Measure the hard numerical cases on this adapter against f64; exit 3 if any fails.
    Check(Box<check::CheckArgs>),
    /// Compare an image with a reference: errors, bias, FLIP, SSIM; exit 3 beyond a tolerance.
    #[command(after_help = compare::AFTER_HELP)]
    Compare(compare::CompareArgs),
    /// Measure error against time for any set of ways to render: plots, tables, an HTML report.
    #[command(after_help = converge::after_help())]
    Converge(Box<converge::ConvergeArgs>),
    /// List the adapters, with driver and limits.
    Devices {
        /// Print JSON.
        #[arg(long)]
        json: bool,
    },
    /// Check a scene file, print the format's JSON schema, or list the built-in scenes.
    #[command(subcommand)]
    Scene(SceneCommand),
    /// Print a shell's completion script.
    Completions {
        /// The shell.
        shell: clap_complete::Shell,
    },
    /// Print the manual page.
    Man,
}

#[derive(Debug, Subcommand)]
enum SubmitCommand {
    /// By Slurm: an array of tasks, each a range of samples, and a dependent merge.
    #[command(after_help = submit::AFTER_HELP)]
    Slurm(Box<submit::SlurmArgs>),
}

#[derive(Debug, Subcommand)]
enum SceneCommand {
    /// Load a scene, report every mistake in it, and summarise it.
    Check {
        /// A scene file or the name of a built-in scene.
        #[arg(default_value = crate::scene::builtin::DEFAULT)]
        scene: String,
    },
    /// Print the JSON schema of the scene file.
    Schema,
    /// List the built-in scenes, or print one as a start for your own.
    List {
        /// The built-in scene to print.
        name: Option<String>,
    },
}

/// Runs the program on the process's arguments; returns the exit code.
#[must_use]
pub fn main() -> u8 {
    heap::share();
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => {
            if let Some(text) = misplaced_word(&error) {
                let _ = writeln!(std::io::stderr(), "error: {text}");
                return 2;
            }
            // Help and version go to stdout and are no error. A closed pipe is none either.
            let _ = error.print();
            return u8::try_from(error.exit_code()).unwrap_or(2);
        }
    };
    match run(cli) {
        Ok(()) => 0,
        Err(error) => {
            if !matches!(error, Error::Interrupted(_)) {
                let heading = match error {
                    Error::Scene(_) => "",
                    _ => "error: ",
                };
                let _ = writeln!(std::io::stderr(), "{heading}{error}");
            }
            error.exit_code()
        }
    }
}

fn run(cli: Cli) -> Result<()> {
    match cli.command {
        None => {
            let scene = cli.render.scene.as_deref().unwrap_or_default();
            if command_names().any(|name| name == scene) && !Path::new(scene).exists() {
                return Err(Error::Usage(format!(
                    "the command `{scene}` comes first: gpu-trace {scene} ..."
                )));
            }
            render::run(&cli.render)
        }
        Some(Command::Render(args)) => render::run(&args),
        Some(Command::Resume(args)) => render::resume(&args),
        Some(Command::Merge(args)) => render::merge(&args),
        Some(Command::Submit(SubmitCommand::Slurm(args))) => submit::run(&args),
        Some(Command::Effects(args)) => effects::run(&args),
        Some(Command::Price(args)) => price::run(&args),
        Some(Command::Check(args)) => check::run(&args),
        Some(Command::Compare(args)) => compare::run(&args),
        Some(Command::Converge(args)) => converge::run(&args),
        Some(Command::Devices { json }) => devices::run(json),
        Some(Command::Scene(SceneCommand::Check { scene })) => scene::check(&scene),
        Some(Command::Scene(SceneCommand::Schema)) => scene::schema(),
        Some(Command::Scene(SceneCommand::List { name })) => scene::list(name.as_deref()),
        Some(Command::Completions { shell }) => shell::completions(shell),
        Some(Command::Man) => shell::man(),
    }
}

fn command_names() -> impl Iterator<Item = String> {
    let command = Cli::command();
    let names = command.get_subcommands().map(|c| c.get_name().to_owned());
    names.collect::<Vec<_>>().into_iter()
}

/// What to say of a second word after the scene, which the parser takes for a command.
fn misplaced_word(error: &clap::Error) -> Option<String> {
    let Some(ContextValue::String(word)) = error.get(ContextKind::InvalidSubcommand) else {
        return None;
    };
    (error.kind() == ErrorKind::ArgumentConflict).then(|| {
        if command_names().any(|name| name == *word) {
            format!("the command `{word}` comes first: gpu-trace {word} ...")
        } else {
            format!("unexpected argument '{word}': one scene is rendered at a time")
        }
    })
}

/// Prints a result. A reader that has seen enough (`| head`) is no error.
fn print(text: &str) -> Result<()> {
    let mut stdout = std::io::stdout().lock();
    match stdout
        .write_all(text.as_bytes())
        .and_then(|()| stdout.flush())
    {
        Err(source) if source.kind() != std::io::ErrorKind::BrokenPipe => Err(Error::File {
            action: Action::Write,
            path: PathBuf::from("stdout"),
            source,
        }),
        _ => Ok(()),
    }
}

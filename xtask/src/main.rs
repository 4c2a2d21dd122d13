//! Tasks of the project: `cargo xtask test`, `cargo xtask bench` and others.

mod bench;
mod drivers;
mod forecasts;
mod gallery;
mod lints;
mod numerics;
mod prices;
#[cfg(unix)]
mod slurm;
mod soak;
mod suite;
mod test;

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

const USAGE: &str = "\
Usage: cargo xtask TASK

  test     install what the tests need (Mesa lavapipe), check format and lints, run every test on
           every driver that is there (--help for its options)
  bench    run the benchmarks side by side and print their table (--help for its options)
  numerics run `gpu-trace check` on every driver that is there, into the table of docs/numerics.md
           (--help for its options)
  prices   measure what every effect costs on this device, into docs/effects.md
  gallery  render the pictures of docs/gallery.md and write it anew
  slurm    start a Slurm on this machine, which has to be installed, and run the tests of
           `submit slurm` on it
  soak     render for 30 minutes, or as many as are named, and fail if memory grows
";

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    let task = arguments.next();
    let rest: Vec<String> = arguments.collect();
    let done = match task.as_deref() {
        Some("test") => test::all(&rest),
        Some("numerics") => numerics::all(&rest),
        Some("prices") => prices::all(&rest),
        Some("gallery") => gallery::all(&rest),
        Some("bench") => bench::all(&rest),
        #[cfg(unix)]
        Some("slurm") => slurm::all(&rest),
        Some("soak") => soak::all(&rest),
        Some("help" | "--help" | "-h") => {
            print!("{USAGE}");
            Ok(())
        }
        _ => Err(USAGE.to_owned()),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(text) => {
            eprintln!("{text}");
            ExitCode::FAILURE
        }
    }
}

/// Runs a command, shown first; an exit code other than 0 is an error.
fn run(command: &mut Command) -> Result<(), String> {
    let shown: Vec<_> = std::iter::once(command.get_program())
        .chain(command.get_args())
        .map(|part| part.to_string_lossy().into_owned())
        .collect();
    let shown = shown.join(" ");
    eprintln!("$ {shown}");
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(format!("{shown}: {status}")),
        Err(error) => Err(format!("{shown}: {error}")),
    }
}

/// The cargo that runs this task.
fn cargo() -> Command {
    Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
}

/// The repository.
fn root() -> &'static Path {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().unwrap_or(here)
}

/// The program, as cargo has built it in `profile`'s folder.
fn program(profile: &str) -> PathBuf {
    let target = std::env::var_os("CARGO_TARGET_DIR");
    let target = target.map_or_else(|| root().join("target"), PathBuf::from);
    target.join(profile).join("gpu-trace")
}

//! What goes wrong while a render runs: samples that are not finite, devices that fail, memory and
//! disks that are full, folders that vanish, signals that end it at the worst moment.
#![cfg(unix)]

mod damaged;
mod disks;
mod injected;
mod kills;
mod limits;
mod signals;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::cli_support::{Folder, Run};

/// What is left of a process that was killed while it wrote.
fn temporaries(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("the folder can be listed");
    entries
        .map(|entry| entry.expect("an entry of the folder").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "tmp"))
        .collect()
}

/// Runs the program under `limits`, shell commands.
fn limited(folder: &Folder, limits: &str, arguments: &str) -> Run {
    let mut command = Command::new("sh");
    command
        .args(["-c", &format!("{limits} && exec \"$0\" \"$@\"")])
        .arg(env!("CARGO_BIN_EXE_gpu-trace"))
        .args(arguments.split_whitespace())
        .current_dir(folder.path(""));
    Run::new(command.output().expect("a shell"))
}

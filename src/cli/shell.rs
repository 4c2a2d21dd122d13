//! `gpu-trace completions` and `gpu-trace man`.

use clap::CommandFactory as _;

use super::{Cli, print};
use crate::error::{Error, Result};

/// Runs `completions`.
pub(super) fn completions(shell: clap_complete::Shell) -> Result<()> {
    let mut text = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "gpu-trace", &mut text);
    print(&String::from_utf8_lossy(&text))
}

/// Runs `man`.
pub(super) fn man() -> Result<()> {
    let mut text = Vec::new();
    clap_mangen::Man::new(Cli::command())
        .render(&mut text)
        .map_err(|e| Error::Usage(format!("cannot write the manual page: {e}")))?;
    print(&String::from_utf8_lossy(&text))
}

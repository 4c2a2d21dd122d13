//! Signals: the first asks to stop, the second ends the process.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::error::{Error, Result};

/// The signals that ask to stop.
#[cfg(unix)]
const SIGNALS: &[i32] = &[
    signal_hook::consts::SIGINT,
    signal_hook::consts::SIGTERM,
    signal_hook::consts::SIGHUP,
];
#[cfg(not(unix))]
const SIGNALS: &[i32] = &[signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM];

/// Listens for the signals that ask to stop.
pub(super) struct Signals {
    /// The last signal, 0 before any.
    seen: Arc<AtomicUsize>,
}

impl Signals {
    /// Starts to listen. A signal that the process was started to ignore, as `nohup` does with
    /// SIGHUP, stays ignored.
    ///
    /// # Errors
    /// [`Error::Usage`] if the system refuses.
    pub(super) fn listen() -> Result<Self> {
        let seen = Arc::default();
        SIGNALS
            .iter()
            .filter(|signal| !ignored(**signal))
            .try_for_each(|signal| register(*signal, &seen))
            .and_then(|()| survive_limits())
            .map_err(|e| Error::Usage(format!("cannot listen for signals: {e}")))?;
        Ok(Self { seen })
    }

    /// The exit code after a signal; `None` before any.
    pub(super) fn code(&self) -> Option<i32> {
        match self.seen.load(Ordering::Relaxed) {
            0 => None,
            signal => Some(128 + signal as i32),
        }
    }
}

fn register(signal: i32, seen: &Arc<AtomicUsize>) -> io::Result<()> {
    use signal_hook::flag;
    if can_be_repeated(signal) {
        // In this order: what ends the process at the second must not see the first.
        let again = Arc::default();
        flag::register_conditional_shutdown(signal, 128 + signal, Arc::clone(&again))?;
        flag::register(signal, again)?;
    }
    flag::register_usize(signal, Arc::clone(seen), signal as usize).map(drop)
}

/// Whether somebody who is impatient may send it again. A terminal that closes can send its SIGHUP
/// twice, by the kernel and by the shell, and nobody means to lose the render by it.
#[cfg(unix)]
fn can_be_repeated(signal: i32) -> bool {
    signal != signal_hook::consts::SIGHUP
}

#[cfg(not(unix))]
fn can_be_repeated(_signal: i32) -> bool {
    true
}

/// Lets a write beyond the limit on the size of files fail, like one to a full disk, rather than
/// end the process.
#[cfg(unix)]
fn survive_limits() -> io::Result<()> {
    let hit = Arc::default();
    signal_hook::flag::register(signal_hook::consts::SIGXFSZ, hit).map(drop)
}

#[cfg(not(unix))]
fn survive_limits() -> io::Result<()> {
    Ok(())
}

/// Whether the process was started to ignore a signal.
#[cfg(unix)]
#[expect(unsafe_code, reason = "a system call without a safe form")]
fn ignored(signal: i32) -> bool {
    // SAFETY: a new action is not passed, and the old one is written to memory for just that, which
    // is valid with all bytes zero.
    unsafe {
        let mut action: libc::sigaction = std::mem::zeroed();
        libc::sigaction(signal, std::ptr::null(), &raw mut action) == 0
            && action.sa_sigaction == libc::SIG_IGN
    }
}

#[cfg(not(unix))]
fn ignored(_signal: i32) -> bool {
    false
}

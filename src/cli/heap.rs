//! The heap of the process.

/// Lets all threads share one heap. Else glibc gives each thread that allocates one of its own, of 64 MiB of
/// address space, at a moment that nobody knows: under a limit on that (`ulimit -v`), what was free when
/// a render was checked may be gone when it begins. Small blocks come from each thread's cache as ever.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
#[expect(unsafe_code, reason = "a call of libc without a safe form")]
pub(super) fn share() {
    // SAFETY: takes two numbers, and changes no block that is in use.
    unsafe {
        // It fails only for numbers out of range, and then nothing changes.
        libc::mallopt(libc::M_ARENA_MAX, 1);
    }
}

#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
pub(super) fn share() {}

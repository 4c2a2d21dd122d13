//! The program `gpu-trace`; see the library's documentation for how it works.

use std::process::ExitCode;

fn main() -> ExitCode {
    hush_vulkan_loader();
    ExitCode::from(gpu_trace::cli::main())
}

/// Mesa's device selection layer asks for a Wayland display and complains on stderr where there is
/// no `XDG_RUNTIME_DIR`, as in containers. This program chooses its device itself and needs neither.
#[expect(unsafe_code, reason = "set_var is unsafe; no other thread runs yet")]
fn hush_vulkan_loader() {
    if std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        // SAFETY: this is the first thing the program does, on its only thread.
        unsafe { std::env::set_var("NODEVICE_SELECT", "1") };
    }
}

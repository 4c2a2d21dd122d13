//! The program `gpu-trace`; see the library's documentation for how it works.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(gpu_trace::cli::main())
}

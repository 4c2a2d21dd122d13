//! The path tracer as one writes it first, twice: a kernel in f32, which the benchmarks measure ours against, and
//! the same in f64, a second opinion on the truth that shares no code with the renderer. `tests/naive.rs` has it too.

pub(crate) mod flat;
pub(crate) mod kernel;
pub(crate) mod tracer;

//! Whether tests run in their long form.

/// The long form with `cargo xtask test --all`, which sets `GPU_TRACE_TEST_ALL` to 1: a test that takes
/// minutes has a short form of the same power for what breaks often, and says what the long one adds.
pub(crate) fn thorough() -> bool {
    std::env::var_os("GPU_TRACE_TEST_ALL").is_some_and(|value| value == "1")
}

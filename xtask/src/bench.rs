//! `cargo xtask bench`.
pub(crate) fn all(_: &[String]) -> Result<(), String> {
    crate::run(crate::cargo().args(["bench", "--bench", "speed"]))
}

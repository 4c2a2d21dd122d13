//! Rows of the probes, and the errors of f32 arithmetic.

use glam::DVec3;

/// Unit roundoff of f32.
pub const U: f64 = 1.0 / (1 << 24) as f64;

/// Largest relative error of one f32 addition or multiplication: WGSL leaves the direction of
/// rounding open. Division has 2.5 of these, inverseSqrt 2, sqrt 4.5 (WGSL 15.7.4).
pub const ULP: f64 = 2.0 * U;

/// A row of the probe.
pub type Row = [f32; 4];

/// A vector of a row's first three numbers.
#[must_use]
pub fn vector(row: Row) -> DVec3 {
    DVec3::new(f64::from(row[0]), f64::from(row[1]), f64::from(row[2]))
}

/// A row of a vector and a fourth number, rounded to f32.
#[must_use]
pub fn to_row(v: DVec3, w: f64) -> Row {
    [v.x as f32, v.y as f32, v.z as f32, w as f32]
}

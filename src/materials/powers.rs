//! Exponentials and logarithms; twin of `shaders/materials/powers.wesl`.

/// ln(x); of 0, that of the smallest normal f32.
#[must_use]
pub fn log_of(x: f64) -> f64 {
    x.max(f64::from(f32::MIN_POSITIVE)).ln()
}

/// ln(1 + x)/x
#[must_use]
pub fn log1p_over(x: f64) -> f64 {
    if x == 0.0 { 1.0 } else { x.ln_1p() / x }
}

/// (exp(x) - 1)/x
#[must_use]
pub fn expm1_over(x: f64) -> f64 {
    if x == 0.0 { 1.0 } else { x.exp_m1() / x }
}

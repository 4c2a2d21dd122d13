//! sRGB's transfer function, IEC 61966-2-1, and its inverse.

/// The transfer function of sRGB, IEC 61966-2-1: display value of a linear one; 0 and below are 0.
#[must_use]
pub fn srgb(linear: f64) -> f64 {
    if linear <= 0.003_130_8 {
        12.92 * linear.max(0.0)
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    }
}

/// The inverse of sRGB's transfer function, IEC 61966-2-1: linear value of a display value.
#[must_use]
pub fn linear(display: f64) -> f64 {
    if display <= 0.040_45 {
        display / 12.92
    } else {
        ((display + 0.055) / 1.055).powf(2.4)
    }
}

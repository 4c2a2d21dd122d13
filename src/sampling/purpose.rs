//! Twin of `shaders/sampler/purpose.wesl`, which has the table: which random numbers of a sample are for
//! what. Four dimensions are drawn at a time, by the number of the four.

/// Place in the pixel (x, y) and on the lens (z, w).
pub const CAMERA: u32 = 0;

/// Time (x).
pub const TIME: u32 = 1;

/// Wavelength (y).
pub const WAVELENGTH: u32 = 1;

/// A scattering event: direction (x, y), lobe (z), roulette (w).
#[must_use]
pub fn scattering(bounce: u32) -> u32 {
    4 * (bounce + 1)
}

/// The other point of a cell (x, y).
#[must_use]
pub fn pairs(bounce: u32) -> u32 {
    4 * (bounce + 1) + 3
}

/// Images of lamps at its vertex: choice of the image and direction (z, w).
#[must_use]
pub fn imaging(bounce: u32) -> u32 {
    4 * (bounce + 1) + 3
}

/// Light sampling at its vertex: direction (x, y), choice of the light (z, w).
#[must_use]
pub fn lighting(bounce: u32) -> u32 {
    4 * (bounce + 1) + 1
}

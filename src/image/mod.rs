//! What an image is, whoever made it: what [`output`](crate::output) writes,
//! [`input`](crate::input) reads and [`compare`](mod@crate::compare) compares.

pub mod exr;
mod format;
mod srgb;

pub use format::Format;
pub use srgb::{linear, srgb};

/// An image in linear RGB with the primaries of sRGB (Rec. 709), in the unit of radiance.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Columns, at least 1.
    pub width: u32,
    /// Rows, at least 1.
    pub height: u32,
    /// `width * height` values of red, green and blue, row by row from the top left.
    pub pixels: Vec<[f32; 3]>,
}

impl Picture {
    /// Joins a size and the pixels that fill it.
    ///
    /// # Panics
    /// If the size is zero or `pixels` does not hold `width * height` values: a defect of the
    /// caller, for files are checked where they are read.
    #[must_use]
    pub fn new(width: u32, height: u32, pixels: Vec<[f32; 3]>) -> Self {
        assert!(
            width > 0 && height > 0,
            "an image of {width}x{height} pixels"
        );
        assert_eq!(
            pixels.len() as u64,
            u64::from(width) * u64::from(height),
            "the number of pixels of an image of {width}x{height}"
        );
        Self {
            width,
            height,
            pixels,
        }
    }
}

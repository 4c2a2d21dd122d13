//! The kinds of image files.

/// The image formats, each known by its extension.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// sRGB with 8 bits: to look at.
    Png,
    /// Linear 32-bit floats with layers and attributes: to work with.
    Exr,
    /// Linear 32-bit floats of shape (height, width, 3): to compute with.
    Npy,
}

impl Format {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Png, Self::Exr, Self::Npy];

    /// As people call it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Png => "PNG",
            Self::Exr => "EXR",
            Self::Npy => "NPY",
        }
    }
    /// The first bytes of every such file.
    #[must_use]
    pub fn magic(self) -> &'static [u8] {
        match self {
            Self::Png => b"\x89PNG\r\n\x1a\n",
            Self::Exr => &[0x76, 0x2f, 0x31, 0x01],
            Self::Npy => b"\x93NUMPY",
        }
    }
}

//! Twin of `shaders/bsdf/sample.wesl`.

use glam::DVec3;

/// The direction in which a path goes on, with weight = f cos/pdf.
#[derive(Clone, Copy, Debug)]
pub struct BsdfSample {
    /// Unit vector.
    pub direction: DVec3,
    /// f cos/pdf
    pub weight: DVec3,
    /// pdf of the direction in solid angle; 0 for a delta lobe.
    pub density: f64,
    /// Whether the path crossed the surface.
    pub crossed: bool,
    /// Index ratio squared that a refraction took out of the weight.
    pub compression: f64,
}

/// A sample that stays on its side.
#[must_use]
pub fn bsdf_sample(direction: DVec3, weight: DVec3) -> BsdfSample {
    BsdfSample {
        direction,
        weight,
        density: 0.0,
        crossed: false,
        compression: 1.0,
    }
}

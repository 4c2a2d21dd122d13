//! Twin of `shaders/materials/contract.wesl`: what a BSDF is asked and what it answers.

use std::ops::BitOr;

use glam::DVec3;

/// A point of a surface, as a path sees it that has come to it.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// Unit length, on the side from which the path came.
    pub normal: DVec3,
    /// Refractive index beyond the surface over that before it, for materials that transmit; for others one
    /// over the index before it.
    pub eta: f64,
    /// From the sphere's centre, in scene units. In the kernel from the sphere's anchor.
    pub offset: DVec3,
}

/// The direction in which a path goes on.
#[derive(Clone, Copy, Debug)]
pub struct BsdfSample {
    /// Unit vector, away from the surface.
    pub wi: DVec3,
    /// f cos/pdf; 0 if the path ends.
    pub weight: DVec3,
    /// In solid angle; 0 for a delta lobe.
    pub pdf: f64,
    /// What happened.
    pub event: Event,
    /// Index beyond the surface over the one before it if the path crossed it, else 1.
    pub eta: f64,
}

/// A BSDF's value for two directions.
#[derive(Clone, Copy, Debug)]
pub struct BsdfValue {
    /// f cos
    pub f_cos: DVec3,
    /// In solid angle.
    pub pdf: f64,
    /// What scattering that way would be.
    pub event: Event,
}

impl BsdfValue {
    /// Nothing: of delta lobes, which have no value.
    pub const NONE: Self = Self {
        f_cos: DVec3::ZERO,
        pdf: 0.0,
        event: Event::DELTA,
    };
}

/// A kind of scattering event: a set of the constants.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Event(u32);

impl Event {
    /// By a wide lobe.
    pub const DIFFUSE: Self = Self(1);
    /// By a lobe about a mirror direction.
    pub const GLOSSY: Self = Self(2);
    /// In one direction alone.
    pub const DELTA: Self = Self(4);
    /// Through the surface.
    pub const TRANSMITTED: Self = Self(8);

    /// Its bits in the kernel.
    #[must_use]
    pub fn bits(self) -> u32 {
        self.0
    }

    /// Whether it is of this kind.
    #[must_use]
    pub fn is(self, kind: Self) -> bool {
        self.0 & kind.0 != 0
    }
}

impl BitOr for Event {
    type Output = Self;

    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

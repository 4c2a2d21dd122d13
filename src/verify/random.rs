//! Deterministic inputs.

use glam::{DVec2, DVec3};

use crate::sampling::directions::sphere_direction;
use crate::sampling::random::{random_words, unit_float};

/// A deterministic source of inputs, by the sample stream itself.
#[derive(Clone, Debug)]
pub struct Random {
    key: [u32; 2],
}

impl Random {
    /// A stream of its own for each `name`.
    #[must_use]
    pub fn new(name: &str) -> Self {
        // FNV-1a.
        let hash = name.bytes().fold(0x811c_9dc5, |h: u32, b| {
            (h ^ u32::from(b)).wrapping_mul(0x0100_0193)
        });
        Self { key: [hash, 0] }
    }

    /// Four random words.
    pub fn words(&mut self) -> [u32; 4] {
        self.key[1] += 1;
        random_words([self.key[0], !self.key[0]], self.key[1])
    }

    /// Four uniform numbers in [0, 1) with 24 bits, as the kernel has them.
    pub fn unit4(&mut self) -> [f32; 4] {
        unit_float(self.words()).map(|x| x as f32)
    }

    /// A uniform number in [0, 1).
    pub fn unit(&mut self) -> f64 {
        f64::from(self.unit4()[0])
    }

    /// A uniform number in [low, high).
    pub fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// A number whose logarithm is uniform: 10^low to 10^high.
    pub fn magnitude(&mut self, low: f64, high: f64) -> f64 {
        10f64.powf(self.range(low, high))
    }

    /// A uniform direction.
    pub fn direction(&mut self) -> DVec3 {
        let u = self.unit4();
        sphere_direction(DVec2::new(f64::from(u[0]), f64::from(u[1])))
    }
}

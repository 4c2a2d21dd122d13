//! Twin of `shaders/core/spectrum.wesl`, which has the formulas' sources.

use glam::DVec3;

/// The shortest wavelength, in nm.
pub const SHORTEST: f64 = 360.0;
/// The longest wavelength, in nm.
pub const LONGEST: f64 = 830.0;

/// What light of one wavelength, in nm, is in XYZ.
#[must_use]
pub fn xyz(wavelength: f64) -> DVec3 {
    let lobe = |peak: f64, before: f64, after: f64| {
        let apart = wavelength - peak;
        let t = apart * if apart < 0.0 { before } else { after };
        (-0.5 * t * t).exp()
    };
    DVec3::new(
        0.362 * lobe(442.0, 0.0624, 0.0374) + 1.056 * lobe(599.8, 0.0264, 0.0323)
            - 0.065 * lobe(501.1, 0.0490, 0.0382),
        0.821 * lobe(568.8, 0.0213, 0.0247) + 0.286 * lobe(530.9, 0.0613, 0.0322),
        1.217 * lobe(437.0, 0.0845, 0.0278) + 0.681 * lobe(459.0, 0.0385, 0.0725),
    )
}

/// The same in linear sRGB.
#[must_use]
pub fn srgb(wavelength: f64) -> DVec3 {
    let xyz = xyz(wavelength);
    DVec3::new(
        xyz.dot(DVec3::new(3.240_454_2, -1.537_138_5, -0.498_531_4)),
        xyz.dot(DVec3::new(-0.969_266_0, 1.876_010_8, 0.041_556_0)),
        xyz.dot(DVec3::new(0.055_643_4, -0.204_025_9, 1.057_225_2)),
    )
}

/// The integrals of [`srgb`] over all wavelengths, in nm.
pub const INTEGRALS: DVec3 = DVec3::new(128.141_450, 101.637_958, 97.088_446);

/// The density of wavelengths is in proportion to 1 - tanh²(SLOPE (l - PEAK)).
pub const SLOPE: f64 = 0.0072;
/// Where it is largest, in nm.
pub const PEAK: f64 = 538.0;

/// A wavelength, and by how much light of all of them counts for this one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spectral {
    /// In nm.
    pub wavelength: f64,
    /// Of linear sRGB; with both signs.
    pub weight: DVec3,
}

/// A wavelength from a uniform number.
#[must_use]
pub fn sample_wavelength(u: f64) -> Spectral {
    let [first, last] = [SHORTEST, LONGEST].map(|l| (SLOPE * (l - PEAK)).tanh());
    let x = first + (last - first) * u;
    let wavelength = PEAK + x.atanh() / SLOPE;
    let pdf = SLOPE / (last - first) * (1.0 - x) * (1.0 + x);
    Spectral {
        wavelength,
        weight: srgb(wavelength) / INTEGRALS / pdf,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The midpoint rule over all wavelengths.
    fn integral(f: impl Fn(f64) -> DVec3) -> DVec3 {
        const STEPS: u32 = 47_000;
        let step = (LONGEST - SHORTEST) / f64::from(STEPS);
        let sum: DVec3 = (0..STEPS)
            .map(|i| f(SHORTEST + step * (f64::from(i) + 0.5)))
            .sum();
        step * sum
    }

    #[test]
    fn the_matching_functions_have_their_integrals() {
        let found = integral(srgb);
        assert!((found - INTEGRALS).abs().max_element() < 1.0e-6, "{found}");
        let published = DVec3::new(128.1, 101.6, 97.1);
        assert!((found - published).abs().max_element() < 0.05, "{found}");
        // Red is negative between blue and green, by .37 of its integral.
        let negative = integral(|l| srgb(l).min(DVec3::ZERO)).x / found.x;
        assert!((negative + 0.37).abs() < 0.005, "{negative}");
    }

    #[test]
    fn the_mean_of_the_weights_is_one() {
        const STEPS: u32 = 100_000;
        let of = |i| sample_wavelength((f64::from(i) + 0.5) / f64::from(STEPS));
        let sum: DVec3 = (0..STEPS).map(|i| of(i).weight).sum();
        let mean = sum / f64::from(STEPS);
        assert!((mean - DVec3::ONE).abs().max_element() < 1.0e-6, "{mean}");
        let ends = [0.0, 1.0].map(|u| sample_wavelength(u).wavelength);
        assert!((ends[0] - SHORTEST).abs() < 1.0e-9 && (ends[1] - LONGEST).abs() < 1.0e-9);
        let all = (0..STEPS).map(|i| of(i).weight.abs().max_element());
        assert!(all.fold(0.0, f64::max) < 8.0);
    }
}

//! A table of a BRDF by half and difference angles.

use std::f64::consts::{FRAC_PI_2, PI};
use std::fmt;
use std::hash::Hasher as _;
use std::sync::{Arc, OnceLock};

use fnv::FnvHasher;
use glam::DVec3;

use super::fit::Lobe;
use super::{Measured, NAME};
use crate::materials::lobes::Pair;
use crate::materials::scattered::most_scattered;

/// Values of an isotropic BRDF, by the angles of Rusinkiewicz, "A New Change of Variables for Efficient BRDF
/// Representation" (Eurographics Workshop on Rendering 1998): theta_h of the half vector with the normal, theta_d
/// of either direction with the half vector, phi_d about it, from the plane of half vector and normal.
pub struct BrdfTable {
    sizes: [usize; 3],
    entries: Vec<[f32; 3]>,
    content: u64,
    largest: DVec3,
    lobe: Lobe,
    color: DVec3,
    most: OnceLock<DVec3>,
}

/// The directions o and i with these angles, in radians, about the normal +z.
#[must_use]
pub fn directions(theta_h: f64, theta_d: f64, phi_d: f64) -> [DVec3; 2] {
    let (sin_h, cos_h) = theta_h.sin_cos();
    let (sin_d, cos_d) = theta_d.sin_cos();
    let (sin_p, cos_p) = phi_d.sin_cos();
    let h = DVec3::new(sin_h, 0.0, cos_h);
    let down = DVec3::new(cos_h, 0.0, -sin_h);
    let aside = sin_d * (cos_p * down + sin_p * DVec3::Y);
    [cos_d * h - aside, cos_d * h + aside]
}

impl BrdfTable {
    /// A table of `sizes` entries by theta_h, theta_d and phi_d, finite and not negative, the last angle running
    /// first. Entry (i, j, k) of sizes (I, J, K) stands at theta_h = 90 (i/I)^2, theta_d = 90 j/J and phi_d = 180 k/K
    /// degrees.
    ///
    /// # Panics
    /// If there are more or fewer entries than the sizes say, or none.
    #[must_use]
    pub fn new(sizes: [usize; 3], entries: Vec<[f32; 3]>) -> Self {
        assert!(!entries.is_empty() && entries.len() == sizes.iter().product::<usize>());
        let mut hasher = FnvHasher::default();
        for size in sizes {
            hasher.write(&(size as u64).to_le_bytes());
        }
        for value in entries.as_flattened() {
            hasher.write(&value.to_bits().to_le_bytes());
        }
        let value = |entry: &[f32; 3]| DVec3::from(entry.map(f64::from));
        let largest = entries.iter().map(value).fold(DVec3::ZERO, DVec3::max);
        let mut table = Self {
            sizes,
            entries,
            content: hasher.finish(),
            largest,
            lobe: Lobe::COSINE,
            color: DVec3::ZERO,
            most: OnceLock::new(),
        };
        (table.lobe, table.color) = Lobe::fitted(&|pair| table.value(pair));
        table
    }

    /// The table of such sizes with the values of `f` at its entries, rounded to f32, of directions o and i about the
    /// normal +z; what is below the horizon is asked as well.
    #[must_use]
    pub fn sampled(sizes: [usize; 3], f: impl Fn(DVec3, DVec3) -> DVec3) -> Self {
        let [across, down, around] = sizes;
        let mut entries = Vec::with_capacity(across * down * around);
        for i in 0..across {
            for j in 0..down {
                for k in 0..around {
                    let theta_h = FRAC_PI_2 * (i as f64 / across as f64).powi(2);
                    let theta_d = FRAC_PI_2 * j as f64 / down as f64;
                    let [o, i] = directions(theta_h, theta_d, PI * k as f64 / around as f64);
                    entries.push(f(o, i).as_vec3().to_array());
                }
            }
        }
        Self::new(sizes, entries)
    }

    /// How many entries there are by theta_h, theta_d and phi_d.
    #[must_use]
    pub fn sizes(&self) -> [usize; 3] {
        self.sizes
    }

    /// All entries, phi_d running first.
    #[must_use]
    pub fn entries(&self) -> &[[f32; 3]] {
        &self.entries
    }

    /// A hash of sizes and entries.
    #[must_use]
    pub fn content(&self) -> u64 {
        self.content
    }

    /// The largest entry of each channel.
    #[must_use]
    pub fn largest(&self) -> DVec3 {
        self.largest
    }

    /// What directions are drawn from.
    #[must_use]
    pub fn lobe(&self) -> Lobe {
        self.lobe
    }

    /// The share of the light that is scattered at about 45 degrees.
    #[must_use]
    pub fn color(&self) -> DVec3 {
        self.color
    }

    /// The share that is scattered at the angle where it is largest, by channel, about.
    #[must_use]
    pub fn most(self: &Arc<Self>) -> DVec3 {
        *self.most.get_or_init(|| {
            let whole = Measured::of(NAME, Arc::clone(self), DVec3::ONE);
            most_scattered(&whole, DVec3::Y)
        })
    }

    /// Where a pair of directions is in the table, in entries.
    #[must_use]
    pub fn place(&self, pair: &Pair) -> DVec3 {
        let Pair { o, i, h, cos_h } = *pair;
        let sizes = DVec3::from(self.sizes.map(|size| size as f64));
        let difference = 0.5 * (i - o);
        let (across, d) = (h.truncate(), difference.truncate());
        let down = h.z * across.dot(d) - across.length_squared() * difference.z;
        let theta_h = across.length().atan2(h.z) / FRAC_PI_2;
        let theta_d = difference.length().atan2(cos_h) / FRAC_PI_2;
        let phi_d = (across.perp_dot(d).atan2(down) / PI).rem_euclid(1.0);
        sizes * DVec3::new(theta_h.max(0.0).sqrt(), theta_d, phi_d)
    }

    /// The BRDF there: trilinear between entries; phi_d has the period pi, the others end.
    #[must_use]
    pub fn value(&self, pair: &Pair) -> DVec3 {
        let [across, down, around] = self.sizes;
        let most = DVec3::new((across - 1) as f64, (down - 1) as f64, f64::INFINITY);
        let place = self.place(pair).min(most);
        let low = place.floor();
        let part = place - low;
        let [i, j, k] = low.to_array().map(|x| x as usize);
        let entry = |i: usize, j: usize, k: usize| {
            let place = (i.min(across - 1) * down + j.min(down - 1)) * around + k % around;
            DVec3::from(self.entries[place].map(f64::from))
        };
        let line = |i, j| entry(i, j, k).lerp(entry(i, j, k + 1), part.z);
        let plane = |i| line(i, j).lerp(line(i, j + 1), part.y);
        plane(i).lerp(plane(i + 1), part.x)
    }
}

impl PartialEq for BrdfTable {
    fn eq(&self, other: &Self) -> bool {
        (self.sizes, &self.entries) == (other.sizes, &other.entries)
    }
}

impl fmt::Debug for BrdfTable {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Without its entries, which may be millions.
        formatter
            .debug_struct("BrdfTable")
            .field("sizes", &self.sizes)
            .field("content", &self.content)
            .field("lobe", &self.lobe)
            .finish_non_exhaustive()
    }
}

//! Where samples lie: which of them are placed together, and so cannot be told apart by chance.

/// From this index on samples are a pilot's: they decide where others go (`--adaptive`), and are in no
/// image. They are placed as those from index 0 on.
pub const PILOT: u64 = 1 << 48;

/// How the random numbers of a sample are made (`--sampler`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sampler {
    /// Each by itself: `core/random`.
    Independent,
    /// In scrambles of a Sobol' sequence: `sampler/sobol`.
    #[default]
    Sobol,
}

impl Sampler {
    /// All of them.
    pub const ALL: &'static [Self] = &[Self::Sobol, Self::Independent];

    /// The name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Independent => "independent",
            Self::Sobol => "sobol",
        }
    }

    /// Samples of the batch that has the sample `index`: a power of two, and batches begin at multiples
    /// of their length. The spread of batches tells the error, since they are independent of each
    /// other; the samples of a scramble, which is a batch, are not.
    ///
    /// A longer scramble is better, and more batches make a better estimate: the length grows such that
    /// there are always at least 16 batches from 64 samples on, counted from sample 0, and all batches
    /// of a window (`film::window_end`) are of one length.
    #[must_use]
    pub fn batch(self, index: u64) -> u64 {
        match (self, index.checked_sub(PILOT).unwrap_or(index)) {
            (Self::Independent, _) | (Self::Sobol, 0..64) => 4,
            (Self::Sobol, 64..256) => 16,
            (Self::Sobol, _) => 64,
        }
    }

    /// The sample indices from which on batches have another length than before.
    #[must_use]
    pub fn levels(self) -> &'static [u64] {
        match self {
            Self::Independent => &[0],
            Self::Sobol => &[0, 64, 256],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Sampler;

    #[test]
    fn batches_change_at_the_levels_only() {
        for sampler in Sampler::ALL {
            for index in 1..2000 {
                let changes = sampler.batch(index) != sampler.batch(index - 1);
                assert_eq!(changes, sampler.levels()[1..].contains(&index), "{index}");
            }
        }
    }
}

//! Where samples lie: which of them are placed together, and so cannot be told apart by chance.

/// How the random numbers of a sample are made (`--sampler`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sampler {
    /// Each by itself: `core/random`.
    #[default]
    Independent,
    /// In scrambles of a Sobol' sequence: `core/sobol`.
    Sobol,
}

impl Sampler {
    /// The name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Independent => "independent",
            Self::Sobol => "sobol",
        }
    }

    /// Samples of the batch that has the sample `index`, a power of two. Batches begin at multiples of
    /// their length.
    #[must_use]
    pub fn batch(self, index: u64) -> u64 {
        match self {
            Self::Independent => 4,
            Self::Sobol => {
                let s: u64 = std::env::var("GT_S").map_or(16, |s| s.parse().unwrap());
                if s == 0 {
                    return if index < 64 { 4 } else if index < 256 { 16 } else { 64 };
                }
                let _ = index;
                s
            }
        }
    }
}

//! Whether a stated error can be trusted.
//!
//! An error is estimated from the samples that it is the error of. Where few pixels have most of it, another render
//! has others; where a pixel meets its light less than once, its error is missing with the light. Both leave traces in
//! the film, of which a verdict is made. What no sample has met leaves none.

use serde::Serialize;

/// Two figures that an estimated error has beside its size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trust {
    /// The error's upper 95 % bound by its spread over the pixels, over the error: near 1 where many pixels share it.
    pub spread: f64,
    /// What the jackknife adds to the error's square, as a share of it: the part that falls as 1/N of what rare light
    /// hides. Of a share this large the next part counts, too, which it leaves.
    pub correction: f64,
}

/// The largest spread of an error that is trusted, and the largest correction either way: between those of renders
/// whose error is within a tenth of the true one and of those where it is off by a quarter, chosen from up to 60 seeds
/// of most scenes of docs/accuracy.md.
const SPREAD: f64 = 1.15;
const CORRECTION: f64 = 0.15;

/// What is said of an error.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verdict {
    /// `good` or `doubtful`.
    pub verdict: &'static str,
    /// What speaks against it.
    pub why: Vec<&'static str>,
    /// [`Trust::spread`].
    pub spread: f64,
    /// [`Trust::correction`].
    pub correction: f64,
}

impl Trust {
    /// Whether the film has nothing that speaks against the error.
    #[must_use]
    pub fn is_good(&self) -> bool {
        self.doubts(false).is_empty()
    }

    /// What speaks against the error; `heavy_tailed`: that its estimate has no finite variance is known of the scene.
    fn doubts(&self, heavy_tailed: bool) -> Vec<&'static str> {
        // What is no number is doubtful.
        let few = self.spread.is_nan() || self.spread > SPREAD;
        let rare = self.correction.is_nan() || self.correction.abs() > CORRECTION;
        [
            (few, "few pixels have most of the error"),
            (rare, "pixels have met too little of their light"),
            (heavy_tailed, "samples have a heavy tail"),
        ]
        .into_iter()
        .filter_map(|(is, why)| is.then_some(why))
        .collect()
    }

    /// The verdict with what it is made of; `heavy_tailed`: that the error's estimate has no finite variance is known
    /// of the scene ([`VarianceClass::HeavyTailed`](crate::variance::VarianceClass)).
    #[must_use]
    pub fn verdict(&self, heavy_tailed: bool) -> Verdict {
        let why = self.doubts(heavy_tailed);
        Verdict {
            verdict: if why.is_empty() { "good" } else { "doubtful" },
            why,
            spread: self.spread,
            correction: self.correction,
        }
    }
}

/// As in `good` and `doubtful (few pixels have most of the error)`.
impl std::fmt::Display for Verdict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.verdict)?;
        match self.why[..] {
            [] => Ok(()),
            _ => write!(f, " ({})", self.why.join("; ")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_figure_can_be_doubted() {
        let said = |spread, correction| {
            let trust = Trust { spread, correction };
            trust.verdict(false).to_string()
        };
        assert_eq!(said(1.15, -0.15), "good");
        assert_eq!(
            said(1.16, 0.0),
            "doubtful (few pixels have most of the error)"
        );
        let rare = "doubtful (pixels have met too little of their light)";
        assert_eq!([said(1.0, 0.16), said(1.0, -0.16)], [rare; 2]);
        assert!(said(f64::NAN, f64::NAN).contains("; "));
        let trust = Trust {
            spread: 1.0,
            correction: 0.0,
        };
        let heavy = trust.verdict(true).to_string();
        assert_eq!(heavy, "doubtful (samples have a heavy tail)");
    }
}

//! Tests of hypotheses, for `check` and for the tests. All p-values are two-sided or upper tails, as each function says.

use statrs::distribution::{ChiSquared, ContinuousCDF, Normal, StudentsT};

/// The significance of a whole family of tests.
pub const SIGNIFICANCE: f64 = 1.0e-3;

/// The level of each of `count` tests such that all together have [`SIGNIFICANCE`] (Sidak).
#[must_use]
pub fn sidak(count: usize) -> f64 {
    // 1 - (1 - a)^(1/n), without the cancellation.
    -((-SIGNIFICANCE).ln_1p() / count as f64).exp_m1()
}

/// The size that none of `count` standard normal deviates exceeds, at [`SIGNIFICANCE`].
#[must_use]
pub fn normal_limit(count: usize) -> f64 {
    Normal::standard().inverse_cdf(1.0 - 0.5 * sidak(count))
}

/// Two-sided p-value of a standard normal deviate.
#[must_use]
pub fn normal_p(z: f64) -> f64 {
    2.0 * Normal::standard().sf(z.abs())
}

/// The size that a Student's t of `freedom` degrees of freedom exceeds with a probability of
/// 1 - `level`.
///
/// # Panics
/// If `freedom` is not positive.
#[must_use]
pub fn student_quantile(freedom: f64, level: f64) -> f64 {
    if freedom.is_infinite() {
        return Normal::standard().inverse_cdf(0.5 + 0.5 * level);
    }
    student(freedom).inverse_cdf(0.5 + 0.5 * level)
}

/// The size of a normal deviate that is as improbable as |t| with `freedom` degrees of freedom, which
/// may be infinite.
///
/// # Panics
/// If `freedom` is not positive.
#[must_use]
pub fn as_normal(t: f64, freedom: f64) -> f64 {
    if freedom.is_infinite() {
        return t.abs();
    }
    -Normal::standard().inverse_cdf(student(freedom).sf(t.abs()))
}

fn student(freedom: f64) -> StudentsT {
    StudentsT::new(0.0, 1.0, freedom).expect("positive degrees of freedom")
}

/// What a chi-square test found.
#[derive(Clone, Copy, Debug)]
pub struct ChiSquare {
    /// The statistic.
    pub statistic: f64,
    /// Degrees of freedom, after pooling.
    pub freedom: usize,
    /// Probability of a statistic at least as large.
    pub p: f64,
}

/// Counts against expected probabilities, which sum to 1. Cells with fewer than 5 expected counts
/// are pooled into one; if that has fewer too, more than 20 unexpected counts make the test fail.
///
/// # Panics
/// If there are not as many probabilities as counts, if they do not sum to 1, or if one cell is left.
#[must_use]
pub fn chi_square(counts: &[u64], probabilities: &[f64]) -> ChiSquare {
    assert_eq!(counts.len(), probabilities.len());
    let total: f64 = probabilities.iter().sum();
    assert!(
        (total - 1.0).abs() < 1.0e-3,
        "the probabilities sum to {total}"
    );
    let samples = counts.iter().sum::<u64>() as f64;
    let mut statistic = 0.0;
    let mut cells = 0;
    let mut pool = (0.0, 0.0);
    let mut add = |count: f64, expected: f64| {
        statistic += (count - expected).powi(2) / expected;
        cells += 1;
    };
    for (&count, &probability) in counts.iter().zip(probabilities) {
        let expected = samples * probability / total;
        if expected < 5.0 {
            pool = (pool.0 + count as f64, pool.1 + expected);
        } else {
            add(count as f64, expected);
        }
    }
    if pool.1 >= 5.0 {
        add(pool.0, pool.1);
    } else if pool.0 > 20.0 * pool.1 + 20.0 {
        // Too little expected for a cell, far too much seen: p < 1e-10 even at 5 expected.
        return ChiSquare {
            statistic: f64::INFINITY,
            freedom: 1,
            p: 0.0,
        };
    }
    assert!(cells > 1, "one cell is no test");
    let freedom = cells - 1;
    let p = ChiSquared::new(freedom as f64)
        .expect("at least one degree of freedom")
        .sf(statistic);
    ChiSquare {
        statistic,
        freedom,
        p,
    }
}

/// p-value of the two-sided Kolmogorov-Smirnov test of `values` against the uniform distribution on
/// [0, 1). The asymptotic series, for thousands of values.
#[must_use]
pub fn uniform_ks(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    let n = values.len() as f64;
    let distance = values
        .iter()
        .enumerate()
        .map(|(i, x)| (x - i as f64 / n).max((i + 1) as f64 / n - x))
        .fold(0.0, f64::max);
    let lambda = distance * (n.sqrt() + 0.12 + 0.11 / n.sqrt());
    let series: f64 = (1..=100)
        .map(|k| {
            let k = f64::from(k);
            let sign = if k % 2.0 == 1.0 { 1.0 } else { -1.0 };
            sign * (-2.0 * k * k * lambda * lambda).exp()
        })
        .sum();
    if lambda < 0.2 {
        1.0
    } else {
        (2.0 * series).clamp(0.0, 1.0)
    }
}

/// Pearson's correlation.
#[must_use]
pub fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let n = a.len().min(b.len());
    let mean = |v: &[f64]| v[..n].iter().sum::<f64>() / n as f64;
    let (ma, mb) = (mean(a), mean(b));
    let (mut ab, mut aa, mut bb) = (0.0, 0.0, 0.0);
    for (x, y) in a[..n].iter().zip(&b[..n]) {
        ab += (x - ma) * (y - mb);
        aa += (x - ma) * (x - ma);
        bb += (y - mb) * (y - mb);
    }
    ab / (aa * bb).sqrt()
}

/// Mean and standard error of the mean.
#[must_use]
pub fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, (variance / n).sqrt())
}

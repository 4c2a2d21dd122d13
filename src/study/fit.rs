//! Laws fitted to errors: a power of the samples or the time, and bias against variance.

use crate::sampler::Sampler;

/// The slope of ln y over ln x by least squares; `None` for fewer than 3 points, or any that is not
/// positive.
#[must_use]
pub fn slope(points: &[(f64, f64)]) -> Option<f64> {
    if points.len() < 3 || !points.iter().all(|(x, y)| *x > 0.0 && *y > 0.0) {
        return None;
    }
    let n = points.len() as f64;
    let logs: Vec<(f64, f64)> = points.iter().map(|(x, y)| (x.ln(), y.ln())).collect();
    let mean = |f: &dyn Fn(&(f64, f64)) -> f64| logs.iter().map(f).sum::<f64>() / n;
    let (mx, my) = (mean(&|p| p.0), mean(&|p| p.1));
    let xy: f64 = logs.iter().map(|(x, y)| (x - mx) * (y - my)).sum();
    let xx: f64 = logs.iter().map(|(x, _)| (x - mx).powi(2)).sum();
    (xx > 0.0).then(|| xy / xx)
}

/// Bias and variance of MSE = b² + v/N.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BiasFit {
    /// b², unconstrained: of an unbiased series it is as often negative as positive.
    pub bias_squared: f64,
    /// v: the variance of a sample, in the longest scrambles where the sampler makes such.
    pub variance: f64,
}

/// Fits MSE(N) = b² + v/N to (N, MSE) by weighted least squares. The error of an MSE is taken to be
/// proportional to `scale`, which is what was measured before the reference's noise was subtracted.
///
/// Scrambles of the sampler `sobol` grow with the sample index, and the variance of a sample, v, is
/// less in longer ones. So v/N is the sum of v_L n_L/N² over the lengths L, of which n_L samples are in
/// scrambles of length L: for independent scrambles that holds exactly, at every N that is a whole
/// number of them. `None` without more points than unknowns.
#[must_use]
pub fn bias_fit(sampler: Sampler, points: &[(u64, f64)], scale: &[f64]) -> Option<BiasFit> {
    let points: Vec<(u64, f64, f64)> = points
        .iter()
        .zip(scale)
        .map(|((n, mse), scale)| (*n, *mse, *scale))
        .filter(|(n, _, scale)| whole(sampler, *n) && *scale > 0.0)
        .collect();
    let last = points.iter().map(|p| p.0).max()?;
    // A variance for each length of scrambles that was come to.
    let begun = sampler.levels().iter().filter(|from| **from < last);
    let unknowns = 1 + begun.count();
    if points.len() <= unknowns {
        return None;
    }
    // Columns are divided by their size at the last point, which keeps the system well conditioned.
    let column = |n: u64, i: usize| match i {
        0 => 1.0,
        i => count(sampler, n, i - 1) as f64 / (n as f64 * n as f64),
    };
    let sizes: Vec<f64> = (0..unknowns).map(|i| column(last, i)).collect();
    let mut matrix = vec![vec![0.0; unknowns + 1]; unknowns];
    for (n, mse, scale) in &points {
        let row: Vec<f64> = (0..unknowns)
            .map(|i| column(*n, i) / sizes[i] / scale)
            .collect();
        for i in 0..unknowns {
            for j in 0..unknowns {
                matrix[i][j] += row[i] * row[j];
            }
            matrix[i][unknowns] += row[i] * mse / scale;
        }
    }
    let solution = solve(matrix)?;
    Some(BiasFit {
        bias_squared: solution[0],
        variance: solution[unknowns - 1] / sizes[unknowns - 1],
    })
}

/// Whether the samples up to `n` are whole scrambles.
fn whole(sampler: Sampler, n: u64) -> bool {
    sampler == Sampler::Independent || n > 0 && n.is_multiple_of(sampler.batch(n - 1))
}

/// How many of the samples up to `n` are in one of `Sampler::levels`.
fn count(sampler: Sampler, n: u64, level: usize) -> u64 {
    let levels = sampler.levels();
    let end = levels.get(level + 1).copied().unwrap_or(u64::MAX);
    n.min(end).saturating_sub(levels[level])
}

/// Solves a system whose last column is the right side, by elimination with pivots.
fn solve(mut rows: Vec<Vec<f64>>) -> Option<Vec<f64>> {
    let n = rows.len();
    for i in 0..n {
        let pivot = (i..n).max_by(|a, b| rows[*a][i].abs().total_cmp(&rows[*b][i].abs()))?;
        rows.swap(i, pivot);
        if rows[i][i].abs() < 1.0e-300 {
            return None;
        }
        let pivot = rows[i].clone();
        for row in &mut rows[i + 1..] {
            let factor = row[i] / pivot[i];
            for (value, above) in row.iter_mut().zip(&pivot) {
                *value -= factor * above;
            }
        }
    }
    let mut solution = vec![0.0; n];
    for i in (0..n).rev() {
        let known: f64 = (i + 1..n).map(|j| rows[i][j] * solution[j]).sum();
        solution[i] = (rows[i][n] - known) / rows[i][i];
    }
    solution.iter().all(|x| x.is_finite()).then_some(solution)
}

/// Where a curve crosses a value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Crossing {
    /// No later than its first point.
    Before(f64),
    /// Here.
    At(f64),
    /// Not at the points before one that is unknown.
    Unknown,
    /// Not at all.
    Never,
}

/// The x at which a falling curve first reaches `y`, on a line in the logarithms of its points. What is
/// beyond a point whose y is unknown says nothing: y may have been reached there.
#[must_use]
pub fn crossing(points: &[(f64, Option<f64>)], y: f64) -> Crossing {
    let mut before: Option<(f64, f64)> = None;
    for (x, value) in points {
        let Some(value) = *value else {
            return Crossing::Unknown;
        };
        let point = (*x, value);
        if value <= y {
            let Some(before) = before else {
                return Crossing::Before(*x);
            };
            return between(&[before, point], y, true).map_or(Crossing::Unknown, Crossing::At);
        }
        before = Some(point);
    }
    Crossing::Never
}

/// The y of a curve at `x`, on a line in the logarithms of its points; `None` outside of it, and beside
/// a point whose y is unknown.
#[must_use]
pub fn value_at(points: &[(f64, Option<f64>)], x: f64) -> Option<f64> {
    if let Some(point) = points.iter().find(|p| p.0 == x) {
        return point.1;
    }
    let pair = points.windows(2).find(|p| p[0].0 <= x && x <= p[1].0)?;
    between(
        &[(pair[0].0, pair[0].1?), (pair[1].0, pair[1].1?)],
        x,
        false,
    )
}

fn between(pair: &[(f64, f64); 2], at: f64, inverse: bool) -> Option<f64> {
    let turn = |(x, y): (f64, f64)| if inverse { (y, x) } else { (x, y) };
    let (a, b) = (turn(pair[0]), turn(pair[1]));
    if [a.0, a.1, b.0, b.1, at].iter().any(|v| *v <= 0.0) {
        return None;
    }
    let share = (at / a.0).ln() / (b.0 / a.0).ln();
    Some((a.1.ln() + share * (b.1 / a.1).ln()).exp())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::bootstrap::Interval;
    use crate::verify::Random;
    use statrs::distribution::{ContinuousCDF, Normal};

    fn powers(last: u32) -> Vec<u64> {
        (0..=last).map(|k| 1 << k).collect()
    }

    #[test]
    fn a_power_law_is_found_again() {
        let law = |x: u64| (x as f64, 3.0 * (x as f64).powf(-0.62));
        let points: Vec<(f64, f64)> = powers(10).into_iter().map(law).collect();
        let found = slope(&points).expect("a slope");
        assert!((found + 0.62).abs() < 1.0e-12, "{found}");
        assert_eq!(slope(&points[..2]), None);
        assert_eq!(slope(&[(1.0, 1.0), (2.0, 0.0), (3.0, 1.0)]), None);
    }

    /// Without noise both samplers' laws come out to rounding.
    #[test]
    fn bias_and_variance_are_found_again() {
        let law = |n: u64| 0.03 + 2.0 / n as f64;
        let points: Vec<(u64, f64)> = powers(10).into_iter().map(|n| (n, law(n))).collect();
        let scale: Vec<f64> = points.iter().map(|p| p.1).collect();
        let fit = bias_fit(Sampler::Independent, &points, &scale).expect("a fit");
        assert!((fit.bias_squared - 0.03).abs() < 1.0e-12, "{fit:?}");
        assert!((fit.variance - 2.0).abs() < 1.0e-10, "{fit:?}");

        let [short, middle, long] = [3.0, 2.0, 1.5];
        let scrambled = |n: u64| {
            let part = |from: u64, to: u64| n.min(to).saturating_sub(from) as f64;
            let sum = short * part(0, 64) + middle * part(64, 256) + long * part(256, u64::MAX);
            0.001 + sum / (n * n) as f64
        };
        let points: Vec<(u64, f64)> = powers(12).into_iter().map(|n| (n, scrambled(n))).collect();
        let scale: Vec<f64> = points.iter().map(|p| p.1).collect();
        let fit = bias_fit(Sampler::Sobol, &points, &scale).expect("a fit");
        assert!((fit.bias_squared - 0.001).abs() < 1.0e-10, "{fit:?}");
        assert!((fit.variance - long).abs() < 1.0e-6, "{fit:?}");
        // As many samples as are in none of the longer scrambles: there is one variance to fit.
        let few = bias_fit(Sampler::Sobol, &points[..7], &scale[..7]).expect("a fit");
        assert!((few.variance - short).abs() < 1.0e-6, "{few:?}");
        // The plain law sees a bias that is none.
        let plain = bias_fit(Sampler::Independent, &points, &scale).expect("a fit");
        assert!((plain.bias_squared - 0.001).abs() > 1.0e-4, "{plain:?}");
        assert_eq!(bias_fit(Sampler::Sobol, &points[..4], &scale[..4]), None);
    }

    /// The MSE of images of `pixels` normal values with bias `b`, at growing numbers of samples of one
    /// run: the samples of a point are in all later ones.
    fn run(random: &mut Random, b: f64, marks: &[u64], pixels: usize) -> Vec<f64> {
        let normal = Normal::standard();
        let mut sums = vec![0.0; pixels];
        let mut done = 0;
        let mut mse = Vec::new();
        for &mark in marks {
            let spread = ((mark - done) as f64).sqrt();
            for sum in &mut sums {
                *sum += spread * normal.inverse_cdf(random.unit() + 1.0e-9);
            }
            done = mark;
            let square = |s: &f64| (s / mark as f64 + b).powi(2);
            mse.push(sums.iter().map(square).sum::<f64>() / pixels as f64);
        }
        mse
    }

    fn fitted(runs: &[Vec<f64>], marks: &[u64]) -> Option<Interval> {
        Interval::of(runs.len(), |chosen| {
            let mean =
                |i: usize| chosen.iter().map(|r| runs[*r][i]).sum::<f64>() / chosen.len() as f64;
            let points: Vec<(u64, f64)> = marks
                .iter()
                .enumerate()
                .map(|(i, n)| (*n, mean(i)))
                .collect();
            let scale: Vec<f64> = points.iter().map(|p| p.1).collect();
            bias_fit(Sampler::Independent, &points, &scale).map(|f| f.bias_squared)
        })
    }

    /// Runs of correlated points, as those of a study are: the interval holds the true b² about as often
    /// as `bootstrap` says (93 % of 8 runs; here 40 trials, of which 31 or more hold it but once in a
    /// thousand times), tells b = 0.05 from 0, and is unbiased.
    #[test]
    fn the_interval_for_the_bias_holds_the_truth() {
        let marks = powers(8);
        for b in [0.0, 0.05] {
            let mut random = Random::new("bias");
            let (mut held, mut zero) = (0, 0);
            for _ in 0..40 {
                let runs: Vec<Vec<f64>> =
                    (0..8).map(|_| run(&mut random, b, &marks, 256)).collect();
                let range = fitted(&runs, &marks)
                    .and_then(|i| i.range)
                    .expect("a range");
                held += usize::from((range[0]..=range[1]).contains(&(b * b)));
                zero += usize::from((range[0]..=range[1]).contains(&0.0));
            }
            println!("b = {b}: {held} of 40 hold it, {zero} of 40 hold 0");
            assert!(held >= 31, "b = {b}: {held}");
            assert_eq!(zero == 0, b > 0.0, "b = {b}: {zero} of 40 hold 0");
        }
    }

    #[test]
    fn curves_are_read_between_their_points() {
        let curve = [(1.0, Some(1.0)), (4.0, Some(0.5)), (16.0, Some(0.25))];
        assert_eq!(crossing(&curve, 2.0), Crossing::Before(1.0));
        let Crossing::At(x) = crossing(&curve, 0.5f64.sqrt()) else {
            panic!("between the first two");
        };
        assert!((x - 2.0).abs() < 1.0e-12, "{x}");
        assert_eq!(crossing(&curve, 0.2), Crossing::Never);
        assert!((value_at(&curve, 8.0).expect("inside") - 0.125f64.sqrt()).abs() < 1.0e-12);
        assert_eq!(value_at(&curve, 4.0), Some(0.5));
        assert_eq!(value_at(&curve, 17.0), None);
        assert_eq!(value_at(&curve, 0.5), None);
    }

    #[test]
    fn nothing_is_read_beyond_what_is_unknown() {
        let curve = [
            (1.0, Some(1.0)),
            (4.0, Some(0.5)),
            (16.0, None),
            (64.0, Some(0.2)),
        ];
        assert!(matches!(crossing(&curve, 0.6), Crossing::At(_)));
        assert_eq!(crossing(&curve, 0.4), Crossing::Unknown);
        assert_eq!(crossing(&curve, 0.1), Crossing::Unknown);
        assert!(value_at(&curve, 2.0).is_some());
        for x in [5.0, 16.0, 20.0] {
            assert_eq!(value_at(&curve, x), None);
        }
        assert_eq!(value_at(&curve, 64.0), Some(0.2));
    }
}

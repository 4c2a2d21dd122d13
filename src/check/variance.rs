//! Case 39: what samples of the lecture's estimator vary by.

use super::Case;
use super::context::Context;
use super::film::must;
use super::integrator::closed;
use crate::error::Result;
use crate::film::{BLOCK, Film};
use crate::job::prepare;
use crate::sampler::Sampler;
use crate::settings::{Integrator, Settings};
use crate::variance::VarianceClass;
use crate::verify::Measure;

pub(super) const CASES: &[Case] = &[Case {
    id: 39,
    name: "the lecture's variance",
    setup: "closed furnaces: the blocks' variance is (1 + 2 rho m)/(1 - q) - m^2, q = \
                4 rho^2/(3 (1 - p)), to 3.9 of its standard errors; infinite where q >= 1",
    run: variance_law,
}];

/// Raw moments, first to fourth, of the lecture's estimator in a closed sphere that emits 1.
///
/// A sample is L = 1 + w L' with L' of the same distribution and independent of w, which is 0 with
/// probability p and else 2 rho c/(1 - p), c uniform on [0, 1]: E w^k = q_k =
/// (2 rho)^k/((k + 1) (1 - p)^(k - 1)). Expanding E (1 + w L')^k gives E L^k by the lower ones.
fn lecture_moments(rho: f64, p: f64) -> [f64; 4] {
    let q = |k: i32| (2.0 * rho).powi(k) / (f64::from(k + 1) * (1.0 - p).powi(k - 1));
    let (q1, q2, q3, q4) = (q(1), q(2), q(3), q(4));
    let m1 = 1.0 / (1.0 - q1);
    let m2 = (1.0 + 2.0 * q1 * m1) / (1.0 - q2);
    let m3 = (1.0 + 3.0 * q1 * m1 + 3.0 * q2 * m2) / (1.0 - q3);
    let m4 = (1.0 + 4.0 * q1 * m1 + 6.0 * q2 * m2 + 4.0 * q3 * m3) / (1.0 - q4);
    [m1, m2, m3, m4]
}

fn variance_law(context: &Context) -> Result<Measure> {
    // All have finite sixth moments: the variance of the sample variance is finite, and so is its
    // third moment, which makes it normal for many samples.
    let mut all = vec![(0.3, 0.2), (0.55, 0.2)];
    if !context.options.quick {
        all.extend([(0.45, 0.2), (0.55, 0.1), (0.6, 0.0), (0.4, 0.4)]);
    }
    let mut measure = Measure::new(3.9, "standard errors");
    for (rho, p) in all {
        let scene = closed(rho, 1.0, 1.0).load()?;
        let settings = Settings {
            integrator: Integrator::Lecture { termination: p },
            // The law is one of independent samples.
            sampler: Sampler::Independent,
            ..context.settings(&scene, 64, context.size(64, 512))
        };
        let film = context.render(&scene, &settings)?;
        let [m1, m2, m3, m4] = lecture_moments(rho, p);
        let truth = m2 - m1 * m1;
        let fourth = m4 - 4.0 * m1 * m3 + 6.0 * m1 * m1 * m2 - 3.0 * m1.powi(4);
        let excess = fourth / (truth * truth) - 3.0;
        let (measured, blocks) = sample_variance(&film);
        // The variance of b block sums varies by 2/(b - 1) + their excess kurtosis over b, and that
        // of the sum of 4 samples is a quarter of a sample's; over all pixels.
        let error = truth
            * ((2.0 / (blocks - 1.0) + excess / BLOCK as f64 / blocks)
                / film.rect().pixels() as f64)
                .sqrt();
        let wanted = truth * context.disturbed(0.2);
        measure.add((measured - wanted).abs() / error, || {
            format!("rho {rho}, p {p}: {measured:.5} for {wanted:.5} +- {error:.5}")
        });
    }
    classes(context, &mut measure)?;
    Ok(measure)
}

/// The variance of a sample by the blocks' spread, averaged over the pixels; and the blocks a pixel.
fn sample_variance(film: &Film) -> (f64, f64) {
    let (pixels, samples) = (film.rect().pixels(), film.samples() as f64);
    let sum: f64 = (0..pixels)
        .map(|i| film.variance_of_mean(i).map_or(f64::NAN, |v| v[0]))
        .sum();
    (sum * samples / pixels as f64, samples / BLOCK as f64)
}

/// Where no variance can be measured the program says so: q_2 >= 1; and q_4 >= 1, where the variance
/// of the measured variance is infinite.
fn classes(context: &Context, measure: &mut Measure) -> Result<()> {
    use VarianceClass::{Finite, HeavyTailed, Infinite};
    let steps = [
        (0.62, Finite),
        (0.64, HeavyTailed),
        (0.77, HeavyTailed),
        (0.78, Infinite),
    ];
    for (rho, wanted) in steps {
        let scene = closed(context.disturbed(0.2) * rho, 1.0, 1.0).load()?;
        let settings = Settings {
            integrator: Integrator::Lecture { termination: 0.2 },
            ..context.settings(&scene, 1, 1)
        };
        let class = prepare(&scene, &settings)?.variance().class;
        must(measure, class == wanted, || {
            format!("rho {rho}: {class:?} instead of {wanted:?}")
        });
    }
    Ok(())
}

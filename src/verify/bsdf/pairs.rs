//! Sample against evaluate, and both against themselves the other way round.

use glam::DVec3;

use super::{EDGE, PERTURBED, Question, ROUNDINGS, Subjects};
use crate::error::Result;
use crate::gpu::bsdf_probe::{BsdfInput, Evaluated};
use crate::materials::Event;
use crate::verify::{Agreement, Random, ULP, to_row};

/// The relative allowance of f cos and of the pdf for a direction; `None` on an edge.
fn allowance(subjects: &Subjects, input: &BsdfInput, seed: usize) -> Option<[f64; 2]> {
    let subject = input.material as usize;
    let question = Question::of(input);
    let truth = subjects.twin_evaluate(subject, &question);
    let mut random = Random::new(&format!("pairs {seed}"));
    let mut spread = [0.0f64; 2];
    let size = truth.f_cos.max_element();
    // A spread about infinity would be no number, and pass for none.
    assert!(
        size.is_finite() && truth.pdf.is_finite(),
        "{input:?}: the twin has {truth:?}"
    );
    for _ in 0..PERTURBED {
        let other = subjects.twin_evaluate(subject, &question.perturbed(&mut random));
        if other.event != truth.event {
            return None;
        }
        let apart = (other.f_cos - truth.f_cos).abs().max_element();
        spread[0] = spread[0].max(relative(apart, size));
        spread[1] = spread[1].max(relative((other.pdf - truth.pdf).abs(), truth.pdf));
    }
    let allowed = spread.map(|spread| spread + ROUNDINGS);
    allowed.iter().all(|a| *a <= EDGE).then_some(allowed)
}

/// A difference over a size; of nothing it is none.
fn relative(apart: f64, size: f64) -> f64 {
    if apart == 0.0 { 0.0 } else { apart / size }
}

fn f_cos(e: &Evaluated) -> DVec3 {
    DVec3::from(e.f_cos.map(f64::from))
}

/// Values below this may be 0, or have lost digits: a few of f32's smallest normal number, which drivers may keep or
/// not.
const LEAST: f64 = 1.0e-36;

/// weight = f cos/pdf, the pdf and the event are the same, asked by `sample` and by `evaluate`, for materials
/// that are no delta lobes. `factor` on the weight, for companions.
///
/// # Errors
/// If the device fails.
pub fn weights(
    subjects: &Subjects,
    subject: usize,
    count: usize,
    factor: f64,
) -> Result<Agreement> {
    let mut random = Random::new(&format!("weights {subject}"));
    let inputs = subjects.questions(&mut random, subject, count);
    let samples = subjects.sample(&inputs)?;
    let transmits = subjects.kinds[subject].transmits();
    let (asked, samples): (Vec<BsdfInput>, Vec<_>) = inputs
        .iter()
        .zip(samples)
        .filter(|(input, s)| {
            let above = s.wi().dot(input.surface().normal) > 0.0;
            // What went into a delta lobe beside others has no value.
            let delta = s.event & Event::DELTA.bits() != 0;
            s.weight().max_element() > 0.0 && s.pdf > 0.0 && (above || transmits) && !delta
        })
        .map(|(input, s)| {
            let u = [s.wi[0], s.wi[1], s.wi[2], 0.0];
            (BsdfInput { u, ..*input }, s)
        })
        .unzip();
    let values = subjects.evaluate(&asked)?;
    let mut agreement = Agreement::default();
    for (i, (input, (s, e))) in asked.iter().zip(samples.iter().zip(&values)).enumerate() {
        let Some([by_value, by_pdf]) = allowance(subjects, input, i) else {
            continue;
        };
        let sampled = f64::from(s.pdf) * s.weight();
        if f_cos(e).max(sampled).max_element() < LEAST {
            continue;
        }
        let place = || format!("{input:?}: {s:?}, {e:?}");
        let (weight, pdf) = (factor * s.weight(), f64::from(s.pdf));
        let size = f_cos(e).max_element();
        let off = (weight * pdf - f_cos(e)).abs().max_element() / size;
        agreement.add(off, by_value + by_pdf, place);
        agreement.add(if s.event == e.event { 0.0 } else { 1.0 }, 0.5, place);
        if !subjects.is_uniform(subject) {
            agreement.add((pdf / f64::from(e.pdf) - 1.0).abs(), 2.0 * by_pdf, place);
        }
    }
    Ok(agreement)
}

/// f(wo, wi) = f(wi, wo), and f(wo, wi) eta^2 = f(wi, wo) through the surface, where it is seen from the other side
/// (Veach, thesis 1997, 5.2); for materials that are no delta lobes. `factor` on one of them, for companions.
///
/// # Errors
/// If the device fails.
pub fn reciprocity(
    subjects: &Subjects,
    subject: usize,
    count: usize,
    factor: f64,
) -> Result<Agreement> {
    let mut random = Random::new(&format!("reciprocity {subject}"));
    let mut there = subjects.directions(&mut random, subject, count);
    let cosine = |input: &BsdfInput| super::super::vector(input.u).dot(input.surface().normal);
    let through = subjects.kinds[subject].is_translucent();
    there.retain(|input| cosine(input) > 1.0e-4 || through && cosine(input) < -1.0e-4);
    let back: Vec<BsdfInput> = there
        .iter()
        .map(|input| {
            let turned = BsdfInput {
                wo: [input.u[0], input.u[1], input.u[2]],
                u: to_row(input.wo(), 0.0),
                ..*input
            };
            if cosine(input) > 0.0 {
                return turned;
            }
            BsdfInput {
                normal: input.normal.map(|x| -x),
                eta: 1.0 / input.eta,
                ..turned
            }
        })
        .collect();
    let (forth, returned) = (subjects.evaluate(&there)?, subjects.evaluate(&back)?);
    let mut agreement = Agreement::default();
    for (i, (a, b)) in forth.iter().zip(&returned).enumerate() {
        let (there, back) = (&there[i], &back[i]);
        let allowed = [there, back].map(|input| allowance(subjects, input, i));
        let [Some([one, _]), Some([other, _])] = allowed else {
            continue;
        };
        let [cos_i, cos_o] = [there, back].map(|input| cosine(input).abs());
        // Both cosines are above 1e-4. Of a material that sends nothing there, 0 both ways counts.
        let sizes = [a, b].map(|e| f_cos(e).max_element());
        if sizes.iter().all(|size| *size < 1.0e4 * LEAST) && sizes != [0.0; 2] {
            continue;
        }
        let crossed = a.event & Event::TRANSMITTED.bits() != 0;
        let scale = if crossed {
            f64::from(there.eta).powi(2)
        } else {
            1.0
        };
        let (f, g) = (scale * f_cos(a) / cos_i, factor * f_cos(b) / cos_o);
        // The cosines here are those of the f32 numbers.
        let allowed = one + other + 4.0 * ULP * (1.0 / cos_i + 1.0 / cos_o);
        let off = relative((f - g).abs().max_element(), f.max_element());
        agreement.add(off, allowed, || format!("{there:?}: {a:?}, {b:?}"));
    }
    Ok(agreement)
}

/// Light that a delta lobe sends through a surface, and back from where it came: it has its old direction and
/// its old radiance. `factor` on the index of the way back, for companions.
///
/// # Errors
/// If the device fails.
pub fn there_and_back(
    subjects: &Subjects,
    subject: usize,
    count: usize,
    factor: f64,
) -> Result<Agreement> {
    let mut random = Random::new(&format!("there and back {subject}"));
    let mut there = subjects.questions(&mut random, subject, count);
    // Never reflected where there is a choice.
    for input in &mut there {
        input.u[2] = 1.0 - (0.5 * ULP) as f32;
    }
    let samples = subjects.sample(&there)?;
    // The square of the cosine on the way back has some 30 roundings, times up to 2.5^2: within these f32 may
    // find total reflection.
    let steep = |input: &BsdfInput| input.surface().normal.dot(input.wo()).powi(2) > 200.0 * ULP;
    let crossed: Vec<_> = std::iter::zip(there, samples)
        .filter(|(input, s)| s.event & Event::TRANSMITTED.bits() != 0 && steep(input))
        .collect();
    let back: Vec<BsdfInput> = crossed
        .iter()
        .map(|(input, s)| BsdfInput {
            wo: s.wi,
            normal: input.normal.map(|x| -x),
            eta: factor as f32 / input.eta,
            ..*input
        })
        .collect();
    let returned = subjects.sample(&back)?;
    let mut agreement = Agreement::default();
    for (i, ((input, s), second)) in crossed.iter().zip(&returned).enumerate() {
        let question = Question::of(&BsdfInput {
            eta: 1.0 / input.eta,
            ..back[i]
        });
        let truth = subjects.twin_sample(subject, &question);
        let mut random = Random::new(&format!("back {i}"));
        let mut spread = 0.0f64;
        for _ in 0..PERTURBED {
            // Once for each way.
            let once = question.perturbed(&mut random);
            let other = subjects.twin_sample(subject, &once.perturbed(&mut random));
            let through = other.event.is(Event::TRANSMITTED);
            spread = spread.max(if through {
                (other.wi - truth.wi).length()
            } else {
                1.0
            });
        }
        let allowed = spread + ROUNDINGS;
        if allowed > EDGE {
            continue;
        }
        let place = || format!("{input:?}: {s:?}, back {second:?}");
        agreement.add((second.wi() - input.wo()).length(), allowed, place);
        let radiance = (s.weight() * second.weight() - DVec3::ONE)
            .abs()
            .max_element();
        agreement.add(radiance, ROUNDINGS, place);
    }
    Ok(agreement)
}

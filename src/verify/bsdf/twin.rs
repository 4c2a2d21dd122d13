//! The device's BSDFs against their f64 twins, fed with the same f32 numbers.

use glam::DVec3;
use rayon::prelude::*;

use super::{EDGE, PERTURBED, Question, ROUNDINGS, Subjects};
use crate::error::Result;
use crate::gpu::bsdf_probe::BsdfInput;
use crate::materials::Surface;
use crate::verify::{Agreement, Random};

/// A way to be wrong, for companions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wrong {
    /// The twin's normal is turned by this, and its eta larger by this share.
    pub turn: f64,
    /// The twin is that of the material's next case.
    pub next: bool,
}

/// How the device and a twin agree.
#[derive(Clone, Debug, Default)]
pub struct Compared {
    /// Of directions, weights, values, pdfs and events.
    pub agreement: Agreement,
    /// Cases on an edge, where either answer will do.
    pub edges: usize,
    /// All cases.
    pub cases: usize,
}

/// An answer as numbers: the event, and groups of values, each with its size.
struct Answer {
    event: u32,
    groups: Vec<(DVec3, f64)>,
}

/// Asks `sample` of the subject so many times.
///
/// # Errors
/// If the device fails.
pub fn samples(
    subjects: &Subjects,
    subject: usize,
    count: usize,
    wrong: Wrong,
) -> Result<Compared> {
    let mut random = Random::new(&format!("twin samples {subject}"));
    let inputs = subjects.questions(&mut random, subject, count);
    let outputs = subjects.sample(&inputs)?.into_iter().map(|s| Answer {
        event: s.event,
        groups: sample_groups(s.wi(), s.weight(), s.pdf.into(), s.eta.into()),
    });
    Ok(compare(inputs, outputs.collect(), wrong, |q| {
        let of = if wrong.next {
            subjects.next(subject)
        } else {
            subject
        };
        let s = subjects.twin_sample(of, q);
        Answer {
            event: s.event.bits(),
            groups: sample_groups(s.wi, s.weight, s.pdf, s.eta),
        }
    }))
}

fn sample_groups(wi: DVec3, weight: DVec3, pdf: f64, eta: f64) -> Vec<(DVec3, f64)> {
    let weighed = weight.max_element();
    vec![
        (wi, 1.0),
        (weight, weighed),
        (DVec3::splat(pdf), pdf),
        (DVec3::splat(eta), eta),
    ]
}

/// Asks `evaluate` of the subject so many times.
///
/// # Errors
/// If the device fails.
pub fn values(subjects: &Subjects, subject: usize, count: usize, wrong: Wrong) -> Result<Compared> {
    let mut random = Random::new(&format!("twin values {subject}"));
    let inputs = subjects.directions(&mut random, subject, count);
    let outputs = subjects.evaluate(&inputs)?.into_iter().map(|e| {
        let f_cos = DVec3::from(e.f_cos.map(f64::from));
        Answer {
            event: e.event,
            groups: value_groups(f_cos, e.pdf.into()),
        }
    });
    Ok(compare(inputs, outputs.collect(), wrong, |q| {
        let of = if wrong.next {
            subjects.next(subject)
        } else {
            subject
        };
        let e = subjects.twin_evaluate(of, q);
        Answer {
            event: e.event.bits(),
            groups: value_groups(e.f_cos, e.pdf),
        }
    }))
}

fn value_groups(f_cos: DVec3, pdf: f64) -> Vec<(DVec3, f64)> {
    vec![(f_cos, f_cos.max_element()), (DVec3::splat(pdf), pdf)]
}

/// Error and tolerance of each group of an answer; `None` on an edge.
fn judge(
    output: &Answer,
    question: &Question,
    seed: usize,
    twin: &(impl Fn(&Question) -> Answer + Sync),
) -> Option<Vec<(f64, f64)>> {
    let truth = twin(question);
    let mut random = Random::new(&format!("perturbed {seed}"));
    let mut spread = vec![0.0f64; truth.groups.len()];
    for _ in 0..PERTURBED {
        let other = twin(&question.perturbed(&mut random));
        if other.event != truth.event {
            return None;
        }
        for (spread, (a, b)) in spread
            .iter_mut()
            .zip(truth.groups.iter().zip(&other.groups))
        {
            *spread = spread.max((a.0 - b.0).abs().max_element());
        }
    }
    let mut judged = Vec::new();
    if output.event != truth.event {
        judged.push((1.0, 0.5));
    }
    for ((found, _), ((value, size), spread)) in
        output.groups.iter().zip(truth.groups.iter().zip(&spread))
    {
        let allowed = *spread;
        if allowed > EDGE * size {
            return None;
        }
        // Results below f32's smallest normal number may be 0.
        let error = (*found - *value).abs().max_element();
        judged.push((error, allowed + ROUNDINGS * size + 1.0e-37));
    }
    Some(judged)
}

fn compare(
    inputs: Vec<BsdfInput>,
    outputs: Vec<Answer>,
    wrong: Wrong,
    twin: impl Fn(&Question) -> Answer + Sync,
) -> Compared {
    let asked: Vec<Question> = inputs
        .iter()
        .map(|input| turned(&Question::of(input), wrong.turn))
        .collect();
    let judged: Vec<Option<Vec<(f64, f64)>>> = asked
        .par_iter()
        .zip(&outputs)
        .enumerate()
        .map(|(i, (question, output))| judge(output, question, i, &twin))
        .collect();
    let mut compared = Compared {
        cases: inputs.len(),
        ..Compared::default()
    };
    for ((input, output), judged) in inputs.iter().zip(&outputs).zip(judged) {
        let Some(judged) = judged else {
            compared.edges += 1;
            continue;
        };
        for (group, (error, tolerance)) in judged.into_iter().enumerate() {
            compared.agreement.add(error, tolerance, || {
                let (event, groups) = (output.event, &output.groups);
                format!("{input:?}: event {event}, {groups:?}, group {group}")
            });
        }
    }
    compared
}

/// The question with its normal turned by `angle`, and eta larger by that share.
fn turned(question: &Question, angle: f64) -> Question {
    let Surface {
        normal,
        eta,
        offset,
    } = question.surface;
    let turned = normal + angle * normal.any_orthonormal_vector();
    let normal = if angle == 0.0 {
        normal
    } else {
        turned.normalize()
    };
    Question {
        surface: Surface {
            normal,
            eta: eta * (1.0 + angle),
            offset,
        },
        ..*question
    }
}

//! Every material, by its line in the list alone: on the device through the dispatch against its f64 twin,
//! sample against evaluate, both ways round. Tolerances follow from what the twin makes of inputs that are
//! slightly off (`verify::bsdf`). And Fresnel's terms, whose truth is known.

use std::collections::BTreeSet;

use crate::common::{gpu, probe};
use crate::thorough::thorough;
use gpu_trace::materials::fresnel::fresnel;
use gpu_trace::materials::{ALL, forms};
use gpu_trace::settings::Integrator;
use gpu_trace::verify::bsdf::twin::{Compared, Wrong, samples, values};
use gpu_trace::verify::bsdf::{Subjects, pairs};
use gpu_trace::verify::{Agreement, Random, Row, ULP};

/// Questions to each case, and where the answer is wrong.
const CASES: usize = 10_000;
const WRONG_CASES: usize = CASES / 10;
/// The long form has so many times more. Many more would need a tolerance that is a bound (`verify::bsdf`).
const LONG: usize = 2;

fn questions() -> usize {
    CASES * if thorough() { LONG } else { 1 }
}

/// Fresnel's terms.
const TERMS: usize = 100_000;

const LECTURE: Integrator = Integrator::Lecture { termination: 0.2 };

fn subjects(integrator: Integrator) -> Subjects {
    Subjects::all(&gpu(), integrator)
}

/// Each case of each material in turn. Under the lecture's integrator directions are the same for all, values those of
/// `evaluate`, and delta lobes as under any: there the short form takes the first case of each form.
fn each(subjects: &Subjects, integrator: Integrator) -> impl Iterator<Item = (usize, String)> + '_ {
    let most = match integrator {
        LECTURE if !thorough() => 1,
        _ => usize::MAX,
    };
    let name = |i: usize| format!("case {i}, {}", subjects.kinds()[i].name());
    let chosen = subjects.first_of_each_form(most);
    chosen.map(move |i| (i, name(i)))
}

/// Fails unless the device agrees with the twin, at most a fifth of the cases being on edges: glass that is
/// as dense as what is around it reflects all grazing light or none, and where a value falls as a high power of a
/// sine or a cosine, as those of cloth do about the half vector, rounded directions say little of what is left of it.
fn assert_agrees(name: &str, compared: &Compared) {
    eprint!(
        "{name}: {} of {} on an edge; ",
        compared.edges, compared.cases
    );
    compared.agreement.assert_holds(compared.cases);
    assert!(5 * compared.edges <= compared.cases, "{name}: {compared:?}");
}

#[test]
fn every_form_has_its_cases() {
    for material in ALL {
        let cases = (material.cases)();
        assert!(cases.len() > 1, "{}: a case and another one", material.name);
        let tested: BTreeSet<&str> = cases.iter().map(|kind| kind.form().name).collect();
        let all: BTreeSet<&str> = material.forms.iter().map(|form| form.name).collect();
        assert_eq!(tested, all);
        assert!(cases.iter().all(|kind| kind.name() == material.name));
    }
}

#[test]
fn samples_are_those_of_the_twin() {
    const TURNED: Wrong = Wrong {
        turn: 1.0e-3,
        next: false,
    };
    const NEXT: Wrong = Wrong {
        turn: 0.0,
        next: true,
    };
    for integrator in [Integrator::Bsdf, LECTURE] {
        let subjects = subjects(integrator);
        for (subject, name) in each(&subjects, integrator) {
            let ask =
                |count, wrong| samples(&subjects, subject, count, wrong).expect("the probe runs");
            assert_agrees(&name, &ask(questions(), Wrong::default()));
            let turned = ask(WRONG_CASES, TURNED).agreement;
            // Uniform directions are the same for any normal, and weights off a narrow lobe are 0.
            let uniform = subjects.is_uniform(subject);
            let least = if uniform { 1 } else { WRONG_CASES as u64 / 4 };
            assert!(turned.measure().failures() >= least, "{name}: {turned:?}");
            // Smooth glass has all that its surface is in eta: most of its cases are followed by another one.
            let kind = &subjects.kinds()[subject];
            let next = ask(WRONG_CASES, NEXT).agreement;
            let same = kind.is_delta() && kind.transmits();
            assert!(
                same || next.any_fails(),
                "{name}: the next is not told from it"
            );
        }
    }
}

#[test]
fn values_are_those_of_the_twin() {
    let subjects = subjects(Integrator::Bsdf);
    for (subject, name) in each(&subjects, Integrator::Bsdf) {
        if subjects.kinds()[subject].is_delta() {
            continue;
        }
        let ask = |count, wrong| values(&subjects, subject, count, wrong).expect("the probe runs");
        assert_agrees(&name, &ask(questions(), Wrong::default()));
        for wrong in [
            Wrong {
                turn: 1.0e-3,
                next: false,
            },
            Wrong {
                turn: 0.0,
                next: true,
            },
        ] {
            let found = ask(WRONG_CASES, wrong).agreement;
            // Half of the directions are below the horizon, or off the lobe that differs.
            assert!(
                found.measure().failures() > WRONG_CASES as u64 / 100,
                "{name}: {found:?}"
            );
        }
    }
}

#[test]
fn each_material_alone_is_the_same() {
    // The dispatch of a kernel that has no other.
    for integrator in [Integrator::Bsdf, LECTURE] {
        for material in ALL {
            let cases = (material.cases)();
            let subjects = Subjects::of(&gpu(), cases, integrator);
            for (subject, name) in each(&subjects, integrator) {
                let found = samples(&subjects, subject, questions() / 10, Wrong::default());
                assert_agrees(&name, &found.expect("the probe runs"));
                if !subjects.kinds()[subject].is_delta() {
                    let found = values(&subjects, subject, questions() / 10, Wrong::default());
                    assert_agrees(&name, &found.expect("the probe runs"));
                }
            }
        }
    }
}

#[test]
fn the_kernel_knows_delta_lobes() {
    let subjects = subjects(Integrator::Bsdf);
    for (subject, name) in each(&subjects, Integrator::Bsdf) {
        let kind = &subjects.kinds()[subject];
        let surface = gpu_trace::materials::Surface {
            normal: glam::DVec3::Z,
            eta: 1.0,
            offset: glam::DVec3::ZERO,
        };
        let input = gpu_trace::gpu::bsdf_probe::BsdfInput::new(
            subject,
            &surface,
            glam::DVec3::Z,
            [0.0, 0.0, 1.0, 0.0],
        );
        let found = subjects.evaluate(&[input]).expect("the probe runs");
        assert_eq!(found[0].delta != 0, kind.is_delta(), "{name}");
    }
    // Of both sorts, so that the answer can be wrong.
    assert!(forms().iter().any(|form| form.delta) && forms().iter().any(|form| !form.delta));
}

#[test]
fn weights_are_values_over_pdfs() {
    for integrator in [Integrator::Bsdf, LECTURE] {
        let subjects = subjects(integrator);
        for (subject, name) in each(&subjects, integrator) {
            if subjects.kinds()[subject].is_delta() {
                continue;
            }
            let found = |count, factor| {
                pairs::weights(&subjects, subject, count, factor).expect("the probe runs")
            };
            eprint!("{name}: ");
            // Uniform directions find narrow lobes alone rarely.
            let least = if integrator == LECTURE {
                0
            } else {
                questions() / 2
            };
            let right = found(questions(), 1.0);
            right.assert_holds(least);
            let count = match integrator {
                LECTURE => questions(),
                _ => WRONG_CASES,
            };
            if right.measure().trials() > 0 {
                let wrong = found(count, 1.0 + 1.0e-2);
                assert!(wrong.any_fails(), "{name}: 1 % is not found");
            }
        }
    }
}

#[test]
fn light_goes_both_ways() {
    let subjects = subjects(Integrator::Bsdf);
    for (subject, name) in each(&subjects, Integrator::Bsdf) {
        let kind = &subjects.kinds()[subject];
        eprint!("{name}: ");
        match (kind.transmits(), kind.is_delta()) {
            (_, false) => {
                let found = |count, factor| {
                    pairs::reciprocity(&subjects, subject, count, factor).expect("the probe runs")
                };
                found(questions(), 1.0).assert_holds(questions() / 100);
                let wrong = found(WRONG_CASES, 1.0 + 1.0e-2);
                assert!(wrong.any_fails(), "{name}: 1 % is not found");
            }
            (true, true) => {
                let found = |count, factor| {
                    pairs::there_and_back(&subjects, subject, count, factor)
                        .expect("the probe runs")
                };
                found(questions(), 1.0).assert_holds(questions());
                found(WRONG_CASES, 1.0 + 1.0e-2).assert_fails();
            }
            // A mirror's direction is tested against the twin.
            (false, true) => {}
        }
    }
}

// ---- Fresnel ----

/// Bounds of what a driver may make of the Fresnel terms: the least and the largest share that is
/// reflected, and cos_t, for cos_t^2 off by its roundings.
fn fresnel_bounds(cos_i: f64, eta: f64) -> ([f64; 2], [f64; 2]) {
    let square = ((eta - 1.0) * (eta + 1.0) + cos_i * cos_i) / (eta * eta);
    // eta -+ 1 and their product 3; cos^2 1; the sum 1; eta^2 1 and the ratio 2.5.
    let sizes = ((eta - 1.0) * (eta + 1.0)).abs() + cos_i * cos_i;
    let error = (4.0 * sizes / (eta * eta) + 3.5 * square.abs()) * ULP;
    let cosines = [square - error, square + error].map(|s| s.max(0.0).sqrt());
    let reflected = cosines.map(|cos_t| {
        if cos_t == 0.0 {
            return 1.0;
        }
        let s = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
        let p = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
        0.5 * (s * s + p * p)
    });
    let sorted = |[a, b]: [f64; 2]| [a.min(b), a.max(b)];
    // s and p: products 1 each, in a difference and a sum of the same size; 2.5 for the ratio. At
    // most 1 in size, so twice that in their squares; 2 more. The root 4.5.
    let r = sorted(reflected);
    let c = sorted(cosines);
    (
        [r[0] - 14.0 * ULP, r[1] + 14.0 * ULP],
        [c[0] * (1.0 - 5.0 * ULP), c[1] * (1.0 + 5.0 * ULP)],
    )
}

/// How far `x` is out of a range, on top of a rounding.
fn outside(x: f64, [low, high]: [f64; 2]) -> f64 {
    (low - x).max(x - high).max(0.0)
}

fn double(row: Row) -> [f64; 4] {
    row.map(f64::from)
}

fn fresnel_inputs() -> Vec<Row> {
    let mut random = Random::new("fresnel");
    let inputs = (0..TERMS).map(|i| {
        let eta = [
            1.0 / 1.5,
            1.5,
            random.range(0.4, 2.5),
            1.0 + 1.0e-4 * random.unit(),
        ][i % 4];
        let critical = (1.0 - eta * eta).max(0.0).sqrt();
        let cos_i = match i % 3 {
            0 => random.unit(),
            1 => 10f64.powf(random.range(-6.0, 0.0)),
            _ => (critical * (1.0 + 1.0e-4 * (random.unit() - 0.5))).clamp(1.0e-6, 1.0),
        };
        [cos_i as f32, eta as f32, 0.0, 0.0]
    });
    inputs.collect()
}

#[test]
fn fresnel_agrees() {
    let inputs = fresnel_inputs();
    let outputs: Vec<Row> = probe(&[]).call("fresnel", &inputs).expect("the probe runs");
    let run = |factor: f64| {
        let (mut share, mut cosine) = (Agreement::default(), Agreement::default());
        for (input, output) in inputs.iter().zip(&outputs) {
            let [cos_i, eta, ..] = double(*input);
            let [reflected, cos_t, ..] = double(*output);
            let twin = fresnel(cos_i, factor * eta);
            let (r, c) = fresnel_bounds(cos_i, factor * eta);
            assert!(outside(twin.reflected, r) == 0.0 && outside(twin.cos_t, c) == 0.0);
            let place = || format!("cos_i = {cos_i}, eta = {eta}: {output:?} for {twin:?}");
            share.add(outside(reflected, r), 1.0e-30, place);
            cosine.add(outside(cos_t, c), 1.0e-30, place);
            assert!((0.0..=1.0).contains(&output[0]), "share {}", output[0]);
        }
        (share, cosine)
    };
    let (share, cosine) = run(1.0);
    share.assert_holds(TERMS);
    cosine.assert_holds(TERMS);
    let (share, cosine) = run(1.001);
    share.assert_fails();
    cosine.assert_fails();
}

#[test]
fn fresnel_is_reciprocal() {
    // numerics.md, case 23, where the refraction is not total.
    let forward: Vec<Row> = fresnel_inputs();
    let probe = probe(&[]);
    let outputs: Vec<Row> = probe.call("fresnel", &forward).expect("the probe runs");
    let pairs = || forward.iter().zip(&outputs).filter(|(_, o)| o[1] > 0.0);
    for (factor, holds) in [(1.0, true), (1.01, false)] {
        let back: Vec<Row> = pairs()
            .map(|(i, o)| [o[1], factor / i[1], 0.0, 0.0])
            .collect();
        let returned: Vec<Row> = probe.call("fresnel", &back).expect("the probe runs");
        let mut agreement = Agreement::default();
        for ((input, output), back) in pairs().zip(&returned) {
            let error = f64::from((output[0] - back[0]).abs());
            let place = || format!("cos_i, eta = {input:?}: {output:?}, back {back:?}");
            agreement.add(error, 1.0e-5 / f64::from(input[0]), place);
        }
        if holds {
            agreement.assert_holds(TERMS / 2);
        } else {
            assert!(agreement.any_fails(), "a wrong index is not found");
        }
    }
}

/// What glass reflects on the device, of light that arrives at these cosines.
fn reflected(cosines: &[f64], eta: f64) -> Vec<f64> {
    let inputs: Vec<Row> = cosines
        .iter()
        .map(|c| [*c as f32, eta as f32, 0.0, 0.0])
        .collect();
    let outputs: Vec<Row> = probe(&[]).call("fresnel", &inputs).expect("the probe runs");
    outputs.iter().map(|output| f64::from(output[0])).collect()
}

#[test]
fn fresnel_is_what_is_known_of_it() {
    // Independent of the formula: (eta - 1)^2/(eta + 1)^2 at normal incidence (Hecht, Optics, 4.6), and at
    // Brewster's angle, tan i = eta, where the refracted ray is at a right angle to the reflected one, p is
    // not reflected and s by cos^2 2i.
    let known = |eta: f64| {
        let brewster = eta.atan();
        let normal = ((eta - 1.0) / (eta + 1.0)).powi(2);
        [
            (1.0, normal),
            (brewster.cos(), 0.5 * (2.0 * brewster).cos().powi(2)),
            (1.0e-7, 1.0),
        ]
    };
    for eta in [1.5, 1.0 / 1.5, 1.33, 2.4, 1.0 / 2.4, 1.0625] {
        let eta = f64::from(eta as f32);
        let cosines = known(eta).map(|(cosine, _)| cosine);
        let found = reflected(&cosines, eta);
        let wrong = reflected(&cosines, 1.01 * eta);
        for (i, (cosine, share)) in known(eta).into_iter().enumerate() {
            // At Brewster's angle the share changes with the cosine by less than 4.
            let device = [4.0 * ULP, 64.0 * ULP, 1.0e-5][i];
            let twin = fresnel(cosine, eta).reflected;
            let exact = [1.0e-15, 1.0e-14, 1.0e-5][i];
            assert!(
                (twin - share).abs() <= exact,
                "{eta}, {cosine}: {twin} for {share}"
            );
            let off = |found: f64| (found - share).abs();
            assert!(
                off(found[i]) <= device,
                "{eta}, {cosine}: {} for {share}",
                found[i]
            );
            // Grazing light is all reflected, by anything.
            assert!(
                i == 2 || off(wrong[i]) > device,
                "{eta}, {cosine}: 1 % is not found"
            );
        }
    }
    // Total reflection, beyond sin i = eta.
    let eta = 1.0 / 1.5;
    let critical = f64::sqrt(1.0 - eta * eta);
    assert_eq!(
        reflected(&[0.999 * critical, 0.5 * critical, 1.0e-6], eta),
        [1.0; 3]
    );
    assert!(reflected(&[1.001 * critical], eta)[0] < 1.0);
}

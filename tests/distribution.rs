//! Samples drawn on the device follow the pdf that their weights assume: chi-square over cells whose
//! masses are integrals of the f64 pdf, and the share of each of several delta lobes. The mean of the weights is
//! the light that is scattered, by quadrature.
//!
//! Significance 1e-3 over all tests together (Sidak). Power: a normal turned by a tenth, a cosine taken for
//! uniform, or a cap 1 % too wide fail (the companions).

use std::f64::consts::{PI, TAU};
use std::sync::LazyLock;

use crate::common::{gpu, probe, probe_of, scene};
use crate::thorough::thorough;
use bytemuck::Pod;
use glam::{DVec2, DVec3};
use gpu_trace::gpu::bsdf_probe::Sampled;
use gpu_trace::gpu::probe::Probe;
use gpu_trace::materials::dielectric::Dielectric;
use gpu_trace::materials::fresnel::fresnel;
use gpu_trace::materials::{Event, MaterialKind};
use gpu_trace::placement::Placement;
use gpu_trace::settings::Integrator;
use gpu_trace::statistics::{chi_square, normal_limit, normal_p, sidak};
use gpu_trace::verify::bsdf::Subjects;
use gpu_trace::verify::bsdf::draw::{Draw, Energy};
use gpu_trace::verify::{Cells, Outcome, Random, Row, to_row, vector};

const SAMPLES: usize = 1_000_000;

/// A function's outputs for uniform numbers, others for each `case`.
fn draw<I: Pod, O: Pod>(
    probe: &Probe,
    function: &str,
    case: &str,
    input: impl Fn(Row) -> I,
) -> Vec<O> {
    let mut random = Random::new(&format!("{function} {case}"));
    let inputs: Vec<I> = (0..SAMPLES).map(|_| input(random.unit4())).collect();
    probe
        .call(function, &inputs)
        .unwrap_or_else(|e| panic!("{e}"))
}

fn normals() -> Vec<DVec3> {
    let mut random = Random::new("normals");
    vec![DVec3::Z, -DVec3::Z, random.direction(), random.direction()]
}

fn sphere() -> Vec<Outcome> {
    let outputs: Vec<Row> = draw(&probe(&[]), "sphere_direction", "", |u| u);
    let cells = Cells::new(DVec3::new(1.0, 2.0, 3.0), &[0.0, 2.0], 32, 32);
    let p = cells.test(outputs.iter().map(|w| Some(vector(*w))), |_| 0.25 / PI);
    vec![("sphere".into(), p)]
}

fn cap(factor: f64) -> Vec<Outcome> {
    let probe = probe(&[]);
    let run = |(height, axis): (f64, DVec3)| {
        let row = to_row(axis, height);
        let (axis, height) = (vector(row), factor * f64::from(row[3]));
        let outputs: Vec<Row> = draw(&probe, "cap_direction", &axis.to_string(), |u| [row, u]);
        let edges = [0.0, height, 2.0];
        let cells = Cells::new(axis, &edges, 16, 16);
        let pdf = |w: DVec3| {
            let inside = 0.5 * (w - axis.normalize()).length_squared() < height;
            if inside { 1.0 / (TAU * height) } else { 0.0 }
        };
        let p = cells.test(outputs.iter().map(|w| Some(vector(*w))), pdf);
        (format!("cap of height {height} about {axis}"), p)
    };
    [1.0e-4, 0.01, 0.5, 1.0]
        .into_iter()
        .zip(normals())
        .map(run)
        .collect()
}

/// Places on the lens: uniform in area. `power` of the radius, 2 for a uniform disc.
fn lens(power: f64) -> Vec<Outcome> {
    let scene = scene(
        "[camera]\nposition = [0, 0, 4]\nlook_at = [1, 2, 0]\nfov = 36.0\naperture_radius = 0.5\n\
         focus_distance = 3.0\n[image]\nwidth = 64\nheight = 64\n",
    );
    let camera = Placement::new(&scene, 64, 64).camera;
    let probe = probe_of(&scene, &["lens"]);
    let rays: Vec<[Row; 3]> = draw(&probe, "camera_ray", "", |u| {
        [[11, 52, 0, 0], u.map(f32::to_bits)]
    });
    assert_eq!(camera.approach, 0.0);
    let (rings, sectors) = (16, 32);
    let mut counts = vec![0; rings * sectors];
    for [_, offset, _] in &rays {
        let semi = |axis: DVec3| vector(*offset).dot(axis) / axis.length_squared();
        let disc = DVec2::new(semi(camera.lens_across), semi(camera.lens_down));
        let ring = (disc.length().powf(power) * rings as f64) as usize;
        let turn = disc.y.atan2(disc.x).rem_euclid(TAU) / TAU * sectors as f64;
        counts[ring.min(rings - 1) * sectors + (turn as usize).min(sectors - 1)] += 1;
    }
    let equal = vec![1.0 / counts.len() as f64; counts.len()];
    vec![("lens".into(), chi_square(&counts, &equal).p)]
}

/// Samples of each case of each material at each angle, in the short form and in the long one.
const DRAWN: [usize; 2] = [100_000, 300_000];

fn drawn() -> usize {
    DRAWN[usize::from(thorough())]
}

/// The short form draws from so many cases of a form, the long one from all; uniform directions, which are the
/// same for all, from one.
const CASES: usize = 2;
const UNIFORM_CASES: usize = 1;

/// So few samples beside a delta lobe that a normal turned by a tenth is not seen in a cosine of them.
const FEW: usize = 10_000;

const LECTURE: Integrator = Integrator::Lecture { termination: 0.2 };

/// What is asked of a draw by all tests, so that it is drawn once.
struct Found {
    integrator: Integrator,
    kind: MaterialKind,
    name: String,
    /// p-values of the twin's pdf, and of one that is wrong.
    right: f64,
    wrong: f64,
    /// Whether a coat reflects so much that hardly anything can be told of the rest.
    few: bool,
    energy: Energy,
    /// Those of the material's own sampling.
    moments: Option<[[f64; 3]; 4]>,
    /// See [`Draw::peak`].
    peak: f64,
}

/// What each material's cases give.
fn found() -> &'static [Found] {
    static FOUND: LazyLock<Vec<Found>> = LazyLock::new(|| {
        let mut found = Vec::new();
        for (integrator, most) in [(Integrator::Bsdf, CASES), (LECTURE, UNIFORM_CASES)] {
            let most = if thorough() { usize::MAX } else { most };
            let each = Subjects::each(&gpu(), integrator);
            let chosen = each.iter().flat_map(|subjects| {
                let first = subjects.first_of_each_form(most);
                first.map(move |subject| (subjects, subject))
            });
            for (subjects, subject) in chosen {
                // Delta lobes are the same whatever the integrator.
                if integrator == Integrator::Bsdf || subjects.is_uniform(subject) {
                    let draws = Draw::all(subjects, subject, drawn());
                    for draw in draws.unwrap_or_else(|e| panic!("{e}")) {
                        let kind = subjects.kinds()[subject].clone();
                        found.push(Found::of(&draw, kind, integrator));
                    }
                }
            }
        }
        found
    });
    &FOUND
}

impl Found {
    fn of(draw: &Draw<'_>, kind: MaterialKind, integrator: Integrator) -> Self {
        // A companion that is not found: what has one lobe in one direction chooses nothing.
        let chooses = !kind.is_delta() || kind.transmits();
        let delta = |s: &&Sampled| s.event & Event::DELTA.bits() != 0;
        let beside = draw.samples().len() - draw.samples().iter().filter(delta).count();
        Self {
            integrator,
            name: draw.name().to_owned(),
            right: draw.follows(0.0).1,
            wrong: if chooses { draw.follows(0.1).1 } else { 1.0 },
            few: kind.is_part_delta() && beside < FEW,
            energy: draw.energy(),
            moments: (integrator == Integrator::Bsdf).then(|| draw.moments()),
            peak: draw.peak(),
            kind,
        }
    }
}

#[test]
fn samples_follow_their_pdfs() {
    let mut outcomes = Vec::new();
    for draw in found() {
        let Found { name, wrong, .. } = draw;
        let told = *wrong < sidak(100) || draw.kind.is_delta() || draw.few;
        assert!(told, "not found: {name}, p = {wrong:e}");
        outcomes.push((name.clone(), draw.right));
    }
    outcomes.extend(sphere());
    outcomes.extend(cap(1.0));
    outcomes.extend(lens(2.0));
    let level = sidak(outcomes.len());
    for (name, p) in &outcomes {
        eprintln!("p = {p:.4}: {name}");
    }
    let failed: Vec<&Outcome> = outcomes.iter().filter(|(_, p)| *p < level).collect();
    let tests = outcomes.len();
    assert!(
        failed.is_empty(),
        "below {level:e} of {tests} tests: {failed:?}"
    );
}

#[test]
fn mean_weights_are_the_light_that_is_scattered() {
    for integrator in [Integrator::Bsdf, LECTURE] {
        // Uniform directions meet a narrow lobe a few times or never: no estimate.
        let rare = |draw: &Found| match draw.kind.moment(0, 2) {
            _ if integrator != LECTURE => false,
            bound if bound.is_finite() => bound > drawn() as f64,
            // Without a bound: if the peak is so high that less than a thousand find it.
            _ => draw.peak > 1.0e-3 * drawn() as f64,
        };
        let found = found().iter().filter(|draw| draw.integrator == integrator);
        let all = found.clone().count();
        let found: Vec<&Found> = found.filter(|draw| !rare(draw)).collect();
        assert!(
            2 * found.len() > all,
            "only {} of {all} materials",
            found.len()
        );
        let limit = normal_limit(3 * found.len());
        let mut missed = 0;
        for Found {
            name, energy, kind, ..
        } in &found
        {
            for (c, most) in kind.albedo().to_array().iter().enumerate() {
                let (drawn, truth) = (energy.drawn[c], energy.integrals[c]);
                // The quadrature, and weights that are the same every time up to rounding.
                let allowed = |truth: f64| limit * energy.errors[c] + 2.0e-5 * truth;
                assert!(
                    (drawn - truth).abs() <= allowed(truth),
                    "{name}: {drawn} +- {} for {truth}",
                    energy.errors[c]
                );
                assert!(
                    truth <= most * (1.0 + 1.0e-5),
                    "{name}: {truth} of {}",
                    most
                );
                let wrong = 1.05 * truth;
                let unseen = (drawn - wrong).abs() <= allowed(wrong);
                missed += usize::from(truth > 0.0 && unseen);
            }
        }
        // The uniform hemisphere finds narrow lobes too rarely for that; and of all directions and channels one in a
        // hundred has more noise, as the fainter hue of two lobes at grazing incidence.
        let most = if integrator == LECTURE {
            found.len()
        } else {
            3 * found.len() / 100
        };
        assert!(
            missed <= most,
            "companion: 5 % are not found {missed} times"
        );
    }
}

#[test]
fn moments_are_within_their_bounds() {
    let mut largest = 0.0f64;
    for Found { name, moments, .. } in found() {
        for moment in moments.iter().flatten().flatten() {
            assert!(*moment <= 1.0 + 1.0e-4, "{name}: {moments:?} of the bound");
            largest = largest.max(*moment);
        }
    }
    // Companion: a bound a tenth lower is not kept.
    assert!(largest > 0.9, "{largest}");
}

/// How often glass reflects, against Fresnel's share; `factor` on the share.
fn glass(factor: f64) -> Vec<Outcome> {
    let kinds = [1.5, 2.4].map(|ior| MaterialKind::from(Dielectric::smooth(ior)));
    let subjects = Subjects::of(&gpu(), kinds.into(), Integrator::Bsdf);
    let mut outcomes = Vec::new();
    for subject in 0..subjects.kinds().len() {
        let draws = Draw::all(&subjects, subject, drawn()).unwrap_or_else(|e| panic!("{e}"));
        for draw in &draws {
            let through = Event::TRANSMITTED.bits();
            let samples = draw.samples();
            let reflected = samples.iter().filter(|s| s.event & through == 0).count() as f64;
            let share = fresnel(draw.cosine(), draw.eta()).reflected;
            let total = samples.len() as f64;
            let p = if share == 1.0 {
                // Total reflection: always.
                f64::from(u8::from(reflected == total * factor.min(1.0)))
            } else {
                let share = factor * share;
                normal_p((reflected - total * share) / (total * share * (1.0 - share)).sqrt())
            };
            outcomes.push((draw.name().to_owned(), p));
        }
    }
    outcomes
}

#[test]
fn glass_reflects_fresnels_share() {
    let outcomes = glass(1.0);
    let level = sidak(outcomes.len());
    assert!(outcomes.iter().all(|(_, p)| *p > level), "{outcomes:?}");
    assert_found(&glass(0.9));
}

fn assert_found(outcomes: &[Outcome]) {
    let level = sidak(100);
    let missed: Vec<&Outcome> = outcomes.iter().filter(|(_, p)| *p > level).collect();
    assert!(missed.is_empty(), "not found: {missed:?}");
}

#[test]
fn companion_wrong_caps_and_discs_are_found() {
    assert_found(&cap(1.01));
    assert_found(&lens(1.9));
}

//! Lamps with a pole frame as a vertex sees them: half angle, projected solid angle and directions keep the
//! digits of the gap, whatever the radius.

use std::f64::consts::PI;

use crate::common::{probe, walled};
use glam::{DVec2, DVec3};
use gpu_trace::reference::light::aim::{Aim, aim_center, aim_pole, cone_height};
use gpu_trace::reference::light::projected::{cap_seen, sample_cap};
use gpu_trace::verify::{Agreement, Random, Row, ULP, to_row, vector};

const PROJECTED: [&str; 6] = ["baked", "pole", "emission", "lights", "projected", "mis"];

/// Vertices over walls of radius 1e3 to 1e8, 1e-6 to 10 above them and up to 10 from the pole.
fn walls(count: usize) -> Vec<([Row; 2], Aim, DVec3)> {
    let mut random = Random::new("walls");
    (0..count)
        .map(|_| {
            let (radius, gap) = (random.magnitude(3.0, 8.0), random.magnitude(-6.0, 1.0));
            let (rows, aim) = walled((radius, gap, random.range(0.0, 10.0)), &mut random);
            (rows, aim, random.direction().as_vec3().as_dvec3())
        })
        .collect()
}

/// By how much f32 may miss k C, the square of the cotangent of the half angle: three roundings in each of
/// the products that C is the sum of.
fn rounding_of_the_gap([x, _]: &[Row; 2]) -> f64 {
    let (k, x) = (f64::from(x[3]), vector(*x).length());
    6.0 * ULP * k * x * (2.0 + k * x)
}

#[test]
fn a_wall_is_a_sphere() {
    // Both frames in f64, where the centre has digits enough.
    let mut random = Random::new("frames");
    for _ in 0..10_000 {
        let (radius, gap) = (random.magnitude(0.0, 3.0), random.magnitude(-3.0, 1.0));
        let pole = random.direction();
        let x = radius * (random.direction() - pole) * random.unit().sqrt() + gap * pole;
        let (a, b) = (
            aim_pole(x, pole, 1.0 / radius),
            aim_center(radius * pole + x, radius),
        );
        assert_eq!(a.outside, b.outside);
        if !a.outside {
            continue;
        }
        let off = [
            (a.axis - b.axis).length(),
            a.distance / b.distance - 1.0,
            a.sine - b.sine,
            // In f64, gaps of 1e-3 to 1000 radii.
            (a.rim - b.rim) * b.rim,
        ];
        assert!(off.iter().all(|o| o.abs() < 1.0e-12), "{a:?} {b:?}");
    }
}

#[test]
fn walls_keep_the_digits_of_their_gap() {
    let walls = walls(100_000);
    let inputs: Vec<[Row; 2]> = walls.iter().map(|(rows, ..)| *rows).collect();
    let outputs: Vec<[Row; 2]> = probe(&PROJECTED)
        .call("aim_at", &inputs)
        .expect("the probe runs");
    let (mut axes, mut rims) = (Agreement::default(), Agreement::default());
    let mut centered = Agreement::default();
    for ((rows, aim, _), [a, b]) in walls.iter().zip(&outputs) {
        let place = || format!("{rows:?}: {aim:?}");
        let off = (vector(*a) - aim.axis).length();
        axes.add(off, 8.0 * ULP, place);
        axes.add(
            (f64::from(a[3]) / aim.distance - 1.0).abs(),
            12.0 * ULP,
            place,
        );
        axes.add((f64::from(b[0]) / aim.sine - 1.0).abs(), 8.0 * ULP, place);
        let rounding = rounding_of_the_gap(rows);
        if aim.rim * aim.rim < rounding {
            continue;
        }
        assert!(b[2] == 1.0, "{}", place());
        let tolerance = rounding / aim.rim + 6.0 * ULP * aim.rim;
        rims.add((f64::from(b[1]) - aim.rim).abs(), tolerance, place);
        let height = f64::from(b[3]) - cone_height(aim);
        rims.add(height.abs(), tolerance + 8.0 * ULP, place);
        // Companion: from the centre, in f32.
        let radius = 1.0 / rows[0][3];
        let v = (vector(rows[0]) + f64::from(radius) * vector(rows[1])).as_vec3();
        let rim = (1.0 - radius * radius / v.dot(v)).max(0.0).sqrt();
        centered.add((f64::from(rim) - aim.rim).abs(), tolerance, place);
    }
    axes.assert_holds(300_000);
    rims.assert_holds(150_000);
    centered.assert_fails();
}

#[test]
fn walls_agree_on_both_backends() {
    let walls = walls(100_000);
    let areas: Vec<[Row; 3]> = walls
        .iter()
        .map(|([x, pole], _, normal)| [*x, *pole, to_row(*normal, 0.0)])
        .collect();
    let probe = probe(&PROJECTED);
    let outputs: Vec<Row> = probe.call("cap_seen", &areas).expect("the probe runs");
    let (mut areas, mut companion) = (Agreement::default(), Agreement::default());
    for ((rows, aim, normal), output) in walls.iter().zip(&outputs) {
        let rounding = rounding_of_the_gap(rows);
        if aim.rim * aim.rim < rounding {
            continue;
        }
        let cap = cap_seen(aim, *normal);
        // The area's derivatives to the cosines of half angle and tilt are at most 2 pi.
        let tolerance =
            2.0 * PI * (rounding / aim.rim + 6.0 * ULP) + 24.0 * ULP * (cap.area + cap.segment);
        let place = || format!("{rows:?} {normal}: {cap:?}");
        areas.add((f64::from(output[0]) - cap.area).abs(), tolerance, place);
        companion.add(
            (f64::from(output[0]) - 1.01 * cap.area).abs(),
            tolerance,
            place,
        );
    }
    areas.assert_holds(70_000);
    companion.assert_fails();

    let mut random = Random::new("wall directions");
    let inputs: Vec<[Row; 4]> = walls
        .iter()
        .filter(|(rows, aim, normal)| {
            aim.rim * aim.rim > rounding_of_the_gap(rows) && cap_seen(aim, *normal).area > 1.0e-3
        })
        .map(|([x, pole], _, normal)| [*x, *pole, to_row(*normal, 0.0), random.unit4()])
        .collect();
    let outputs: Vec<Row> = probe.call("sample_cap", &inputs).expect("the probe runs");
    let mut off = Vec::new();
    for ([x, pole, normal, u], output) in inputs.iter().zip(&outputs) {
        let aim = aim_pole(vector(*x), vector(*pole), f64::from(x[3]));
        let normal = vector(*normal);
        let u = DVec2::new(f64::from(u[0]), f64::from(u[1]));
        let (direction, _) = sample_cap(&cap_seen(&aim, normal), normal, u);
        let d = vector(*output);
        assert!(d.is_finite() && output[3] > 0.0, "{aim:?}: {output:?}");
        off.push((d - direction).length());
    }
    assert!(off.len() > 40_000);
    off.sort_by(f64::total_cmp);
    let at = |share: f64| off[(share * (off.len() - 1) as f64) as usize];
    eprintln!("{:e} {:e} {:e} {:e}", at(0.5), at(0.99), at(0.999), at(1.0));
    assert!(at(0.5) < 4.0 * ULP && at(0.99) < 1.0e-4 && at(1.0) < 4.0e-3);
}

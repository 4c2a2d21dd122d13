//! Light sampling by projected solid angle: areas against the closed form, a quadrature and the twin,
//! directions by chi-square tests in every position of a light to the horizon.

use std::f64::consts::PI;

use crate::common::{Wall, probe, walled};
use glam::{DVec2, DVec3};
use gpu_trace::reference::light::aim::{Aim, aim_center};
use gpu_trace::reference::light::projected::{
    Cap, cap_seen, sample_cap, segment_area, segment_point,
};
use gpu_trace::statistics::{chi_square, mean_and_error, normal_limit, sidak};
use gpu_trace::verify::{Agreement, Random, Row, ULP, to_row, vector};

const PROJECTED: [&str; 6] = ["baked", "pole", "emission", "lights", "projected", "mis"];

/// A light: the cosine of its tilt and the sine of its half angle.
type Place = (f64, f64);

/// Above the horizon, touching it, across it on either side, nearly below, almost touching the vertex,
/// filling the hemisphere, far.
const PLACES: [Place; 16] = [
    (1.0, 0.5),
    (0.9, 0.3),
    (0.31, 0.3),
    (0.299, 0.3),
    (0.1, 0.3),
    (0.0, 0.3),
    (-0.1, 0.3),
    (-0.27, 0.3),
    (0.5, 0.9),
    (0.2, 0.999),
    (-0.6, 0.999),
    (0.97, 0.999_999),
    (0.5, 1.0e-3),
    (5.0e-4, 1.0e-3),
    (-5.0e-4, 1.0e-3),
    (0.7, 1.0e-5),
];

/// With the cosine of the angle from the vertex's normal to the centre: facing the wall, across the horizon on
/// either side, facing away, at it, far; of any radius.
const WALLS: [(Wall, f64); 9] = [
    ((1.0e3, 2.0, 1.0), 1.0),
    ((1.0e3, 2.0, 3.0), 0.99),
    ((1.0e3, 1.0e-3, 0.5), 0.3),
    ((1.0e4, 10.0, 5.0), 0.7),
    ((1.0e5, 1.0e-6, 1.0), 0.9),
    ((1.0e6, 1.0e-2, 2.0), -0.9),
    ((1.0e8, 1.0, 1.0), 0.0),
    ((1.0e8, 1.0e-6, 0.0), -0.5),
    ((100.0, 10.0, 2.0), -0.2),
];

/// A normal at this angle to `axis`, rounded to f32.
fn tilted(axis: DVec3, cosine: f64, random: &mut Random) -> DVec3 {
    let across = axis.any_orthonormal_vector();
    let turn = random.range(0.0, 2.0 * PI);
    let across = turn.cos() * across + turn.sin() * axis.cross(across);
    let normal = cosine * axis + (1.0 - cosine * cosine).sqrt() * across;
    normal.as_vec3().as_dvec3()
}

/// Normal and vector to the centre of a light of radius 1, turned at random and rounded to f32.
fn placed(place: Place, random: &mut Random) -> (DVec3, DVec3) {
    let (c, s) = place;
    let normal = random.direction();
    let across = normal.any_orthonormal_vector();
    let turn = random.range(0.0, 2.0 * PI);
    let across = turn.cos() * across + turn.sin() * normal.cross(across);
    let w = (c * normal + (1.0 - c * c).sqrt() * across) / s;
    let rounded = |v: DVec3| v.as_vec3().as_dvec3();
    (rounded(normal), rounded(w))
}

fn seen(w: DVec3, normal: DVec3) -> Cap {
    cap_seen(&aim_center(-w, 1.0), normal)
}

/// A light of radius 1 as the probes take it.
fn rows(w: DVec3) -> [Row; 2] {
    [to_row(-w, 1.0), [0.0; 4]]
}

fn random_place(random: &mut Random) -> Place {
    let s = match random.range(0.0, 3.0) as u32 {
        0 => random.magnitude(-8.0, -1.0),
        1 => random.range(0.1, 0.999),
        // Distances of 1 + e radii.
        _ => 1.0 / (1.0 + random.magnitude(-5.0, 0.0)),
    };
    let c = if random.unit() < 0.7 {
        // Across the horizon, or not far from it.
        random.range(-1.0, 1.5) * s
    } else {
        random.range(-1.0, 1.0)
    };
    // Straight above, a tilt has no direction.
    (c.min(0.999), s)
}

#[test]
fn segments_keep_their_digits() {
    let mut random = Random::new("segments");
    let probe = probe(&PROJECTED);
    let angles: Vec<f64> = (0..100_000)
        .map(|i| match i % 2 {
            0 => random.range(0.0, PI),
            _ => random.magnitude(-8.0, -0.3),
        })
        .collect();
    let inputs: Vec<Row> = angles
        .iter()
        .map(|h| [h.cos() as f32, h.sin() as f32, 0.0, 0.0])
        .collect();
    let outputs: Vec<Row> = probe.call("segment_area", &inputs).expect("the probe runs");
    let (mut areas, mut naive) = (Agreement::default(), Agreement::default());
    for (h, (input, output)) in angles.iter().zip(inputs.iter().zip(&outputs)) {
        let p = DVec2::new(f64::from(input[0]), f64::from(input[1]));
        let angle = p.y.atan2(p.x);
        areas.add(
            (f64::from(output[0]) / angle - 1.0).abs(),
            4.0 * ULP,
            || format!("angle {h}"),
        );
        // From 30 degrees on by a difference: six times as large as its result there.
        let truth = segment_area(p);
        let error = (f64::from(output[1]) / truth - 1.0).abs();
        areas.add(error, 16.0 * ULP, || format!("area {h}"));
        let textbook = f64::from(output[0] - input[0] * input[1]);
        if *h < 1.0e-2 {
            naive.add((textbook / truth - 1.0).abs(), 16.0 * ULP, || {
                format!("{h}")
            });
        }
    }
    areas.assert_holds(200_000);
    naive.assert_fails();
}

#[test]
fn segments_are_inverted() {
    let mut random = Random::new("inverse");
    let inputs: Vec<Row> = (0..100_000)
        .map(|i| {
            let area = match i % 2 {
                0 => random.range(0.0, 3.1),
                _ => random.magnitude(-24.0, 0.0),
            };
            [area as f32, 0.0, 0.0, 0.0]
        })
        .collect();
    let outputs: Vec<Row> = probe(&PROJECTED)
        .call("segment_point", &inputs)
        .expect("the probe runs");
    let (mut points, mut companion) = (Agreement::default(), Agreement::default());
    for (input, output) in inputs.iter().zip(&outputs) {
        let area = f64::from(input[0]);
        let truth = segment_point(area);
        // The twin's own equation.
        let back = segment_area(truth);
        assert!(
            (back - area).abs() <= 1.0e-12 * area.max(1.0e-3 * area),
            "{area}: {back}"
        );
        // The fit is within 4e-7 of the angle, the polynomials are within 6e-7.
        let (cos, sin) = (f64::from(output[0]), f64::from(output[1]));
        // Towards the whole disc, pi - area is known to a rounding of pi.
        let tolerance = 1.5e-6 + 2.0 * ULP / truth.y.powi(2);
        let off = (cos - truth.x).abs().max((sin - truth.y).abs());
        if area > 1.0 {
            points.add(off, tolerance, || format!("{area:e}"));
        }
        let relative = (sin / truth.y - 1.0).abs();
        if area < 1.5 {
            points.add(relative, 1.5e-6, || format!("{area:e}"));
        }
        companion.add(
            (sin / (truth.y * 1.000_01) - 1.0).abs(),
            1.5e-6,
            String::new,
        );
    }
    points.assert_holds(100_000);
    companion.assert_fails();
}

/// Irradiance over radiance of a sphere light: Snyder's closed form, as in Peters and Dachsbacher.
fn irradiance((c, s): Place) -> f64 {
    if c >= s {
        return PI * s * s * c;
    }
    if c <= -s {
        return 0.0;
    }
    let (x, sin) = ((1.0 / (s * s) - 1.0).sqrt(), (1.0 - c * c).sqrt());
    let y = -x * c / sin;
    let w = sin * (1.0 - y * y).sqrt();
    s * s * (c * y.acos() - x * w) + (w / x).atan()
}

#[test]
fn areas_are_those_of_the_closed_form() {
    let mut random = Random::new("areas");
    for _ in 0..10_000 {
        let s = random.range(0.05, 0.99);
        let place = (random.range(-1.0, 1.0), s);
        let (normal, w) = placed(place, &mut random);
        let (c, s) = (normal.normalize().dot(w) / w.length(), 1.0 / w.length());
        let area = seen(w, normal.normalize()).area;
        let truth = irradiance((c, s));
        assert!((area - truth).abs() < 1.0e-9, "{c} {s}: {area} for {truth}");
    }
}

#[test]
fn areas_agree_on_both_backends() {
    let mut random = Random::new("areas");
    let cases: Vec<(DVec3, DVec3)> = (0..100_000)
        .map(|_| {
            let place = random_place(&mut random);
            placed(place, &mut random)
        })
        .collect();
    let row = |(normal, w): &(DVec3, DVec3)| (rows(*w), to_row(*normal, 0.0));
    let inputs: Vec<[Row; 3]> = cases
        .iter()
        .map(row)
        .map(|([x, pole], normal)| [x, pole, normal])
        .collect();
    let outputs: Vec<Row> = probe(&PROJECTED)
        .call("cap_seen", &inputs)
        .expect("the probe runs");
    let (mut areas, mut companion) = (Agreement::default(), Agreement::default());
    for ((normal, w), output) in cases.iter().zip(&outputs) {
        let cap = seen(*w, *normal);
        // What roundings of the cosine and of the distance do to the area, in f64.
        let moved = |by: f64| {
            [
                seen(*w * (1.0 + by), *normal).area,
                seen(*w, *normal + by * w.normalize()).area,
            ]
        };
        let slope = [moved(6.0 * ULP), moved(-6.0 * ULP)]
            .as_flattened()
            .iter()
            .map(|a| (a - cap.area).abs())
            .sum::<f64>();
        // Below the horizon, the ellipse's segment is taken from the disc's.
        let tolerance = 24.0 * ULP * (cap.area + cap.segment) + slope;
        let place = || format!("{cap:?}");
        let error = (f64::from(output[0]) - cap.area).abs();
        areas.add(error, tolerance.max(1.0e-30), place);
        if cap.area > 1.0e-3 {
            let error = (f64::from(output[0]) - 1.001 * cap.area).abs();
            companion.add(error, tolerance, place);
        }
    }
    areas.assert_holds(100_000);
    companion.assert_fails();
}

/// Cells along a side.
const SIDE: usize = 16;

/// The part of the tangent disc that a cap covers, in cells of its bounding box.
struct Cells {
    low: DVec2,
    size: DVec2,
    /// Of a sample to fall into each.
    probabilities: Vec<f64>,
    /// The area of the part, by quadrature.
    area: f64,
}

impl Cells {
    /// By the definition: the points of a row that, lifted to the sphere, are in the cap are an
    /// interval. Rows of a light whose centre is below the horizon have the probability that they have
    /// in the disc's segment.
    fn new(cap: &Cap) -> Self {
        const ROWS: usize = 256;
        let (c, s) = (cap.cosine, cap.aim.sine);
        let sin_t = (1.0 - c * c).max(0.0).sqrt();
        let g = sin_t * cap.aim.rim;
        // Below the horizon, the leftmost points are those where the rim meets it.
        let low_x = if c < 0.0 { cap.horizon.x } else { g - s * c };
        let high_x = if c >= s { g + s * c } else { 1.0 };
        let half = if c <= 0.0 { cap.horizon.y } else { s };
        let low = DVec2::new(low_x, -half);
        let size = DVec2::new(high_x - low_x, 2.0 * half) / SIDE as f64;
        let mut probabilities = vec![0.0; SIDE * SIDE];
        let mut area = 0.0;
        for row in 0..SIDE * ROWS {
            let y = low.y + (row as f64 + 0.5) / ROWS as f64 * size.y;
            let horizon = (1.0 - y * y).sqrt();
            let inside = |x: f64| {
                let square = (horizon - x) * (horizon + x);
                square >= 0.0 && sin_t * x + c * square.sqrt() >= cap.aim.rim
            };
            let middle = if c > 0.0 { g } else { horizon };
            let end = |mut out: f64| {
                let mut within = middle;
                for _ in 0..60 {
                    let half = 0.5 * (within + out);
                    *(if inside(half) { &mut within } else { &mut out }) = half;
                }
                within
            };
            let (left, right) = (end(low_x), end(high_x));
            area += (right - left) * size.y / ROWS as f64;
            let weight = if c < 0.0 {
                (horizon - cap.horizon.x) / (right - left)
            } else {
                1.0
            };
            for cell in 0..SIDE {
                let from = low_x + cell as f64 * size.x;
                let part = right.min(from + size.x) - left.max(from);
                probabilities[row / ROWS * SIDE + cell] += weight * part.max(0.0);
            }
        }
        let total: f64 = probabilities.iter().sum();
        for p in &mut probabilities {
            *p /= total;
        }
        Self {
            low,
            size,
            probabilities,
            area,
        }
    }

    fn counts(&self, points: impl Iterator<Item = DVec2>) -> Vec<u64> {
        let mut counts = vec![0; SIDE * SIDE];
        for p in points {
            let cell = ((p - self.low) / self.size).clamp(DVec2::ZERO, DVec2::splat(15.5));
            counts[cell.y as usize * SIDE + cell.x as usize] += 1;
        }
        counts
    }
}

#[test]
fn directions_have_their_pdf() {
    let mut random = Random::new("projected");
    let probe = probe(&PROJECTED);
    let mut p_values = Vec::new();
    let mut means = Vec::new();
    let mut lights: Vec<(String, [Row; 2], Aim, DVec3)> = Vec::new();
    for place in PLACES {
        let (normal, w) = placed(place, &mut random);
        lights.push((format!("{place:?}"), rows(w), aim_center(-w, 1.0), normal));
    }
    for (wall, cosine) in WALLS {
        let (rows, aim) = walled(wall, &mut random);
        let normal = tilted(aim.axis, cosine, &mut random);
        lights.push((format!("wall {wall:?}, {cosine}"), rows, aim, normal));
    }
    for (place, [x, pole], aim, normal) in lights {
        let inputs: Vec<[Row; 4]> = (0..100_000)
            .map(|_| [x, pole, to_row(normal, 0.0), random.unit4()])
            .collect();
        let outputs: Vec<Row> = probe.call("sample_cap", &inputs).expect("the probe runs");
        let normal = normal.normalize();
        let cap = cap_seen(&aim, normal);
        let axis = aim.axis;
        let tilt = axis - axis.dot(normal) * normal;
        // Straight above, it is rounding.
        let along = if tilt.length() > 1.0e-6 {
            tilt.normalize()
        } else {
            normal.any_orthonormal_vector()
        };
        let across = normal.cross(along);
        for (input, output) in inputs.iter().zip(&outputs) {
            let d = vector(*output);
            // f32 knows a direction to its roundings, as an angle; at the horizon as a square.
            let rounding = 16.0 * ULP;
            assert!((d.length() - 1.0).abs() < rounding, "{place}: {d}");
            let angle = axis.cross(d).length().atan2(axis.dot(d));
            let most =
                cap.aim.sine.atan2(cap.aim.rim) + rounding + rounding.sqrt() * cap.aim.sine.powi(4);
            assert!(angle <= most, "{place}: {angle} > {most} for {input:?}");
            assert!(d.dot(normal) >= -rounding, "{place}: {d}");
        }
        // Where f32 cannot resolve the cells there is nothing to count.
        let cells = Cells::new(&cap);
        if cells.size.min_element() > 100.0 * ULP {
            let points = outputs.iter().map(|o| vector(*o));
            let points = points.map(|d| DVec2::new(d.dot(along), d.dot(across)));
            let counts = cells.counts(points.clone());
            let p = chi_square(&counts, &cells.probabilities).p;
            p_values.push(p);
            // Companion: points 3 % farther from the middle of the cap.
            let middle = points.clone().sum::<DVec2>() / outputs.len() as f64;
            let counts = cells.counts(points.map(|p| middle + 1.03 * (p - middle)));
            assert!(
                chi_square(&counts, &cells.probabilities).p < 1.0e-6,
                "{place}"
            );
            let error = (cells.area / cap.area - 1.0).abs();
            assert!(error < 2.0e-3, "{place}: area off by {error}");
        }
        // pdf = cos/extent: the mean of the extents is the area, without variance if the centre is above.
        let extents: Vec<f64> = outputs.iter().map(|o| f64::from(o[3])).collect();
        let (mean, error) = mean_and_error(&extents);
        let c = cap.cosine;
        // At the horizon itself a driver's rounding decides on which side the centre is.
        if c > 16.0 * ULP {
            let same = extents.iter().all(|e| *e == extents[0]);
            assert!(same, "{place}: the extent varies");
        } else if c > -16.0 * ULP {
            let near = |e: &f64| (e / cap.area - 1.0).abs() < 1.0e-3;
            assert!(extents.iter().all(near), "{place}: the extent is no area");
        } else {
            assert!(
                error * (extents.len() as f64).sqrt() < 0.28 * mean,
                "{place}"
            );
            // Over a half space the rest is the same share of every row: there is no variance either, and
            // what is left is rounding.
            let excess = ((mean - cap.area).abs() - 16.0 * ULP * cap.area).max(0.0);
            means.push(excess / error);
        }
    }
    let limit = sidak(p_values.len());
    eprintln!("{p_values:?}\n{means:?}");
    assert!(p_values.len() >= 22 && p_values.iter().all(|p| *p > limit));
    let most = normal_limit(means.len());
    assert!(means.iter().all(|z| *z < most), "{means:?}");
}

#[test]
fn directions_agree_on_both_backends() {
    let mut random = Random::new("directions");
    let inputs: Vec<[Row; 4]> = (0..100_000)
        .filter_map(|_| {
            let place = random_place(&mut random);
            let (normal, w) = placed(place, &mut random);
            let [x, pole] = rows(w);
            let area = seen(w, normal).area;
            (area > 1.0e-12).then(|| [x, pole, to_row(normal, 0.0), random.unit4()])
        })
        .collect();
    let outputs: Vec<Row> = probe(&PROJECTED)
        .call("sample_cap", &inputs)
        .expect("the probe runs");
    let mut off = Vec::new();
    for (input, output) in inputs.iter().zip(&outputs) {
        let (w, normal) = (-vector(input[0]), vector(input[2]));
        let u = DVec2::new(f64::from(input[3][0]), f64::from(input[3][1]));
        let (direction, _) = sample_cap(&seen(w, normal), normal, u);
        let d = vector(*output);
        assert!(d.is_finite() && output[3] > 0.0, "{input:?}: {output:?}");
        off.push((d - direction).length());
    }
    assert!(off.len() > 40_000);
    off.sort_by(f64::total_cmp);
    let at = |share: f64| off[(share * (off.len() - 1) as f64) as usize];
    eprintln!("{:e} {:e} {:e} {:e}", at(0.5), at(0.99), at(0.999), at(1.0));
    // At the horizon a height is the root of a rounding.
    assert!(at(0.5) < 4.0 * ULP && at(0.99) < 1.0e-4 && at(1.0) < 4.0e-3);
}

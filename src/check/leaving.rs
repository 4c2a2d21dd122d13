//! Cases 4, 7 and 8: rays that are within a sphere or leave it, by the kernel's own way to its surface and off it.

use glam::DVec3;

use super::Case;
use super::context::Context;
use super::intersection::{NO_HIT, ray, ulp};
use crate::effects::Effect;
use crate::error::Result;
use crate::materials::dielectric::Dielectric;
use crate::reference::scene::sphere::{
    pole_quadratic, root_interior, root_outside, sphere_quadratic,
};
use crate::verify::{Measure, Random, Row, ULP, to_row, vector};

pub(super) const CASES: &[Case] = &[
    Case {
        id: 4,
        name: "a tiny sphere, left and crossed",
        setup: "radius 1e-8 to 1e-3: a leaving ray does not hit it again, one that goes inside \
                comes to the far side after the chord, to 1e-6 r",
        run: tiny,
    },
    Case {
        id: 7,
        name: "from inside",
        setup: "from the exact centre, from 1 ulp within the wall and between, radius 1e-4 to \
                1e4: distance in units of 8 ulp(R) (1 + R/s)",
        run: inside,
    },
    Case {
        id: 8,
        name: "leaving rays do not return",
        setup: "radius 1e-4 to 1e4 and, by their poles, 1e4 to 1e8: leaving rays, n.d = 0 and \
                +-1e-8 among them, must not hit the sphere that they are on",
        run: reintersect,
    },
];

/// Rows of `probe_bounce` for a ray from `from` in the frame of a sphere, about its centre or with
/// a pole; the next direction is filled in later.
pub(super) fn bounce_rows(
    from: DVec3,
    inside: bool,
    d: DVec3,
    radius: f64,
    pole: Option<DVec3>,
) -> [Row; 6] {
    let frame_radius = if pole.is_some() { 0.0 } else { radius };
    [
        to_row(DVec3::ZERO, f64::from(u8::from(inside))),
        to_row(from, 0.0),
        to_row(d, 1.0 / radius),
        to_row(DVec3::ZERO, frame_radius),
        to_row(pole.unwrap_or_default(), 0.0),
        [0.0; 4],
    ]
}

/// Paths that hit a sphere, go on and meet it again or not.
pub(super) fn bounce(context: &Context, inputs: &[[Row; 6]]) -> Result<Vec<[Row; 3]>> {
    let glass = Effect::of_material(Dielectric::smooth(1.5));
    let probe = context.probe(&[glass, Effect::Interior, Effect::Pole])?;
    probe.call("bounce", inputs)
}

/// Outward normal where the ray of `rows` first hits, by the twin; `None` for a miss.
pub(super) fn normal_at_hit(rows: &[Row; 6], inside: bool) -> Option<DVec3> {
    let (x, d) = (vector(rows[1]), vector(rows[2]));
    let curvature = f64::from(rows[2][3]);
    let pole = (rows[3][3] == 0.0).then(|| vector(rows[4]));
    let q = match pole {
        Some(n) => pole_quadratic(x, d, n, curvature),
        None => sphere_quadratic(x, d, f64::from(rows[3][3])),
    };
    let t = if inside {
        root_interior(&q, false)
    } else {
        root_outside(&q, false)?
    };
    let hit = x + t * d;
    Some((pole.unwrap_or_default() + curvature * hit).normalize())
}

/// A direction on the side of `n`, one in four of them grazing.
pub(super) fn leaving(random: &mut Random, n: DVec3, i: usize) -> DVec3 {
    let tangent = n.cross(random.direction()).normalize();
    match i % 16 {
        0 => tangent,
        4 => tangent + 1.0e-8 * n,
        8 => tangent - 1.0e-8 * n,
        12 => (tangent + 1.0e-3 * random.unit() * n).normalize(),
        _ => {
            let d = random.direction();
            if d.dot(n) < 0.0 { -d } else { d }
        }
    }
}

fn tiny(context: &Context) -> Result<Measure> {
    let mut random = Random::new("tiny");
    let mut inputs: Vec<[Row; 6]> = Vec::new();
    for i in 0..context.size(50_000, 500_000) {
        let radius = f64::from(random.magnitude(-8.0, -3.0) as f32);
        let distance = radius * random.range(1.5, 4.0);
        let impact = 0.98 * radius * random.unit().sqrt();
        let (from, d) = ray(&mut random, distance, impact);
        let mut rows = bounce_rows(from, false, d, radius, None);
        let Some(n) = normal_at_hit(&rows, false) else {
            continue;
        };
        let crossed = i % 2 == 1;
        let next = leaving(&mut random, n, if crossed { 1 } else { i });
        rows[5] = to_row(
            if crossed { -next } else { next },
            f64::from(u8::from(crossed)),
        );
        inputs.push(rows);
    }
    let outputs = bounce(context, &inputs)?;
    let mut measure = Measure::new(1.0e-6, "of the radius");
    for (rows, [t, offset, _]) in inputs.iter().zip(&outputs) {
        let radius = f64::from(rows[3][3]);
        let (next, again) = (vector(rows[5]), f64::from(t[1]));
        let error = if rows[5][3] == 0.0 {
            // Not hit again; how far away it would have been does not matter.
            if again == NO_HIT { 0.0 } else { f64::INFINITY }
        } else {
            let n = vector(*offset).normalize();
            let chord = -2.0 * radius * n.dot(next) / next.length_squared();
            (again - chord * context.disturbed(1.0e-4)).abs() * next.length() / radius
        };
        measure.add(error, || {
            format!(
                "radius {radius:e}, crossed {}: next hit at {again:e}",
                rows[5][3]
            )
        });
    }
    Ok(measure)
}

fn reintersect(context: &Context) -> Result<Measure> {
    let mut random = Random::new("reintersect");
    let mut inputs: Vec<[Row; 6]> = Vec::new();
    for i in 0..context.size(100_000, 1_000_000) {
        let mut rows = if i % 2 == 0 {
            let radius = random.magnitude(-4.0, 4.0);
            let distance = radius * random.range(1.1, 10.0);
            let impact = radius * random.unit().sqrt();
            let (from, d) = ray(&mut random, distance, impact);
            bounce_rows(from, false, d, radius, None)
        } else {
            let (n, radius) = (random.direction(), random.magnitude(4.0, 8.0));
            let across = random.range(-4.0, 4.0) * n.any_orthonormal_vector();
            let d = random.direction();
            let d = if d.dot(n) > 0.0 { -d } else { d };
            bounce_rows(random.unit() * n + across, false, d, radius, Some(n))
        };
        let Some(n) = normal_at_hit(&rows, false) else {
            continue;
        };
        let next = leaving(&mut random, n, i / 2);
        // The disturbance: one in a hundred goes inside, and must be seen to come back.
        let crossed = context.options.disturb && i % 100 == 0;
        rows[5] = to_row(
            if crossed { -next } else { next },
            f64::from(u8::from(crossed)),
        );
        inputs.push(rows);
    }
    let outputs = bounce(context, &inputs)?;
    let mut measure = Measure::new(0.0, "rays that return");
    for (rows, [t, ..]) in inputs.iter().zip(&outputs) {
        // What f32 took for a miss has no surface to leave.
        if f64::from(t[0]) == NO_HIT {
            continue;
        }
        let again = f64::from(t[1]);
        measure.count(1, u64::from(again != NO_HIT), || {
            let radius = 1.0 / f64::from(rows[2][3]);
            format!("radius {radius:e}: hit again at {again:e}")
        });
    }
    Ok(measure)
}

fn inside(context: &Context) -> Result<Measure> {
    let mut random = Random::new("inside");
    let inputs: Vec<[Row; 6]> = (0..context.size(50_000, 500_000))
        .map(|i| {
            let radius = f64::from(random.magnitude(-4.0, 4.0) as f32);
            let share = match i % 3 {
                0 => 0.0,
                1 => 1.0 - 2.0 * ULP,
                _ => random.unit(),
            };
            let from = share * radius * random.direction();
            bounce_rows(from, true, random.direction(), radius, None)
        })
        .collect();
    let outputs = bounce(context, &inputs)?;
    let mut measure = Measure::new(1.0, "of the bound");
    for (rows, [t, ..]) in inputs.iter().zip(&outputs) {
        let radius = f64::from(rows[3][3]) * context.disturbed(1.0e-4);
        let q = sphere_quadratic(vector(rows[1]), vector(rows[2]), radius);
        let truth = root_interior(&q, false);
        let s = q.square.max(0.0).sqrt();
        let bound = 8.0 * ulp(radius) * (1.0 + radius / s);
        let t = f64::from(t[0]);
        measure.add((t - truth).abs() / bound, || {
            let at = vector(rows[1]).length() / radius;
            format!("from {at} of radius {radius:e}: t = {t:e} for {truth:e}")
        });
    }
    Ok(measure)
}

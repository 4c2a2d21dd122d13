//! Case 41: spheres that move, with the kernel's own functions.

use glam::DVec3;

use super::Case;
use super::context::Context;
use super::intersection::{NO_HIT, ray, ulp};
use super::leaving::{bounce_rows, leaving, normal_at_hit};
use crate::bvh::{Options, Tree};
use crate::effects::{Effect, Effects};
use crate::error::Result;
use crate::gpu::probe::Probe;
use crate::materials::dielectric::Dielectric;
use crate::materials::diffuse::Diffuse;
use crate::placement::{Placement, Side};
use crate::reference::scene::sphere::{root_outside, sphere_quadratic};
use crate::verify::{
    Crowd, EMPTY, HitRow, Measure, Random, RayRows, Row, ULP, crowds, to_row, vector,
};

pub(super) const CASES: &[Case] = &[Case {
    id: 41,
    name: "spheres that move",
    setup: "radius 1e-3 to 1, ways to 1000 radii, from another sphere that moves: distance in units of 8 ulp(D) and \
            what rounding does to the ways, times (1 + b/sqrt(R^2 - b^2)); left and crossed as at rest (case 4); bits \
            as at rest where both move alike; crowds that move, by the tree as by a loop",
    run,
}];

/// The effects of the probes at rest.
fn glass() -> [Effect; 3] {
    [
        Effect::of_material(Diffuse { albedo: DVec3::ONE }),
        Effect::of_material(Dielectric::smooth(1.5)),
        Effect::Interior,
    ]
}

fn run(context: &Context) -> Result<Measure> {
    let mut measure = Measure::new(1.0, "of the bound");
    one_by_one(context, &mut measure)?;
    in_crowds(context, &mut measure)?;
    Ok(measure)
}

/// Rows of `probe_bounce`.
type Rows = [Row; 8];

/// f32 numbers.
fn rounded(v: DVec3) -> DVec3 {
    v.as_vec3().as_dvec3()
}

/// A ray from the surface of one moving sphere to another; also where it starts from the other's centre, at rest.
fn moving(random: &mut Random, i: usize) -> Option<(Rows, DVec3)> {
    let radius = f64::from(random.magnitude(-3.0, 0.0) as f32);
    let distance = radius * random.range(1.5, 20.0);
    let impact = 0.9 * radius * random.unit().sqrt();
    let (from, d) = ray(random, distance, impact);
    let [bent, _, frame_rows @ ..] = bounce_rows(from, false, d, radius, None);
    let way =
        |random: &mut Random| rounded(radius * random.magnitude(-2.0, 3.0) * random.direction());
    let (own, other) = (way(random), way(random));
    let time = f64::from((random.unit() - 0.5) as f32);
    let anchor = rounded(random.range(0.0, 4.0) * random.direction());
    let offset = rounded(radius * random.range(0.1, 3.0) * random.direction());
    // What f32 makes of the other's anchor moves it a little.
    let there = rounded(anchor + time * (own - other) + offset - from);
    let start = (anchor - there) + time * (own - other) + offset;
    let mut rows = [[0.0; 4]; 8];
    rows[0] = to_row(anchor, f64::from(bent[3]));
    rows[1] = to_row(offset, 0.0);
    rows[2..6].copy_from_slice(&frame_rows);
    rows[3] = to_row(there, radius);
    rows[6] = to_row(own, time);
    rows[7] = to_row(other, 0.0);
    // As seen from the other sphere.
    let at_rest = bounce_rows(start, false, vector(rows[2]), radius, None);
    let n = normal_at_hit(&at_rest, false)?;
    let crossed = i % 2 == 1;
    let next = leaving(random, n, if crossed { 1 } else { i });
    let sign = if crossed { -1.0 } else { 1.0 };
    rows[5] = to_row(sign * next, f64::from(u8::from(crossed)));
    Some((rows, start))
}

fn one_by_one(context: &Context, measure: &mut Measure) -> Result<()> {
    let mut random = Random::new("spheres that move");
    let count = context.size(20_000, 200_000);
    let cases: Vec<(Rows, DVec3)> = (0..count).filter_map(|i| moving(&mut random, i)).collect();
    let inputs: Vec<Rows> = cases.iter().map(|(rows, _)| *rows).collect();
    let probe = context.probe(&[&glass()[..], &[Effect::Motion]].concat())?;
    let outputs: Vec<[Row; 3]> = probe.call("bounce", &inputs)?;
    for ((rows, start), [t, offset, _]) in cases.iter().zip(&outputs) {
        let radius = f64::from(rows[3][3]);
        // The disturbance: the other sphere is elsewhere on its way.
        let late = context.disturbed(1.0e-2) - 1.0;
        let f = *start - late * vector(rows[7]);
        let d = vector(rows[2]);
        let impact = f.cross(d).length() / d.length();
        let q = sphere_quadratic(f, d, radius);
        // (anchor - anchor) and the sum with the way: each is rounded in the size of f, the offset and the way; the
        // difference of the ways and its product with the time, in that of the way; the last sum, in that of f.
        let (own, other) = (vector(rows[6]), vector(rows[7]));
        let way = f64::from(rows[6][3]).abs() * (own - other).length();
        let off = ULP * (3.0 * f.length() + 2.0 * vector(rows[1]).length() + 4.0 * way);
        let error = match root_outside(&q, false) {
            Some(truth) if impact + off < radius => {
                let slope = (impact + off) / (radius * radius - (impact + off).powi(2)).sqrt();
                let bound = (8.0 * ulp(f.length()) + off) * (1.0 + slope);
                (f64::from(t[0]) - truth).abs() / bound
            }
            // f32 may say either.
            _ if impact - off < radius => 0.0,
            _ if f64::from(t[0]) == NO_HIT => 0.0,
            _ => f64::INFINITY,
        };
        measure.add(error, || {
            format!("radius {radius:e}, way {way:e}: t = {:e}", t[0])
        });
        if f64::from(t[0]) == NO_HIT {
            continue;
        }
        let (next, again) = (vector(rows[5]), f64::from(t[1]));
        let error = if rows[5][3] == 0.0 {
            if again == NO_HIT { 0.0 } else { f64::INFINITY }
        } else {
            let n = vector(*offset).normalize();
            let chord = -2.0 * radius * n.dot(next) / next.length_squared();
            (again - chord * context.disturbed(1.0e-4)).abs() * next.length() / (1.0e-6 * radius)
        };
        measure.add(error, || {
            format!("radius {radius:e}, way {way:e}: next hit at {again:e}")
        });
    }
    // Both alike, and at rest.
    let alike = |motion: fn(&Rows) -> Row| -> Vec<Rows> {
        let change = |rows: &Rows| {
            let mut rows = *rows;
            let time = rows[6][3];
            rows[6] = motion(&rows);
            rows[7] = rows[6];
            rows[6][3] = time;
            rows
        };
        inputs.iter().map(change).collect()
    };
    let together: Vec<[Row; 3]> = probe.call("bounce", &alike(|rows| rows[7]))?;
    let still = context.probe(&glass())?;
    let still: Vec<[Row; 3]> = still.call("bounce", &alike(|_| [0.0; 4]))?;
    for (rows, (a, b)) in inputs.iter().zip(together.iter().zip(&still)) {
        let same = a.as_flattened().iter().zip(b.as_flattened());
        let same = same.into_iter().all(|(a, b)| a.to_bits() == b.to_bits());
        measure.add(if same { 0.0 } else { f64::INFINITY }, || {
            format!("together: {rows:?}: {a:?} for {b:?}")
        });
    }
    Ok(())
}

/// Ways of the spheres of a crowd: one that all have, and one of its own for each but every fourth.
fn ways(crowd: &Crowd, random: &mut Random) -> Vec<DVec3> {
    let farthest = crowd
        .balls
        .iter()
        .map(|(center, radius)| f64::from(center.length() + radius));
    let extent = farthest.fold(0.0, f64::max);
    let common = extent * random.magnitude(-2.0, 0.0) * random.direction();
    let own = crowd.balls.iter().enumerate().map(|(i, (_, radius))| {
        let own = f64::from(*radius) * random.magnitude(-2.0, 0.5) * random.direction();
        rounded(if i % 4 == 0 { common } else { common + own })
    });
    own.collect()
}

fn in_crowds(context: &Context, measure: &mut Measure) -> Result<()> {
    let scene = context.scene(EMPTY)?;
    let mut random = Random::new("rays at crowds that move");
    for crowd in crowds(context.size(200, 1000)) {
        let empty = Placement::new(&scene, scene.width, scene.height);
        let mut placement = crowd.placed(empty, Side::Tracked);
        let ways = ways(&crowd, &mut random);
        for (sphere, way) in placement.spheres.iter_mut().zip(&ways) {
            sphere.motion = *way;
        }
        // Where no sphere is, none moves, and no kernel asks for it.
        if !placement.moves() {
            continue;
        }
        if context.options.disturb {
            let smaller = Options {
                scale: 0.99,
                ..placement.tree_options()
            };
            let tree = Tree::with(&placement.balls(), 0, smaller);
            placement = placement.with_tree(tree);
        }
        let count = context.size(2048, 16_384);
        let rays = crowd.rays(&mut random, count, true).into_iter();
        let rays: Vec<[Row; 4]> = rays
            .map(|[from, offset, d]: RayRows| {
                let own = ways.get(from[3].to_bits() as usize);
                let way = own.copied().unwrap_or(ways[0]);
                [from, offset, d, to_row(way, random.unit() - 0.5)]
            })
            .collect();
        let [list, tree] = [Effect::List, Effect::Bvh].map(|form| -> Result<Vec<HitRow>> {
            let effects = Effects::of(&[&glass()[..], &[Effect::Motion, form]].concat());
            let probe = Probe::new(&context.gpu, &scene, &placement, &effects);
            probe.call("closest_hit", &rays)
        });
        for (ray, (list, tree)) in rays.iter().zip(list?.iter().zip(&tree?)) {
            measure.add(if tree == list { 0.0 } else { f64::INFINITY }, || {
                format!("{}: {ray:?}: {tree:?} for {list:?}", crowd.name)
            });
        }
    }
    Ok(())
}

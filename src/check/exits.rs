//! What ways to leave a surface do: rays wrongly blocked by the sphere that they leave, and rays that
//! leak out of a closed one. The comparison of `docs/numerics.md`.

use super::context::Context;
use super::intersection::NO_HIT;
use super::leaving::{bounce, bounce_rows, leaving, normal_at_hit};
use crate::error::Result;
use crate::verify::{Random, Row, vector};

/// Above this radius the sphere is a wall, seen from a distance of 1; below, a ball, seen from a few
/// radii.
const WALL: f64 = 16.0;

/// What became of rays that went on from a sphere.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Exits {
    /// Rays that left its outside.
    pub outside: u64,
    /// Of these, those that hit it again.
    pub blocked: u64,
    /// Rays that left its inside.
    pub inside: u64,
    /// Of these, those that were not found to come to its other side.
    pub leaked: u64,
}

impl Exits {
    /// Rays blocked in a million.
    #[must_use]
    pub fn blocked_per_million(&self) -> f64 {
        1.0e6 * self.blocked as f64 / self.outside as f64
    }

    /// Rays leaked in a million.
    #[must_use]
    pub fn leaked_per_million(&self) -> f64 {
        1.0e6 * self.leaked as f64 / self.inside as f64
    }
}

/// Sends some `trials` paths on from a sphere of `radius`, by the offset of the context's options;
/// large ones have a pole frame if `poles`.
///
/// # Errors
/// If the device fails.
pub fn exits(context: &Context, radius: f64, poles: bool, trials: usize) -> Result<Exits> {
    let mut random = Random::new("exits");
    let mut inputs: Vec<[Row; 6]> = Vec::new();
    for i in 0..trials {
        let inside = i % 2 == 1;
        let mut rows = arrival(&mut random, radius, poles, inside);
        let Some(outward) = normal_at_hit(&rows, inside) else {
            continue;
        };
        let n = if inside { -outward } else { outward };
        // No grazing rays by design: what a path would do.
        let d = leaving(&mut random, n, 1);
        rows[5] = [d.x as f32, d.y as f32, d.z as f32, 0.0];
        inputs.push(rows);
    }
    let outputs = bounce(context, &inputs)?;
    let mut exits = Exits::default();
    for (rows, [t, ..]) in inputs.iter().zip(&outputs) {
        let (first, again, again_inside) = (t[0], f64::from(t[1]), t[2] != 0.0);
        if f64::from(first) == NO_HIT {
            continue;
        }
        if rows[0][3] == 0.0 {
            exits.outside += 1;
            exits.blocked += u64::from(again != NO_HIT);
            continue;
        }
        // Rays that run along the wall come back to it within rounding: they say nothing.
        let n = normal_at_hit(rows, true).unwrap_or_default();
        let chord = 2.0 * radius * n.dot(vector(rows[5])).abs();
        if chord > 1.0e-2 * radius {
            exits.inside += 1;
            let arrives = again_inside && again > 0.5 * chord && again < 2.0 * chord;
            exits.leaked += u64::from(!arrives);
        }
    }
    Ok(exits)
}

/// A ray that arrives at the sphere.
fn arrival(random: &mut Random, radius: f64, poles: bool, inside: bool) -> [Row; 6] {
    let d = random.direction();
    if radius <= WALL {
        let across = d.cross(random.direction()).normalize();
        let impact = radius * random.unit().sqrt();
        let back = if inside {
            0.0
        } else {
            radius * random.range(1.5, 4.0)
        };
        return bounce_rows(impact * across - back * d, inside, d, radius, None);
    }
    let n = random.direction();
    let height = if inside { -1.0 } else { 1.0 };
    let across = random.range(-4.0, 4.0) * n.any_orthonormal_vector();
    let d = if d.dot(n) * height > 0.0 { -d } else { d };
    let x = height * n + across;
    if poles {
        bounce_rows(x, inside, d, radius, Some(n))
    } else {
        bounce_rows(x + radius * n, inside, d, radius, None)
    }
}

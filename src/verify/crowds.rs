//! Crowds of spheres that are hard on a tree, and rays at them.

use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3};

use super::{Random, Row};
use crate::placement::{PlacedSphere, Placement, Side};

/// Rows of a ray for `probe_closest_hit` of `shaders/probe/scene.wesl`.
pub type RayRows = [Row; 3];

/// What `probe_closest_hit` and `probe_lamp_hit` of `shaders/probe/scene.wesl` answer.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct HitRow {
    /// In units of the direction's length.
    pub t: f32,
    /// Index into the placement's spheres.
    pub index: u32,
    /// 1 if the ray arrived from inside the sphere.
    pub inside: u32,
    /// Nothing.
    pub unused: u32,
}

// To the bit.
impl PartialEq for HitRow {
    fn eq(&self, other: &Self) -> bool {
        (self.t.to_bits(), self.index, self.inside)
            == (other.t.to_bits(), other.index, other.inside)
    }
}

/// Spheres, as centre and radius.
#[derive(Clone, Debug)]
pub struct Crowd {
    /// What is hard.
    pub name: &'static str,
    /// In kernel units.
    pub balls: Vec<(Vec3, f32)>,
}

/// Every kind of crowd, of some `count` spheres each.
#[must_use]
pub fn crowds(count: usize) -> Vec<Crowd> {
    type Make = fn(&mut Random, f64, f64) -> (DVec3, f64);
    // By a random source, a ball's share of all and the cube root of their number.
    let kinds: [(&'static str, Make); 10] = [
        ("in a cube", |random, _, side| {
            (point(random) * side, random.range(0.1, 0.4))
        }),
        ("radii 1e-8 to 1e8", |random, _, _| {
            let radius = random.magnitude(-8.0, 8.0);
            (point(random) * radius * 4.0, radius)
        }),
        ("about one centre", |_, share, _| {
            (DVec3::new(0.3, 0.1, -0.7), 1.0e-3 + share)
        }),
        ("at one point", |_, _, _| (DVec3::new(0.3, 0.1, -0.7), 0.25)),
        ("in a line", |_, share, side| {
            (DVec3::new(1.0, 0.5, 0.25) * share * side, 0.1)
        }),
        ("along an axis", |_, share, side| {
            (DVec3::new(0.0, side.powi(3) * share, 0.0), 0.5)
        }),
        ("in a plane", |random, _, side| {
            let p = point(random) * side;
            (DVec3::new(p.x, 0.0, p.z), 0.2)
        }),
        ("far away", |random, _, _| {
            (
                DVec3::new(1.0e5, 3.0e4, -2.0e4) + point(random),
                random.magnitude(-1.5, -0.5),
            )
        }),
        ("at 1e15", |random, _, side| {
            (
                1.0e15 * point(random) * side,
                1.0e15 * random.range(0.1, 0.4),
            )
        }),
        ("one within another, touching", |random, share, _| {
            let radius = 1.0e-3 + share;
            (
                DVec3::new(1.0 - radius, 0.0, 1.0e-7 * random.unit()),
                radius,
            )
        }),
    ];
    let mut all: Vec<Crowd> = Vec::new();
    for (name, make) in kinds {
        let mut random = Random::new(name);
        let side = 0.5 * (count as f64).cbrt();
        let ball = |i: usize| {
            let (center, radius) = make(&mut random, i as f64 / count as f64, side);
            (center.as_vec3(), radius as f32)
        };
        all.push(Crowd {
            name,
            balls: (0..count).map(ball).collect(),
        });
    }
    for (name, few) in [("one", 1), ("two", 2), ("five", 5), ("none", 0)] {
        all.push(Crowd {
            name,
            balls: all[0].balls[..few.min(count)].to_vec(),
        });
    }
    all
}

fn point(random: &mut Random) -> DVec3 {
    DVec3::from_array([(); 3].map(|()| random.range(-1.0, 1.0)))
}

impl Crowd {
    /// The spheres, on one side each, or on both, as `placement` would have them if it had found them.
    #[must_use]
    pub fn placed(&self, mut placement: Placement, side: Side) -> Placement {
        let sphere = |(source, (center, radius)): (usize, &(Vec3, f32))| PlacedSphere {
            source,
            material: 0,
            anchor: center.as_dvec3(),
            motion: DVec3::ZERO,
            radius: f64::from(*radius),
            pole: None,
            side,
            level: 0,
            container: None,
            cores: Vec::new(),
        };
        placement.spheres = self.balls.iter().enumerate().map(sphere).collect();
        placement.poles = 0;
        placement
    }

    /// Rays at the spheres: from afar and from nearby, from surfaces and, if they can be `within`, from inside;
    /// along axes, grazing, and with directions of any length.
    pub fn rays(&self, random: &mut Random, count: usize, within: bool) -> Vec<RayRows> {
        if self.balls.is_empty() {
            let d = point(random);
            return vec![rows(Vec3::ZERO, None, DVec3::ZERO, d, None)];
        }
        // Squares of its products with what a sphere is made of have to be numbers of f32, and those with the least
        // radius normal ones, also in their last places: where a device takes smaller ones for 0, the discriminant of
        // a ray that just misses is that of one that touches.
        let extent = |(center, radius): &(Vec3, f32)| f64::from(center.length() + radius);
        let extent = self.balls.iter().map(extent).fold(1.0, f64::max);
        let least = self.balls.iter().map(|(_, radius)| f64::from(*radius));
        let least = least.fold(1.0, f64::min);
        let lengths = [-15.0 - least.log10(), (17.0 - extent.log10()).min(15.0)];
        let kinds = if within { 8 } else { 6 };
        (0..count)
            .map(|i| {
                let pick =
                    |random: &mut Random| (random.words()[0] as usize % self.balls.len()) as u32;
                let (from, to) = (pick(random), pick(random));
                let (center, radius) = self.balls[from as usize];
                let (aim, size) = self.balls[to as usize];
                let (center, aim) = (center.as_dvec3(), aim.as_dvec3());
                let size = f64::from(size);
                let grazing = 1.0 + random.magnitude(-8.0, -2.0) * (random.unit() - 0.5);
                let share = if random.unit() < 0.5 {
                    random.unit()
                } else {
                    grazing
                };
                let offset = f64::from(radius) * random.direction();
                let ray = match i % kinds {
                    // From a surface: to another sphere, or anywhere.
                    0 => {
                        let target = aim + share * size * random.direction();
                        let d = target - (center + offset);
                        rows(center.as_vec3(), Some(from), offset, d, None)
                    }
                    1 => rows(
                        center.as_vec3(),
                        Some(from),
                        offset,
                        random.direction(),
                        None,
                    ),
                    // From some distance, in scales of either.
                    2 | 3 => {
                        let scale = if i % 2 == 0 { size } else { f64::from(radius) };
                        let eye = aim + scale * random.magnitude(0.1, 3.0) * random.direction();
                        let d = aim - eye;
                        let across = d.cross(random.direction()).normalize_or_zero();
                        rows(
                            eye.as_vec3(),
                            None,
                            DVec3::ZERO,
                            d + share * size * across,
                            None,
                        )
                    }
                    // Along an axis, exactly or nearly, grazing or not.
                    4 | 5 => {
                        let axis = DVec3::AXES[random.words()[0] as usize % 3];
                        let across = axis.cross(random.direction()).normalize_or_zero();
                        let back = (1.5 + random.magnitude(0.0, 4.0)) * size;
                        let eye = aim + share * size * across - back * axis;
                        let tilt = if i % 2 == 0 {
                            0.0
                        } else {
                            random.magnitude(-30.0, -6.0)
                        };
                        rows(eye.as_vec3(), None, DVec3::ZERO, axis + tilt * across, None)
                    }
                    // From within, and from the surface inwards.
                    6 => rows(
                        center.as_vec3(),
                        None,
                        random.unit() * offset,
                        random.direction(),
                        Some(from),
                    ),
                    _ => {
                        let mut d = random.direction();
                        if d.dot(offset) > 0.0 {
                            d = -d;
                        }
                        rows(center.as_vec3(), Some(from), offset, d, Some(from))
                    }
                };
                scaled(ray, lengths, random)
            })
            .collect()
    }
}

/// One in four with a direction of another length, between these powers of ten.
fn scaled(mut ray: RayRows, [shortest, longest]: [f64; 2], random: &mut Random) -> RayRows {
    if random.unit() < 0.25 {
        let length = random.magnitude(shortest, longest) as f32;
        for axis in &mut ray[2][..3] {
            *axis *= length;
        }
    }
    ray
}

/// A ray's rows, its direction brought to unit length.
fn rows(
    anchor: Vec3,
    own: Option<u32>,
    offset: DVec3,
    direction: DVec3,
    within: Option<u32>,
) -> RayRows {
    let word = |index: Option<u32>| f32::from_bits(index.unwrap_or(u32::MAX));
    let d = direction.try_normalize().unwrap_or(DVec3::X).as_vec3();
    [
        anchor.extend(word(own)).to_array(),
        offset.as_vec3().extend(0.0).to_array(),
        d.extend(word(within)).to_array(),
    ]
}

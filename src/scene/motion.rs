//! What holds of spheres for all of the time for which the shutter is open.
//!
//! All move along straight lines, each with its own velocity: so the distance of two is the length of a vector that is
//! linear in time, which is longest at an end and shortest where it is perpendicular to its own way.

use glam::DVec3;

use super::file::{CameraTable, SphereTable};
use super::report::{Problem, Report};
use super::{Scene, Sphere};
use crate::materials::schema::MAX_MAGNITUDE;
use crate::numbers::significant;

/// Rounding of the sum of a distance and a radius in f64, as a share of it.
pub(crate) const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// The longest way, in radii. A path's time has 24 bits, and f32 has the place at that time to about as much: this
/// keeps both below a thousandth of the radius.
pub const LONGEST_WAY: f64 = 16384.0;

/// The least and the greatest distance while the shutter is open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distances {
    /// Never less.
    pub least: f64,
    /// Never more.
    pub most: f64,
}

impl Distances {
    /// Those of the end of a vector, `middle` in the middle of the time, in which it changes by `motion`.
    #[must_use]
    pub fn of(middle: DVec3, motion: DVec3) -> Self {
        if motion == DVec3::ZERO {
            let distance = middle.length();
            return Self {
                least: distance,
                most: distance,
            };
        }
        let half = 0.5 * motion;
        // In units of the largest component, so that no square is lost.
        let unit = half.abs().max_element();
        let way = half / unit;
        let along = (-middle.dot(way) / way.length_squared()).clamp(-unit, unit);
        Self {
            least: (middle + along * way).length(),
            most: (middle - half).length().max((middle + half).length()),
        }
    }

    /// How near it comes to a `radius`.
    #[must_use]
    pub fn gap(self, radius: f64) -> f64 {
        (self.least - radius).max(radius - self.most).max(0.0)
    }

    /// How far it gets from a `radius`.
    #[must_use]
    pub fn farthest_gap(self, radius: f64) -> f64 {
        (self.least - radius).abs().max((self.most - radius).abs())
    }
}

impl Sphere {
    /// The distances of its centre from that of another sphere.
    #[must_use]
    pub fn distances(&self, other: &Self) -> Distances {
        Distances::of(self.center - other.center, self.motion - other.motion)
    }

    /// The distances of its centre from a point.
    #[must_use]
    pub fn distances_from(&self, point: DVec3) -> Distances {
        Distances::of(self.center - point, self.motion)
    }
}

/// Why a sphere cannot move as it does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// Beyond the largest coordinate.
    TooFar,
    /// So many radii, more than [`LONGEST_WAY`].
    TooLong(f64),
    /// Over the camera: on which side of every sphere paths begin must not change.
    OverCamera,
}

impl Fault {
    /// That of a sphere, if it has one. Spheres may move through each other: each path sees them at one time.
    #[must_use]
    pub fn of(scene: &Scene, sphere: &Sphere) -> Option<Self> {
        let half = 0.5 * sphere.motion.abs();
        if (sphere.center.abs() + half).max_element() > MAX_MAGNITUDE {
            return Some(Self::TooFar);
        }
        if half == DVec3::ZERO {
            return None;
        }
        let longest = half.max_element();
        // As before, without squares.
        let radii = 2.0 * longest * (half / longest).length() / sphere.radius;
        if radii > LONGEST_WAY {
            return Some(Self::TooLong(radii));
        }
        let distances = sphere.distances_from(scene.camera.position);
        let within = sphere.radius * (1.0 - ROUNDING);
        (distances.least < within && distances.most >= within).then_some(Self::OverCamera)
    }

    /// What the sphere does.
    #[must_use]
    pub fn what(self) -> String {
        match self {
            Self::TooFar => {
                format!("moves beyond {MAX_MAGNITUDE:e} by the time at which the shutter closes")
            }
            Self::TooLong(radii) => format!(
                "moves by {} times its radius while the shutter is open",
                significant(radii)
            ),
            Self::OverCamera => "moves over the camera while the shutter is open".to_owned(),
        }
    }

    /// What to do instead.
    #[must_use]
    pub fn help(self) -> String {
        match self {
            Self::TooFar => "a shorter time or a lower velocity".to_owned(),
            Self::TooLong(_) => format!(
                "at most {LONGEST_WAY} times: time has no more digits; a shorter time or a lower velocity"
            ),
            Self::OverCamera => {
                "the camera has to be outside of it for all of the time, or inside".to_owned()
            }
        }
    }
}

/// When the shutter opens and closes.
pub(super) fn shutter(table: &CameraTable, report: &mut Report) -> [f64; 2] {
    let Some(shutter) = &table.shutter else {
        return [0.0; 2];
    };
    let [opens, closes] = *shutter.get_ref();
    if opens > closes {
        let problem = Problem::new(shutter.span(), "the `shutter` closes before it opens", "");
        report
            .errors
            .push(problem.help(format!("`shutter = [{closes:?}, {opens:?}]` opens first")));
    }
    [opens, closes]
}

/// Reports the spheres of the file, which are the first ones of `scene`, that cannot move as they do, and those that
/// were probably meant to.
pub(super) fn check_motion(
    scene: &Scene,
    camera: &CameraTable,
    spheres: &[SphereTable],
    report: &mut Report,
) {
    let mut first = None;
    for (sphere, table) in std::iter::zip(&scene.spheres, spheres) {
        let Some(velocity) = &table.velocity else {
            continue;
        };
        first = first.or((*velocity.get_ref() != [0.0; 3]).then_some(velocity));
        let Some(fault) = Fault::of(scene, sphere) else {
            continue;
        };
        let message = format!("this sphere {}", fault.what());
        let problem = Problem::new(velocity.span(), message, "").help(fault.help());
        let other = match fault {
            Fault::OverCamera => Some((camera.position.span(), "the camera")),
            _ => camera.shutter.as_ref().map(|s| (s.span(), "the shutter")),
        };
        report.errors.push(match other {
            Some((span, label)) => problem.also(span, label),
            None => problem,
        });
    }
    if let Some(velocity) = first.filter(|_| camera.shutter.is_none()) {
        let message = "`velocity` moves nothing: the camera has no `shutter`";
        let problem = Problem::new(velocity.span(), message, "");
        report.warnings.push(
            problem.help("`shutter = [0.0, 1.0]` in `[camera]` is open from time 0 to time 1"),
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::verify::Random;

    #[test]
    fn distances_are_those_of_many_times() {
        let mut random = Random::new("distances over time");
        let mut inner = 0;
        for _ in 0..2000 {
            let middle = random.magnitude(-3.0, 3.0) * random.direction();
            let motion = random.magnitude(-3.0, 3.0) * random.direction();
            let found = Distances::of(middle, motion);
            let at = |i: i32| (middle + (f64::from(i) / 500.0 - 0.5) * motion).length();
            let (least, most) = (0..=500).map(at).fold((f64::INFINITY, 0.0), |(a, b), d| {
                (f64::min(a, d), f64::max(b, d))
            });
            let size = 1.0e-14 * (middle.length() + motion.length());
            // Between two of the times it comes nearer by less than half a step.
            let step = motion.length() / 1000.0;
            assert!((found.most - most).abs() <= size, "{middle} {motion}");
            assert!(found.least <= least + size && found.least >= least - step - size);
            inner += u32::from(found.least < at(0).min(at(500)) - step);
        }
        assert!(inner > 300, "{inner}");
        let still = Distances::of(DVec3::new(1.0, 2.0, 2.0), DVec3::ZERO);
        assert_eq!((still.least, still.most), (3.0, 3.0));
        // Where squares are no numbers.
        let tiny = Distances::of(DVec3::X, 1.0e-200 * DVec3::Y);
        assert_eq!((tiny.least, tiny.most), (1.0, 1.0));
        assert_eq!(still.gap(1.0), 2.0);
        let moving = Distances::of(DVec3::ZERO, 2.0 * DVec3::X);
        assert_eq!((moving.gap(0.5), moving.gap(3.0)), (0.0, 2.0));
        assert_eq!(moving.farthest_gap(0.75), 0.75);
    }
}

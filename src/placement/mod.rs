//! Where everything is, prepared in f64 so that f32 can stand it.
//!
//! Points are kept as an offset from an *anchor*: the centre of a sphere, or its *pole* if the
//! sphere is much larger than what is near it. All anchors are relative to one origin close to the
//! camera's view, and in units of a power of two that brings the scene to size one. So a scene that
//! is moved or scaled by a power of two gives the same numbers, and a wall of radius 1e8 keeps all
//! its digits where the picture is.

pub mod containment;
pub mod lights;
pub mod media;

pub use lights::{Light, Lights};
pub use media::{Media, Medium};

use glam::DVec3;

use crate::scene::{Handedness, Scene};
use crate::settings::Offset;
use containment::{ROUNDING, containers, reachable};

/// A scene's spheres and camera as the renderers use them.
#[derive(Clone, Debug)]
pub struct Placement {
    /// Kernel units per scene unit, a power of two.
    pub scale: f64,
    /// Kernel radiance per radiance, a power of two that brings the brightest light to 2^32: sums of
    /// squares in f32 then hold light of 1e20, and beside it light a 1e-26 of that.
    pub light: f64,
    /// The spheres that paths can reach, those with a pole frame first, else in scene order.
    pub spheres: Vec<PlacedSphere>,
    /// How many of `spheres` have a pole frame.
    pub poles: usize,
    /// Which dielectrics take precedence where they share points.
    pub media: Media,
    /// The dielectrics that the camera is in, `sphere` being an index into `spheres`.
    pub within: Vec<Medium>,
    /// Whether an opaque sphere is all around the camera: no path leaves it.
    pub enclosed: bool,
    /// Spheres of the scene that equal an earlier one, with that one: they are not there.
    pub coincident: Vec<[usize; 2]>,
    /// The camera.
    pub camera: PlacedCamera,
    /// How paths leave surfaces, distances in kernel units.
    pub offset: Offset,
    /// What light sampling chooses from.
    pub lights: Lights,
}

/// A sphere in kernel units, relative to the placement's origin.
#[derive(Clone, Debug)]
pub struct PlacedSphere {
    /// Index into the scene's spheres.
    pub source: usize,
    /// Index into the scene's materials.
    pub material: usize,
    /// The centre, or the pole.
    pub anchor: DVec3,
    /// Radius, in kernel units.
    pub radius: f64,
    /// Outward unit normal at the pole, if the sphere has a pole frame.
    pub pole: Option<DVec3>,
    /// Which side of the surface paths can be on.
    pub side: Side,
    /// Precedence among dielectrics that share points; see [`Media`].
    pub level: u32,
    /// The dielectric that this sphere lies just within, an index into the placement's spheres:
    /// this sphere is hit only from within that.
    pub container: Option<usize>,
    /// The dielectrics that lie just within this sphere, indices into the placement's spheres: from
    /// within any of them, this sphere is not hit.
    pub cores: Vec<usize>,
}

/// Which side of a sphere's surface paths can be on.
///
/// No path crosses an opaque surface, so its side is that of the camera, once and for all; and a
/// path that crosses a dielectric's surface knows it. What f32 says about a point near the surface
/// is not asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Side {
    /// Only outside.
    Outside = 0,
    /// Only inside.
    Inside = 1,
    /// Both: a dielectric. The path keeps account of it.
    Tracked = 2,
    /// Both, and only the sign of the ray's distance tells: a surface that the lens straddles, or
    /// any surface where paths leave by a nudge ([`Offset`]).
    Sign = 3,
}

/// The camera: rays start at `anchor + lens_share lens + approach film` in the direction
/// `forward + film - focus lens`, for a point `film` of the image plane at distance 1 and a point
/// `lens` of the lens.
#[derive(Clone, Debug)]
pub struct PlacedCamera {
    /// The camera's position, moved along the view axis by `approach`.
    pub anchor: DVec3,
    /// How far rays can go along the view axis before they can hit anything.
    pub approach: f64,
    /// Film position of the top left corner of pixel (0, 0).
    pub corner: DVec3,
    /// Film step from a pixel to the one right of it.
    pub across: DVec3,
    /// Film step from a pixel to the one below it.
    pub down: DVec3,
    /// Unit vector along the view axis.
    pub forward: DVec3,
    /// Semi-axis of the lens along the image's rows; zero for a pinhole.
    pub lens_across: DVec3,
    /// Semi-axis of the lens along the image's columns.
    pub lens_down: DVec3,
    /// One over the focus distance; zero for a pinhole.
    pub focus: f64,
    /// `1 - approach focus`
    pub lens_share: f64,
}

/// A sphere gets a pole frame if something that matters is nearer to its surface than this share
/// of its radius ...
const POLE_NEAR: f64 = 1.0 / 16.0;
/// ... and nothing is farther from it than this many radii, where a pole frame would lose digits.
const POLE_FAR: f64 = 64.0;

impl Placement {
    /// Prepares `scene` for an image of `width` x `height` pixels.
    #[must_use]
    pub fn new(scene: &Scene, width: u32, height: u32) -> Self {
        Self::with_offset(scene, width, height, Offset::Exact)
    }

    /// The same for paths that leave surfaces by `offset`.
    #[must_use]
    pub fn with_offset(scene: &Scene, width: u32, height: u32, offset: Offset) -> Self {
        let eye = scene.camera.position;
        let forward = (scene.camera.look_at - eye).normalize();
        let approach = approach(scene, forward);
        let origin = eye + approach * forward;
        // In units of the origin from here on: the subtraction in f64 is the last place that sees
        // world coordinates.
        let centers: Vec<DVec3> = scene.spheres.iter().map(|s| s.center - origin).collect();
        let count = centers.len();
        let mut coincident = Vec::new();
        let (sides, reachable, containers) = if offset == Offset::Exact {
            let sides: Vec<Side> = (0..count).map(|i| side(scene, i)).collect();
            let reachable = reachable(scene, &sides, &mut coincident);
            let containers = containers(scene, &sides, &reachable);
            (sides, reachable, containers)
        } else {
            (
                vec![Side::Sign; count],
                vec![true; count],
                vec![None; count],
            )
        };
        let media = Media::new(scene, &reachable);
        let mut order: Vec<usize> = (0..count).filter(|i| reachable[*i]).collect();
        let mut poles = vec![None; count];
        for &i in &order {
            poles[i] = pole_normal(scene, &centers, &order, i);
        }
        let scale = unit(scene, &centers, &poles, &order);
        order.sort_by_key(|i| (poles[*i].is_none(), *i));
        let mut place = vec![None; count];
        for (at, source) in order.iter().enumerate() {
            place[*source] = Some(at);
        }
        let mut spheres: Vec<PlacedSphere> = order
            .iter()
            .map(|&i| {
                let sphere = &scene.spheres[i];
                let normal = poles[i];
                let anchor =
                    normal.map_or(centers[i], |n| pole_point(centers[i], sphere.radius, n));
                PlacedSphere {
                    source: i,
                    material: sphere.material,
                    anchor: anchor * scale,
                    radius: sphere.radius * scale,
                    pole: normal,
                    side: sides[i],
                    level: media.level[i],
                    container: containers[i].and_then(|c| place[c]),
                    cores: Vec::new(),
                }
            })
            .collect();
        for inner in 0..spheres.len() {
            if let Some(outer) = spheres[inner].container
                && spheres[inner].side == Side::Tracked
            {
                spheres[outer].cores.push(inner);
            }
        }
        let within = media.camera.iter().filter_map(|medium| {
            let sphere = place[medium.sphere]?;
            Some(Medium { sphere, ..*medium })
        });
        let within = within.collect();
        let enclosed = spheres.iter().any(|s| s.side == Side::Inside);
        let poles = spheres.iter().filter(|s| s.pole.is_some()).count();
        let camera = place_camera(scene, forward, approach, scale, width, height);
        let mut placement = Self {
            scale,
            light: light(scene, &order, enclosed),
            enclosed,
            coincident,
            spheres,
            poles,
            media,
            within,
            camera,
            offset: offset.scaled(scale),
            lights: Lights::default(),
        };
        placement.lights = Lights::new(scene, &placement);
        placement
    }
}

/// The unit of radiance for the reachable spheres `all`.
fn light(scene: &Scene, all: &[usize], enclosed: bool) -> f64 {
    let emission = |i: &usize| scene.materials[scene.spheres[*i].material].emission;
    let brightest = all
        .iter()
        .map(emission)
        .chain(scene.environment.filter(|_| !enclosed))
        .fold(0.0, |most: f64, radiance| most.max(radiance.max_element()));
    if brightest > 0.0 {
        (32.0 - brightest.log2().floor()).exp2()
    } else {
        1.0
    }
}

/// How far along the view axis nothing can be hit, for any ray of the camera.
fn approach(scene: &Scene, forward: DVec3) -> f64 {
    let eye = scene.camera.position;
    let nearest = scene
        .spheres
        .iter()
        .map(|s| (forward.dot(s.center - eye), s.radius))
        // What is wholly behind the lens is out of every ray's way.
        .filter(|(depth, radius)| depth + radius > 0.0)
        .map(|(depth, radius)| depth - radius)
        .fold(f64::INFINITY, f64::min);
    if nearest.is_finite() {
        nearest.max(0.0)
    } else {
        0.0
    }
}

/// The pole's outward normal, if sphere `i` needs a pole frame: there are the camera or much
/// smaller spheres close to its surface. The pole is the surface point nearest to the middle of
/// these.
fn pole_normal(scene: &Scene, centers: &[DVec3], all: &[usize], i: usize) -> Option<DVec3> {
    let (center, radius) = (centers[i], scene.spheres[i].radius);
    let small = |j: &usize| *j != i && scene.spheres[*j].radius < POLE_NEAR * radius;
    if !all.iter().any(small) && alone(scene, i) {
        return None;
    }
    let eye = scene.camera.position;
    let eye = eye - (scene.spheres[i].center - center);
    let points = || {
        all.iter()
            .copied()
            .filter(small)
            .map(|j| (centers[j], scene.spheres[j].radius))
            .chain([(eye, 0.0)])
    };
    let gap = |point: DVec3| (point.distance(center) - radius).abs();
    if points().any(|(point, _)| gap(point) > POLE_FAR * radius) {
        return None;
    }
    let near: Vec<DVec3> = points()
        .filter(|(point, size)| gap(*point) - size < POLE_NEAR * radius)
        .map(|(point, _)| point)
        .collect();
    if near.is_empty() {
        return None;
    }
    // Offsets are summed rather than points, so that the scene's place does not matter.
    let middle = near.iter().map(|p| *p - center).sum::<DVec3>() / near.len() as f64;
    middle.try_normalize()
}

/// Whether the camera is not near the surface of sphere `i`.
fn alone(scene: &Scene, i: usize) -> bool {
    let sphere = &scene.spheres[i];
    let distance = scene.camera.position.distance(sphere.center);
    (distance - sphere.radius).abs() >= POLE_NEAR * sphere.radius
}

/// The pole: the centre is the large number here, and what is left of it the small one.
fn pole_point(center: DVec3, radius: f64, normal: DVec3) -> DVec3 {
    center + radius * normal
}

/// The power of two that brings the scene's extent, without the spheres in pole frames, to [1, 2).
fn unit(scene: &Scene, centers: &[DVec3], poles: &[Option<DVec3>], all: &[usize]) -> f64 {
    let extent = all
        .iter()
        .map(|&i| match poles[i] {
            Some(n) => pole_point(centers[i], scene.spheres[i].radius, n).length(),
            None => centers[i].length() + scene.spheres[i].radius,
        })
        .fold(0.0, f64::max);
    if extent > 0.0 {
        (-extent.log2().floor()).exp2()
    } else {
        1.0
    }
}

fn side(scene: &Scene, i: usize) -> Side {
    let sphere = &scene.spheres[i];
    let distance = scene.camera.position.distance(sphere.center);
    let lens = scene.camera.aperture_radius;
    if lens > 0.0 && (distance - sphere.radius).abs() <= lens {
        return Side::Sign;
    }
    if scene.materials[sphere.material].kind.transmits() {
        Side::Tracked
    } else if distance >= sphere.radius * (1.0 - ROUNDING) {
        // A camera on the surface sees it from outside.
        Side::Outside
    } else {
        Side::Inside
    }
}

fn place_camera(
    scene: &Scene,
    forward: DVec3,
    approach: f64,
    scale: f64,
    width: u32,
    height: u32,
) -> PlacedCamera {
    let camera = &scene.camera;
    let right = match camera.handedness {
        Handedness::Right => forward.cross(camera.up),
        Handedness::Left => camera.up.cross(forward),
    }
    .normalize();
    // Perpendicular to the two, on the side of `up`.
    let up = (camera.up - camera.up.dot(forward) * forward).normalize();
    let pixel = 2.0 * (0.5 * camera.fov.to_radians()).tan() / f64::from(height);
    let (across, down) = (pixel * right, -pixel * up);
    let corner = -0.5 * (f64::from(width) * across + f64::from(height) * down);
    let lens = camera.aperture_radius * scale;
    let focus = if lens > 0.0 {
        1.0 / (camera.focus_distance * scale)
    } else {
        0.0
    };
    let approach = approach * scale;
    PlacedCamera {
        // The origin is where the rays start.
        anchor: DVec3::ZERO,
        approach,
        corner,
        across,
        down,
        forward,
        lens_across: lens * right,
        lens_down: -lens * up,
        focus,
        lens_share: 1.0 - approach * focus,
    }
}

//! A particle file without a scene file: a camera that has it all in the picture, soft light from all around
//! and a lamp behind the viewer's left shoulder.

use std::path::Path;

use glam::DVec3;

use super::look::Look;
use super::table::colored;
use super::{Ball, Cloud, Coloring, Fault, RadiusBy, Request, Similarity, gather};
use crate::error::{Error, Result};
use crate::materials::diffuse::{self, Diffuse};
use crate::scene::load::{Loaded, Source};
use crate::scene::{
    Camera, Environment, Handedness, Material, RenderDefaults, Scene, Sphere, content_hash,
};

/// Size of the picture, in pixels.
const SIZE: [u32; 2] = [960, 720];
/// Vertical angle of view, in degrees.
const FOV: f64 = 30.0;
/// Distance of the camera over the least from which all is seen.
const MARGIN: f64 = 1.04;
/// Light that a colour of 1 scatters: no real surface gives all of it back, and what is white must stay
/// darker than a white background.
const ALBEDO: f64 = 0.8;
/// Radiance of the background, and so of the light from all around.
const BACKGROUND: DVec3 = DVec3::ONE;
/// Distance and radius of the lamp, in radii of the particles' bounds.
const LAMP: [f64; 2] = [5.0, 1.5];
/// What the lamp adds where it shines straight on, as a share of white.
const LAMP_SHARE: f64 = 0.5;

/// The scene that shows the file.
///
/// # Errors
/// [`Error::Usage`] if the file or an option cannot be used.
pub fn load(path: &Path, look: &Look) -> Result<Loaded> {
    let radius = look.radius_by.as_deref().map(|word| match word.parse() {
        Ok(number) => RadiusBy::Constant(number),
        Err(_) => RadiusBy::of_word(word),
    });
    let coloring = look.coloring();
    if look.map.is_some() && !matches!(coloring, Some(Coloring::Column { .. })) {
        return Err(Error::Usage(
            "--map: it needs a column in --color-by".into(),
        ));
    }
    let cloud = gather(&Request {
        file: path.to_owned(),
        format: None,
        frame: 0,
        radius,
        coloring: coloring.unwrap_or(Coloring::ElementIfKnown),
        select: None,
        transform: Similarity::IDENTITY,
    });
    let cloud = cloud.map_err(|fault| usage(&fault))?;
    // Without its ending, and that of gzip before it.
    let plain = match path.extension() {
        Some(ending) if ending.eq_ignore_ascii_case("gz") => path.with_extension(""),
        _ => path.to_owned(),
    };
    let stem = plain.file_stem().unwrap_or_default();
    let name = stem.to_string_lossy().into_owned();
    let scene = scene(cloud, look.background.unwrap_or(BACKGROUND));
    Ok(Loaded {
        hash: content_hash(&scene),
        warnings: Vec::new(),
        source: Source::Particles(look.clone()),
        files: vec![path.to_owned()],
        name,
        scene,
    })
}

/// The fault, with the option that a key is.
fn usage(fault: &Fault) -> Error {
    let option = match fault.key {
        "color_by" => "--color-by: ",
        "radius" => "--radius-by: ",
        _ => "",
    };
    let help = match &fault.help {
        Some(help) => format!("; {help}"),
        None => String::new(),
    };
    Error::Usage(format!("{option}{}{help}", fault.message))
}

fn scene(cloud: Cloud, background: DVec3) -> Scene {
    let camera = camera(&cloud.balls);
    let (center, extent) = bounds(&cloud.balls);
    let mut materials: Vec<Material> = match cloud.colors.is_empty() {
        true => colored(
            vec![("particles".into(), DVec3::splat(0.75))],
            diffuse::NAME,
        )
        .collect(),
        false => colored(cloud.colors, diffuse::NAME).collect(),
    };
    for material in &mut materials {
        material.kind = Diffuse {
            albedo: ALBEDO * material.kind.color(),
        }
        .into();
    }
    let mut spheres: Vec<Sphere> = cloud
        .balls
        .iter()
        .map(|ball| Sphere {
            center: ball.center,
            radius: ball.radius,
            material: ball.color,
            priority: None,
        })
        .collect();
    let [forward, right, up] = axes(camera.position, camera.look_at, camera.up);
    let towards = (1.2 * up - right - 1.2 * forward).normalize();
    // Its cap of directions has sin² = (radius/distance)², and irradiance pi L sin².
    let radiance = LAMP_SHARE * (LAMP[0] / LAMP[1]).powi(2);
    spheres.push(Sphere {
        center: center + LAMP[0] * extent * towards,
        radius: LAMP[1] * extent,
        material: materials.len(),
        priority: None,
    });
    materials.push(Material {
        name: "lamp".into(),
        kind: Diffuse {
            albedo: DVec3::ZERO,
        }
        .into(),
        emission: DVec3::splat(radiance),
    });
    Scene {
        camera,
        width: SIZE[0],
        height: SIZE[1],
        render: RenderDefaults::default(),
        environment: (background != DVec3::ZERO).then_some(Environment::Constant(background)),
        materials,
        spheres,
    }
}

/// Centre of the box around all, and the distance from there to the farthest surface.
fn bounds(balls: &[Ball]) -> (DVec3, f64) {
    let [low, high] = corners(balls);
    let center = 0.5 * low + 0.5 * high;
    let reach = balls
        .iter()
        .map(|ball| ball.center.distance(center) + ball.radius);
    (center, reach.fold(0.0, f64::max))
}

fn corners(balls: &[Ball]) -> [DVec3; 2] {
    let start = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    balls.iter().fold(start, |[low, high], ball| {
        [
            low.min(ball.center - ball.radius),
            high.max(ball.center + ball.radius),
        ]
    })
}

/// Forward, right and up, of unit length.
fn axes(from: DVec3, to: DVec3, up: DVec3) -> [DVec3; 3] {
    let forward = (to - from).normalize();
    let right = forward.cross(up).normalize();
    [forward, right, right.cross(forward)]
}

/// Along the axis in which the particles extend least, with the longest from left to right, and somewhat from
/// above and from the side; as near as has all of it in the picture.
fn camera(balls: &[Ball]) -> Camera {
    let [low, high] = corners(balls);
    let extent = high - low;
    let mut order = [0, 1, 2];
    // The sort is stable: of equal ones x is across, y upward.
    order.sort_by(|a, b| extent[*b].total_cmp(&extent[*a]));
    let axis = |i: usize| [DVec3::X, DVec3::Y, DVec3::Z][order[i]];
    let (across, upward) = (axis(0), axis(1));
    let towards = across.cross(upward);
    let center = 0.5 * low + 0.5 * high;
    let direction = (towards + 0.25 * across + 0.3 * upward).normalize();
    let [forward, right, up] = axes(direction, DVec3::ZERO, upward);
    let half = (0.5 * FOV).to_radians();
    let aspect = f64::from(SIZE[0]) / f64::from(SIZE[1]);
    let halves = [(right, (half.tan() * aspect).atan()), (up, half)];
    // A plane through the camera at the angle a to the axis touches a ball from outside where
    // (distance - z) sin a - |x| cos a = radius.
    let needed = balls.iter().flat_map(|ball| {
        let x = ball.center - center;
        halves.map(|(axis, a)| {
            -x.dot(forward) + (ball.radius + x.dot(axis).abs() * a.cos()) / a.sin()
        })
    });
    let distance = MARGIN * needed.fold(0.0, f64::max);
    Camera {
        position: center - distance * forward,
        look_at: center,
        up: upward,
        fov: FOV,
        handedness: Handedness::Right,
        aperture_radius: 0.0,
        focus_distance: distance,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::verify::Random;

    /// The largest share of a half of the picture that a ball reaches to, in the directions up and across; 1
    /// is the edge.
    fn reach(camera: &Camera, balls: &[Ball]) -> f64 {
        let [forward, right, up] = axes(camera.position, camera.look_at, camera.up);
        let half = (0.5 * FOV).to_radians();
        let aspect = f64::from(SIZE[0]) / f64::from(SIZE[1]);
        let of = |ball: &Ball| {
            let x = ball.center - camera.position;
            let share = |axis: DVec3, edge: f64| {
                let (z, y) = (x.dot(forward), x.dot(axis).abs());
                // The far side's tangent through the camera, in the plane of both axes.
                let angle = y.atan2(z) + (ball.radius / z.hypot(y)).asin();
                angle.tan() / edge
            };
            share(right, half.tan() * aspect).max(share(up, half.tan()))
        };
        balls.iter().map(of).fold(0.0, f64::max)
    }

    #[test]
    fn all_is_in_the_picture_and_fills_it() {
        let mut random = Random::new("particles in the picture");
        for shape in [
            [1.0, 1.0, 1.0],
            [10.0, 1.0, 3.0],
            [0.1, 5.0, 5.0],
            [0.0, 0.0, 1e6],
        ] {
            for offset in [0.0, 1e5] {
                let mut ball = || {
                    let [x, y, z, r] = random.unit4().map(f64::from);
                    Ball {
                        center: DVec3::new(x, y, z) * DVec3::from(shape) + offset,
                        radius: 0.01 + 0.2 * r,
                        color: 0,
                    }
                };
                let balls: Vec<Ball> = (0..50).map(|_| ball()).collect();
                let camera = camera(&balls);
                let reach_of = |camera: &Camera| reach(camera, &balls);
                let there = reach_of(&camera);
                assert!((0.9..1.0).contains(&there), "{shape:?}: {there}");
                // Companion: from a tenth nearer not all is.
                let mut near = camera.clone();
                near.position = near.position.lerp(near.look_at, 0.1);
                assert!(reach_of(&near) > 1.0, "{shape:?}: {}", reach_of(&near));
            }
        }
    }

    #[test]
    fn the_lamp_is_not_seen() {
        let ball = Ball {
            center: DVec3::ZERO,
            radius: 1.0,
            color: 0,
        };
        let cloud = Cloud {
            balls: vec![ball],
            colors: Vec::new(),
        };
        let scene = scene(cloud, BACKGROUND);
        let lamp = scene.spheres.last().expect("a lamp");
        let lamp = Ball {
            center: lamp.center,
            radius: lamp.radius,
            color: 0,
        };
        let [forward, ..] = axes(scene.camera.position, scene.camera.look_at, scene.camera.up);
        let x = lamp.center - scene.camera.position;
        let angle = x.angle_between(forward) - (lamp.radius / x.length()).asin();
        // The corners are at most 20 degrees off the axis.
        assert!(angle > 20f64.to_radians(), "{}", angle.to_degrees());
    }
}

//! A particle file without a scene file: a camera that has it all in the picture, soft light from all around
//! and a lamp behind the viewer's left shoulder.

use std::path::Path;

use glam::DVec3;

use super::load::{Loaded, Source};
use super::particles::look::Look;
use super::particles::{
    Ball, Cloud, Coloring, Fault, RadiusBy, Request, Similarity, colored, gather,
};
use super::{Camera, Environment, Handedness, RenderDefaults, Scene, Sphere, content_hash};
use crate::error::{Error, Result};
use crate::materials::Material;
use crate::materials::diffuse::{self, Diffuse};
use crate::materials::schema::MAX_MAGNITUDE;

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
    let request = request(path, look)?;
    let cloud = gather(&request).map_err(|fault| usage(&fault))?;
    let view = View::of(&cloud.balls)?;
    Ok(loaded(path, look, cloud, &view))
}

/// The frames of a particle file, all seen from one place and coloured by one map.
#[derive(Debug)]
pub(super) struct Movie {
    look: Look,
    request: Request,
    view: View,
}

impl Movie {
    /// Looks at those `frames` of the file.
    ///
    /// # Errors
    /// Those of [`load`].
    pub(super) fn open(
        path: &Path,
        look: &Look,
        frames: impl Fn(u64) -> Result<Vec<u64>>,
    ) -> Result<(Self, Vec<u64>)> {
        let mut request = request(path, look)?;
        let frames = frames(request.frames().map_err(|fault| usage(&fault))?)?;
        let cloud = |frame| {
            let request = Request {
                frame,
                may_be_empty: true,
                ..request.clone()
            };
            gather(&request).map_err(|fault| usage(&fault))
        };
        let mut corners = NOWHERE;
        let mut range: Option<[f64; 2]> = None;
        for frame in &frames {
            let cloud = cloud(*frame)?;
            corners = around(corners, &cloud.balls);
            range = match (range, cloud.range) {
                (Some([a, b]), Some([c, d])) => Some([a.min(c), b.max(d)]),
                (_, new) => new,
            };
        }
        if corners == NOWHERE {
            let text = format!("no frame of {} has particles", path.display());
            return Err(Error::Usage(text));
        }
        let mut framing = Framing::about(corners);
        for frame in &frames {
            framing.add(&cloud(*frame)?.balls);
        }
        if let Coloring::Column { range: of_map, .. } = &mut request.coloring {
            *of_map = range;
        }
        let movie = Self {
            look: look.clone(),
            view: framing.view()?,
            request,
        };
        Ok((movie, frames))
    }

    /// The scene of a frame.
    ///
    /// # Errors
    /// Those of [`load`].
    pub(super) fn load(&self, frame: u64) -> Result<Loaded> {
        let request = Request {
            frame,
            may_be_empty: true,
            ..self.request.clone()
        };
        let cloud = gather(&request).map_err(|fault| usage(&fault))?;
        Ok(loaded(&request.file, &self.look, cloud, &self.view))
    }
}

/// What is asked of the file: its first frame.
fn request(path: &Path, look: &Look) -> Result<Request> {
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
    Ok(Request {
        file: path.to_owned(),
        format: None,
        frame: 0,
        may_be_empty: false,
        radius,
        coloring: coloring.unwrap_or(Coloring::ElementIfKnown),
        select: None,
        transform: Similarity::IDENTITY,
    })
}

fn loaded(path: &Path, look: &Look, cloud: Cloud, view: &View) -> Loaded {
    // Without its ending, and that of gzip before it.
    let plain = match path.extension() {
        Some(ending) if ending.eq_ignore_ascii_case("gz") => path.with_extension(""),
        _ => path.to_owned(),
    };
    let stem = plain.file_stem().unwrap_or_default();
    let name = stem.to_string_lossy().into_owned();
    let scene = scene(cloud, view, look.background.unwrap_or(BACKGROUND));
    Loaded {
        hash: content_hash(&scene),
        warnings: Vec::new(),
        source: Source::Particles(look.clone()),
        files: vec![path.to_owned()],
        frames: None,
        name,
        scene,
    }
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

fn scene(cloud: Cloud, view: &View, background: DVec3) -> Scene {
    let View {
        camera,
        center,
        extent,
    } = view.clone();
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
            motion: DVec3::ZERO,
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
        motion: DVec3::ZERO,
        radius: LAMP[1] * extent,
        material: materials.len(),
        priority: None,
    });
    let black = Diffuse {
        albedo: DVec3::ZERO,
    };
    materials.push(Material {
        emission: DVec3::splat(radiance),
        ..Material::new("lamp", black.into())
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

/// Two corners of a box around nothing.
const NOWHERE: [DVec3; 2] = [DVec3::INFINITY, DVec3::NEG_INFINITY];

/// The corners of a box around these balls too.
fn around(corners: [DVec3; 2], balls: &[Ball]) -> [DVec3; 2] {
    balls.iter().fold(corners, |[low, high], ball| {
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

/// From where particles are seen, and how far they reach.
#[derive(Clone, Debug)]
struct View {
    camera: Camera,
    /// Of the box around them.
    center: DVec3,
    /// From there to the farthest surface.
    extent: f64,
}

impl View {
    fn of(balls: &[Ball]) -> Result<Self> {
        let mut framing = Framing::about(around(NOWHERE, balls));
        framing.add(balls);
        framing.view()
    }
}

/// A view along the axis in which the particles extend least, with the longest from left to right, and somewhat
/// from above and from the side; as near as has all of them in the picture.
struct Framing {
    center: DVec3,
    forward: DVec3,
    upward: DVec3,
    /// The picture's axes, with half of the angle of view along each.
    halves: [(DVec3, f64); 2],
    /// The least distance of the camera from the centre.
    distance: f64,
    extent: f64,
}

impl Framing {
    /// Of particles in the box with these corners.
    fn about([low, high]: [DVec3; 2]) -> Self {
        let extent = high - low;
        let mut order = [0, 1, 2];
        // The sort is stable: of equal ones x is across, y upward.
        order.sort_by(|a, b| extent[*b].total_cmp(&extent[*a]));
        let axis = |i: usize| [DVec3::X, DVec3::Y, DVec3::Z][order[i]];
        let (across, upward) = (axis(0), axis(1));
        let towards = across.cross(upward);
        let direction = (towards + 0.25 * across + 0.3 * upward).normalize();
        let [forward, right, up] = axes(direction, DVec3::ZERO, upward);
        let half = (0.5 * FOV).to_radians();
        let aspect = f64::from(SIZE[0]) / f64::from(SIZE[1]);
        Self {
            center: 0.5 * low + 0.5 * high,
            forward,
            upward,
            halves: [(right, (half.tan() * aspect).atan()), (up, half)],
            distance: 0.0,
            extent: 0.0,
        }
    }

    /// Takes these into the picture.
    fn add(&mut self, balls: &[Ball]) {
        for ball in balls {
            let x = ball.center - self.center;
            self.extent = self.extent.max(x.length() + ball.radius);
            // A plane through the camera at the angle a to the axis touches a ball from outside where
            // (distance - z) sin a - |x| cos a = radius.
            for (axis, a) in self.halves {
                let needed =
                    -x.dot(self.forward) + (ball.radius + x.dot(axis).abs() * a.cos()) / a.sin();
                self.distance = self.distance.max(needed);
            }
        }
    }

    /// The view from there.
    ///
    /// # Errors
    /// [`Error::Usage`] if camera or lamp would be farther away than a scene may say.
    fn view(&self) -> Result<View> {
        let distance = MARGIN * self.distance;
        let farthest = distance.max((LAMP[0] + LAMP[1]) * self.extent);
        if self.center.abs().max_element() + farthest > MAX_MAGNITUDE {
            return Err(Error::Usage(format!(
                "the particles extend to {:e} from their middle: camera and lamp would be beyond {MAX_MAGNITUDE:e}; \
                 in a scene file `transform` brings them together",
                self.extent
            )));
        }
        Ok(View {
            camera: Camera {
                position: self.center - distance * self.forward,
                look_at: self.center,
                up: self.upward,
                fov: FOV,
                handedness: Handedness::Right,
                aperture_radius: 0.0,
                focus_distance: distance,
            },
            center: self.center,
            extent: self.extent,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::verify::Random;

    /// The largest share of a half of the picture that a ball reaches to, in the directions up and across; 1
    /// is the edge.
    fn filled(camera: &Camera, balls: &[Ball]) -> f64 {
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
                let View { camera, .. } = View::of(&balls).expect("a view");
                let filled_by = |camera: &Camera| filled(camera, &balls);
                let there = filled_by(&camera);
                assert!((0.9..1.0).contains(&there), "{shape:?}: {there}");
                // Companion: from a tenth nearer not all is.
                let mut near = camera.clone();
                near.position = near.position.lerp(near.look_at, 0.1);
                assert!(filled_by(&near) > 1.0, "{shape:?}: {}", filled_by(&near));
            }
        }
    }

    #[test]
    fn what_is_too_far_apart_for_a_camera_is_an_error() {
        let ball = |x: f64| Ball {
            center: x * DVec3::X,
            radius: 1.0,
            color: 0,
        };
        let of = |x: f64| View::of(&[ball(-x), ball(x)]);
        let error = of(3e19).expect_err("too far").to_string();
        assert!(
            error.contains("extend to 3e19 from their middle"),
            "{error}"
        );
        let view = of(1e19).expect("a view");
        assert!(view.camera.position.is_finite());
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
            range: None,
        };
        let view = View::of(&cloud.balls).expect("a view");
        let scene = scene(cloud, &view, BACKGROUND);
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

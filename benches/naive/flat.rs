//! A scene as plain programs want it: world coordinates, one record a sphere.

use glam::DVec3;
use gpu_trace::materials::MaterialKind;
use gpu_trace::scene::{Environment, Handedness, Scene};

/// How a surface scatters.
#[derive(Clone, Copy, PartialEq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Kind {
    Diffuse,
    Mirror,
    Dielectric,
}

#[derive(Clone, Copy, serde::Serialize)]
pub(crate) struct FlatSphere {
    pub(crate) center: [f64; 3],
    pub(crate) radius: f64,
    pub(crate) kind: Kind,
    /// Albedo or reflectance.
    pub(crate) color: [f64; 3],
    pub(crate) emission: [f64; 3],
    /// Refractive index inside, and around it: that of the smallest dielectric that holds it.
    pub(crate) ior: [f64; 2],
}

#[derive(Clone, serde::Serialize)]
pub(crate) struct FlatScene {
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) position: [f64; 3],
    pub(crate) look_at: [f64; 3],
    pub(crate) up: [f64; 3],
    pub(crate) fov: f64,
    pub(crate) mirrored: bool,
    pub(crate) environment: [f64; 3],
    pub(crate) spheres: Vec<FlatSphere>,
    /// On the film at distance 1: the corner, and steps of a pixel across and down.
    pub(crate) film: [[f64; 3]; 3],
    /// Semi-axes of the lens, zero for a pinhole, and the distance of the plane that is in focus.
    pub(crate) lens: [[f64; 3]; 2],
    pub(crate) focus: f64,
}

fn ior_around(scene: &Scene, index: usize) -> f64 {
    let inner = &scene.spheres[index];
    scene
        .spheres
        .iter()
        .filter(|outer| {
            outer.radius > inner.radius
                && (outer.center - inner.center).length() < outer.radius - inner.radius + 1.0e-12
        })
        .filter_map(|outer| {
            let kind = &scene.materials[outer.material].kind;
            kind.transmits().then(|| (outer.radius, kind.ior()))
        })
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map_or(1.0, |(_, ior)| ior)
}

impl FlatScene {
    pub(crate) fn of(scene: &Scene) -> Self {
        let spheres = (0..scene.spheres.len()).map(|i| {
            let sphere = &scene.spheres[i];
            let material = &scene.materials[sphere.material];
            let (kind, color, ior) = match &material.kind {
                MaterialKind::Diffuse(m) => (Kind::Diffuse, m.albedo, 1.0),
                MaterialKind::Mirror(m) => (Kind::Mirror, m.reflectance, 1.0),
                glass @ MaterialKind::Dielectric(_) if glass.is_delta() => {
                    (Kind::Dielectric, DVec3::ONE, glass.ior())
                }
                other => panic!("the naive tracers do not know {}", other.name()),
            };
            FlatSphere {
                center: sphere.center.to_array(),
                radius: sphere.radius,
                kind,
                color: color.to_array(),
                emission: material.emission.to_array(),
                ior: [ior, ior_around(scene, i)],
            }
        });
        let camera = &scene.camera;
        let forward = (camera.look_at - camera.position).normalize();
        let mirrored = camera.handedness == Handedness::Left;
        let right = if mirrored {
            camera.up.cross(forward)
        } else {
            forward.cross(camera.up)
        }
        .normalize();
        let up = (camera.up - camera.up.dot(forward) * forward).normalize();
        let pixel = 2.0 * (0.5 * camera.fov.to_radians()).tan() / f64::from(scene.height);
        let (across, down) = (pixel * right, -pixel * up);
        let half = 0.5 * (f64::from(scene.width) * across + f64::from(scene.height) * down);
        Self {
            width: scene.width,
            height: scene.height,
            position: camera.position.to_array(),
            look_at: camera.look_at.to_array(),
            up: camera.up.to_array(),
            fov: camera.fov,
            mirrored,
            environment: {
                let environment = scene.environment.as_ref();
                let radiance = environment.and_then(Environment::constant);
                radiance.unwrap_or_default().to_array()
            },
            spheres: spheres.collect(),
            film: [forward - half, across, down].map(|v| v.to_array()),
            lens: [right, up].map(|v| (camera.aperture_radius * v).to_array()),
            focus: camera.focus_distance,
        }
    }
}

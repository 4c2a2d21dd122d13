//! The kernel's BSDFs on a device, through the dispatch and with the records that a render has.

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use crate::effects::Effects;
use crate::error::Result;
use crate::gpu::device::Gpu;
use crate::gpu::probe::Probe;
use crate::materials::{Material, MaterialKind, Surface};
use crate::placement::Placement;
use crate::scene::{Camera, Handedness, RenderDefaults, Scene, Sphere};
use crate::settings::{GeometryChoice, Integrator, Settings};

/// A question to a BSDF.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct BsdfInput {
    /// Where the path came from.
    pub wo: [f32; 3],
    /// Index of the material.
    pub material: u32,
    /// On the side of `wo`.
    pub normal: [f32; 3],
    /// See [`Surface::eta`].
    pub eta: f32,
    /// Uniform numbers for `sample`, a direction for `evaluate`.
    pub u: [f32; 4],
    /// See [`Surface::offset`].
    pub offset: [f32; 3],
    /// Padding.
    pub unused: u32,
}

impl BsdfInput {
    /// The question, rounded to f32.
    #[must_use]
    pub fn new(material: usize, surface: &Surface, wo: DVec3, u: [f32; 4]) -> Self {
        Self {
            wo: wo.as_vec3().to_array(),
            material: material as u32,
            normal: surface.normal.as_vec3().to_array(),
            eta: surface.eta as f32,
            u,
            offset: surface.offset.as_vec3().to_array(),
            unused: 0,
        }
    }

    /// The surface, as the device has it.
    #[must_use]
    pub fn surface(&self) -> Surface {
        Surface {
            normal: DVec3::from(self.normal.map(f64::from)),
            eta: f64::from(self.eta),
            offset: DVec3::from(self.offset.map(f64::from)),
        }
    }

    /// `wo`, as the device has it.
    #[must_use]
    pub fn wo(&self) -> DVec3 {
        DVec3::from(self.wo.map(f64::from))
    }
}

/// What `sample` answers.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
#[expect(
    missing_docs,
    reason = "the members are those of the kernel's BsdfSample"
)]
pub struct Sampled {
    pub wi: [f32; 3],
    pub pdf: f32,
    pub weight: [f32; 3],
    pub eta: f32,
    pub event: u32,
    pub unused: [u32; 3],
}

impl Sampled {
    /// Where the path goes on.
    #[must_use]
    pub fn wi(&self) -> DVec3 {
        DVec3::from(self.wi.map(f64::from))
    }

    /// f cos/pdf
    #[must_use]
    pub fn weight(&self) -> DVec3 {
        DVec3::from(self.weight.map(f64::from))
    }
}

/// What `evaluate` answers.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
#[expect(
    missing_docs,
    reason = "the members are those of the kernel's BsdfValue"
)]
pub struct Evaluated {
    pub f_cos: [f32; 3],
    pub pdf: f32,
    pub event: u32,
    /// Whether there are delta lobes alone.
    pub delta: u32,
    pub unused: [u32; 2],
}

/// Some materials on a device.
#[derive(Debug)]
pub struct BsdfProbe(Probe);

impl BsdfProbe {
    /// A kernel of exactly these materials, as `integrator` samples them.
    #[must_use]
    pub fn new(gpu: &Gpu, materials: &[MaterialKind], integrator: Integrator) -> Self {
        let named =
            |(i, kind): (usize, &MaterialKind)| Material::new(&format!("m{i}"), kind.clone());
        Self::of(
            gpu,
            materials.iter().enumerate().map(named).collect(),
            integrator,
        )
    }

    /// The same of materials that may have textures, which are looked up where a question is.
    #[must_use]
    pub fn of(gpu: &Gpu, materials: Vec<Material>, integrator: Integrator) -> Self {
        let scene = scene_of(materials);
        let settings = Settings {
            integrator,
            geometry: GeometryChoice::Baked,
            ..Settings::for_scene(&scene)
        };
        let placement = Placement::new(&scene, settings.width, settings.height);
        let effects = Effects::derive(&scene, &placement, &settings);
        Self(Probe::new(gpu, &scene, &placement, &effects))
    }

    /// Samples.
    ///
    /// # Errors
    /// If the device fails.
    pub fn sample(&self, inputs: &[BsdfInput]) -> Result<Vec<Sampled>> {
        self.0.call("sample", inputs)
    }

    /// Evaluates.
    ///
    /// # Errors
    /// If the device fails.
    pub fn evaluate(&self, inputs: &[BsdfInput]) -> Result<Vec<Evaluated>> {
        self.0.call("evaluate", inputs)
    }
}

/// A ball of each material, side by side and none of them special.
fn scene_of(materials: Vec<Material>) -> Scene {
    let ball = |i: usize| Sphere {
        center: DVec3::new(3.0 * i as f64, 0.0, 0.0),
        motion: DVec3::ZERO,
        radius: 1.0,
        material: i,
        priority: None,
    };
    Scene {
        camera: Camera {
            position: DVec3::new(0.0, 0.0, 10.0),
            look_at: DVec3::ZERO,
            up: DVec3::Y,
            fov: 36.0,
            handedness: Handedness::Right,
            aperture_radius: 0.0,
            focus_distance: 1.0,
        },
        width: 16,
        height: 16,
        render: RenderDefaults::default(),
        environment: None,
        spheres: (0..materials.len()).map(ball).collect(),
        materials,
    }
}

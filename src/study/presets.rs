//! Built-in studies: questions that many have, with the options that answer them.

use crate::sampler::Sampler;
use crate::settings::{DEFAULT_TERMINATION, Integrator, Offset};

use super::series::BackendKind;

/// A built-in study. What is `None` or empty is as without one.
#[derive(Clone, Copy, Debug)]
pub struct Preset {
    /// Its name on the command line.
    pub name: &'static str,
    /// The question.
    pub title: &'static str,
    /// What it compares, in one line.
    pub about: &'static str,
    /// The scene.
    pub scene: &'static str,
    /// Estimators.
    pub integrators: &'static [Integrator],
    /// Samplers.
    pub samplers: &'static [Sampler],
    /// What renders.
    pub backends: &'static [BackendKind],
    /// Ways to leave a surface.
    pub offsets: &'static [Offset],
    /// Whether there is a radiance cache.
    pub caches: &'static [bool],
    /// Whether the CPU renders without any nudge only: the truth of the others.
    pub exact_on_cpu: bool,
    /// What renders the reference.
    pub reference: Option<BackendKind>,
    /// Its samples a pixel.
    pub reference_spp: u64,
    /// The longer side of the image, in pixels.
    pub side: u32,
    /// Samples a pixel.
    pub spp: u64,
    /// Runs of each series.
    pub seeds: u64,
    /// Numbers of samples whose images the report shows.
    pub shown: &'static [u64],
}

const LECTURE: Integrator = Integrator::Lecture {
    termination: DEFAULT_TERMINATION,
};

/// All of them.
pub const PRESETS: [Preset; 4] = [
    Preset {
        name: "cpu-gpu",
        title: "CPU against GPU",
        about: "the same paths in f32 on the GPU and in f64 on the CPU: time, and what f32 changes",
        scene: "lecture",
        integrators: &[],
        samplers: &[],
        backends: &[BackendKind::Gpu, BackendKind::Cpu],
        offsets: &[],
        caches: &[],
        exact_on_cpu: false,
        reference: Some(BackendKind::Cpu),
        reference_spp: 4096,
        side: 128,
        spp: 1024,
        seeds: 8,
        shown: &[],
    },
    Preset {
        name: "precision",
        title: "What precision costs",
        about: "f32 as it is and with each nudge of --offset, against f64: the bias of each, and its time",
        scene: "glass",
        integrators: &[],
        samplers: &[],
        backends: &[BackendKind::Gpu, BackendKind::Cpu],
        offsets: &[
            Offset::Exact,
            Offset::None,
            Offset::Back(1.0e-4),
            Offset::Out(1.0e-4),
            Offset::Ulp,
        ],
        caches: &[],
        exact_on_cpu: true,
        reference: Some(BackendKind::Cpu),
        reference_spp: 4096,
        side: 96,
        spp: 1024,
        seeds: 8,
        shown: &[],
    },
    Preset {
        name: "lecture",
        title: "1, 32 and 4096 rays a pixel",
        about: "the lecture's estimator at 1, 32 and 4096 rays a pixel: three images and the law 1/sqrt(N)",
        scene: "lecture",
        integrators: &[LECTURE],
        samplers: &[Sampler::Independent],
        backends: &[],
        offsets: &[],
        caches: &[],
        exact_on_cpu: false,
        reference: None,
        reference_spp: 8192,
        side: 160,
        spp: 4096,
        seeds: 8,
        shown: &[1, 32, 4096],
    },
    Preset {
        name: "estimators",
        title: "What each estimator costs",
        about: "the lecture's estimator, BSDF sampling, light sampling, and the radiance cache",
        scene: "lecture",
        integrators: &[LECTURE, Integrator::Bsdf, Integrator::Path],
        samplers: &[Sampler::Sobol],
        backends: &[],
        offsets: &[],
        caches: &[false, true],
        exact_on_cpu: false,
        reference: None,
        reference_spp: 8192,
        side: 160,
        spp: 1024,
        seeds: 8,
        shown: &[],
    },
];

/// The study of that name.
#[must_use]
pub fn preset(name: &str) -> Option<&'static Preset> {
    PRESETS.iter().find(|preset| preset.name == name)
}

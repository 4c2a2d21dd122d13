//! What the GPU tests share: a device, kernels for any set of effects, and statistics.

pub(crate) mod blocks;
pub(crate) mod images;

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use gpu_trace::backend::cpu::ReferenceRenderer;
use gpu_trace::effects::Effects;
use gpu_trace::film::Film;
use gpu_trace::gpu::device::{DRIVER_ADVICE, DeviceChoice, Gpu, open};
use gpu_trace::gpu::probe::Probe;
use gpu_trace::gpu::renderer::GpuRenderer;
use gpu_trace::job::{Job, prepare};
use gpu_trace::placement::Placement;
use gpu_trace::reference::light::aim::{Aim, aim_pole};
use gpu_trace::scene::Scene;
use gpu_trace::scene::load::{load_file, load_str};
use gpu_trace::settings::Settings;
use gpu_trace::verify::{
    EMPTY, Random, Row, reference_renderer, render_in_f64, render_on, renderer_on, to_row, vector,
};

/// A sphere with a pole frame: its radius, and how far a vertex is above it and along it from its pole.
pub(crate) type Wall = (f64, f64, f64);

/// The rows of the wall, as f32 has them, and what the vertex sees.
pub(crate) fn walled((radius, gap, along): Wall, random: &mut Random) -> ([Row; 2], Aim) {
    let pole = random.direction();
    let across = along * pole.any_orthonormal_vector();
    // The wall falls away from its tangent plane.
    let fall = along * along / (radius + (radius * radius - along * along).sqrt());
    let x = to_row(across + (gap - fall) * pole, 1.0 / radius);
    let pole = to_row(pole, 0.0);
    let aim = aim_pole(vector(x), vector(pole), f64::from(x[3]));
    ([x, pole], aim)
}

/// The device of this test binary.
///
/// # Panics
/// If there is none: a test that does not run must not pass.
pub(crate) fn gpu() -> Gpu {
    static GPU: OnceLock<Gpu> = OnceLock::new();
    let gpu = GPU.get_or_init(|| {
        open(&DeviceChoice::Best).unwrap_or_else(|e| {
            panic!(
                "these tests need a GPU adapter: {e}\n{DRIVER_ADVICE}; `cargo xtask test` does it"
            )
        })
    });
    gpu.clone()
}

/// A scene from text.
pub(crate) fn scene(text: &str) -> Scene {
    load_str("test", text)
        .unwrap_or_else(|e| panic!("{e}"))
        .scene
}

/// A scene from a file of the repository.
pub(crate) fn scene_file(path: impl AsRef<Path>) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(path);
    load_file(&path).unwrap_or_else(|e| panic!("{e}")).scene
}

/// All scene files, relative to the repository.
pub(crate) fn scene_files() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = Vec::new();
    for folder in ["scenes", "scenes/tests"] {
        let entries = std::fs::read_dir(root.join(folder)).expect("the folder of scenes");
        for entry in entries {
            let path = entry.expect("an entry of the folder").path();
            if path.extension().is_some_and(|e| e == "toml") {
                files.push(path.strip_prefix(root).expect("below the root").to_owned());
            }
        }
    }
    files.sort();
    assert!(files.len() >= 10, "only {} scenes found", files.len());
    files
}

/// A job that nothing is wrong with.
pub(crate) fn job(scene: &Scene, settings: &Settings) -> Job {
    prepare(scene, settings).unwrap_or_else(|e| panic!("{e}"))
}

/// A renderer on the GPU.
pub(crate) fn gpu_renderer(scene: &Scene, settings: &Settings) -> GpuRenderer {
    renderer_on(&gpu(), scene, settings).unwrap_or_else(|e| panic!("{e}"))
}

/// Renders on the GPU.
pub(crate) fn render_gpu(scene: &Scene, settings: &Settings) -> Film {
    render_on(&gpu(), scene, settings).unwrap_or_else(|e| panic!("{e}"))
}

/// A renderer on the CPU.
pub(crate) fn cpu_renderer(scene: &Scene, settings: &Settings) -> ReferenceRenderer {
    reference_renderer(scene, settings).unwrap_or_else(|e| panic!("{e}"))
}

/// Renders with the CPU reference.
pub(crate) fn render_cpu(scene: &Scene, settings: &Settings) -> Film {
    render_in_f64(scene, settings).unwrap_or_else(|e| panic!("{e}"))
}

/// A probe of the functions that exactly `effects` bring, with the camera of `scene`.
pub(crate) fn probe_of(scene: &Scene, effects: &[&str]) -> Probe {
    let settings = Settings::for_scene(scene);
    let placement = Placement::with_offset(scene, settings.width, settings.height, settings.offset);
    let stored = |effect: &&str| ["list", "bvh"].contains(effect);
    let geometry: &[&str] = if effects.iter().any(stored) {
        &[]
    } else {
        &["baked"]
    };
    let effects = Effects::named(&[effects, geometry].concat());
    Probe::new(&gpu(), scene, &placement, &effects)
}

/// A probe of the functions that exactly `effects` bring.
pub(crate) fn probe(effects: &[&str]) -> Probe {
    probe_of(&scene(EMPTY), effects)
}

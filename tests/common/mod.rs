//! What the GPU tests share: a device, kernels for any set of effects, and statistics.
#![expect(dead_code, reason = "each test binary uses a part of it")]

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use gpu_trace::check::Random;
use gpu_trace::effects::Effects;
use gpu_trace::film::Film;
use gpu_trace::gpu::device::{DRIVER_ADVICE, DeviceChoice, Gpu, open};
use gpu_trace::gpu::probe::Probe;
use gpu_trace::gpu::renderer::GpuRenderer;
use gpu_trace::job::{Job, prepare};
use gpu_trace::placement::Placement;
use gpu_trace::reference::light::aim::{Aim, aim_pole};
use gpu_trace::reference::renderer::ReferenceRenderer;
use gpu_trace::render::render_quietly;
use gpu_trace::scene::Scene;
use gpu_trace::scene::load::{load_file, load_str};
use gpu_trace::settings::{Rect, Settings};

/// Unit roundoff of f32.
pub(crate) const U: f64 = 1.0 / (1 << 24) as f64;

/// Largest relative error of one f32 addition or multiplication: WGSL leaves the direction of
/// rounding open. Division has 2.5 of these, inverseSqrt 2, sqrt 4.5 (WGSL 15.7.4).
pub(crate) const ULP: f64 = 2.0 * U;

/// A row of the probe.
pub(crate) type Row = [f32; 4];

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

/// The settings of `scene` at another size and number of samples.
pub(crate) fn settings(scene: &Scene, width: u32, height: u32, spp: u64) -> Settings {
    Settings {
        width,
        height,
        crop: Rect {
            x: 0,
            y: 0,
            width,
            height,
        },
        samples: 0..spp,
        ..Settings::for_scene(scene)
    }
}

/// A job that nothing is wrong with.
pub(crate) fn job(scene: &Scene, settings: &Settings) -> Job {
    prepare(scene, settings).unwrap_or_else(|e| panic!("{e}"))
}

/// A renderer on the GPU.
pub(crate) fn gpu_renderer(scene: &Scene, settings: &Settings) -> GpuRenderer {
    GpuRenderer::new(gpu(), &job(scene, settings)).unwrap_or_else(|e| panic!("{e}"))
}

/// Renders on the GPU.
pub(crate) fn render_gpu(scene: &Scene, settings: &Settings) -> Film {
    let mut renderer = gpu_renderer(scene, settings);
    render_quietly(&mut renderer, settings)
        .unwrap_or_else(|e| panic!("{e}"))
        .film
}

/// A renderer on the CPU.
pub(crate) fn cpu_renderer(scene: &Scene, settings: &Settings) -> ReferenceRenderer {
    ReferenceRenderer::new(&job(scene, settings), 0).unwrap_or_else(|e| panic!("{e}"))
}

/// Renders with the CPU reference.
pub(crate) fn render_cpu(scene: &Scene, settings: &Settings) -> Film {
    let mut renderer = cpu_renderer(scene, settings);
    render_quietly(&mut renderer, settings)
        .unwrap_or_else(|e| panic!("{e}"))
        .film
}

/// The means of all pixels and channels, rows from the top.
pub(crate) fn means(film: &Film) -> Vec<f64> {
    (0..film.rect().pixels())
        .flat_map(|i| film.mean(i))
        .collect()
}

/// The bits of the image that a film gives.
pub(crate) fn image_bits(film: &Film) -> Vec<u32> {
    film.pixels()
        .as_flattened()
        .iter()
        .map(|x| x.to_bits())
        .collect()
}

/// A scene that has no effect of its own.
pub(crate) const EMPTY: &str = "
    [camera]
    position = [0.0, 0.0, 4.0]
    look_at = [0.0, 0.0, 0.0]
    fov = 36.0
    [image]
    width = 16
    height = 16
";

/// A probe of the functions that exactly `effects` bring, with the camera of `scene`.
pub(crate) fn probe_of(scene: &Scene, effects: &[&str]) -> Probe {
    let settings = Settings::for_scene(scene);
    let placement = Placement::with_offset(scene, settings.width, settings.height, settings.offset);
    let effects = Effects::of(scene, &placement, &settings, effects);
    Probe::new(&gpu(), scene, &placement, &effects).unwrap_or_else(|e| panic!("{e}"))
}

/// A probe of the functions that exactly `effects` bring.
pub(crate) fn probe(effects: &[&str]) -> Probe {
    probe_of(&scene(EMPTY), effects)
}

/// A vector of a row's first three numbers.
pub(crate) fn vector(row: Row) -> glam::DVec3 {
    glam::DVec3::new(f64::from(row[0]), f64::from(row[1]), f64::from(row[2]))
}

/// A row of a vector and a fourth number, rounded to f32.
pub(crate) fn to_row(v: glam::DVec3, w: f64) -> Row {
    [v.x as f32, v.y as f32, v.z as f32, w as f32]
}

/// Errors of many cases, each in units of its own tolerance.
#[derive(Debug, Default)]
pub(crate) struct Agreement {
    cases: usize,
    beyond: usize,
    worst: f64,
    place: String,
}

impl Agreement {
    /// Takes note of a case; no number is an error without bound.
    pub(crate) fn add(&mut self, error: f64, tolerance: f64, place: impl FnOnce() -> String) {
        let ratio = error / tolerance;
        let ratio = if ratio.is_nan() { f64::INFINITY } else { ratio };
        self.cases += 1;
        self.beyond += usize::from(ratio > 1.0);
        if ratio > self.worst {
            self.worst = ratio;
            self.place = format!("error {error:e}, tolerance {tolerance:e}: {}", place());
        }
    }

    /// Fails unless all of at least `least` cases are within their tolerances.
    pub(crate) fn assert_holds(&self, least: usize) {
        assert!(self.cases >= least, "{} cases, {least} wanted", self.cases);
        assert!(
            self.beyond == 0,
            "{} of {} cases are off, by up to {} times the tolerance; {}",
            self.beyond,
            self.cases,
            self.worst,
            self.place
        );
        eprintln!(
            "{} cases, worst {:.3} of the tolerance",
            self.cases, self.worst
        );
    }

    /// For companions: whether any case is off.
    pub(crate) fn any_fails(&self) -> bool {
        self.beyond > 0
    }

    /// For companions: fails unless at least half of the cases are off.
    pub(crate) fn assert_fails(&self) {
        let (beyond, cases) = (self.beyond, self.cases);
        assert!(
            cases > 0 && 2 * beyond >= cases,
            "only {beyond} of {cases} cases are off"
        );
    }
}

//! `cargo bench --bench hazards -- FOLDER [--spp N] [SCENE...]`: renders scenes that are hard in f32
//! with the kernel, its f64 reference (the truth) and `benches/naive`, in batches that give standard
//! errors. `compare.py` adds Mitsuba, and prints and draws what came out; `cargo xtask bench hazards`
//! runs both.
//!
//! For every scene FOLDER/SCENE.json describes it, and FOLDER/SCENE.RENDERER holds f64 numbers, of
//! shape (batches, height, width, 3). The kernel and its reference trace the same paths: their
//! difference is rounding alone, while the others' has the noise of both.

#[path = "../naive/mod.rs"]
#[expect(dead_code, reason = "variances are for the tests")]
mod naive;

use std::path::{Path, PathBuf};
use std::time::Instant;

use gpu_trace::backend::cpu::ReferenceRenderer;
use gpu_trace::gpu::device::{self, DeviceChoice};
use gpu_trace::gpu::renderer::GpuRenderer;
use gpu_trace::job::prepare;
use gpu_trace::render::{Renderer, render_quietly};
use gpu_trace::scene::{Scene, builtin, load};
use gpu_trace::settings::Settings;
use naive::flat::FlatScene;
use naive::kernel::Kernel;

/// Batches: enough for standard errors that hardly vary themselves.
const BATCHES: u64 = 32;
/// Width and height of every image.
const SIDE: u32 = 128;
const SCENES: [&str; 7] = [
    "lecture",
    "room-5e3",
    "room-1e5",
    "ground-1e6",
    "balls",
    "balls-moved",
    "shell",
];

fn load(name: &str) -> Scene {
    let loaded = if name == "lecture" {
        builtin::resolve(Some(name))
    } else {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/hazards");
        load::load_file(&folder.join(format!("{name}.toml")))
    };
    let mut scene = loaded.unwrap_or_else(|e| panic!("{e}")).scene;
    (scene.width, scene.height) = (SIDE, SIDE);
    scene
}

/// Means of the sample indices of one batch, three channels a pixel.
fn ours(renderer: &mut dyn Renderer, settings: &Settings) -> Vec<f64> {
    let outcome = render_quietly(renderer, settings).unwrap_or_else(|e| panic!("{e}"));
    (0..settings.crop.pixels())
        .flat_map(|i| outcome.film.mean(i))
        .collect()
}

struct Batches<'a> {
    folder: &'a Path,
    scene: &'a str,
    spp: u64,
}

impl Batches<'_> {
    /// Renders all batches with `render` and writes them.
    fn run(
        &self,
        renderer: &str,
        spp: u64,
        mut render: impl FnMut(std::ops::Range<u64>) -> Vec<f64>,
    ) {
        let begin = Instant::now();
        let step = spp / BATCHES;
        let file: Vec<u8> = (0..BATCHES)
            .flat_map(|batch| render(batch * step..(batch + 1) * step))
            .flat_map(f64::to_le_bytes)
            .collect();
        let path = self.folder.join(format!("{}.{renderer}", self.scene));
        std::fs::write(&path, file).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let seconds = begin.elapsed().as_secs_f64();
        eprintln!("{} by {renderer}: {spp} spp, {seconds:.1} s", self.scene);
    }

    fn all(&self) {
        let scene = load(self.scene);
        let mut settings = Settings::for_scene(&scene);
        let job = prepare(&scene, &settings).unwrap_or_else(|e| panic!("{e}"));
        let bounces = settings.max_bounces;
        let flat = FlatScene::of(&scene);
        let gpu = device::open(&DeviceChoice::Best).unwrap_or_else(|e| panic!("{e}"));
        let device = gpu.summary.name.clone();
        let mut description = serde_json::json!(flat);
        description["batches"] = BATCHES.into();
        description["spp"] = self.spp.into();
        description["max_bounces"] = bounces.into();
        description["device"] = format!("{device}, {}", gpu.summary.driver).into();
        let path = self.folder.join(format!("{}.json", self.scene));
        std::fs::write(&path, description.to_string())
            .unwrap_or_else(|e| panic!("{}: {e}", path.display()));

        let mut kernel = GpuRenderer::new(gpu, &job).unwrap_or_else(|e| panic!("{e}"));
        let mut reference = ReferenceRenderer::new(&job, 0).unwrap_or_else(|e| panic!("{e}"));
        let both: [(&str, &mut dyn Renderer); 2] =
            [("gpu-trace", &mut kernel), ("truth", &mut reference)];
        for (name, renderer) in both {
            self.run(name, self.spp, |samples| {
                settings.samples = samples;
                ours(renderer, &settings)
            });
        }
        let mut naive = Kernel::new(&flat, bounces);
        self.run("naive", self.spp, |s| {
            naive.render(s.start as u32..s.end as u32)
        });
        // A quarter of the samples is enough to tell.
        for (name, nudge) in [("naive-f64", 1.0e-4), ("check", 1.0e-7)] {
            self.run(name, self.spp / 4, |s| {
                let image =
                    naive::tracer::render(&flat, bounces, nudge, s.start as u32..s.end as u32);
                image.mean.into_flattened()
            });
        }
    }
}

fn main() {
    let mut folder = None;
    let mut spp = 2048;
    let mut scenes = Vec::new();
    let mut arguments = std::env::args().skip(1).filter(|a| a != "--bench");
    while let Some(argument) = arguments.next() {
        if argument == "--spp" {
            let value = arguments.next().and_then(|n| n.parse().ok());
            spp = value.expect("--spp takes a number");
        } else if folder.is_none() {
            folder = Some(PathBuf::from(argument));
        } else {
            scenes.push(argument);
        }
    }
    assert!(
        spp % (16 * BATCHES) == 0,
        "--spp takes multiples of {}",
        16 * BATCHES
    );
    let Some(folder) = folder else {
        // `cargo bench` and `cargo test --benches` without a table run every benchmark.
        eprintln!("hazards: no folder, nothing to do");
        return;
    };
    std::fs::create_dir_all(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    for scene in SCENES {
        if scenes.is_empty() || scenes.iter().any(|s| s == scene) {
            let batches = Batches {
                folder: &folder,
                scene,
                spp,
            };
            batches.all();
        }
    }
}

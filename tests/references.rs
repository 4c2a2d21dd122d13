//! Images against references of Mitsuba 3 (`tests/references/make.py`).

use std::path::{Path, PathBuf};

use crate::common::{gpu, job};
use crate::equivalence::{Demand, Independent, check, darker, holds, is_found};
use gpu_trace::film::Film;
use gpu_trace::gpu::renderer::GpuRenderer;
use gpu_trace::input::read;
use gpu_trace::job::Job;
use gpu_trace::render::render_quietly;
use gpu_trace::scene::Scene;
use gpu_trace::scene::load::load_str_in;
use gpu_trace::verify::settings;

/// Samples a pixel, in the short form and in the long one: the interval of the bias is a twentieth of a
/// percent wide at most, half of what it may be, and with the long form half of that.
const SPP: [u64; 2] = [4096, 16_384];

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/references")
}

/// One part of the reference of a scene, and its size.
fn part(name: &str, part: &str) -> ([u32; 2], Vec<[f64; 3]>) {
    let read = read(&folder().join(format!("{name}.{part}.npy")));
    let picture = read.unwrap_or_else(|e| panic!("{e}")).picture;
    let pixels = picture.pixels.iter().map(|pixel| pixel.map(f64::from));
    ([picture.width, picture.height], pixels.collect())
}

/// How many samples of a pixel Mitsuba took.
fn samples(name: &str) -> f64 {
    let text = std::fs::read_to_string(folder().join("references.json"));
    let all: serde_json::Value =
        serde_json::from_str(&text.expect("references.json")).expect("JSON");
    all[name]["spp"].as_f64().expect(name)
}

/// A scene, and what Mitsuba says of it.
struct Reference {
    name: &'static str,
    text: String,
    other: Independent,
    demand: Demand,
}

impl Reference {
    fn of(name: &'static str) -> Self {
        let path = folder().join(format!("{name}.toml"));
        let text = std::fs::read_to_string(&path);
        Self {
            name,
            text: text.unwrap_or_else(|e| panic!("{}: {e}", path.display())),
            other: Independent {
                mean: part(name, "mean").1,
                variance: part(name, "variance").1,
                samples: samples(name),
            },
            demand: Demand {
                spp: SPP[usize::from(crate::thorough::thorough())],
                equivalent: 1.0e-3,
            },
        }
    }

    /// The scene with another word in the place of one of its own.
    fn with(&self, own: &str, other: &str) -> Scene {
        assert_eq!(self.text.matches(own).count(), 1, "{own}");
        self.read(&self.text.replace(own, other))
    }

    fn scene(&self) -> Scene {
        self.read(&self.text)
    }

    fn read(&self, text: &str) -> Scene {
        let loaded = load_str_in(self.name, text, &folder());
        let scene = loaded.unwrap_or_else(|e| panic!("{e}")).scene;
        let (size, _) = part(self.name, "mean");
        assert_eq!(size, [scene.width, scene.height]);
        scene
    }

    fn job(&self, scene: &Scene) -> Job {
        let settings = settings(scene, scene.width, scene.height, self.demand.spp);
        job(scene, &settings)
    }

    fn holds(&self, job: &Job) {
        holds(self.name, &render(job), &self.other, self.demand);
    }

    fn is_found(&self, wrong: &str, job: &Job) {
        is_found(self.name, wrong, &render(job), &self.other, self.demand);
    }
}

fn render(job: &Job) -> Film {
    let mut renderer = GpuRenderer::new(gpu(), job).unwrap_or_else(|e| panic!("{e}"));
    let end = render_quietly(&mut renderer, job.settings());
    end.unwrap_or_else(|e| panic!("{e}")).film
}

macro_rules! references {
    ($($name:ident),*) => { $(#[test] fn $name() {
        let reference = Reference::of(stringify!($name));
        check(reference.name, &reference.scene(), &reference.other, reference.demand);
    })* };
}

references!(diffuse, mirror, glass, lens, emitters, mixed);

/// With the shadowing that Mitsuba has; as companions with our own, and with a darker floor.
fn holds_with_separable_shadowing(name: &'static str) {
    let reference = Reference::of(name);
    let scene = reference.scene();
    let own = reference.job(&scene);
    reference.holds(&own.clone().with_separable_shadowing());
    reference.is_found("shadowing by correlated heights", &own);
    let darker = reference.job(&darker(&scene));
    reference.is_found("an albedo 1 % lower", &darker.with_separable_shadowing());
}

#[test]
fn rough_conductor() {
    holds_with_separable_shadowing("rough_conductor");
}

#[test]
fn rough_glass() {
    holds_with_separable_shadowing("rough_glass");
}

/// As companions, with one word of the scene wrong, and with a darker floor.
fn holds_without(mut reference: Reference, own: &str, other: &str) {
    // The interval of the bias is wider than elsewhere.
    reference.demand.spp *= 2;
    let scene = reference.scene();
    reference.holds(&reference.job(&scene));
    let wrong = reference.job(&reference.with(own, other));
    reference.is_found(other, &wrong);
    let darker = reference.job(&darker(&scene));
    reference.is_found("an albedo 1 % lower", &darker);
}

#[test]
fn sky() {
    holds_without(Reference::of("sky"), "rotation = 205.0", "rotation = 206.0");
}

#[test]
fn textures() {
    let reference = Reference::of("textures");
    holds_without(
        reference,
        "axis = [0.5, 1.0, 0.3]",
        "axis = [0.52, 1.0, 0.3]",
    );
}

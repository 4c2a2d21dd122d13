//! What the kernels of all scenes bind, and which loops they have.

use super::cloud;
use crate::common::{scene, scene_file, scene_files};
use gpu_trace::effects::{Effect, Effects};
use gpu_trace::gpu::device::STORAGE_BUFFERS;
use gpu_trace::placement::Placement;
use gpu_trace::sampler::Sampler;
use gpu_trace::scene::Scene;
use gpu_trace::settings::{GeometryChoice, Integrator, LightSampling, Settings};
use gpu_trace::shader::steps::{LOOPS, vertex_steps};
use gpu_trace::shader::{Binding, Kernel, Stage, link};
use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::LazyLock;

/// The kernel of a scene with these settings, and its effects.
fn kernel(scene: &Scene, settings: &Settings) -> (Kernel, Placement, Effects) {
    let placement = Placement::with_offset(scene, settings.width, settings.height, settings.offset);
    let effects = Effects::derive(scene, &placement, settings);
    let kernel = link(Stage::Path, scene, &placement, &effects).unwrap_or_else(|e| panic!("{e}"));
    (kernel, placement, effects)
}

/// What is asked of a scene's kernel.
struct Linked {
    file: PathBuf,
    effects: Effects,
    bindings: Vec<Binding>,
    loops: Vec<String>,
}

/// The kernels of every scene: with as few and with as many effects as settings can bring, in all forms. Linked
/// once for all tests.
fn kernels() -> &'static [Linked] {
    static KERNELS: LazyLock<Vec<Linked>> =
        LazyLock::new(|| scene_files().into_iter().flat_map(kernels_of).collect());
    &KERNELS
}

fn kernels_of(file: PathBuf) -> Vec<Linked> {
    let scene = scene_file(&file);
    let few = Settings {
        integrator: Integrator::Lecture { termination: 0.2 },
        sampler: Sampler::Independent,
        ..Settings::for_scene(&scene)
    };
    let many = Settings {
        adaptive: true,
        classes: true,
        features: true,
        ..Settings::for_scene(&scene)
    };
    let table = Settings {
        light_sampling: Some(LightSampling::Cone),
        ..many.clone()
    };
    // Where there can be one.
    let cache = Settings {
        radiance_cache: true,
        ..Settings::for_scene(&scene)
    };
    let images = Settings {
        lamp_images: true,
        ..Settings::for_scene(&scene)
    };
    // What lights bring is the same in both forms that keep spheres in textures.
    let stored = [GeometryChoice::List, GeometryChoice::Bvh];
    let two = [GeometryChoice::Auto, GeometryChoice::List];
    let forms = [
        GeometryChoice::Auto,
        GeometryChoice::List,
        GeometryChoice::Bvh,
    ];
    let mut all = Vec::new();
    for (settings, forms) in [
        (few, &stored[..]),
        (many, &forms),
        (table, &two),
        (cache, &two),
        (images, &two),
    ] {
        for geometry in forms {
            let settings = Settings {
                geometry: *geometry,
                ..settings.clone()
            };
            let (kernel, _, effects) = kernel(&scene, &settings);
            all.push(Linked {
                file: file.clone(),
                effects,
                bindings: kernel.bindings("render"),
                loops: kernel.loops(),
            });
        }
    }
    all
}

/// Five of eight stay free for what comes, six without a radiance cache.
#[test]
fn few_storage_buffers_are_bound() {
    let mut most = 0;
    for linked in kernels() {
        let (file, bindings, effects) = (&linked.file, &linked.bindings, &linked.effects);
        let buffers = bindings.iter().filter(|b| b.storage_buffer).count();
        let names: Vec<_> = effects.names().collect();
        assert_eq!(
            buffers,
            2 + usize::from(effects.has(Effect::RadianceCache)),
            "{file:?} with {names:?}"
        );
        most = most.max(buffers);
    }
    // What adapters are asked for is what is needed.
    assert_eq!(most, STORAGE_BUFFERS as usize);
}

/// Bindings are numbered without gaps, in the order of their names, and a pass binds only what it uses.
#[test]
fn bindings_are_found_by_name() {
    let scene = scene(&cloud(100));
    let (kernel, ..) = kernel(&scene, &Settings::for_scene(&scene));
    let mut bindings = kernel.bindings("render");
    bindings.sort_by_key(|b| b.number);
    let numbers: Vec<u32> = bindings.iter().map(|b| b.number).collect();
    assert_eq!(numbers, (0..bindings.len() as u32).collect::<Vec<_>>());
    let mut names: Vec<&str> = bindings.iter().map(|b| b.name.as_str()).collect();
    names.sort_unstable();
    let expected = [
        "attribute_texels",
        "counters",
        "deviations",
        "dispatch",
        "material_texels",
        "partials",
        "sum_high",
        "sum_low",
        "tree",
        "view",
    ];
    assert_eq!(names, expected);
    assert_eq!(kernel.bindings("no entry point"), []);
    let probe = crate::common::probe(&["list"]);
    let names = |entry: &str| {
        let bindings = probe.bindings(entry).unwrap_or_else(|e| panic!("{e}"));
        let mut names: Vec<String> = bindings.into_iter().map(|b| b.name).collect();
        names.sort_unstable();
        names
    };
    assert_eq!(names("probe_rounding"), ["inputs", "outputs", "shape"]);
    assert_eq!(
        names("probe_camera_ray"),
        ["inputs", "outputs", "shape", "view"]
    );
}

/// The functions with a loop that the account knows, for these effects.
fn accounted(effects: &Effects) -> Vec<&'static str> {
    let used = LOOPS.iter().filter(|l| (l.used)(effects));
    let mut functions: Vec<&str> = used.map(|l| l.function).collect();
    functions.sort_unstable();
    functions
}

#[test]
fn every_loop_is_accounted_for() {
    let mut found = BTreeSet::new();
    for linked in kernels() {
        let (file, effects) = (&linked.file, &linked.effects);
        let mut loops = linked.loops.clone();
        loops.sort_unstable();
        let names: Vec<_> = effects.names().collect();
        assert_eq!(loops, accounted(effects), "{file:?} with {names:?}");
        found.extend((0..LOOPS.len()).filter(|i| (LOOPS[*i].used)(effects)));
    }
    // All the loops that there are were among them.
    assert_eq!(found.len(), LOOPS.len());
}

#[test]
fn companion_a_loop_that_is_not_accounted_for_is_found() {
    let scene = scene(&cloud(100));
    let settings = |geometry| Settings {
        geometry,
        ..Settings::for_scene(&scene)
    };
    let (list, placement, in_list) = kernel(&scene, &settings(GeometryChoice::List));
    let (baked, _, in_baked) = kernel(&scene, &settings(GeometryChoice::Baked));
    assert_eq!(baked.loops(), accounted(&in_baked));
    assert_ne!(list.loops(), accounted(&in_baked));
    // 100 spheres, eight an iteration, of which the first may have a pole frame; the ends of the loops, and
    // the loop over vertices.
    let poles = placement.poles as u32;
    let ends = 1 + u32::from(in_list.has(Effect::Pole));
    let spheres = poles + (100 - poles).div_ceil(8);
    assert_eq!(vertex_steps(&placement, &in_list), spheres + ends + 1);
    assert_eq!(vertex_steps(&placement, &in_baked), 1);
}

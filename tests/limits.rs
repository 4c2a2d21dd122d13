//! Limits of drivers: llvmpipe, lavapipe's machine, ends every loop in silence after 65535 iterations
//! of all loops of an invocation. Renders that need more take several dispatches, or fail loudly. Of
//! textures: large images are rendered in parts. And of bindings: a pass may have eight storage buffers.

use std::cell::RefCell;
use std::collections::BTreeSet;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::LazyLock;
use std::time::Duration;

use crate::common::images::mean;
use crate::common::{gpu_renderer, job, render_cpu, render_gpu, scene, scene_file, scene_files};
use crate::thorough::thorough;
use gpu_trace::effects::{Effect, Effects};
use gpu_trace::error::{Error, Result};
use gpu_trace::film::{PixelSums, Tally, Tiles, Window};
use gpu_trace::gpu::device::STORAGE_BUFFERS;
use gpu_trace::gpu::renderer::DispatchLimits;
use gpu_trace::placement::Placement;
use gpu_trace::render::{Control, Renderer, Status, StoppedBy, Watch, render, render_quietly};
use gpu_trace::sampler::Sampler;
use gpu_trace::scene::Scene;
use gpu_trace::settings::{GeometryChoice, Integrator, LightSampling, Rect, Settings};
use gpu_trace::shader::steps::{LOOPS, vertex_steps};
use gpu_trace::shader::{Binding, Kernel, Stage, link};
use gpu_trace::verify::{Random, image_bits, means, settings};

/// A closed furnace that keeps all light.
const FURNACE: &str = "
    [camera]
    position = [0.0, 0.0, 0.0]
    look_at = [0.0, 0.0, 1.0]
    fov = 60.0
    [image]
    width = 2
    height = 2
    [material.wall]
    type = \"diffuse\"
    albedo = [1.0, 1.0, 1.0]
    emission = [1.0, 1.0, 1.0]
    [[sphere]]
    center = [0.0, 0.0, 0.0]
    radius = 2.0
    material = \"wall\"
";

/// Many spheres in a cube under a sky.
fn cloud(count: u32) -> String {
    let mut random = Random::new("cloud");
    let mut text = String::from(
        "
        [camera]
        position = [0.0, 0.0, -30.0]
        look_at = [0.0, 0.0, 0.0]
        fov = 40.0
        [image]
        width = 16
        height = 16
        [environment]
        radiance = [1.0, 1.0, 1.0]
        [material.gray]
        type = \"diffuse\"
        albedo = [0.5, 0.5, 0.5]
        ",
    );
    for _ in 0..count {
        let [x, y, z] = [(); 3].map(|()| random.range(-10.0, 10.0));
        let radius = random.range(0.1, 0.4);
        text += &format!(
            "[[sphere]]\ncenter = [{x:?}, {y:?}, {z:?}]\nradius = {radius:?}\nmaterial = \"gray\"\n"
        );
    }
    text
}

#[test]
fn more_bounces_than_a_loop_may_have_in_one_dispatch() {
    let scene = scene(FURNACE);
    let mut long = settings(&scene, 2, 2, 16);
    long.max_bounces = 10_000;
    // 10001 emissions a path, 16 paths: 160016 iterations. Sums of ones are exact.
    assert_eq!(mean(&means(&render_gpu(&scene, &long))), 10_001.0);
}

#[test]
fn more_spheres_than_a_loop_may_visit_in_one_dispatch() {
    let scene = scene(&cloud(5000));
    let many = Settings {
        geometry: GeometryChoice::List,
        ..settings(&scene, 16, 16, 32)
    };
    // The same paths but for rounding at silhouettes, where some 20 of the 8192 part: a difference with a
    // standard deviation of sqrt(20) times half the radiance, 7e-4 of the sum, and four of these.
    let (gpu, cpu) = (
        mean(&means(&render_gpu(&scene, &many))),
        mean(&means(&render_cpu(&scene, &many))),
    );
    assert!(
        (gpu / cpu - 1.0).abs() < 2.8e-3,
        "{gpu} on the GPU, {cpu} on the CPU"
    );
}

#[test]
fn a_path_longer_than_any_dispatch_is_an_error_or_right() {
    let scene = scene(FURNACE);
    let mut endless = settings(&scene, 2, 2, 4);
    endless.max_bounces = 65_535;
    match render_quietly(&mut gpu_renderer(&scene, &endless), &endless) {
        // A driver without such a limit.
        Ok(outcome) => assert_eq!(mean(&means(&outcome.film)), 65_536.0),
        Err(Error::Gpu(text)) => assert!(text.contains("--max-bounces"), "{text}"),
        Err(other) => panic!("{other}"),
    }
}

/// A furnace with many small lamps in it, which look as its wall does.
fn crowded_furnace() -> Scene {
    let mut random = Random::new("crowd");
    let (head, wall) = FURNACE.split_once("[[sphere]]").expect("one sphere");
    let mut text = head.to_owned();
    for _ in 0..4000 {
        let d = random.direction() * random.range(0.4, 1.6);
        text += &format!(
            "[[sphere]]\ncenter = [{:?}, {:?}, {:?}]\nradius = 0.004\nmaterial = \"wall\"\n",
            d.x, d.y, d.z
        );
    }
    scene(&format!("{text}[[sphere]]{wall}"))
}

/// A driver that ends the loop over spheres within a path makes it miss the wall behind them, which is the
/// last of the list: what it saw until then is no sample.
#[test]
fn a_path_within_which_a_loop_ends_is_an_error_or_right() {
    let scene = crowded_furnace();
    let endless = |geometry| Settings {
        max_bounces: 1000,
        integrator: Integrator::Bsdf,
        geometry,
        ..settings(&scene, 2, 1, 1)
    };
    // By the tree the path may fit.
    let forms = [GeometryChoice::List, GeometryChoice::Bvh].map(endless);
    for (endless, seed) in forms
        .iter()
        .flat_map(|s| (1..=8).map(move |seed| (s, seed)))
    {
        let mut renderer = gpu_renderer(&scene, endless).with_seed(seed);
        match render_quietly(&mut renderer, endless) {
            // A driver without such a limit.
            Ok(outcome) => assert_eq!(means(&outcome.film), [1001.0; 6], "seed {seed}"),
            Err(Error::Gpu(text)) => assert!(text.contains("--max-bounces"), "{text}"),
            Err(other) => panic!("{other}"),
        }
    }
}

/// In a tree an invocation does not know how many iterations the driver has counted: it goes on until loops end. The
/// path that this happens to is no sample, and begun again; rays are counted once.
#[test]
fn paths_in_a_tree_go_on_in_the_next_dispatch() {
    // In the furnace every path is as long as the next, has exactly its light, and often runs into the driver's limit;
    // in the cloud paths differ, and rarely do.
    // In the furnace a few samples are enough for that, some four in a dispatch; the long form has as many as the cloud.
    let (furnace, cloud) = (crowded_furnace(), scene(&cloud(5000)));
    let few = if thorough() { 64 } else { 16 };
    for (scene, spp, whole) in [(furnace, few, true), (cloud, 64, false)] {
        let settings = Settings {
            max_bounces: 150,
            integrator: Integrator::Bsdf,
            geometry: GeometryChoice::Bvh,
            ..settings(&scene, 16, 16, spp)
        };
        let film = |steps: Option<u32>, seed| {
            let renderer = gpu_renderer(&scene, &settings).with_seed(seed);
            let mut renderer = match steps {
                Some(steps) => renderer.with_step_limit(steps),
                None => renderer,
            };
            let outcome = render_quietly(&mut renderer, &settings);
            outcome.unwrap_or_else(|e| panic!("{e}")).film
        };
        let usual = film(None, 0);
        if whole {
            assert_eq!(means(&usual), vec![151.0; 3 * 256]);
            assert_eq!(usual.tally().rays, 151 * 256 * spp);
        }
        for steps in [1, u32::MAX] {
            let other = film(Some(steps), 0);
            assert_eq!(image_bits(&other), image_bits(&usual), "{steps}");
            assert_eq!(other.tally(), usual.tally(), "{steps}");
        }
        // Companion: other samples.
        let other = film(None, 1);
        assert_eq!(image_bits(&other) == image_bits(&usual), whole);
        assert_eq!(other.tally() == usual.tally(), whole);
    }
}

/// Asks to stop after so many paths.
struct Impatient {
    enough: f64,
    paths: u64,
    /// Reports after that.
    late: u32,
}

impl Watch for Impatient {
    fn update(&mut self, status: &Status) {
        self.late += u32::from(self.interrupted());
        self.paths = status.paths;
    }

    fn interrupted(&self) -> bool {
        self.paths as f64 >= self.enough
    }
}

/// Images beyond a region are rendered in parts, window by window: a signal does not wait for the rest of
/// a window, unless there would be no image.
#[test]
fn large_images_stop_between_their_parts() {
    let scene = scene(&cloud(8));
    let settings = settings(&scene, 2100, 8, 256);
    let limits = DispatchLimits {
        tiles: 16,
        samples: 16,
    };
    let renderer = || gpu_renderer(&scene, &settings).with_limits(limits);
    // In the first window, of 16 samples, and in the second, of 48.
    for samples in [0.1, 17.0, 30.0, 60.0] {
        let mut watch = Impatient {
            enough: samples * settings.crop.pixels() as f64,
            paths: 0,
            late: 0,
        };
        let outcome = render(&mut renderer(), &job(&scene, &settings), &mut watch);
        assert_eq!(outcome.stopped_by, StoppedBy::Interrupt);
        let done = outcome.film.samples();
        let first = samples < 16.0;
        assert!(done == 16 || first && (4..16).contains(&done), "{done}");
        assert_eq!(watch.late > 0, first, "{samples}: {} late", watch.late);
        let whole = render_gpu(
            &scene,
            &Settings {
                samples: 0..done,
                ..settings.clone()
            },
        );
        assert_eq!(means(&outcome.film), means(&whole), "{samples}");
        assert_eq!(outcome.film.tally(), whole.tally(), "{samples}");
    }
}

/// Where one part of a large image goes, the others have to follow: there must be time for that.
#[test]
fn large_images_keep_to_the_time() {
    /// Takes note of what it is asked.
    struct Clock {
        enough: bool,
        asked: RefCell<Vec<Duration>>,
    }
    impl Control for Clock {
        fn proceed(&mut self, _: u64) -> bool {
            true
        }
        fn has_time(&self, rest: Duration) -> bool {
            self.asked.borrow_mut().push(rest);
            self.enough
        }
    }
    let scene = scene(&cloud(8));
    let settings = settings(&scene, 2100, 8, 256);
    let limits = DispatchLimits {
        tiles: 1 << 20,
        samples: 4,
    };
    let mut renderer = gpu_renderer(&scene, &settings).with_limits(limits);
    for (enough, end) in [(false, 4), (true, 16)] {
        let mut clock = Clock {
            enough,
            asked: RefCell::default(),
        };
        let window = renderer.render(0..16, &mut clock).expect("a window");
        assert_eq!(window.samples, 0..end);
        let asked = clock.asked.borrow();
        // Only of the first part, after every slab; the last one may have been all.
        assert_eq!(asked.len() as u64, end / 4);
        assert!(asked.iter().all(|rest| *rest > Duration::ZERO));
        assert!(
            window.pixels.iter().all(|p| p.sum[0] > 0.0),
            "a part is missing"
        );
    }
}

/// A window that came back short for want of time is the last, whatever time is left then: none begins where
/// windows never do.
#[test]
fn a_window_cut_short_is_the_last() {
    struct Short;
    impl Renderer for Short {
        fn device(&self) -> (String, String, String) {
            Default::default()
        }
        fn render_tiles(
            &mut self,
            samples: Range<u64>,
            _: Option<&Tiles>,
            _: &mut dyn Control,
        ) -> Result<Window> {
            // The second window.
            let end = if samples.start == 16 { 24 } else { samples.end };
            Ok(Window {
                image: Vec::new(),
                rect: RECT,
                samples: samples.start..end,
                batch: 4,
                pixels: vec![PixelSums::default(); RECT.pixels()],
                aovs: Vec::new(),
                tally: Tally::default(),
            })
        }
        fn show(&mut self, _: Rect) {}
        fn device_bytes(&self) -> u64 {
            0
        }
    }
    const RECT: Rect = Rect::whole(2, 2);
    let settings = Settings {
        time: Some(Duration::from_secs(3600)),
        ..settings(&scene(FURNACE), 2, 2, 256)
    };
    let outcome = render_quietly(&mut Short, &settings).expect("an image");
    assert_eq!(outcome.stopped_by, StoppedBy::Time);
    assert_eq!(outcome.film.samples(), 24);
}

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
    let mut all = Vec::new();
    for settings in [few, many, table, cache] {
        for geometry in [
            GeometryChoice::Auto,
            GeometryChoice::List,
            GeometryChoice::Bvh,
        ] {
            let settings = Settings {
                geometry,
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

/// Four of eight stay free for what comes, five without a radiance cache.
#[test]
fn few_storage_buffers_are_bound() {
    let mut most = 0;
    for linked in kernels() {
        let (file, bindings, effects) = (&linked.file, &linked.bindings, &linked.effects);
        let buffers = bindings.iter().filter(|b| b.storage_buffer).count();
        let names: Vec<_> = effects.names().collect();
        let binds_scene = bindings.iter().any(|b| b.name == "scene");
        assert_eq!(
            buffers,
            2 + usize::from(binds_scene) + usize::from(effects.has(Effect::RadianceCache)),
            "{file:?} with {names:?}"
        );
        let reads_scene = effects.keeps_spheres()
            || effects.has(Effect::Table)
            || effects.has_textures()
            || effects.has_mixes();
        assert_eq!(binds_scene, reads_scene, "{file:?} with {names:?}");
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
        "counters",
        "deviations",
        "dispatch",
        "partials",
        "scene",
        "sum_high",
        "sum_low",
        "tree",
        "view",
    ];
    assert_eq!(names, expected);
    assert_eq!(kernel.bindings("no entry point"), []);
    let probe = crate::common::probe(&["list"]);
    let names = |entry: &str| {
        let bindings = probe.kernel().bindings(entry);
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

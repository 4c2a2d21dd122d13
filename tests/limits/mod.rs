//! Limits of drivers: llvmpipe, lavapipe's machine, ends every loop in silence after 65535 iterations
//! of all loops of an invocation. Renders that need more take several dispatches, or fail loudly. Of
//! textures: large images are rendered in parts. And of bindings: a pass may have eight storage buffers.

mod kernels;
mod pace;

use crate::common::images::{Left, assert_same, mean, uniform};
use crate::common::{gpu_renderer, render_cpu, render_gpu, scene};
use crate::thorough::thorough;
use gpu_trace::error::Error;
use gpu_trace::render::render_quietly;
use gpu_trace::scene::Scene;
use gpu_trace::settings::{GeometryChoice, Integrator, Settings};
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
    let film = render_gpu(&scene, &long);
    let _left = Left::of("more bounces", &film, &uniform(&film, [10_001.0; 3]));
    assert_eq!(mean(&means(&film)), 10_001.0);
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
    let (film, reference) = (render_gpu(&scene, &many), render_cpu(&scene, &many));
    let _left = Left::of("more spheres", &film, &reference);
    let [gpu, cpu] = [film, reference].map(|film| mean(&means(&film)));
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
        Ok(outcome) => {
            let film = outcome.film;
            let _left = Left::of("a long path", &film, &uniform(&film, [65_536.0; 3]));
            assert_eq!(mean(&means(&film)), 65_536.0);
        }
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
            Ok(outcome) => {
                let (film, wanted) = (&outcome.film, uniform(&outcome.film, [1001.0; 3]));
                let _left = Left::of("a crowded furnace", film, &wanted);
                assert_eq!(means(film), [1001.0; 6], "seed {seed}");
            }
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
            let _left = Left::of("in a tree", &usual, &uniform(&usual, [151.0; 3]));
            assert_eq!(means(&usual), vec![151.0; 3 * 256]);
            assert_eq!(usual.tally().rays, 151 * 256 * spp);
        }
        for steps in [1, u32::MAX] {
            let other = film(Some(steps), 0);
            assert_same(format!("in a tree, {steps} steps"), &other, &usual);
            assert_eq!(other.tally(), usual.tally(), "{steps}");
        }
        // Companion: other samples.
        let other = film(None, 1);
        assert_eq!(image_bits(&other) == image_bits(&usual), whole);
        assert_eq!(other.tally() == usual.tally(), whole);
    }
}

//! Limits of drivers: llvmpipe, lavapipe's machine, ends every loop in silence after 65535 iterations
//! of all loops of an invocation. Renders that need more take several dispatches, or fail loudly.

mod common;

use common::{gpu_renderer, means, render_cpu, render_gpu, scene, settings};
use gpu_trace::error::Error;
use gpu_trace::film::Film;
use gpu_trace::render::render_quietly;

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
    let mut random = gpu_trace::check::Random::new("cloud");
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

fn mean(film: &Film) -> f64 {
    let values = means(film);
    values.iter().sum::<f64>() / values.len() as f64
}

#[test]
fn more_bounces_than_a_loop_may_have_in_one_dispatch() {
    let scene = scene(FURNACE);
    let mut long = settings(&scene, 2, 2, 16);
    long.max_bounces = 10_000;
    // 10001 emissions a path, 16 paths: 160016 iterations. Sums of ones are exact.
    assert_eq!(mean(&render_gpu(&scene, &long)), 10_001.0);
}

#[test]
fn more_spheres_than_a_loop_may_visit_in_one_dispatch() {
    let scene = scene(&cloud(5000));
    let many = settings(&scene, 16, 16, 32);
    // The same paths but for rounding at silhouettes, where some 20 of the 8192 part: a difference with a
    // standard deviation of sqrt(20) times half the radiance, 7e-4 of the sum, and four of these.
    let (gpu, cpu) = (
        mean(&render_gpu(&scene, &many)),
        mean(&render_cpu(&scene, &many)),
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
        Ok(outcome) => assert_eq!(mean(&outcome.film), 65_536.0),
        Err(Error::Gpu(text)) => assert!(text.contains("--max-bounces"), "{text}"),
        Err(other) => panic!("{other}"),
    }
}

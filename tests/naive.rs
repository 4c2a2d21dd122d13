//! Images against the path tracer as one writes it first, in f64 (`benches/naive`): it shares nothing with ours,
//! from the ray through a pixel to random numbers, and finds lamps by chance alone.

#[path = "../benches/naive/mod.rs"]
#[expect(dead_code, reason = "its kernel is for the benchmarks")]
mod peer;

use crate::equivalence::{Demand, Independent, check};
use gpu_trace::materials::MaterialKind;
use gpu_trace::scene::Scene;
use gpu_trace::settings::Settings;
use peer::flat::FlatScene;
use peer::tracer::render;

/// What moves a ray off its surface, in scene units: some thousand roundings of f64 in these scenes, and a
/// hundredth of the thinnest glass.
const NUDGE: f64 = 1.0e-7;

/// Holds `scene` to the naive image of it, at as many samples a pixel, `spp` in the short form, and to a bias of
/// at most `equivalent` there: the noise of both makes its interval half as wide. The long form has sixteen times
/// the samples, and so finds a quarter of the bias.
///
/// The naive image's variance is what its samples met: `spp` must be enough for the rarest light of a pixel.
fn holds(name: &str, scene: &mut Scene, size: [u32; 2], spp: u32, equivalent: f64) {
    let (spp, equivalent) = if crate::thorough::thorough() {
        (16 * spp, equivalent / 4.0)
    } else {
        (spp, equivalent)
    };
    [scene.width, scene.height] = size;
    let bounces = Settings::for_scene(scene).max_bounces;
    let image = render(&FlatScene::of(scene), bounces, NUDGE, 0..spp);
    let other = Independent {
        mean: image.mean,
        variance: image.variance,
        samples: spp.into(),
    };
    let demand = Demand {
        spp: spp.into(),
        equivalent,
    };
    check(&format!("naive-{name}"), scene, &other, demand);
}

/// Walls of radius 1000, and colours that throw light back and forth.
#[test]
fn lecture() {
    let mut scene = crate::common::scene_file("scenes/lecture.toml");
    holds("lecture", &mut scene, [16, 16], 8192, 8.0e-3);
}

/// A mirror, glass, and its caustic, in a closed room.
#[test]
fn glass() {
    let mut scene = crate::common::scene_file("scenes/glass.toml");
    holds("glass", &mut scene, [16, 13], 8192, 1.2e-2);
}

/// A diffuse ball within glass, a lamp, a sky.
#[test]
fn mixed() {
    let mut scene = crate::common::scene_file("tests/references/mixed.toml");
    holds("mixed", &mut scene, [10, 14], 8192, 5.0e-3);
}

/// Spheres through a lens: without the reflective ones, which the naive tracer does not know, and the last of
/// the others.
#[test]
fn field() {
    let mut scene = crate::common::scene_file("scenes/field.toml");
    let materials = scene.materials.clone();
    let known = |at: usize| !matches!(materials[at].kind, MaterialKind::Reflective(_));
    scene.spheres.retain(|sphere| known(sphere.material));
    scene.spheres.truncate(60);
    holds("field", &mut scene, [16, 9], 8192, 5.0e-3);
}

/// Glass of thickness 1e-5, seen and seen through.
#[test]
fn shell() {
    let mut scene = crate::common::scene_file("benches/hazards/shell.toml");
    holds("shell", &mut scene, [16, 16], 4096, 5.0e-3);
}

/// A ground of radius 1e6 under balls of 0.5.
#[test]
fn ground() {
    let mut scene = crate::common::scene_file("benches/hazards/ground-1e6.toml");
    holds("ground", &mut scene, [16, 16], 16_384, 3.0e-3);
}

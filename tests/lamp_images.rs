//! Images of lamps in smooth spheres: that looking for them changes no mean, and where there are none.
//!
//! That arcs are what rays find, and that directions have the pdf that is said, is in `src/reference/light/images.rs`;
//! that the kernel traces the reference's paths in `agreement`.

use gpu_trace::effects::{Effect, image_obstacle};
use gpu_trace::film::Film;
use gpu_trace::gpu::renderer::GpuRenderer;
use gpu_trace::placement::Placement;
use gpu_trace::placement::images::{MOST_IMAGES, Way};
use gpu_trace::render::render_quietly;
use gpu_trace::scene::Scene;
use gpu_trace::settings::{GeometryChoice, Integrator, LightSampling, Offset, Settings};
use gpu_trace::verify::settings;

use crate::common::blocks::Blocks;
use crate::common::images::Left;
use crate::common::{gpu, gpu_renderer, job, scene, scene_file};
use crate::thorough::thorough;

/// Pixels of a side of the image, and of the blocks whose means are compared.
const SIZE: u32 = 64;
const BLOCK: usize = 8;

/// A camera over a floor, with the spheres of a case. All of the floor that it sees is near to them: far away samples that
/// find an image by chance are so few that none of them tells the variance.
fn floor(spheres: &str) -> Scene {
    scene(&format!(
        "[camera]\nposition = [0, 5, 4]\nlook_at = [0, 0.3, 0]\nfov = 28.0\n[image]\nwidth = 64\nheight = 64\n\
         [material.gray]\ntype = \"diffuse\"\nalbedo = [0.7, 0.6, 0.5]\n\
         [material.lamp]\ntype = \"diffuse\"\nalbedo = [0.5, 0.5, 0.5]\nemission = [20, 18, 15]\n\
         [material.mirror]\ntype = \"mirror\"\nreflectance = [0.9, 0.8, 0.7]\n\
         [material.glass]\ntype = \"dielectric\"\nior = 1.5\n\
         [material.bubble]\ntype = \"dielectric\"\nior = 0.7\n\
         [[sphere]]\ncenter = [0, -1000, 0]\nradius = 1000\nmaterial = \"gray\"\n{spheres}"
    ))
}

fn sphere([x, y, z]: [f64; 3], radius: f64, material: &str) -> String {
    format!("[[sphere]]\ncenter = [{x}, {y}, {z}]\nradius = {radius}\nmaterial = \"{material}\"\n")
}

/// Spheres in the ways that are hard for images, each with whether it has any.
fn cases() -> Vec<(&'static str, Scene, bool)> {
    let of = |spheres: &[([f64; 3], f64, &str)]| {
        let text: String = spheres.iter().map(|(c, r, m)| sphere(*c, *r, m)).collect();
        floor(&text)
    };
    vec![
        (
            "mirror and glass",
            of(&[
                ([-1.2, 0.8, 0.0], 0.7, "mirror"),
                ([1.0, 0.7, 0.5], 0.7, "glass"),
                ([0.5, 3.0, -1.0], 0.8, "lamp"),
            ]),
            true,
        ),
        (
            "a lamp at the horizon of a sphere on the floor",
            of(&[
                ([0.0, 0.5, 0.0], 0.5, "mirror"),
                ([2.0, 0.8, 0.0], 0.8, "lamp"),
            ]),
            true,
        ),
        (
            "a lamp next to a sphere",
            of(&[
                ([0.0, 0.5, 0.0], 0.5, "glass"),
                ([0.0, 1.31, 0.0], 0.3, "lamp"),
            ]),
            true,
        ),
        (
            "a lamp in a sphere",
            of(&[
                ([0.0, 0.5, 0.0], 0.5, "mirror"),
                ([0.0, 1.1, 0.0], 0.3, "lamp"),
            ]),
            false,
        ),
        (
            "a large lamp, and small spheres",
            of(&[
                ([-0.6, 0.3, 1.0], 0.2, "mirror"),
                ([0.6, 0.4, 1.0], 0.2, "bubble"),
                ([0.0, 6.0, -3.0], 3.0, "lamp"),
            ]),
            true,
        ),
        (
            "small lamps",
            of(&[
                ([-0.8, 0.8, 0.0], 0.8, "glass"),
                ([0.9, 0.8, 0.0], 0.8, "mirror"),
                ([-0.5, 3.0, 1.0], 0.3, "lamp"),
                ([0.8, 2.5, 1.5], 0.25, "lamp"),
            ]),
            true,
        ),
    ]
}

fn imaged(scene: &Scene, spp: u64) -> Settings {
    Settings {
        lamp_images: true,
        ..settings(scene, SIZE, SIZE, spp)
    }
}

fn film(renderer: GpuRenderer, settings: &Settings, seed: u64) -> Film {
    let mut renderer = renderer.with_seed(seed);
    let outcome = render_quietly(&mut renderer, settings).unwrap_or_else(|e| panic!("{e}"));
    outcome.film
}

/// What the mean of the squares may be: 192 blocks, whose channels go together, are some 64 independent ones, so that it
/// has a standard deviation of 0.18, or of more where samples are far from normal.
const APART: f64 = 1.8;

#[test]
fn it_changes_no_mean() {
    let spp = if thorough() { 8192 } else { 512 };
    let mut all = cases();
    all.push(("glass", scene_file("scenes/glass.toml"), true));
    for (name, scene, has_images) in all {
        let with = imaged(&scene, spp);
        let without = Settings {
            lamp_images: false,
            ..with.clone()
        };
        let job = job(&scene, &with);
        assert_eq!(job.effects().has(Effect::LampImages), has_images, "{name}");
        if !has_images {
            continue;
        }
        let truth = film(gpu_renderer(&scene, &without), &without, 1);
        let found = film(gpu_renderer(&scene, &with), &with, 2);
        let _left = Left::of(format!("lamp images, {name}"), &found, &truth);
        let wanted = Blocks::of(&truth, BLOCK);
        let blocks = Blocks::of(&found, BLOCK);
        let [squares, z, unseen] = blocks.apart(&wanted);
        let gain = wanted.image[1] / blocks.image[1];
        let rays = |film: &Film| film.tally().rays as f64 / film.paths() as f64;
        eprintln!(
            "{name}: squares of z {squares:.3}; mean: z {z:.2}, biases below {unseen:.5} are not seen; \
             variance of the mean {gain:.2} times less, rays {:.2} for {:.2}",
            rays(&found),
            rays(&truth)
        );
        assert!(squares < APART && z < 4.0, "{name}: {squares} {z}");
        // A companion: as if images were looked for twice as often as they are.
        let twice = [("IMAGED", 2.0)];
        let renderer = GpuRenderer::with_constants(gpu(), &job, &twice);
        let renderer = renderer.unwrap_or_else(|e| panic!("{e}"));
        let wrong = Blocks::of(&film(renderer, &with, 2), BLOCK);
        let [squares, z, _] = wrong.apart(&wanted);
        eprintln!("{name}, taken for more: squares of z {squares:.3}; mean: z {z:.2}");
        assert!(squares > APART || z > 4.0, "{name}: {squares} {z}");
    }
}

#[test]
fn images_are_of_lamps_apart_from_spheres() {
    let placement = |scene: &Scene| Placement::new(scene, SIZE, SIZE);
    let counts: Vec<usize> = cases()
        .iter()
        .map(|(_, scene, _)| placement(scene).images.expect("few").len())
        .collect();
    assert_eq!(counts, [3, 1, 2, 0, 3, 6]);
    let (_, scene, _) = &cases()[0];
    let images = placement(scene).images.expect("few");
    let ways: Vec<Way> = images.iter().map(|image| image.way).collect();
    assert_eq!(ways, [Way::Reflected, Way::Reflected, Way::Through]);
    // Too many.
    let mirrors = (0..=MOST_IMAGES).map(|i| sphere([i as f64, 0.5, 0.0], 0.3, "mirror"));
    let text: String = mirrors.collect::<String>() + &sphere([0.0, 4.0, 0.0], 0.5, "lamp");
    assert_eq!(placement(&floor(&text)).images, None);
}

#[test]
fn what_stands_against_images_is_said() {
    let (_, plain, _) = &cases()[0];
    let why = |scene: &Scene, change: &dyn Fn(&mut Settings)| {
        let mut settings = imaged(scene, 64);
        change(&mut settings);
        let placement =
            Placement::with_offset(scene, settings.width, settings.height, settings.offset);
        image_obstacle(scene, &placement, &settings).unwrap_or("")
    };
    assert_eq!(why(plain, &|_| {}), "");
    assert_eq!(why(plain, &|s| s.geometry = GeometryChoice::Bvh), "");
    for (change, said) in [
        (
            &(|s: &mut Settings| s.integrator = Integrator::Nee) as &dyn Fn(&mut Settings),
            "--integrator",
        ),
        (&|s| s.light_sampling = Some(LightSampling::Cone), "table"),
        (&|s| s.classes = true, "layers"),
        (&|s| s.offset = Offset::Ulp, "--offset"),
    ] {
        let why = why(plain, change);
        assert!(why.contains(said), "{why}");
    }
    let with = |spheres: &str| {
        let lamp = sphere([0.5, 3.0, -1.0], 0.4, "lamp");
        why(&floor(&(lamp + spheres)), &|_| {})
    };
    assert!(with("").contains("no smooth mirror"));
    let inner = sphere([0.0, 1.0, 0.0], 0.5, "glass") + &sphere([0.0, 1.0, 0.0], 0.3, "bubble");
    assert!(with(&inner).contains("share points"));
    let mirror = sphere([0.0, 1.0, 0.0], 0.5, "mirror");
    assert_eq!(with(&mirror), "");
    let dark = why(&floor(&sphere([0.0, 1.0, 0.0], 0.5, "mirror")), &|_| {});
    assert!(dark.contains("no lamp"), "{dark}");
}

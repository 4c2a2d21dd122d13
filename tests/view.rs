//! `--view`: images of something else than light.

use crate::cli_support::{Folder, GOOD, holds, mean};
use crate::common::images::Left;

const ONE: &str = "
    camera = { position = [0, 0, -5], look_at = [0, 0, 0], fov = 40 }
    image = { width = 16, height = 16 }
    environment = { radiance = [1000, 1000, 1000] }
    material.gray = { type = \"diffuse\", albedo = [0.5, 0.5, 0.5] }
    sphere = [{ center = [0, 0, 0], radius = 1, material = \"gray\" }]
";

#[test]
fn one_leaf_is_one_step_a_ray() {
    let folder = Folder::new();
    folder.write("one.toml", ONE);
    let arguments = "one.toml --geometry bvh --view bvh-cost --spp 8 -o a.npy";
    // Whether it meets the ball or not, and however bright the light is.
    let (one, _) = folder.render(&format!("{arguments} --max-bounces 0"));
    let _left = Left::alone("one leaf", &one);
    assert!(one.pixels.iter().all(|pixel| *pixel == [1.0; 3]), "{one:?}");
    // Companion: a sample that goes on takes one for each of its rays.
    let (more, stats) = folder.render(arguments);
    let rays = stats["rays"].as_f64().expect("a number");
    assert!(rays > 16.0 * 16.0 * 8.0 + 100.0);
    assert_eq!(more.pixels[0], [1.0; 3]);
    let steps = mean(&more) * 16.0 * 16.0 * 8.0;
    assert!((steps / rays - 1.0).abs() < 1e-6, "{steps} {rays}");
}

#[test]
fn the_paths_are_those_of_the_image() {
    let folder = Folder::new();
    let arguments = "field --size 48x32 --spp 4 --geometry bvh --quiet -o a.npy --stats a.json";
    let said = folder.ok(&arguments.replace("--quiet", "--view bvh-cost -o a.png -o a.exr"));
    holds(&said, &["steps through the tree a sample", "pale yellow"]);
    let cost = folder.npy("a.npy");
    let with = folder.json("a.json");
    assert!(folder.read("a.exr").windows(8).any(|w| w == b"bvh-cost"));
    let colours = image::open(folder.path("a.png")).expect("a PNG").to_rgb8();
    assert!(colours.pixels().any(|pixel| pixel.0[0] > 200));
    folder.ok(arguments);
    assert_eq!(with["rays"], folder.json("a.json")["rays"]);
    assert_ne!(cost.pixels, folder.npy("a.npy").pixels);
    let _left = Left::alone("steps in a field", &cost);
    // The sky at the top is cheaper than the balls.
    let row = |y: usize| (0..48).map(|x| cost.pixels[y * 48 + x][0]).sum::<f32>();
    assert!(
        row(31) > 2.0 * row(0) && row(0) >= 48.0,
        "{} {}",
        row(0),
        row(31)
    );
}

#[test]
fn what_has_no_tree_is_refused() {
    let folder = Folder::new();
    folder.write("good.toml", GOOD);
    for (arguments, says) in [
        (
            "good.toml --view bvh-cost",
            &["baked", "--geometry bvh"][..],
        ),
        (
            "field --geometry list --view bvh-cost",
            &["list", "--geometry bvh"],
        ),
        ("field --view bvh-cost --backend cpu", &["no tree"]),
        (
            "field --view bvh-cost --checkpoint a.film",
            &["--checkpoint"],
        ),
        (
            "field --view bvh-cost -o a.exr --aov direct",
            &["layers of light"],
        ),
        ("field --view depth", &["bvh-cost"]),
    ] {
        let words: Vec<&str> = arguments.split(' ').collect();
        holds(&folder.refused(&words), says);
    }
}

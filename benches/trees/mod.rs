//! A loop over all spheres against a tree, by their number; and what a tree costs as they grow.

use std::fmt::Write as _;
use std::time::Instant;

use glam::DVec3;
use gpu_trace::bvh::Tree;
use gpu_trace::materials::diffuse::Diffuse;
use gpu_trace::materials::{Material, MaterialKind};
use gpu_trace::placement::Placement;
use gpu_trace::scene::{Camera, Environment, Handedness, RenderDefaults, Scene, Sphere};
use gpu_trace::settings::{GeometryChoice, Rect, Settings};
use gpu_trace::verify::Random;

use crate::{ROUNDS, compare, ours};

/// Spheres, and samples a pixel in one turn.
const COUNTS: [(usize, u64); 6] = [
    (32, 16),
    (64, 16),
    (96, 16),
    (128, 16),
    (256, 16),
    (1024, 8),
];

/// Prints a table for each number.
pub(crate) fn run() {
    for (count, spp) in COUNTS {
        let scene = crowd(count);
        let form = |geometry| ours(&scene, |s| short(s, spp, geometry), &[]);
        let mut contestants = vec![
            ("bvh", form(GeometryChoice::Bvh)),
            ("list", form(GeometryChoice::List)),
        ];
        let title = format!("{count} spheres of equal density, 320x240");
        compare(&title, &mut contestants);
    }
}

fn short(settings: &mut Settings, spp: u64, geometry: GeometryChoice) {
    settings.crop = Rect::whole(settings.width, settings.height);
    settings.samples = 0..spp;
    settings.geometry = geometry;
}

/// Spheres, and samples a pixel in one turn.
const DECADES: [(usize, u64); 6] = [
    (100, 16),
    (1000, 8),
    (10_000, 4),
    (100_000, 4),
    (1_000_000, 4),
    (10_000_000, 4),
];

/// Prints what a tree costs in each decade; the same as CSV in the file that `GPU_TRACE_SCALE` names, for
/// `plot.py`.
///
/// # Panics
/// If that file cannot be written.
pub(crate) fn scale() {
    println!(
        "| spheres | placed in | tree built in | levels | bytes a sphere | Mpaths/s (lowest, highest of {ROUNDS}) \
         | cost of a path |\n|---|---|---|---|---|---|---|"
    );
    let mut csv = String::from("spheres,placed,built,bytes,rate,low,high\n");
    let mut first = None;
    for (count, spp) in DECADES {
        let scene = crowd(count);
        let begin = Instant::now();
        let placement = Placement::new(&scene, scene.width, scene.height);
        let placed = begin.elapsed().as_secs_f64();
        let balls = placement.balls();
        let begin = Instant::now();
        let tree = Tree::new(&balls, placement.poles as u32);
        let built = begin.elapsed().as_secs_f64();
        let (levels, texels) = (tree.levels, tree.used);
        drop((placement, balls, tree));
        // Those of the texture, and of material and place in a buffer.
        let bytes = 16.0 * texels as f64 / count as f64 + 8.0;
        let mut turn = ours(&scene, |s| short(s, spp, GeometryChoice::Bvh), &[]);
        turn(); // compiles
        let mut rates: Vec<f64> = (0..ROUNDS)
            .map(|_| turn())
            .map(|(paths, seconds)| 1.0e-6 * paths / seconds)
            .collect();
        rates.sort_by(f64::total_cmp);
        let [low, rate, high] = [0, ROUNDS / 2, ROUNDS - 1].map(|i| rates[i]);
        let cost = *first.get_or_insert(rate) / rate;
        println!(
            "| {count} | {placed:.3} s | {built:.3} s | {levels} | {bytes:.1} | {rate:.2} ({low:.2}, {high:.2}) | {cost:.1} |"
        );
        let _ = writeln!(csv, "{count},{placed},{built},{bytes},{rate},{low},{high}");
    }
    println!();
    if let Some(path) = std::env::var_os("GPU_TRACE_SCALE") {
        std::fs::write(&path, csv).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    }
}

/// Gray balls in a cube, one in each unit of its volume, under a white sky.
pub(crate) fn crowd(count: usize) -> Scene {
    let side = (count as f64).cbrt();
    let mut random = Random::new("trees");
    let mut sphere = || Sphere {
        center: side * DVec3::from_array([(); 3].map(|()| random.range(0.0, 1.0))),
        motion: DVec3::ZERO,
        radius: random.range(0.1, 0.4),
        material: 0,
        priority: None,
    };
    let spheres = (0..count).map(|_| sphere()).collect();
    Scene {
        camera: Camera {
            position: side * DVec3::new(0.5, 0.6, -1.6),
            look_at: side * DVec3::splat(0.5),
            up: DVec3::Y,
            fov: 40.0,
            handedness: Handedness::Right,
            aperture_radius: 0.0,
            focus_distance: 1.0,
        },
        width: 320,
        height: 240,
        render: RenderDefaults::default(),
        environment: Some(Environment::Constant(DVec3::ONE)),
        materials: vec![Material::new(
            "gray",
            MaterialKind::Diffuse(Diffuse {
                albedo: DVec3::splat(0.5),
            }),
        )],
        spheres,
    }
}

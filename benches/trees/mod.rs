//! A loop over all spheres against a tree, by their number.

use std::time::Instant;

use glam::DVec3;
use gpu_trace::bvh::Tree;
use gpu_trace::materials::diffuse::Diffuse;
use gpu_trace::materials::{Material, MaterialKind};
use gpu_trace::placement::Placement;
use gpu_trace::scene::{Camera, Environment, Handedness, RenderDefaults, Scene, Sphere};
use gpu_trace::settings::{GeometryChoice, Rect, Settings};
use gpu_trace::verify::Random;

use crate::{compare, ours};

/// Spheres, and samples a pixel in one turn.
const COUNTS: [(usize, u64); 8] = [
    (32, 16),
    (64, 16),
    (96, 16),
    (128, 16),
    (256, 16),
    (1024, 8),
    (32_768, 4),
    (1_000_000, 4),
];
/// Spheres up to which the loop is measured too.
const MOST_LISTED: usize = 1024;

/// Prints a table for each number, and what the tree takes.
pub(crate) fn run() {
    for (count, spp) in COUNTS {
        let scene = crowd(count);
        let small = |s: &mut Settings, geometry| {
            s.crop = Rect::whole(scene.width, scene.height);
            s.samples = 0..spp;
            s.geometry = geometry;
        };
        let placement = Placement::new(&scene, scene.width, scene.height);
        let balls = placement.balls();
        let begin = Instant::now();
        let tree = Tree::new(&balls, placement.poles as u32);
        println!(
            "{count}: built in {:.3} s, {} levels, {:.1} bytes a sphere\n",
            begin.elapsed().as_secs_f64(),
            tree.levels,
            16.0 * tree.used as f64 / count as f64
        );
        let form = |geometry| ours(&scene, |s| small(s, geometry), &[]);
        let mut contestants = vec![("bvh", form(GeometryChoice::Bvh))];
        if count <= MOST_LISTED {
            contestants.push(("list", form(GeometryChoice::List)));
        }
        let title = format!("{count} spheres of equal density, 320x240");
        compare(&title, &mut contestants);
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

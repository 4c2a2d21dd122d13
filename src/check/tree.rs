//! Case 40: what a ray hits by the tree is what it hits by asking every sphere, with the kernel's own functions.

use glam::DVec3;

use super::Case;
use super::context::Context;
use crate::bvh::{Options, Tree};
use crate::effects::{Effect, Effects};
use crate::error::Result;
use crate::gpu::probe::Probe;
use crate::materials::dielectric::Dielectric;
use crate::materials::diffuse::Diffuse;
use crate::placement::{Placement, Side};
use crate::verify::{EMPTY, HitRow, Measure, Random, crowds};

pub(super) const CASES: &[Case] = &[Case {
    id: 40,
    name: "a tree over spheres loses no hit",
    setup: "crowds of radii 1e-8 to 1e8, at one point, in a line, in a plane, touching, far away; rays from afar, from \
            surfaces, from inside, along axes, grazing, of any length: sphere and distance as by a loop over all",
    run,
}];

fn run(context: &Context) -> Result<Measure> {
    let scene = context.scene(EMPTY)?;
    let mut random = Random::new("rays at crowds");
    let mut measure = Measure::new(0.0, "hits that differ");
    let diffuse = Effect::of_material(Diffuse { albedo: DVec3::ONE });
    let glass = Effect::of_material(Dielectric::smooth(1.5));
    // Opaque, and of glass.
    for (side, effects) in [
        (Side::Outside, &[diffuse][..]),
        (Side::Tracked, &[diffuse, Effect::Interior, glass]),
    ] {
        for crowd in crowds(context.size(300, 1000)) {
            let empty = Placement::new(&scene, scene.width, scene.height);
            let mut placement = crowd.placed(empty, side);
            if context.options.disturb {
                let smaller = Options {
                    scale: 0.99,
                    ..Options::default()
                };
                let tree = Tree::with(&placement.balls(), 0, smaller);
                placement = placement.with_tree(tree);
            }
            let count = context.size(4096, 32_768);
            let rays = crowd.rays(&mut random, count, side == Side::Tracked);
            let [list, tree] = [Effect::List, Effect::Bvh].map(|form| -> Result<Vec<HitRow>> {
                let effects = Effects::of(&[effects, &[form]].concat());
                let probe = Probe::new(&context.gpu, &scene, &placement, &effects);
                probe.call("closest_hit", &rays)
            });
            for (ray, (list, tree)) in rays.iter().zip(list?.iter().zip(&tree?)) {
                measure.count(1, u64::from(tree != list), || {
                    format!("{}: {ray:?}: {tree:?} for {list:?}", crowd.name)
                });
            }
        }
    }
    Ok(measure)
}

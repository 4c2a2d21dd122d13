//! Case 42: where on a sphere a point is, for textures.

use glam::DVec3;

use super::Case;
use super::context::Context;
use crate::effects::Effects;
use crate::error::Result;
use crate::gpu::probe::Probe;
use crate::placement::Placement;
use crate::records::textures::TextureTable;
use crate::reference::scene::texture::{TexturePoint, texture_value};
use crate::scene::Scene;
use crate::settings::Settings;
use crate::verify::{Measure, Random, SceneText, ULP, to_row, vector};

pub(super) const CASES: &[Case] = &[Case {
    id: 42,
    name: "checkers up to their borders",
    setup: "checkers of three sizes on balls and on grounds of radius 1e6 about their poles, points at the lattice's origin, on \
            its planes and up to 10 away: the cell is that of f64, but within the roundings of a coordinate of a border",
    run: checkers,
}];

/// Sizes of cells; in f32 two of them are exact.
const SIZES: [f64; 3] = [0.5, 0.3, 0.0625];

/// A ball of each checker, and a ground.
fn scene() -> Result<Scene> {
    let mut text = SceneText::new([0.0, 1.0, 6.0], [0.0; 3]);
    for (i, size) in SIZES.iter().enumerate() {
        let name = format!("checker{i}");
        let beside = 2.0 * i as f64;
        text = text
            .material(
                &name,
                &format!(
                    "type = \"diffuse\"\nalbedo = {{ checker = [[0.9, 0.1, 0.5], [0.2, 0.8, 0.5]], size = {size:?} }}"
                ),
            )
            .sphere([beside, 0.0, 0.0], 0.5, &name)
            .sphere([0.3, -1.0e6 - 1.0 - i as f64, -0.2], 1.0e6, &name);
    }
    text.load()
}

/// A point relative to where its sphere's points are kept, as f32 has it.
fn point(random: &mut Random, i: usize) -> DVec3 {
    let on_planes = |w: u32| f64::from(w % 17) * 0.5 - 4.0;
    let near = match i % 4 {
        0 => {
            let [x, y, z, _] = random.words();
            DVec3::new(on_planes(x), on_planes(y), on_planes(z))
        }
        1 => 1.0e-3 * random.direction(),
        _ => random.range(0.1, 10.0) * random.direction(),
    };
    near.as_vec3().as_dvec3()
}

/// Whether a point is as near to a border as its coordinate, the quotient and the pole's place are rounded.
fn is_on_border(anchor: DVec3, near: DVec3, size: f64) -> bool {
    let cells = (anchor + near) / size;
    (0..3).any(|axis| {
        let (x, near) = (cells[axis], near[axis]);
        let off = 3.0 * ULP * (near / size).abs() + 2.0 * ULP;
        // What is exact is no border: the planes through a centre, and those of powers of two.
        let exact = anchor == DVec3::ZERO && (near == 0.0 || size.log2().fract() == 0.0);
        (x - x.round()).abs() < off && !exact
    })
}

fn checkers(context: &Context) -> Result<Measure> {
    let scene = scene()?;
    let settings = Settings::for_scene(&scene);
    let placement = Placement::new(&scene, settings.width, settings.height);
    let effects = Effects::derive(&scene, &placement, &settings);
    let probe = Probe::new(&context.gpu, &scene, &placement, &effects);
    let table = TextureTable::new(&scene, &placement);
    let mut random = Random::new("checkers");
    let mut inputs: Vec<[[u32; 4]; 2]> = Vec::new();
    let mut truths = Vec::new();
    let across = context.disturbed(1.0) - 1.0;
    for (i, sphere) in placement.spheres.iter().enumerate() {
        let Some((_, number)) = table.of_sphere(i, &placement).first().copied() else {
            continue;
        };
        let texture = &scene.materials[sphere.material].textures[0].texture;
        let size = SIZES[sphere.material];
        let anchor = sphere.anchor_offset(placement.scale);
        for k in 0..context.size(5000, 50_000) {
            let near = point(&mut random, k);
            if is_on_border(anchor, near, size) {
                continue;
            }
            let [x, y, z] = near.as_vec3().to_array().map(f32::to_bits);
            inputs.push([[x, y, z, number], to_row(DVec3::Y, 0.0).map(f32::to_bits)]);
            // Disturbed, the truth is that of the next cell.
            let truth = TexturePoint {
                offset: anchor + near + across * size * DVec3::X,
                normal: DVec3::Y,
            };
            truths.push((texture_value(texture, &truth), near, size));
        }
    }
    let outputs: Vec<[f32; 4]> = probe.call("texture_value", &inputs)?;
    let mut measure = Measure::new(0.0, "cells that differ");
    for (found, (truth, near, size)) in outputs.iter().zip(truths) {
        let differs = vector(*found) != truth.as_vec3().as_dvec3();
        measure.add(f64::from(u8::from(differs)), || {
            format!("{near} from the anchor, cells of {size}: {found:?} for {truth}")
        });
    }
    Ok(measure)
}

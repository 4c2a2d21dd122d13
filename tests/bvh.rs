//! The tree over spheres: it holds every one, is the same every time, and no ray loses a hit by it.
//!
//! `gpu-trace check` has the hits of all crowds, case 40.

use std::path::PathBuf;

use crate::common::images::{assert_alike, assert_same};
use crate::common::{gpu, gpu_renderer, render_gpu, scene, scene_file, scene_files};
use crate::thorough::thorough;
use glam::{DVec3, Vec3};
use gpu_trace::bvh::{Ball, MOST_SAH_LEVELS, NOTHING, Options, Tree, WIDTH};
use gpu_trace::effects::Effects;
use gpu_trace::gpu::probe::Probe;
use gpu_trace::materials;
use gpu_trace::materials::Material;
use gpu_trace::placement::{Placement, Side};
use gpu_trace::render::render_quietly;
use gpu_trace::scene::Scene;
use gpu_trace::settings::{GeometryChoice, Settings};
use gpu_trace::verify::{
    Crowd, EMPTY, HitRow, Random, RayRows, Row, crowds, image_bits, settings, share_off, vector,
};

fn balls(crowd: &Crowd) -> Vec<Ball> {
    let ball = |&(center, radius): &(Vec3, f32)| Ball {
        center,
        motion: Vec3::ZERO,
        radius,
        apart: false,
    };
    crowd.balls.iter().map(ball).collect()
}

/// Of the part of a tree with this word: how often each ball is in it; or what is wrong with its boxes.
fn visit(
    tree: &Tree,
    word: u32,
    balls: &[Ball],
    seen: &mut Vec<u32>,
    inside: &[(DVec3, DVec3)],
) -> Result<(), String> {
    let at = (word & !(1 << 31)) as usize;
    if word >> 31 == 1 {
        let mut numbers = tree.texels[at].to_vec();
        numbers.dedup();
        for (k, number) in numbers.iter().enumerate() {
            seen[*number as usize] += 1;
            let ball = balls[*number as usize];
            let stored = tree.texels[at + 1 + k].map(f32::from_bits);
            if stored != ball.center.extend(ball.radius).to_array() {
                return Err(format!("{number} is not {stored:?}"));
            }
            for (center, half) in inside {
                let reach = (ball.center.as_dvec3() - center).abs() + f64::from(ball.radius);
                if reach.cmpgt(*half).any() {
                    return Err(format!("{number} sticks out of {center} +- {half}"));
                }
            }
        }
        return Ok(());
    }
    let lane = |row: usize, i: usize| f64::from(f32::from_bits(tree.texels[at + row][i]));
    for (i, word) in tree.texels[at + 6].into_iter().enumerate() {
        if word != NOTHING {
            let center = DVec3::new(lane(0, i), lane(1, i), lane(2, i));
            let half = DVec3::new(lane(3, i), lane(4, i), lane(5, i));
            let inside = [inside, &[(center, half)]].concat();
            visit(tree, word, balls, seen, &inside)?;
        }
    }
    Ok(())
}

/// What is wrong with a tree, if anything is.
fn fault(tree: &Tree, balls: &[Ball]) -> Option<String> {
    let mut seen = vec![0; balls.len()];
    if tree.root != NOTHING
        && let Err(fault) = visit(tree, tree.root, balls, &mut seen, &[])
    {
        return Some(fault);
    }
    let lost = seen.iter().position(|times| *times != 1)?;
    Some(format!("{lost} is there {} times", seen[lost]))
}

#[test]
fn every_sphere_is_in_every_box_around_it() {
    for crowd in crowds(5000) {
        let balls = balls(&crowd);
        let tree = Tree::new(&balls, 0);
        assert_eq!(fault(&tree, &balls), None, "{}", crowd.name);
        // The same every time.
        assert_eq!(Tree::new(&balls, 0), tree, "{}", crowd.name);
        let most = MOST_SAH_LEVELS + balls.len().max(1).ilog2() + 1;
        assert!(
            tree.levels <= most,
            "{}: {} levels",
            crowd.name,
            tree.levels
        );
        // With 12 bytes for material, light and place.
        let bytes = 16.0 * tree.used as f64 / balls.len() as f64 + 12.0;
        eprintln!(
            "{}: {} levels, {bytes:.1} bytes a sphere",
            crowd.name, tree.levels
        );
        if balls.len() >= 5000 {
            assert!(bytes < 64.0, "{}: {bytes}", crowd.name);
        }
        // Companions: boxes a little smaller; a ball that is another one.
        if balls.len() > 4 {
            let smaller = Options {
                scale: 1.0 - 1.0e-4,
                slack: 0.0,
                ..Options::default()
            };
            let smaller = Tree::with(&balls, 0, smaller);
            assert!(fault(&smaller, &balls).is_some(), "{}", crowd.name);
            let mut other = balls.clone();
            other[3].radius *= 1.001;
            assert!(fault(&tree, &other).is_some(), "{}", crowd.name);
        }
    }
}

#[test]
fn what_is_apart_is_beside_the_tree() {
    let mut balls = balls(&crowds(100)[0]);
    for i in [3, 50, 51, 52, 53, 99] {
        balls[i].apart = true;
    }
    let tree = Tree::new(&balls, 7);
    assert_eq!(tree.apart, 2);
    assert_eq!(tree.texels[0], [10, 57, 58, 59]);
    assert_eq!(tree.texels[5], [60, 106, 106, 106]);
    for (ball, place) in balls.iter().zip(&tree.places) {
        let stored = tree.texels[*place as usize].map(f32::from_bits);
        assert_eq!(stored, ball.center.extend(ball.radius).to_array());
    }
    let none = Tree::new(&[], 0);
    assert_eq!((none.root, none.rows(), none.stack()), (NOTHING, 1, 1));
    assert_eq!(none.texels.len(), WIDTH as usize);
}

const GLASS: [&str; 3] = ["diffuse", "interior", "dielectric"];

fn probe(placement: &Placement, form: &str, effects: &[&str]) -> Probe {
    let effects = Effects::named(&[effects, &[form]].concat());
    // The material that placed spheres name.
    let mut scene = scene(EMPTY);
    let gray = materials::ALL[0].of_color(DVec3::splat(0.5));
    let gray = Material::new("gray", gray.expect("a diffuse material"));
    scene.materials.push(gray);
    Probe::new(&gpu(), &scene, placement, &effects)
}

fn empty() -> Placement {
    let scene = scene(EMPTY);
    Placement::new(&scene, scene.width, scene.height)
}

fn hits(placement: &Placement, form: &str, effects: &[&str], rays: &[RayRows]) -> Vec<HitRow> {
    let probe = probe(placement, form, effects);
    probe
        .call("closest_hit", rays)
        .unwrap_or_else(|e| panic!("{e}"))
}

/// How many differ.
fn differing(a: &[HitRow], b: &[HitRow]) -> usize {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).filter(|(a, b)| a != b).count()
}

#[test]
fn hits_beside_walls_are_those_of_the_list() {
    // With pole frames, with rooms, and with no other sphere than these.
    for (count, effects) in [
        (200, &["diffuse", "interior", "pole"][..]),
        (0, &["diffuse", "pole"]),
    ] {
        let crowd = &crowds(200)[0];
        let mut placement = crowd.placed(empty(), Side::Outside);
        placement.spheres.truncate(count);
        for ball in placement.spheres.iter_mut().step_by(40) {
            (ball.side, ball.radius) = (Side::Inside, 30.0);
        }
        let mut wall = crowds(1)[0].placed(empty(), Side::Outside).spheres[0].clone();
        for normal in [DVec3::Y, DVec3::X] {
            (wall.pole, wall.anchor, wall.radius) = (Some(normal), -4.0 * normal, 1.0e4);
            placement.spheres.insert(0, wall.clone());
        }
        placement.poles = 2;
        let mut random = Random::new("beside");
        let mut rays = crowd.rays(&mut random, 4096, false);
        for ray in &mut rays {
            let own = ray[0][3].to_bits();
            ray[0][3] = f32::from_bits(own.saturating_add(if own == u32::MAX { 0 } else { 2 }));
        }
        let list = hits(&placement, "list", effects, &rays);
        assert_eq!(
            differing(&list, &hits(&placement, "bvh", effects, &rays)),
            0
        );
        // Companion: without the walls.
        let mut less = placement.clone();
        less.spheres.truncate(2);
        less.spheres[0].anchor *= 2.0;
        assert_ne!(differing(&list, &hits(&less, "bvh", effects, &rays)), 0);
    }
}

#[test]
fn companion_smaller_boxes_are_found() {
    let tree = |placement: &Placement, options| Tree::with(&placement.balls(), 0, options);
    let mut random = Random::new("smaller boxes");
    for crowd in crowds(1000).into_iter().take(10) {
        let placement = crowd.placed(empty(), Side::Outside);
        let rays = crowd.rays(&mut random, 1 << 14, false);
        let list = hits(&placement, "list", &["diffuse"], &rays);
        let differ = |options| {
            let other = placement.clone().with_tree(tree(&placement, options));
            differing(&list, &hits(&other, "bvh", &["diffuse"], &rays))
        };
        let smaller = Options {
            scale: 0.99,
            ..Options::default()
        };
        let (whole, smaller) = (differ(Options::default()), differ(smaller));
        eprintln!(
            "{}: {whole} of {}; {smaller} in smaller boxes",
            crowd.name,
            rays.len()
        );
        assert_eq!(whole, 0, "{}", crowd.name);
        assert!(smaller > 0, "{}", crowd.name);
    }
}

#[test]
fn very_many_spheres_at_one_point() {
    // More than a loop may visit; the long form has a million.
    let count = if crate::thorough::thorough() {
        1_000_000
    } else {
        100_000
    };
    let point = Vec3::new(0.3, 0.1, -0.7);
    let crowd = Crowd {
        name: "at one point",
        balls: vec![(point, 0.25); count],
    };
    let tree = Tree::new(&balls(&crowd), 0);
    assert!(tree.levels <= count.ilog2(), "{} levels", tree.levels);
    // Rays that miss, and one that comes from one of them: none visits all.
    let placement = crowd.placed(empty(), Side::Outside);
    let word = |index: u32| f32::from_bits(index);
    let ray = |from: Vec3, own: u32, direction: Vec3| -> RayRows {
        [
            from.extend(word(own)).to_array(),
            [0.0; 4],
            direction.extend(0.0).to_array(),
        ]
    };
    let rays = [
        ray(point - 3.0 * Vec3::X, u32::MAX, Vec3::Y),
        ray(point - 3.0 * Vec3::X, u32::MAX, Vec3::NEG_X),
    ];
    let missed = hits(&placement, "bvh", &["diffuse"], &rays);
    assert!(missed.iter().all(|hit| hit.index == u32::MAX), "{missed:?}");
    // Those that hit do, and what they hit is the first of all.
    let short = Crowd {
        balls: crowd.balls[..2000].to_vec(),
        ..crowd
    };
    let placement = short.placed(empty(), Side::Outside);
    let ray = [ray(point - 3.0 * Vec3::X, u32::MAX, Vec3::X)];
    let hit = hits(&placement, "bvh", &["diffuse"], &ray);
    assert_eq!((hit[0].index, hit[0].t), (0, 2.75));
    // Companion: not from the first itself.
    let own = [[
        [ray[0][0][0], ray[0][0][1], ray[0][0][2], word(0)],
        ray[0][1],
        ray[0][2],
    ]];
    assert_eq!(hits(&placement, "bvh", &["diffuse"], &own)[0].index, 1);
}

#[test]
fn a_lamp_is_seen_where_it_is_the_first_hit() {
    const LIT: [&str; 6] = ["diffuse", "emission", "lights", "table", "mis", "interior"];
    let mut random = Random::new("lamps");
    let mut blocked = [0; 2];
    for crowd in crowds(300).into_iter().take(10) {
        let placement = crowd.placed(empty(), Side::Outside);
        let rays = crowd.rays(&mut random, 1 << 13, false);
        let first = hits(&placement, "list", &LIT, &rays);
        // The sphere that is hit or any other; a limb at the first hit, near it, or nowhere.
        let asked: Vec<[Row; 4]> = rays
            .iter()
            .zip(&first)
            .map(|(ray, first)| {
                let other = random.words()[0] % crowd.balls.len() as u32;
                let lamp = if random.unit() < 0.5 {
                    first.index.min(other)
                } else {
                    other
                };
                let limb = first.t * random.range(0.5, 2.0) as f32;
                let [anchor, offset, direction] = *ray;
                [
                    anchor,
                    offset,
                    direction,
                    [limb, f32::from_bits(lamp), 0.0, 0.0],
                ]
            })
            .collect();
        let probe = probe(&placement, "bvh", &LIT);
        let found: Vec<HitRow> = probe
            .call("lamp_hit", &asked)
            .unwrap_or_else(|e| panic!("{e}"));
        for ((asked, first), found) in asked.iter().zip(&first).zip(&found) {
            let (limb, lamp) = (asked[3][0], asked[3][1].to_bits());
            let hides = |hit: &HitRow| hit.index != lamp && hit.t < limb;
            assert_eq!(hides(first), hides(found), "{}: {asked:?}", crowd.name);
            blocked[usize::from(hides(first))] += 1;
            if !hides(first) {
                assert_eq!(first, found, "{}: {asked:?}", crowd.name);
            }
        }
    }
    assert!(blocked.iter().all(|n| *n > 5000), "{blocked:?}");
}

#[test]
fn every_scene_by_the_tree_is_that_of_the_list() {
    let (mut noticed, mut all) = (0, 0);
    // Compilers take most of the time: the gallery's scenes, whose effects nearly all are in those of `scenes/tests`, are the
    // long form's.
    let chosen = |path: &PathBuf| thorough() || path.starts_with("scenes/tests");
    for (i, path) in scene_files().into_iter().filter(chosen).enumerate() {
        let scene = scene_file(&path);
        let film = |geometry, seed| {
            let settings = Settings {
                geometry,
                seed,
                ..settings(&scene, 32, 32, 16)
            };
            render_gpu(&scene, &settings)
        };
        let (list, tree) = (film(GeometryChoice::List, 0), film(GeometryChoice::Bvh, 0));
        // A driver may contract the two kernels differently: nearly all values, not all.
        let off = share_off(&tree, &list);
        let same = image_bits(&list) == image_bits(&tree);
        eprintln!("{}: {off}, the same bits: {same}", path.display());
        let name = format!("{} by the tree", path.display());
        let what = format!("{off} of the values differ");
        assert_alike(&name, &tree, &list, off < 0.02, what);
        // Companion: other samples, but for scenes of one radiance everywhere.
        if i % 4 == 0 {
            noticed += usize::from(share_off(&film(GeometryChoice::Bvh, 1), &list) > 0.02);
            all += 1;
        }
    }
    assert!(
        2 * noticed > all,
        "other samples are noticed in {noticed} scenes of {all}"
    );
}

/// Very many tiny balls in a thin tube, seen from its end: a ray passes thousands of boxes on its way to the sky, and
/// about every third ray meets a ball.
fn tube() -> Scene {
    const HALF: f64 = 2.0e-4;
    let mut random = Random::new("tube");
    let mut text = String::from(
        "
        [camera]
        position = [0.0, 0.0, -3.0]
        look_at = [0.0, 0.0, 0.0]
        fov = 0.004
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
    for _ in 0..24_000 {
        let [x, y] = [(); 2].map(|()| random.range(-HALF, HALF));
        let z = random.range(-1.0, 1.0);
        text += &format!(
            "[[sphere]]\ncenter = [{x:?}, {y:?}, {z:?}]\nradius = 1.0e-6\nmaterial = \"gray\"\n"
        );
    }
    scene(&text)
}

/// A driver that ends loops in silence ends a way through the tree, and the path then misses what comes. Without
/// the question whether loops still turn that would be a sample, and too bright.
#[test]
fn paths_whose_way_through_the_tree_is_ended_are_no_samples() {
    let scene = tube();
    let settings = Settings {
        geometry: GeometryChoice::Bvh,
        ..settings(&scene, 16, 16, 16)
    };
    let film = |steps: Option<u32>| {
        let renderer = gpu_renderer(&scene, &settings);
        let mut renderer = match steps {
            Some(steps) => renderer.with_step_limit(steps),
            None => renderer,
        };
        let outcome = render_quietly(&mut renderer, &settings);
        outcome.unwrap_or_else(|e| panic!("{e}")).film
    };
    // One path an invocation and dispatch; as many as usual; or as many as the driver lets it, which through GL
    // takes some of them for samples: see `step_limit`.
    let short = film(Some(1));
    let all = [None, Some(u32::MAX)];
    let others = if gpu().summary.backend == "gl" {
        &all[..1]
    } else {
        &all
    };
    for steps in others {
        let long = film(*steps);
        // Else the image depends on where the driver ended loops.
        assert_same(format!("a tube, {steps:?}"), &long, &short);
        assert_eq!(short.tally(), long.tally());
    }
}

#[test]
fn glass_hits_from_within_are_those_of_the_list() {
    // A path that is known to be in a ball hits it wherever f32 has put it: also well outside of the box.
    let crowd = &crowds(50)[0];
    let placement = crowd.placed(empty(), Side::Tracked);
    let mut random = Random::new("outside of what it is in");
    let mut rays = crowd.rays(&mut random, 4096, true);
    for ray in &mut rays {
        let away = (vector(ray[0]) + 0.6 * random.direction()).as_vec3();
        ray[0][..3].copy_from_slice(&away.to_array());
    }
    let list = hits(&placement, "list", &GLASS, &rays);
    let tree = hits(&placement, "bvh", &GLASS, &rays);
    assert_eq!(differing(&list, &tree), 0);
    assert!(list.iter().filter(|hit| hit.inside == 1).count() > 500);
    // Companion: paths that are known to be in none.
    for ray in &mut rays {
        ray[2][3] = f32::from_bits(u32::MAX);
    }
    assert_ne!(differing(&list, &hits(&placement, "bvh", &GLASS, &rays)), 0);
}

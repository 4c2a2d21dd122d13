//! The placement's answers by their definitions: every sphere is asked about every other one.

use std::collections::HashMap;

use glam::DVec3;
use gpu_trace::materials::luminance;
use gpu_trace::placement::containment::{MOST_CORES, reachable};
use gpu_trace::placement::media::precedes;
use gpu_trace::placement::{Media, Medium, Side};
use gpu_trace::scene::motion::Distances;
use gpu_trace::scene::{Scene, Sphere};

use super::Answers;

const ROUNDING: f64 = 4.0 * f64::EPSILON;
const CLOSE: f64 = 1.0 / 1024.0;
const POLE_NEAR: f64 = 1.0 / 16.0;
const POLE_FAR: f64 = 64.0;

pub(crate) fn answers(scene: &Scene, origin: DVec3) -> Answers {
    let count = scene.spheres.len();
    let sides: Vec<Side> = (0..count).map(|i| Side::of(scene, i)).collect();
    let reachable = reachable(scene, &sides, &mut Vec::new());
    let centers: Vec<DVec3> = scene.spheres.iter().map(|s| s.center - origin).collect();
    let all: Vec<usize> = (0..count).filter(|i| reachable[*i]).collect();
    let mut poles = vec![None; count];
    for &i in &all {
        poles[i] = pole_normal(scene, &centers, &all, i);
    }
    let emission = |i: usize| scene.materials[scene.spheres[i].material].emission;
    let is_lamp = |i: &usize| {
        sides[*i] != Side::Inside && luminance(emission(*i)) > 0.0 && !is_sealed(scene, *i)
    };
    let straddled = |i: &usize| sides[*i] == Side::Sign && emission(*i).max_element() > 0.0;
    let lamps = if all.iter().any(straddled) {
        Vec::new()
    } else {
        all.iter().copied().filter(is_lamp).collect()
    };
    Answers {
        poles: poles.iter().map(|pole| pole.map(bits)).collect(),
        media: media(scene, &reachable),
        containers: containers(scene, &sides, &reachable),
        lamps,
    }
}

fn bits(v: DVec3) -> [u64; 3] {
    v.to_array().map(f64::to_bits)
}

fn pole_normal(scene: &Scene, centers: &[DVec3], all: &[usize], i: usize) -> Option<DVec3> {
    let (center, radius) = (centers[i], scene.spheres[i].radius);
    let small = |j: &usize| *j != i && scene.spheres[*j].radius < POLE_NEAR * radius;
    if !all.iter().any(small) && alone(scene, i) {
        return None;
    }
    let eye = scene.camera.position;
    let eye = eye - (scene.spheres[i].center - center);
    let own = scene.spheres[i].motion;
    let points = || {
        all.iter()
            .copied()
            .filter(small)
            .map(|j| (centers[j], scene.spheres[j].radius, scene.spheres[j].motion))
            .chain([(eye, 0.0, DVec3::ZERO)])
            .map(|(point, size, motion)| {
                let distances = Distances::of(point - center, motion - own);
                (point, size, distances)
            })
    };
    if points().any(|(.., d)| d.farthest_gap(radius) > POLE_FAR * radius) {
        return None;
    }
    let near: Vec<DVec3> = points()
        .filter(|(_, size, d)| d.gap(radius) - size < POLE_NEAR * radius)
        .map(|(point, ..)| point)
        .collect();
    if near.is_empty() {
        return None;
    }
    let middle = near.iter().map(|p| *p - center).sum::<DVec3>() / near.len() as f64;
    middle.try_normalize()
}

fn alone(scene: &Scene, i: usize) -> bool {
    let sphere = &scene.spheres[i];
    let distances = sphere.distances_from(scene.camera.position);
    distances.gap(sphere.radius) >= POLE_NEAR * sphere.radius
}

struct Ball {
    source: usize,
    center: DVec3,
    motion: DVec3,
    radius: f64,
}

fn media(scene: &Scene, reachable: &[bool]) -> Media {
    let transmits = |s: &Sphere| scene.materials[s.material].kind.transmits();
    let spheres = scene.spheres.iter().enumerate();
    let mut balls: Vec<Ball> = spheres
        .filter(|(source, sphere)| reachable[*source] && transmits(sphere))
        .map(|(source, s)| Ball {
            source,
            center: s.center - scene.camera.position,
            motion: s.motion,
            radius: s.radius,
        })
        .collect();
    balls.sort_by(|a, b| {
        precedes(scene, a.source, b.source).cmp(&precedes(scene, b.source, a.source))
    });
    let neighbours = neighbours(&balls);
    let mut media = Media {
        level: vec![0; scene.spheres.len()],
        ..Media::default()
    };
    for (i, ball) in balls.iter().enumerate() {
        let below = neighbours[i].iter().filter(|j| **j < i);
        let level = below
            .map(|j| media.level[balls[*j].source] + 1)
            .max()
            .unwrap_or(0);
        media.level[ball.source] = level;
        if let Some(j) = neighbours[i].first() {
            media.levels = media.levels.max(level + 1);
            media.example.get_or_insert([ball.source, balls[*j].source]);
        }
        if Distances::of(ball.center, ball.motion).least < ball.radius * (1.0 - ROUNDING) {
            let material = scene.spheres[ball.source].material;
            media.camera.push(Medium {
                level,
                ior: scene.materials[material].kind.ior(),
                sphere: ball.source,
            });
        }
    }
    media
}

/// For each ball the others that share a point with it, those first that begin first along x.
fn neighbours(balls: &[Ball]) -> Vec<Vec<usize>> {
    let mut found = vec![Vec::new(); balls.len()];
    let mut order: Vec<usize> = (0..balls.len()).collect();
    let way = |i: usize| 0.5 * balls[i].motion.x.abs();
    let left = |i: usize| balls[i].center.x - way(i) - balls[i].radius;
    order.sort_by(|a, b| left(*a).total_cmp(&left(*b)));
    for (at, &i) in order.iter().enumerate() {
        for &j in &order[..at] {
            let is_open = balls[j].center.x + way(j) + balls[j].radius >= left(i);
            let (between, motion) = (
                balls[j].center - balls[i].center,
                balls[j].motion - balls[i].motion,
            );
            if is_open && Distances::of(between, motion).least <= balls[j].radius + balls[i].radius
            {
                found[i].push(j);
                found[j].push(i);
            }
        }
    }
    found
}

fn containers(scene: &Scene, sides: &[Side], reachable: &[bool]) -> Vec<Option<usize>> {
    let mut containers = vec![None; scene.spheres.len()];
    let mut order: Vec<usize> = (0..scene.spheres.len()).filter(|i| reachable[*i]).collect();
    let x = |i: usize| scene.spheres[i].center.x;
    let way =
        |i: usize, j: usize| 0.5 * (scene.spheres[i].motion.x - scene.spheres[j].motion.x).abs();
    order.sort_by(|a, b| x(*a).total_cmp(&x(*b)));
    for &outer in order.iter().filter(|i| sides[**i] == Side::Tracked) {
        let reach = CLOSE * scene.spheres[outer].radius;
        for &inner in &order {
            let reach = way(inner, outer) + reach;
            let is_near = x(inner) >= x(outer) - reach && x(inner) <= x(outer) + reach;
            let is_in = inner != outer
                && sides[inner] != Side::Sign
                && is_near
                && just_within(&scene.spheres[outer], &scene.spheres[inner]);
            let tighter = |known: usize| scene.spheres[outer].radius < scene.spheres[known].radius;
            if is_in && containers[inner].is_none_or(tighter) {
                containers[inner] = Some(outer);
            }
        }
    }
    let mut counts: HashMap<usize, usize> = HashMap::new();
    for container in containers.iter().flatten() {
        *counts.entry(*container).or_default() += 1;
    }
    for container in &mut containers {
        *container = container.filter(|c| counts[c] <= MOST_CORES);
    }
    containers
}

fn just_within(outer: &Sphere, inner: &Sphere) -> bool {
    let distances = outer.distances(inner);
    let difference = outer.radius - inner.radius;
    difference > 0.0
        && difference - distances.most >= -(ROUNDING * outer.radius)
        && difference + distances.least <= CLOSE * outer.radius
}

fn is_sealed(scene: &Scene, lamp: usize) -> bool {
    let kind = |sphere: &Sphere| &scene.materials[sphere.material].kind;
    let smooth = |sphere: &Sphere| kind(sphere).is_delta();
    let inner = &scene.spheres[lamp];
    scene.spheres.iter().enumerate().any(|(glass, outer)| {
        let distances = |other: &Sphere| other.distances(outer);
        let reaches = |other: &Sphere| {
            let apart = distances(other).least >= outer.radius + other.radius;
            let around = distances(other).most + outer.radius <= other.radius;
            !apart && !around
        };
        glass != lamp
            && kind(outer).transmits()
            && smooth(outer)
            && distances(inner).most + inner.radius <= outer.radius
            && !scene
                .spheres
                .iter()
                .enumerate()
                .any(|(i, other)| i != lamp && i != glass && !smooth(other) && reaches(other))
    })
}

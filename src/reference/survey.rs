//! Which cells the radiance cache has values for: those that paths come to from a diffuse surface.

use std::collections::BTreeMap;

use glam::DVec3;
use rayon::prelude::*;

use super::path::PathTracer;
use super::scene::ray::vertex_at;
use crate::placement::cells::chart::Chart;
use crate::placement::cells::{Cell, Cells};
use crate::placement::{PlacedSphere, Placement, Side};
use crate::scene::Scene;
use crate::settings::Settings;

/// Paths that are traced, all over the whole image.
const PATHS: u64 = 1 << 15;
/// The sample index of the first of them: no image has it.
const FIRST: u64 = 1 << 50;
/// Of a path that many arrivals count: where a cell is too near, it asks the next.
const ARRIVALS: usize = 2;
/// The share of the arrivals at a grid that its even part has.
const EVEN_SHARE: f64 = 0.9;
/// Points of a cell a side that must lie outside all other spheres.
const POINTS: u32 = 5;

/// The cells of a scene: those that some paths come to. They are the same for all seeds and crops.
#[must_use]
pub fn survey(scene: &Scene, placement: &Placement, settings: &Settings) -> Cells {
    let settings = Settings {
        seed: 0,
        ..settings.clone()
    };
    let tracer = PathTracer::new(scene, placement, &settings);
    let spheres = &placement.spheres;
    let is_diffuse: Vec<bool> = spheres
        .iter()
        .map(|s| scene.materials[s.material].is_diffuse())
        .collect();
    let has_cells: Vec<bool> = std::iter::zip(spheres, &is_diffuse)
        .map(|(sphere, diffuse)| {
            let dark = scene.materials[sphere.material].emission == DVec3::ZERO;
            *diffuse && dark && sphere.side == Side::Outside
        })
        .collect();
    let pixels = u64::from(settings.width) * u64::from(settings.height);
    let of_path = |i: u64| {
        let pixel = u128::from(i) * u128::from(pixels) / u128::from(PATHS);
        let pixel = pixel as u64;
        let [x, y] = [
            pixel % u64::from(settings.width),
            pixel / u64::from(settings.width),
        ];
        let mut arrivals = Vec::new();
        tracer.trace_seen([x as u32, y as u32], FIRST + i, &mut |ray, hit| {
            let from_diffuse = ray.own.is_some_and(|own| is_diffuse[own]);
            if from_diffuse && has_cells[hit.index] && !hit.inside && arrivals.len() < ARRIVALS {
                let offset = vertex_at(ray, hit, &spheres[hit.index]).offset;
                arrivals.push((hit.index, offset));
            }
        });
        arrivals
    };
    let arrivals: Vec<(usize, DVec3)> = (0..PATHS).into_par_iter().flat_map_iter(of_path).collect();
    let chart = |index: usize| match has_cells[index] {
        true => Chart::of(
            &spheres[index],
            even_width(&spheres[index], index, &arrivals),
        ),
        false => Chart::without_cells(is_diffuse[index]),
    };
    let charts: Vec<Chart> = (0..spheres.len()).map(chart).collect();
    let mut visits: BTreeMap<Cell, u32> = BTreeMap::new();
    for (index, offset) in &arrivals {
        let chart = &charts[*index];
        let [column, row] = chart.cell(chart.place(*offset));
        let cell = Cell {
            sphere: *index as u16,
            row,
            column,
        };
        *visits.entry(cell).or_default() += 1;
    }
    let visits: Vec<(Cell, u32)> = visits
        .into_iter()
        .filter(|(cell, _)| is_free(*cell, &charts, spheres))
        .collect();
    Cells::new(charts, &visits, pixels)
}

/// Half the side of the square about its pole that most arrivals at a sphere are in, in kernel units.
fn even_width(sphere: &PlacedSphere, index: usize, arrivals: &[(usize, DVec3)]) -> f64 {
    let Some(pole) = sphere.pole else {
        return 1.0;
    };
    let axes: [DVec3; 2] = pole.any_orthonormal_pair().into();
    let far = |x: DVec3| {
        axes.map(|axis| axis.dot(x).abs())
            .into_iter()
            .fold(0.0, f64::max)
    };
    let own = arrivals.iter().filter(|(i, _)| *i == index);
    let mut distances: Vec<f64> = own.map(|(_, offset)| far(*offset)).collect();
    distances.sort_by(f64::total_cmp);
    let at = (EVEN_SHARE * distances.len() as f64) as usize;
    let width = distances.get(at).copied().unwrap_or(1.0);
    if width > 0.0 { width } else { 1.0 }
}

/// Whether a cell is all on its sphere, and outside all others that are not around everything. What is within another
/// one would do no harm but to the variance.
fn is_free(cell: Cell, charts: &[Chart], spheres: &[PlacedSphere]) -> bool {
    let index = usize::from(cell.sphere);
    let (chart, sphere) = (&charts[index], &spheres[index]);
    let step = |i: u32| f64::from(i) / f64::from(POINTS - 1);
    let places = (0..POINTS * POINTS).map(|i| {
        let u = glam::DVec2::new(step(i % POINTS), step(i / POINTS));
        chart.place_in([cell.column, cell.row], u)
    });
    places.into_iter().all(|place| {
        let offset = chart.point(sphere, place).offset;
        // A grid ends well before the sphere turns away from its pole.
        let near = sphere.pole.is_none() || offset.length() < 0.5 * sphere.radius;
        let others = spheres.iter().enumerate().filter(|(i, _)| *i != index);
        near && others.into_iter().all(|(_, other)| {
            other.side == Side::Inside || !is_within(sphere.anchor - other.anchor + offset, other)
        })
    })
}

/// Whether a point at `x` from the anchor of a sphere is within it.
fn is_within(x: DVec3, sphere: &PlacedSphere) -> bool {
    // Of |x - c|² - r² with the centre c: about a pole, c is -r times the normal there.
    match sphere.pole {
        None => x.length_squared() < sphere.radius * sphere.radius,
        Some(pole) => 2.0 * pole.dot(x) + x.length_squared() / sphere.radius < 0.0,
    }
}

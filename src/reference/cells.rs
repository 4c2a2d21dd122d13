//! Twin of `shaders/cache/cells.wesl` and `pilot.wesl`: values of cells in the place of paths, what corrects them, and
//! the pilots that they come from.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::path::PathTracer;
use super::scene::ray::{Hit, Ray, vertex_at};
use super::scene::sphere::closest_hit;
use super::state::{Begin, Cache, Path, PathResult};
use crate::placement::PlacedSphere;
use crate::placement::cells::chart::ChartPoint;
use crate::placement::cells::{Cell, Cells};
use crate::sampling::purpose::{CAMERA, pairs};
use crate::sampling::random::sample_key;
use crate::sampling::sobol::sobol4;
use crate::settings::pilot_words;

/// The probability with which a value is corrected.
const CORRECTED: f64 = 0.25;

/// A ray that arrives at a point of `sphere`, where a path begins.
fn begin_at(arrived: &Ray, point: &ChartPoint, sphere: &PlacedSphere) -> Ray {
    Ray {
        anchor: sphere.anchor,
        offset: point.offset,
        direction: -point.normal,
        own: None,
        ..arrived.clone()
    }
}

/// The pdf on a chart with which a cosine-weighted direction finds a point, times π; 0 for one that turns away.
fn chart_pdf(from: DVec3, direction: DVec3, to: DVec3, distance: f64, area: f64) -> f64 {
    let cosines = from.dot(direction).max(0.0) * (-to.dot(direction)).max(0.0);
    cosines * area / (distance * distance)
}

impl PathTracer<'_> {
    /// What the path's ray hits, which may be known.
    pub(super) fn arrival(&self, path: &mut Path) -> Option<Hit> {
        if let Some(hit) = path.arrives_at.take() {
            return hit;
        }
        path.found.rays += 1;
        closest_hit(&path.ray, &self.placement.spheres)
    }

    /// Where a path leaves a diffuse surface, at x, for a cell that has a value: takes that in the place of all light that
    /// would be reflected there; whether the path ends with it. Else it goes on to correct the value: by what is
    /// reflected at the point y of the cell that it comes to, and, when it has ended, less what is at another one, y'.
    /// u: uniform, for both choices.
    pub(super) fn use_cell(
        &self,
        cache: &Cache<'_>,
        path: &mut Path,
        (u, random): (f64, &dyn Fn(u32) -> [f64; 4]),
    ) -> bool {
        let charts = cache.cells.charts();
        let Some(own) = path
            .ray
            .own
            .filter(|own| !path.plain && charts[*own].diffuse)
        else {
            return false;
        };
        let spheres = &self.placement.spheres;
        path.found.rays += 1;
        let hit = closest_hit(&path.ray, spheres);
        path.arrives_at = Some(hit);
        let Some(hit) = hit.filter(|hit| !hit.inside && charts[hit.index].side > 0) else {
            return false;
        };
        path.found.lookups += 1;
        let (chart, sphere) = (&charts[hit.index], &spheres[hit.index]);
        let vertex = vertex_at(&path.ray, &hit, sphere);
        // A grid is of the half about the pole.
        if sphere
            .pole
            .is_some_and(|pole| vertex.normal.dot(pole) <= 0.0)
        {
            return false;
        }
        let place = chart.place(vertex.offset);
        let [column, row] = chart.cell(place);
        let cell = Cell {
            sphere: hit.index as u16,
            row,
            column,
        };
        let number = cache.cells.number(cell);
        let Some(number) = number.filter(|_| hit.t >= chart.cell_size(sphere, place)) else {
            return false;
        };
        path.receive(path.class, path.throughput * cache.values[number]);
        if u >= CORRECTED {
            return true;
        }

        let [x, y, ..] = random(pairs(path.found.bounces));
        let other_place = chart.place_in([column, row], DVec2::new(x, y));
        let other = chart.point(sphere, other_place);
        let ray = &path.ray;
        let from = &spheres[own];
        let outward = match from.pole {
            Some(pole) => (pole + ray.offset / from.radius).normalize(),
            None => ray.offset.normalize(),
        };
        let normal = outward * outward.dot(ray.direction).signum();
        // The pdfs of both points on the chart, but for the same factor.
        let area = chart.area(sphere, place);
        let w = chart_pdf(normal, ray.direction, vertex.normal, hit.t, area);
        let way = ((sphere.anchor - from.anchor) + other.offset) - ray.offset;
        let distance = way.length();
        let direction = way / distance;
        let area = chart.area(sphere, other_place);
        let seen = chart_pdf(normal, direction, other.normal, distance, area);
        let mut w_other = 0.0;
        if seen > 0.0 && distance >= chart.cell_size(sphere, other_place) {
            let ray = Ray {
                direction,
                ..ray.clone()
            };
            let first = closest_hit(&ray, spheres);
            path.found.rays += 1;
            let met = first.is_some_and(|first| first.index == hit.index && !first.inside);
            w_other = if met { seen } else { 0.0 };
        }
        // Where rounding leaves neither, y counts.
        let phi = match w + w_other > 0.0 {
            true => (w - w_other) / (w + w_other),
            false => 1.0,
        };
        let largest = path.throughput.abs().max_element();
        let alive = (phi.abs() * largest / CORRECTED).min(1.0);
        if u >= CORRECTED * alive {
            return true;
        }
        path.throughput *= phi / (CORRECTED * alive);
        path.plain = true;
        path.other = Some(Begin {
            ray: begin_at(&path.ray, &other, sphere),
            throughput: -path.throughput,
            bounces: path.found.bounces,
            sphere: hit.index,
        });
        false
    }

    /// The values of all cells for the batch of the samples from `first` on, of so many: a mean over paths of its own;
    /// and their rays.
    #[must_use]
    pub fn pilot(&self, cells: &Cells, first: u64, batch: u64) -> (Vec<DVec3>, u64) {
        let samples = cells.samples(batch);
        let numbers = 0..cells.used().len() as u32;
        let value = |number: u32| {
            let mut found = (DVec3::ZERO, 0);
            for sample in 0..samples {
                let path = self.reflected(cells, number, first, sample, samples);
                found.0 += path.radiance / f64::from(samples);
                found.1 += u64::from(path.rays);
            }
            found
        };
        let values: Vec<(DVec3, u64)> = numbers.into_par_iter().map(value).collect();
        let rays = values.iter().map(|(_, rays)| rays).sum();
        (values.into_iter().map(|(value, _)| value).collect(), rays)
    }

    /// One sample of what a cell reflects.
    fn reflected(
        &self,
        cells: &Cells,
        number: u32,
        first: u64,
        sample: u32,
        samples: u32,
    ) -> PathResult {
        let stream = pilot_words(self.settings.seed, (first >> 32) as u32);
        let key = sample_key(stream, [number, 0], first as u32);
        let random = |dimension| sobol4(key, dimension, sample, samples - 1);
        let Cell {
            sphere: index,
            row,
            column,
        } = cells.used()[number as usize];
        let index = usize::from(index);
        let (chart, sphere) = (&cells.charts()[index], &self.placement.spheres[index]);
        let [x, y, ..] = random(CAMERA);
        let place = chart.place_in([column, row], DVec2::new(x, y));
        let ray = begin_at(&Ray::in_vacuum(), &chart.point(sphere, place), sphere);
        let mut path = Path::new(ray, 0.0);
        path.plain = true;
        path.begin_on(index);
        self.follow(&mut path, &random, &mut |_, _| {});
        path.found
    }
}

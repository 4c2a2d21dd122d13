//! Twin of `shaders/path/state.wesl`: what a path carries from vertex to vertex, and what it has found.

use glam::DVec3;

use super::scene::ray::{Hit, Ray};
use crate::film::{AovSums, LightClass};
use crate::placement::cells::Cells;

/// What one path found.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PathResult {
    /// W/(sr m²) per channel.
    pub radiance: DVec3,
    /// Rays traced.
    pub rays: u32,
    /// Those of them that look for a light.
    pub shadow_rays: u32,
    /// Vertices at which a direction to a light was drawn.
    pub connections: u32,
    /// Cells of the radiance cache that were asked for their values.
    pub lookups: u32,
    /// Scattering events.
    pub bounces: u32,
    /// Throughput with which the bounce limit cut the path; zero if it did not.
    pub cut: DVec3,
    /// Its share of what was asked for beside the image.
    pub aovs: AovSums,
}

/// A path on its way.
pub(super) struct Path {
    pub(super) ray: Ray,
    pub(super) throughput: DVec3,
    /// Product of the index ratios squared of the refractions so far.
    pub(super) eta_scale: f64,
    /// That it keeps, in nm.
    pub(super) wavelength: Option<f64>,
    pub(super) departure: Departure,
    /// What images of lamps have left of it since the last vertex at which they were looked for.
    pub(super) chain: Option<Chain>,
    pub(super) class: LightClass,
    pub(super) found: PathResult,
    /// Whether it asks no cell of the radiance cache: it is a pilot's, or corrects a value.
    pub(super) plain: bool,
    /// What its ray hits, where that is known.
    pub(super) arrives_at: Option<Option<Hit>>,
    /// What is left to do when it has ended.
    pub(super) other: Option<Begin>,
}

/// What light sampling has left of the path's way to go on from a vertex.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Departure {
    /// With which the BSDF found the direction; 0: light sampling could not have found it.
    pub(super) pdf: f64,
    /// See [`light_pdf`](super::light::sphere::light_pdf).
    pub(super) pdf_per_weight: f64,
}

/// A path's way from a vertex at which images of lamps were looked for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Chain {
    /// That vertex.
    pub(super) anchor: DVec3,
    pub(super) offset: DVec3,
    pub(super) normal: DVec3,
    /// In which it left it, and with which pdf the BSDF has found that.
    pub(super) direction: DVec3,
    pub(super) pdf: f64,
    pub(super) stage: Stage,
}

/// Where on such a way it is, with the sphere that it has met.
#[derive(Clone, Copy, Debug)]
pub(super) enum Stage {
    /// It has left the vertex.
    Left,
    /// It is in the sphere.
    Entered(usize),
    /// It has been reflected.
    Reflected(usize),
    /// It has come out of the sphere.
    Through(usize),
}

/// Where a part of a path begins.
pub(super) struct Begin {
    pub(super) ray: Ray,
    pub(super) throughput: DVec3,
    pub(super) bounces: u32,
    pub(super) sphere: usize,
}

impl Path {
    /// One that starts with a ray, at this time.
    pub(super) fn new(ray: Ray, time: f64) -> Self {
        Self {
            ray: Ray { time, ..ray },
            throughput: DVec3::ONE,
            eta_scale: 1.0,
            wavelength: None,
            departure: Departure::default(),
            chain: None,
            class: LightClass::Emission,
            found: PathResult::default(),
            plain: false,
            arrives_at: None,
            other: None,
        }
    }

    pub(super) fn receive(&mut self, class: LightClass, radiance: DVec3) {
        self.found.radiance += radiance;
        let sum = &mut self.found.aovs.classes[class as usize];
        *sum = (DVec3::from(*sum) + radiance).to_array();
    }

    /// Whether another part of the path is left: it goes on there.
    pub(super) fn go_back(&mut self) -> bool {
        let Some(begin) = self.other.take() else {
            return false;
        };
        self.ray = begin.ray;
        self.throughput = begin.throughput;
        self.found.bounces = begin.bounces;
        self.begin_on(begin.sphere);
        true
    }

    /// Lets it arrive on this sphere without a ray.
    pub(super) fn begin_on(&mut self, index: usize) {
        self.arrives_at = Some(Some(Hit {
            t: 0.0,
            index,
            inside: false,
        }));
    }
}

/// The radiance cache for one batch of samples.
#[derive(Clone, Copy, Debug)]
pub struct Cache<'a> {
    /// Which cells there are.
    pub cells: &'a Cells,
    /// The mean of the radiance that each of those in use reflects, W/(sr m²).
    pub values: &'a [DVec3],
}

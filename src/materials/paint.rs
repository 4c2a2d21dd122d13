//! Paint: Lambert and three Cook-Torrance lobes; twin of `shaders/materials/paint.wesl`, which has the formulas and
//! their source.

use std::f64::consts::PI;

use glam::{DMat3, DVec2, DVec3};

use super::beckmann::{Facets, Halfway, beckmann_normal};
use super::{BsdfSample, BsdfValue, Event};
use crate::reference::core::sampling::{basis_around, cosine_direction};

/// Cook and Torrance's lobe.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lobe {
    /// 4 ks
    pub(super) color: DVec3,
    /// F at normal incidence.
    pub(super) f0: f64,
    pub(super) m: f64,
}

/// All of it at a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Paint {
    pub(super) normal: DVec3,
    pub(super) diffuse: DVec3,
    pub(super) lobes: [Lobe; 3],
    /// That the third lobe is about.
    pub(super) third_normal: DVec3,
}

fn schlick(f0: f64, cosine: f64) -> f64 {
    f0 + (1.0 - f0) * (1.0 - cosine).max(0.0).powi(5)
}

pub(super) fn mean(color: DVec3) -> f64 {
    color.element_sum() / 3.0
}

impl Lobe {
    /// f cos, and the pdf.
    fn value(&self, f: &Facets, cos_i: f64) -> (DVec3, f64) {
        let pdf = f.pdf(self.m);
        let share = pdf * f.both * cos_i * schlick(self.f0, f.oh);
        (share * self.color, pdf)
    }
}

/// Of black paint all is diffuse.
fn shares_of(strengths: [f64; 4]) -> [f64; 4] {
    let all: f64 = strengths.iter().sum();
    if all > 0.0 {
        strengths.map(|s| s / all)
    } else {
        [1.0, 0.0, 0.0, 0.0]
    }
}

/// A direction about visible normals, and the facet that reflects it.
fn reflection(normal: DVec3, m: f64, wo: DVec3, u: DVec2, v: f64) -> (DVec3, Halfway) {
    let basis = basis_around(normal);
    let frame = DMat3::from_cols(basis.tangent, basis.bitangent, normal);
    let mut o = frame.transpose() * wo;
    o.z = o.z.max(0.0);
    let h = beckmann_normal(o, m, u, v);
    let oh = o.dot(h);
    let wi = (frame * (2.0 * oh * h - o)).normalize();
    (wi, Halfway { h: frame * h, oh })
}

/// The mean weight of samples over a grid of uniform numbers, to some 1e-3, for light that arrives at `cos_o`.
pub(super) fn mean_weight(
    normal: DVec3,
    cos_o: f64,
    weight: impl Fn(DVec3, [f64; 3]) -> DVec3,
) -> DVec3 {
    // Most along the choice of a lobe, whose parts of the unit interval are of any length.
    const GRID: [u32; 3] = [8, 8, 64];
    let sine = (1.0 - cos_o * cos_o).sqrt();
    let wo = sine * normal.any_orthonormal_vector() + cos_o * normal;
    let mut sum = DVec3::ZERO;
    let count: u32 = GRID.iter().product();
    for i in 0..count {
        let cell = [i % GRID[0], i / GRID[0] % GRID[1], i / GRID[0] / GRID[1]];
        let u = [0, 1, 2].map(|k| (f64::from(cell[k]) + 0.5) / f64::from(GRID[k]));
        sum += weight(wo, u);
    }
    sum / f64::from(count)
}

impl Paint {
    fn lobe_normal(&self, lobe: usize) -> DVec3 {
        [self.normal, self.normal, self.third_normal][lobe]
    }

    /// The cosine of wo with the normal of a lobe; negative on the back of a flake.
    fn cos_o(&self, lobe: usize, wo: DVec3) -> f64 {
        match lobe {
            2 if self.third_normal != self.normal => self.third_normal.dot(wo),
            _ => self.normal.dot(wo).max(0.0),
        }
    }

    /// What each part reflects, about: the diffuse one, and the lobes.
    pub(super) fn strengths(&self, wo: DVec3) -> [f64; 4] {
        let lobe = |k: usize| {
            let (Lobe { color, f0, .. }, cos_o) = (self.lobes[k], self.cos_o(k, wo));
            match cos_o >= 0.0 {
                true => mean(color) * schlick(f0, cos_o),
                false => 0.0,
            }
        };
        [mean(self.diffuse), lobe(0), lobe(1), lobe(2)]
    }

    pub(super) fn evaluate(&self, wo: DVec3, wi: DVec3) -> BsdfValue {
        self.evaluate_between(wo, wi, Halfway::between(wo, wi))
    }

    fn evaluate_between(&self, wo: DVec3, wi: DVec3, between: Halfway) -> BsdfValue {
        let cos_i = self.normal.dot(wi);
        if cos_i <= 0.0 {
            return BsdfValue {
                f_cos: DVec3::ZERO,
                pdf: 0.0,
                event: Event::DIFFUSE,
            };
        }
        let q = shares_of(self.strengths(wo));
        let diffuse = cos_i / PI * self.diffuse;
        let (mut glossy, mut pdf) = (DVec3::ZERO, q[0] * cos_i / PI);
        for (k, lobe) in self.lobes.iter().enumerate() {
            let facets = Facets::about(self.lobe_normal(k), self.cos_o(k, wo), wi, between);
            let (f_cos, of_lobe) = lobe.value(&facets, cos_i);
            glossy += f_cos;
            pdf += q[k + 1] * of_lobe;
        }
        BsdfValue {
            f_cos: diffuse + glossy,
            pdf,
            event: if mean(glossy) >= mean(diffuse) {
                Event::GLOSSY
            } else {
                Event::DIFFUSE
            },
        }
    }

    // Below the horizon the path ends: it would meet another facet.
    pub(super) fn sample(&self, wo: DVec3, u: [f64; 3]) -> BsdfSample {
        let q = shares_of(self.strengths(wo));
        let place = DVec2::new(u[0], u[1]);
        let begin = [q[0], q[0] + q[1], q[0] + q[1] + q[2]];
        let chosen = (1..3).rev().find(|k| u[2] >= begin[*k]).unwrap_or(0);
        let (wi, between) = if u[2] < q[0] {
            let wi = cosine_direction(self.normal, place);
            (wi, Halfway::between(wo, wi))
        } else {
            let v = (u[2] - begin[chosen]) / q[chosen + 1].max(1.0e-30);
            let m = self.lobes[chosen].m;
            reflection(self.lobe_normal(chosen), m, wo, place, v)
        };
        let value = self.evaluate_between(wo, wi, between);
        BsdfSample {
            wi,
            weight: if value.pdf > 0.0 {
                value.f_cos / value.pdf
            } else {
                DVec3::ZERO
            },
            pdf: value.pdf,
            event: value.event,
            eta: 1.0,
        }
    }

    /// The share of the light that it reflects, at most, by channel: facets reflect all of it at most.
    pub(super) fn albedo(&self) -> DVec3 {
        self.diffuse + self.lobes.iter().map(|lobe| lobe.color).sum::<DVec3>()
    }

    /// The share that it does reflect of light that arrives at `cos_o`.
    pub(super) fn reflected(&self, cos_o: f64) -> DVec3 {
        mean_weight(self.normal, cos_o, |wo, u| self.sample(wo, u).weight)
    }

    /// The largest of these, from normal to grazing incidence.
    pub(super) fn most_reflected(&self) -> f64 {
        let cosines = [1.0, 0.7, 0.4, 0.2, 0.1, 0.05, 0.02];
        let shares = cosines.map(|cosine| self.reflected(cosine).max_element());
        shares.into_iter().fold(0.0, f64::max)
    }
}

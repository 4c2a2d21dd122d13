//! Paint: Lambert and three Cook-Torrance lobes; twin of `shaders/materials/paint.wesl`, which has the formulas and
//! their source.

use std::f64::consts::FRAC_1_PI;

use glam::{DVec2, DVec3};

use super::beckmann::{Facets, beckmann_normal};
use super::ggx::Frame;
use super::lobes::{Lobes, Pair, arrival, schlick};
use super::{BsdfSample, BsdfValue};
use crate::sampling::directions::cosine_direction;

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
    pub(super) frame: Frame,
    pub(super) diffuse: DVec3,
    pub(super) lobes: [Lobe; 3],
    /// About the normal of the third lobe, which a flake turns, within `frame`.
    pub(super) third_frame: Frame,
}

/// In proportion to what parts are chosen: the diffuse one, and the lobes.
pub(super) struct Weights {
    pub(super) parts: [f64; 4],
    /// Of a coat over them.
    pub(super) coat: f64,
    /// What all reflect together, in the channel that has the least.
    pub(super) least: f64,
}

impl Weights {
    /// Each part by the largest share that it has in a channel.
    pub(super) fn of(parts: [DVec3; 4], coat: f64) -> Self {
        let all = coat + parts.iter().sum::<DVec3>();
        let largest = |part: DVec3| {
            let shares = DVec3::select(all.cmpgt(DVec3::ZERO), part / all, DVec3::ZERO);
            shares.max_element()
        };
        Self {
            parts: parts.map(largest),
            coat: largest(DVec3::splat(coat)),
            least: all.min_element(),
        }
    }
}

/// Of black paint all is diffuse.
pub(super) fn choosable(weights: [f64; 4]) -> [f64; 4] {
    if weights.iter().sum::<f64>() > 0.0 {
        weights
    } else {
        [1.0, 0.0, 0.0, 0.0]
    }
}

/// A pair in a frame that is given in its own one.
fn within(pair: &Pair, frame: &Frame) -> Pair {
    Pair {
        o: frame.to_local(pair.o),
        i: frame.to_local(pair.i),
        h: frame.to_local(pair.h),
        ..*pair
    }
}

impl Lobe {
    fn reflectance(&self, cosine: f64) -> f64 {
        self.f0 + (1.0 - self.f0) * schlick(cosine)
    }

    /// f cos, and the pdf.
    fn value(&self, pair: &Pair, f: &Facets, cos_i: f64) -> (DVec3, f64) {
        let pdf = f.pdf(self.m);
        let share = pdf * f.both * cos_i * self.reflectance(pair.cos_h);
        (share * self.color, pdf)
    }
}

impl Paint {
    /// What each part reflects, about: the diffuse one, and the lobes.
    pub(super) fn parts(&self, wo: DVec3) -> [DVec3; 4] {
        let o = arrival(&self.frame, wo);
        let cos_o = o.z.min(1.0);
        let cos_third = o.dot(self.third_frame.normal()).min(1.0);
        let [first, second, third] = self.lobes;
        let of_third = match cos_third >= 0.0 {
            true => third.reflectance(cos_third) * third.color,
            false => DVec3::ZERO,
        };
        [
            self.diffuse,
            first.reflectance(cos_o) * first.color,
            second.reflectance(cos_o) * second.color,
            of_third,
        ]
    }

    /// In proportion to what parts are chosen without a coat.
    pub(super) fn weights(&self, wo: DVec3) -> [f64; 4] {
        choosable(Weights::of(self.parts(wo), 0.0).parts)
    }

    /// `third`: the same pair in the third lobe's frame.
    fn lobes(&self, weights: &[f64; 4], pair: &Pair, third: &Pair) -> Lobes {
        let (f, g) = (Facets::of(pair), Facets::of(third));
        let cosine = pair.i.z * FRAC_1_PI;
        let mut lobes = Lobes {
            diffuse: cosine * self.diffuse,
            glossy: DVec3::ZERO,
            pdf: weights[0] * cosine,
        };
        for ((lobe, facets), weight) in self.lobes.iter().zip([&f, &f, &g]).zip(&weights[1..]) {
            let (f_cos, pdf) = lobe.value(pair, facets, pair.i.z);
            lobes.glossy += f_cos;
            lobes.pdf += weight * pdf;
        }
        lobes.pdf /= weights.iter().sum::<f64>();
        lobes
    }

    pub(super) fn evaluate(&self, weights: &[f64; 4], wo: DVec3, wi: DVec3) -> BsdfValue {
        let pair = Pair::between(arrival(&self.frame, wo), self.frame.to_local(wi));
        let third = within(&pair, &self.third_frame);
        self.lobes(weights, &pair, &third).value(&pair)
    }

    pub(super) fn sample(&self, weights: &[f64; 4], wo: DVec3, u: [f64; 3]) -> BsdfSample {
        let (o, plane) = (arrival(&self.frame, wo), DVec2::new(u[0], u[1]));
        let [diffuse, lobes @ ..] = weights;
        let mut place = u[2] * weights.iter().sum::<f64>() - diffuse;
        let mut chosen = 0;
        while chosen < 2 && place >= lobes[chosen] {
            place -= lobes[chosen];
            chosen += 1;
        }
        let about = |o| {
            let (m, v) = (self.lobes[chosen].m, place / lobes[chosen]);
            Pair::about(o, beckmann_normal(o, m, plane, v))
        };
        let turned = &self.third_frame;
        let (pair, third) = if place >= 0.0 && chosen == 2 {
            let third = about(turned.to_local(o));
            let [i, h] = [third.i, third.h].map(|w| turned.to_world(w));
            (Pair { o, i, h, ..third }, third)
        } else {
            let pair = match place >= 0.0 {
                true => about(o),
                false => Pair::between(o, cosine_direction(DVec3::Z, plane)),
            };
            (pair, within(&pair, turned))
        };
        self.lobes(weights, &pair, &third)
            .sample(&self.frame, &pair)
    }

    /// The share of the light that it reflects, at most, by channel: facets reflect all of it at most.
    pub(super) fn albedo(&self) -> DVec3 {
        self.diffuse + self.lobes.iter().map(|lobe| lobe.color).sum::<DVec3>()
    }
}

//! What is drawn from a BSDF on the device: its distribution, and what its weights are in the mean.

use std::f64::consts::TAU;

use glam::DVec3;

use super::Subjects;
use crate::error::Result;
use crate::gpu::bsdf_probe::{BsdfInput, Sampled};
use crate::materials::fresnel::fresnel;
use crate::materials::{Event, Surface};
use crate::sampling::directions::basis_around;
use crate::statistics::{mean_and_error, normal_p};
use crate::verify::{Cells, Outcome, Random, ULP};

/// Angles of incidence, in degrees.
pub const ANGLES: [f64; 4] = [0.0, 45.0, 85.0, 89.9];

/// Where on a ball samples are drawn from materials that look at it.
pub const OFFSETS: [DVec3; 2] = [DVec3::new(0.28, 0.72, 0.635), DVec3::new(0.28, 0.48, 0.831)];

/// Rings about the mirror direction, narrow ones for narrow lobes.
const EDGES: [f64; 7] = [0.0, 1.0e-4, 1.0e-3, 1.0e-2, 0.1, 1.0, 2.0];
const RINGS: usize = 5;

/// Samples on a side of a surface that are too few for a test of where they are.
const FEW: f64 = 1000.0;
const SECTORS: usize = 20;

/// Samples of one direction.
#[derive(Debug)]
pub struct Draw<'a> {
    subjects: &'a Subjects,
    subject: usize,
    surface: Surface,
    wo: DVec3,
    name: String,
    samples: Vec<Sampled>,
}

/// The light that a material scatters by channel, as drawn and by quadrature.
#[derive(Clone, Copy, Debug)]
pub struct Energy {
    /// Mean weights, without what refraction takes.
    pub drawn: [f64; 3],
    /// Their standard errors.
    pub errors: [f64; 3],
    /// The integrals of f cos; of delta lobes, what the twin draws.
    pub integrals: [f64; 3],
}

impl<'a> Draw<'a> {
    /// `count` samples of the subject at each of [`ANGLES`], from either side where it transmits, and where it looks at
    /// the offset at each of [`OFFSETS`].
    ///
    /// # Errors
    /// If the device fails.
    pub fn all(subjects: &'a Subjects, subject: usize, count: usize) -> Result<Vec<Self>> {
        let kind = &subjects.kinds[subject];
        let etas = match kind.transmits() {
            true => vec![kind.ior(), 1.0 / kind.ior()],
            false => vec![1.0],
        };
        let offsets = match kind.form().offset {
            true => &OFFSETS[..],
            false => &[DVec3::ZERO],
        };
        let places = etas
            .iter()
            .flat_map(|eta| offsets.iter().map(move |offset| (*eta, *offset)))
            .flat_map(|place| ANGLES.map(|angle| (place, angle)));
        places
            .map(|(place, degrees)| Self::new(subjects, subject, place, degrees, count))
            .collect()
    }

    fn new(
        subjects: &'a Subjects,
        subject: usize,
        (eta, offset): (f64, DVec3),
        degrees: f64,
        count: usize,
    ) -> Result<Self> {
        let kind = &subjects.kinds[subject];
        // A tilted frame, so that no axis is special, rounded as the device has it.
        let normal = DVec3::new(2.0, -1.0, 2.0) / 3.0;
        let (sin, cos) = f64::to_radians(degrees).sin_cos();
        let wo = cos * normal - sin * basis_around(normal).tangent;
        let surface = Surface {
            normal,
            eta,
            offset,
        };
        let input = BsdfInput::new(subject, &surface, wo, [0.0; 4]);
        let mut name = format!(
            "case {}, {}, eta {eta}, {degrees} degrees",
            subjects.first + subject,
            kind.name()
        );
        if kind.form().offset {
            name += &format!(", at {offset}");
        }
        let mut random = Random::new(&format!("draw {name}"));
        let inputs: Vec<BsdfInput> = (0..count)
            .map(|_| BsdfInput {
                u: random.unit4(),
                ..input
            })
            .collect();
        Ok(Self {
            subjects,
            subject,
            surface: input.surface(),
            wo: input.wo(),
            name,
            samples: subjects.sample(&inputs)?,
        })
    }

    /// What was drawn.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The samples.
    #[must_use]
    pub fn samples(&self) -> &[Sampled] {
        &self.samples
    }

    /// The cosine of the angle of incidence.
    #[must_use]
    pub fn cosine(&self) -> f64 {
        self.surface.normal.dot(self.wo).clamp(0.0, 1.0)
    }

    /// See [`Surface::eta`].
    #[must_use]
    pub fn eta(&self) -> f64 {
        self.surface.eta
    }

    /// The sides to which light is scattered: beyond the surface or not.
    fn sides(&self) -> &'static [bool] {
        match self.subjects.kinds[self.subject].is_translucent() {
            true => &[false, true],
            false => &[false],
        }
    }

    /// Cells about the direction of smooth reflection, or beyond the surface of refraction.
    fn cells(&self, beyond: bool) -> Cells {
        let Surface { normal, eta, .. } = self.surface;
        let refraction = fresnel(self.cosine(), eta);
        let axis = match beyond {
            false => (-self.wo).reflect(normal),
            true if refraction.reflected == 1.0 => -self.wo,
            true => (self.cosine() / eta - refraction.cos_t) * normal - self.wo / eta,
        };
        // Near grazing incidence lobes are streaks in its plane.
        Cells::new(axis, &EDGES, RINGS, SECTORS).with_border(normal)
    }

    /// Integrals over all directions to which light is scattered; `f` is told whether one is beyond the surface.
    fn integrals<const N: usize>(&self, f: impl Fn(DVec3, bool) -> [f64; N] + Sync) -> [f64; N] {
        let mut sums = [0.0; N];
        for beyond in self.sides() {
            let there = |w: DVec3| {
                if is_beyond(&self.surface, w) == *beyond {
                    f(w, *beyond)
                } else {
                    [0.0; N]
                }
            };
            for cell in self.cells(*beyond).integrals(there, 1.0e-7) {
                for (sum, part) in sums.iter_mut().zip(cell) {
                    *sum += part;
                }
            }
        }
        sums
    }

    /// Whether the samples follow the twin: directions its pdf, by chi-square over cells, of delta lobes each
    /// event its share, and both where there are both. `wrong` turns the twin's normal and makes its eta larger,
    /// for companions.
    #[must_use]
    pub fn follows(&self, wrong: f64) -> Outcome {
        let kind = &self.subjects.kinds[self.subject];
        let p = if kind.is_delta() {
            self.choices(wrong)
        } else if kind.is_part_delta() {
            // The less likely of two.
            (2.0 * self.directions(wrong).min(self.reflections(wrong))).min(1.0)
        } else {
            self.directions(wrong)
        };
        (self.name.clone(), p)
    }

    fn wrong_surface(&self, wrong: f64) -> Surface {
        let Surface {
            normal,
            eta,
            offset,
        } = self.surface;
        let across = wrong * basis_around(normal).bitangent;
        Surface {
            normal: (normal + across).normalize(),
            eta: eta * (1.0 + wrong),
            offset,
        }
    }

    /// p-value of the directions on either side, those on the other side counting as ended.
    fn directions(&self, wrong: f64) -> f64 {
        let kind = &self.subjects.kinds[self.subject];
        let uniform = self.subjects.is_uniform(self.subject);
        let surface = self.wrong_surface(wrong);
        let share = kind.delta_share(&surface, self.wo);
        let p = |beyond: &bool| {
            let directions = self.samples.iter().map(|s| {
                let lost = kind.transmits() && s.weight().max_element() == 0.0;
                let delta = s.event & Event::DELTA.bits() != 0;
                let here = is_beyond(&self.surface, s.wi()) == *beyond;
                (!lost && !delta && here).then(|| s.wi())
            });
            let pdf = |w: DVec3| match uniform {
                _ if is_beyond(&surface, w) != *beyond => 0.0,
                true => (1.0 - share) / TAU,
                false => kind.evaluate(&surface, self.wo, w).pdf,
            };
            let cells = self.cells(*beyond);
            // Hardly any on this side, as in total reflection, or where the index hardly changes: their number alone.
            let count = directions.clone().flatten().count() as f64;
            if count < FEW {
                let [mass] = total(&cells.integrals(|w| [pdf(w)], 1.0e-8));
                let mean = mass * self.samples.len() as f64;
                return normal_p((count - mean) / mean.max(1.0).sqrt());
            }
            cells.test(directions, pdf)
        };
        let sides = self.sides();
        let least = sides.iter().map(p).fold(1.0, f64::min);
        (least * sides.len() as f64).min(1.0)
    }

    /// p-value of how often the delta lobe beside others is chosen, whose direction must be that of a mirror.
    fn reflections(&self, wrong: f64) -> f64 {
        let delta = Event::DELTA.bits();
        let chosen: Vec<&Sampled> = self.samples.iter().filter(|s| s.event == delta).collect();
        let mirrored = (-self.wo).reflect(self.surface.normal);
        let aside = |s: &&&Sampled| (s.wi() - mirrored).length() > 64.0 * ULP;
        let kind = &self.subjects.kinds[self.subject];
        let share = kind.delta_share(&self.wrong_surface(wrong), self.wo);
        let (count, total) = (chosen.len() as f64, self.samples.len() as f64);
        if chosen.iter().any(|s| aside(&s)) {
            0.0
        } else if share == 0.0 || share == 1.0 {
            f64::from(u8::from(count == total * share))
        } else {
            normal_p((count - total * share) / (total * share * (1.0 - share)).sqrt())
        }
    }

    /// p-value of how often each event is chosen, the least of all events.
    fn choices(&self, wrong: f64) -> f64 {
        const STEPS: u32 = 1 << 16;
        let kind = &self.subjects.kinds[self.subject];
        let surface = self.wrong_surface(wrong);
        let mut random = Random::new(&self.name);
        let mut shares = std::collections::BTreeMap::new();
        for i in 0..STEPS {
            let [x, y, _, w] = random.unit4().map(f64::from);
            let z = (f64::from(i) + 0.5) / f64::from(STEPS);
            let event = kind.sample(&surface, self.wo, [x, y, z, w]).event;
            *shares.entry(event.bits()).or_insert(0.0) += 1.0 / f64::from(STEPS);
        }
        let total = self.samples.len() as f64;
        let unknown = self.samples.iter().any(|s| !shares.contains_key(&s.event));
        let p = |(event, share): (&u32, &f64)| {
            let count = self.samples.iter().filter(|s| s.event == *event).count() as f64;
            if *share > 1.0 - 0.5 / f64::from(STEPS) {
                f64::from(u8::from(count == total))
            } else {
                normal_p((count - total * share) / (total * share * (1.0 - share)).sqrt())
            }
        };
        if unknown {
            0.0
        } else {
            shares.iter().map(p).fold(1.0, f64::min)
        }
    }

    /// The light that is scattered.
    #[must_use]
    pub fn energy(&self) -> Energy {
        let weighed = |channel: usize| -> Vec<f64> {
            let of = |s: &Sampled| s.weight()[channel] * eta_scale(s.event, s.eta.into());
            self.samples.iter().map(of).collect()
        };
        let drawn = [0, 1, 2].map(|channel| mean_and_error(&weighed(channel)));
        let kind = &self.subjects.kinds[self.subject];
        let integrals = if kind.is_delta() {
            self.twins_moment(1)
        } else {
            let wide = self.integrals(|w, beyond| {
                let scale = if beyond { self.eta() * self.eta() } else { 1.0 };
                (scale * kind.evaluate(&self.surface, self.wo, w).f_cos).to_array()
            });
            let (share, weight) = self.delta_part();
            std::array::from_fn(|c| wide[c] + share * weight[c])
        };
        Energy {
            drawn: drawn.map(|(mean, _)| mean),
            errors: drawn.map(|(_, error)| error),
            integrals,
        }
    }

    /// Probability and weight of the twin's delta lobe beside others.
    fn delta_part(&self) -> (f64, DVec3) {
        let kind = &self.subjects.kinds[self.subject];
        let share = kind.delta_share(&self.surface, self.wo);
        if share == 0.0 {
            return (0.0, DVec3::ZERO);
        }
        let s = kind.sample(&self.surface, self.wo, [0.5, 0.5, 0.0, 0.5]);
        assert!(s.event.is(Event::DELTA), "{}", self.name);
        (share, s.weight)
    }

    /// The largest weight of uniform sampling in the mirror direction, by the twin.
    #[must_use]
    pub fn peak(&self) -> f64 {
        let mirrored = (-self.wo).reflect(self.surface.normal);
        let kind = &self.subjects.kinds[self.subject];
        TAU * kind
            .evaluate(&self.surface, self.wo, mirrored)
            .f_cos
            .max_element()
    }

    /// The mean of the k-th powers of the twin's weights, without what refraction takes.
    fn twins_moment(&self, k: i32) -> [f64; 3] {
        let kind = &self.subjects.kinds[self.subject];
        let mut random = Random::new(&self.name);
        let mut sum = DVec3::ZERO;
        for _ in 0..self.samples.len() {
            let s = kind.sample(&self.surface, self.wo, random.unit4().map(f64::from));
            let weight = s.weight * eta_scale(s.event.bits(), s.eta);
            sum += DVec3::from(weight.to_array().map(|w| w.powi(k)));
        }
        (sum / self.samples.len() as f64).to_array()
    }

    /// The k-th moments, for k from 1 to 4, of the weights of the lecture's uniform sampling or, where that does not
    /// sample, of the material's own, by channel, each over the bound that the material says. 0 where the bound is.
    #[must_use]
    pub fn moments(&self) -> [[f64; 3]; 4] {
        let kind = &self.subjects.kinds[self.subject];
        let bound = |k: usize, channel: usize| kind.moment(channel, k as i32 + 1);
        let over = |moment: f64, bound: f64| if moment == 0.0 { 0.0 } else { moment / bound };
        if !kind.form().is_hemispherical() {
            return std::array::from_fn(|k| {
                let moment = self.twins_moment(k as i32 + 1);
                std::array::from_fn(|c| over(moment[c], bound(k, c)))
            });
        }
        let bounds: [f64; 12] = std::array::from_fn(|i| bound(i / 3, i % 3));
        let (share, delta) = self.delta_part();
        // What is left to the other lobes: nothing where the coat, say, reflects all.
        let rest = 1.0 - share;
        let all = self.integrals(|w, _| -> [f64; 12] {
            if rest == 0.0 {
                return [0.0; 12];
            }
            let f_cos = kind.evaluate(&self.surface, self.wo, w).f_cos;
            std::array::from_fn(|i| {
                let weight = TAU * f_cos[i % 3] / rest;
                over(rest * weight.powi(i as i32 / 3 + 1) / TAU, bounds[i])
            })
        });
        let of_delta = |k: usize, c: usize| over(share * delta[c].powi(k as i32 + 1), bound(k, c));
        std::array::from_fn(|k| std::array::from_fn(|c| all[3 * k + c] + of_delta(k, c)))
    }
}

fn is_beyond(surface: &Surface, w: DVec3) -> bool {
    w.dot(surface.normal) <= 0.0
}

/// What refraction takes out of a weight.
fn eta_scale(event: u32, eta: f64) -> f64 {
    if event & Event::TRANSMITTED.bits() == 0 {
        1.0
    } else {
        eta * eta
    }
}

fn total<const N: usize>(cells: &[[f64; N]]) -> [f64; N] {
    std::array::from_fn(|i| cells.iter().map(|cell| cell[i]).sum())
}

//! What light sampling knows of a light, and what it makes of it: cases 16, 17 and 20.

use std::f64::consts::PI;

use glam::DVec3;

use super::Measure;
use super::context::Context;
use crate::effects::Effect;
use crate::error::Result;
use crate::reference::light::aim::{Aim, aim_center, aim_pole, cone_height};
use crate::reference::light::projected::{Cap, cap_seen};
use crate::settings::{Integrator, LightSampling, Settings};
use crate::statistics::{mean_and_error, normal_limit};
use crate::verify::{Random, SceneText, ULP};

type Row = [f32; 4];

/// A light and a vertex with this normal, as f32 has them: of radius 1, `x` from its centre, or with the
/// outward normal `pole` and this curvature, `x` from its pole.
struct Lamp {
    x: DVec3,
    pole: Option<DVec3>,
    curvature: f64,
    normal: DVec3,
}

fn rounded(v: DVec3) -> DVec3 {
    v.as_vec3().as_dvec3()
}

impl Lamp {
    fn new(distance: f64, cosine: f64, random: &mut Random) -> Self {
        let normal = random.direction();
        let side = normal.any_orthonormal_vector();
        let turn = random.range(0.0, 2.0 * PI);
        let across = turn.cos() * side + turn.sin() * normal.cross(side);
        let w = distance * (cosine * normal + (1.0 - cosine * cosine).sqrt() * across);
        Self {
            x: rounded(-w),
            pole: None,
            curvature: 1.0,
            normal: rounded(normal),
        }
    }

    /// A vertex this far above a wall, at most 10 from its pole along it.
    fn wall(radius: f64, gap: f64, random: &mut Random) -> Self {
        let pole = random.direction();
        let across = random.range(0.0, 10.0) * pole.any_orthonormal_vector();
        // The wall falls away from its tangent plane.
        let square = across.length_squared();
        let fall = square / (radius + (radius * radius - square).sqrt());
        Self {
            x: rounded(across + (gap - fall) * pole),
            pole: Some(rounded(pole)),
            curvature: f64::from((1.0 / radius) as f32),
            normal: rounded(random.direction()),
        }
    }

    fn rows(&self, random: &mut Random) -> [Row; 4] {
        let row = |v: DVec3, w: f32| [v.x as f32, v.y as f32, v.z as f32, w];
        let pole = self.pole.unwrap_or_default();
        [
            row(self.x, self.curvature as f32),
            row(pole, 0.0),
            row(self.normal, 0.0),
            random.unit4(),
        ]
    }

    fn aim(&self) -> Aim {
        match self.pole {
            Some(pole) => aim_pole(self.x, pole, self.curvature),
            None => aim_center(self.x, 1.0),
        }
    }

    fn cap(&self) -> Cap {
        cap_seen(&self.aim(), self.normal)
    }

    /// How far roundings of the distance and of the cosine by so many ulp move the area, in f64.
    fn slope(&self, ulps: f64) -> f64 {
        let aim = self.aim();
        let area = self.cap().area;
        let moved = |by: f64| {
            let farther = cap_seen(&aim_center(self.x * (1.0 + by), 1.0), self.normal).area;
            let turned = cap_seen(&aim, self.normal + by * aim.axis).area;
            (farther - area).abs() + (turned - area).abs()
        };
        moved(ulps * ULP) + moved(-ulps * ULP)
    }
}

/// What the kernel makes of a lamp.
struct Seen {
    /// 1 - cos of the half angle.
    height: f64,
    outside: bool,
    /// Projected solid angle.
    area: f64,
    direction: DVec3,
}

fn seen(context: &Context, lamps: &[Lamp], random: &mut Random) -> Result<Vec<Seen>> {
    let inputs: Vec<[Row; 4]> = lamps.iter().map(|lamp| lamp.rows(random)).collect();
    let effects = [
        Effect::Emission,
        Effect::Lights,
        Effect::Projected,
        Effect::Pole,
    ];
    let probe = context.probe(&effects)?;
    let spheres: Vec<[Row; 2]> = inputs.iter().map(|[x, pole, ..]| [*x, *pole]).collect();
    let aims: Vec<[Row; 2]> = probe.call("aim_at", &spheres)?;
    let caps: Vec<[Row; 3]> = inputs
        .iter()
        .map(|[x, pole, n, _]| [*x, *pole, *n])
        .collect();
    let areas: Vec<Row> = probe.call("cap_seen", &caps)?;
    let samples: Vec<Row> = probe.call("sample_cap", &inputs)?;
    let all = aims.iter().zip(&areas).zip(&samples);
    Ok(all
        .map(|(([_, aim], area), sample)| {
            let direction = sample.map(f64::from);
            Seen {
                height: f64::from(aim[3]),
                outside: aim[2] != 0.0,
                area: f64::from(area[0]),
                direction: DVec3::new(direction[0], direction[1], direction[2]),
            }
        })
        .collect())
}

pub(super) fn far(context: &Context) -> Result<Measure> {
    let mut measure = Measure::new(1.0, "of the bound");
    let mut random = Random::new("far lights");
    let lamps: Vec<Lamp> = (0..context.size(20_000, 200_000))
        .map(|i| {
            let s = random.magnitude(-8.0, -1.0);
            let c = match i % 3 {
                0 => random.range(-1.5, 1.5) * s,
                1 => s,
                _ => random.range(s, 0.999),
            };
            Lamp::new(1.0 / s, c, &mut random)
        })
        .collect();
    let found = seen(context, &lamps, &mut random)?;
    for (
        lamp,
        Seen {
            height,
            area,
            direction,
            ..
        },
    ) in lamps.iter().zip(found)
    {
        let place = || format!("a light at {}, normal {}", -lamp.x, lamp.normal);
        // WGSL 15.7.4: an inverse root, twice, products, sums, a division, a root.
        let truth = cone_height(&lamp.aim()) * context.disturbed(1.0e-3);
        measure.add((height / truth - 1.0).abs() / (16.0 * ULP), place);
        // The cosine and the distance have some roundings, and what follows some more.
        let cap = lamp.cap();
        let truth = cap.area * context.disturbed(1.0e-3);
        let bound = 24.0 * ULP * (cap.area + cap.segment) + lamp.slope(6.0);
        // The least number of f32 is not 0.
        measure.add((area - truth).abs() / bound.max(1.0e-36), place);
        if area > 0.0 && cap.area > 0.0 {
            // A direction has roundings of its own, its height above the horizon their root.
            let beyond = cap.aim.axis.cross(direction).length() - cap.aim.sine;
            let heights = (32.0 * ULP).sqrt() * cap.aim.sine.powi(2);
            measure.add(beyond / (16.0 * ULP + heights), place);
        }
    }
    Ok(measure)
}

pub(super) fn near(context: &Context) -> Result<Measure> {
    let mut measure = Measure::new(1.0, "of the bound");
    let mut random = Random::new("near lights");
    let lamps: Vec<Lamp> = (0..context.size(20_000, 200_000))
        .map(|_| {
            let e = random.magnitude(-7.0, -1.0);
            let c = random.range(-0.9, 0.999);
            Lamp::new(1.0 + e, c, &mut random)
        })
        .collect();
    let found = seen(context, &lamps, &mut random)?;
    for (lamp, Seen { height, area, .. }) in lamps.iter().zip(found) {
        let (xx, aim) = (lamp.x.length_squared(), lamp.aim());
        let e = (xx - 1.0) / (aim.distance + 1.0);
        let place = || format!("{e:e} above a light, normal {}", lamp.normal);
        // Four roundings of the squared distance: the kernel may take the vertex for inside.
        if e < 4.0 * ULP {
            continue;
        }
        let bound = 1.0e-6 / (2.0 * e).sqrt();
        let truth = cone_height(&aim) * context.disturbed(0.02);
        measure.add((height - truth).abs() / bound, place);
        let truth = lamp.cap().area * context.disturbed(0.02);
        // The area's derivative to the cosine of the half angle is at most 2 pi.
        measure.add((area - truth).abs() / (2.0 * PI * bound), place);
    }
    walls(context, &mut measure)?;
    Ok(measure)
}

/// Walls, about their poles: cos of the half angle is known as well as the square of the vertex's height.
fn walls(context: &Context, measure: &mut Measure) -> Result<()> {
    let mut random = Random::new("near walls");
    let lamps: Vec<Lamp> = (0..context.size(20_000, 200_000))
        .map(|_| {
            let (radius, gap) = (random.magnitude(3.0, 8.0), random.magnitude(-6.0, 1.0));
            Lamp::wall(radius, gap, &mut random)
        })
        .collect();
    let found = seen(context, &lamps, &mut random)?;
    for (lamp, seen) in lamps.iter().zip(found) {
        let (aim, k, x) = (lamp.aim(), lamp.curvature, lamp.x.length());
        let place = || {
            format!(
                "{} off a wall of {:e}, normal {}",
                lamp.x,
                1.0 / k,
                lamp.normal
            )
        };
        // cos^2 is k C/(1 + k C): three roundings of each of the products that C is the sum of.
        let rounding = 6.0 * ULP * k * x * (2.0 + k * x);
        let square = aim.rim * aim.rim;
        if square < rounding {
            continue;
        }
        let outside = if seen.outside { 0.0 } else { f64::INFINITY };
        measure.add(outside, place);
        let bound = rounding / aim.rim + 6.0 * ULP;
        let truth = cone_height(&aim) * context.disturbed(0.02);
        measure.add((seen.height - truth).abs() / bound, place);
        let truth = lamp.cap().area * context.disturbed(0.02);
        measure.add((seen.area - truth).abs() / (2.0 * PI * bound), place);
    }
    Ok(())
}

pub(super) fn strategies(context: &Context) -> Result<Measure> {
    let mut measure = Measure::new(1.0, "of the bound");
    for &scale in context.size(&[1.0][..], &[1.0e-5, 1.0e-3, 1.0, 1.0e3, 1.0e6]) {
        for how in [LightSampling::Projected, LightSampling::Cone] {
            limbs(context, scale, how, &mut measure)?;
            hollow(context, scale, how, &mut measure)?;
        }
    }
    Ok(measure)
}

/// A lamp over a floor that fills the image, light sampling alone: a sample that the lamp's own limb
/// blocks is a sample less than in f64.
fn limbs(context: &Context, scale: f64, how: LightSampling, measure: &mut Measure) -> Result<()> {
    let spp = 64;
    for (height, radius) in [(2.0, 0.5), (30.0, 0.01), (0.4, 0.399)] {
        let at = |v: [f64; 3]| v.map(|x| x * scale);
        let scene = SceneText::new(at([1.5, 1.0, 0.0]), at([1.5, 0.0, 0.01]))
            .diffuse("floor", 0.5, 0.0)
            .diffuse("lamp", 0.0, 1.0)
            .sphere(at([0.0, -1000.0, 0.0]), 1000.0 * scale, "floor")
            .sphere(at([0.0, height, 0.0]), radius * scale, "lamp")
            .load()?;
        let settings = Settings {
            integrator: Integrator::Nee,
            light_sampling: Some(how),
            max_bounces: 1,
            ..context.settings(&scene, 8, spp)
        };
        let film = context.render(&scene, &settings)?;
        let reference = context.reference(&scene, &settings)?;
        for i in 0..film.rect().pixels() {
            let (mean, truth) = (film.mean(i)[0], reference.mean(i)[0]);
            let truth = truth * context.disturbed(0.1);
            // Half a sample.
            let bound = 0.5 / spp as f64;
            measure.add((mean / truth - 1.0).abs() / bound, || {
                format!("{how:?}, scale {scale:e}, lamp of {radius}, pixel {i}: {mean} for {truth}")
            });
        }
    }
    Ok(())
}

/// A lamp in the middle of a diffuse hollow sphere, whose radiance is everywhere the same: with the
/// form factors F12 = (r1/r2)^2 and F22 = 1 - F12, L2 = a F12 (E + b L2) + a F22 L2.
fn hollow(context: &Context, scale: f64, how: LightSampling, measure: &mut Measure) -> Result<()> {
    let (wall, lamp) = (0.5, 0.25);
    let form: f64 = (0.5f64 / 2.0).powi(2);
    let exact = wall * form / (1.0 - wall * (1.0 - form + lamp * form));
    let at = |v: [f64; 3]| v.map(|x| x * scale);
    let scene = SceneText::new(at([0.0, 0.3, 1.2]), at([0.0, 0.6, 3.0]))
        .diffuse("wall", wall, 0.0)
        .diffuse("lamp", lamp, 1.0)
        .sphere(at([0.0; 3]), 2.0 * scale, "wall")
        .sphere(at([0.0; 3]), 0.5 * scale, "lamp")
        .load()?;
    for integrator in [Integrator::Path, Integrator::Nee] {
        let settings = Settings {
            integrator,
            light_sampling: Some(how),
            ..context.settings(&scene, 16, context.size(256, 1024))
        };
        let film = context.render(&scene, &settings)?;
        let means: Vec<f64> = (0..film.rect().pixels()).map(|i| film.mean(i)[0]).collect();
        let (mean, error) = mean_and_error(&means);
        let truth = exact * context.disturbed(0.05);
        measure.add((mean - truth).abs() / (normal_limit(20) * error), || {
            let name = integrator.name();
            format!("{name}, {how:?}, scale {scale:e}: {mean} +- {error} for {truth}")
        });
    }
    Ok(())
}

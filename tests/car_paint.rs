//! Car paint: the preset's numbers, the formula written a second time, and its delta lobe in every integrator.

use std::f64::consts::{PI, TAU};

use crate::common::blocks::{Blocks, blocks_of_seeds, deviation};
use crate::common::images::Left;
use crate::common::{gpu_renderer, scene};
use glam::DVec3;
use gpu_trace::materials::car_paint::{CarPaint, Preset};
use gpu_trace::materials::coat::Clearcoat;
use gpu_trace::materials::{ALL, Bsdf, Event, MaterialKind, Surface, Value};
use gpu_trace::scene::Scene;
use gpu_trace::scene::load::load_str;
use gpu_trace::settings::{Integrator, Settings};
use gpu_trace::verify::bsdf::draw::OFFSETS;
use gpu_trace::verify::{Random, settings};

/// All cases of the material.
fn cases() -> Vec<MaterialKind> {
    let material = ALL.iter().find(|material| material.name == "car-paint");
    (material.expect("car paint is a material").cases)()
}

fn paint(kind: &MaterialKind) -> &CarPaint {
    match kind {
        MaterialKind::CarPaint(paint) => paint,
        other => panic!("{other:?}"),
    }
}

/// Where it is tested: with flakes on one and beside.
fn places(kind: &MaterialKind) -> &'static [DVec3] {
    match paint(kind).flakes {
        Some(_) => &OFFSETS,
        None => &OFFSETS[..1],
    }
}

fn surface(normal: DVec3, offset: DVec3) -> Surface {
    Surface {
        normal,
        eta: 1.0,
        offset,
    }
}

/// Its keys as numbers.
struct Keys {
    diffuse: DVec3,
    specular: Vec<DVec3>,
    f0: DVec3,
    m: DVec3,
    coat: Option<f64>,
}

fn keys(kind: &dyn Bsdf) -> Keys {
    let values = kind.parameters();
    let of = |key: &str| values.iter().find(|(name, _)| *name == key).map(|(_, v)| v);
    let vector = |key: &str| match of(key) {
        Some(Value::Vector(v)) => *v,
        other => panic!("{key}: {other:?}"),
    };
    let Some(Value::Vectors(specular)) = of("specular") else {
        panic!("no specular")
    };
    let coat = of("clearcoat").map(|coat| match coat {
        Value::Table(values) => match values[..] {
            [("ior", Value::Number(ior))] => ior,
            _ => panic!("{values:?}"),
        },
        other => panic!("{other:?}"),
    });
    Keys {
        diffuse: vector("diffuse"),
        specular: specular.clone(),
        f0: vector("f0"),
        m: vector("m"),
        coat,
    }
}

/// Günther et al. 2005 as it is printed: ks D G F/(pi cos_i cos_o) about `n`.
fn printed_lobe(ks: DVec3, f0: f64, m: f64, n: DVec3, o: DVec3, i: DVec3) -> DVec3 {
    if n.dot(o) <= 0.0 || n.dot(i) <= 0.0 {
        return DVec3::ZERO;
    }
    let h = (o + i).normalize();
    let tangent = n.dot(h).min(1.0).acos().tan();
    let d = (-tangent.powi(2) / m.powi(2)).exp() / (m.powi(2) * n.dot(h).powi(4));
    let g = 1f64
        .min(2.0 * n.dot(h) * n.dot(o) / h.dot(o))
        .min(2.0 * n.dot(h) * n.dot(i) / h.dot(o));
    let f = f0 + (1.0 - f0) * (1.0 - h.dot(o)).powi(5);
    ks * (d * g * f / (PI * n.dot(i) * n.dot(o)))
}

/// What a smooth surface of that index lets through: Fresnel's equations in the angles of incidence and refraction.
fn lets_through(cosine: f64, ior: f64) -> f64 {
    let i = cosine.min(1.0).acos();
    let t = (i.sin() / ior).asin();
    if i < 1.0e-6 || ior == 1.0 {
        return 1.0 - ((ior - 1.0) / (ior + 1.0)).powi(2);
    }
    let s = (i - t).sin() / (i + t).sin();
    let p = (i - t).tan() / (i + t).tan();
    1.0 - 0.5 * (s * s + p * p)
}

/// A paint at a point, as printed.
struct Printed {
    keys: Keys,
    n: DVec3,
    /// Colour and normal of the third lobe.
    third: (DVec3, DVec3),
}

impl Printed {
    fn of(kind: &MaterialKind, surface: &Surface) -> Self {
        let keys = keys(&**kind);
        let third = match keys.coat {
            Some(_) => DVec3::ZERO,
            None => keys.specular[2],
        };
        let flake = paint(kind)
            .flakes
            .and_then(|flakes| Some((flakes.color, flakes.normal_at(surface)?)));
        Self {
            keys,
            n: surface.normal,
            third: flake.unwrap_or((third, surface.normal)),
        }
    }

    fn through(&self, cosine: f64) -> f64 {
        self.keys.coat.map_or(1.0, |ior| lets_through(cosine, ior))
    }

    fn lobe(&self, k: usize, o: DVec3, i: DVec3) -> DVec3 {
        let (color, n) = match k {
            2 => self.third,
            _ => (self.keys.specular[k], self.n),
        };
        printed_lobe(color, self.keys.f0[k], self.keys.m[k], n, o, i)
    }

    /// The BRDF without the coat's reflection.
    fn value(&self, o: DVec3, i: DVec3) -> DVec3 {
        let lobes: DVec3 = (0..3).map(|k| self.lobe(k, o, i)).sum();
        let coat = self.through(self.n.dot(o)) * self.through(self.n.dot(i));
        coat * (self.keys.diffuse / PI + lobes)
    }

    /// The share of the light from `o` that is reflected: a grid of half vectors for each lobe, by its slopes, up to six
    /// widths, beyond which there is a share of 1e-15; di = 4 (o.h) dh; and of cosines for what is diffuse.
    fn reflected(&self, o: DVec3) -> DVec3 {
        const STEPS: usize = 250;
        let middle = |x: usize| (x as f64 + 0.5) / STEPS as f64;
        let below = self.through(self.n.dot(o));
        let cosines = (0..STEPS).map(|x| 2.0 * middle(x) * self.through(middle(x)) / STEPS as f64);
        let mut sum = (1.0 - below) + below * cosines.sum::<f64>() * self.keys.diffuse;
        for k in 0..3 {
            let about = if k == 2 { self.third.1 } else { self.n };
            let (across, along) = about.any_orthonormal_pair();
            let reach = 6.0 * self.keys.m[k];
            for x in 0..STEPS {
                let r = reach * middle(x);
                for y in 0..STEPS {
                    let (sin, cos) = (TAU * middle(y)).sin_cos();
                    let h = (about + r * (cos * across + sin * along)).normalize();
                    let i = 2.0 * o.dot(h) * h - o;
                    if o.dot(h) > 0.0 && i.dot(self.n) > 0.0 {
                        let area = reach * TAU / (STEPS * STEPS) as f64 * r * h.dot(about).powi(3);
                        let share =
                            i.dot(self.n) * self.through(i.dot(self.n)) * 4.0 * o.dot(h) * area;
                        sum += below * share * self.lobe(k, o, i);
                    }
                }
            }
        }
        sum
    }
}

fn relative(a: DVec3, b: DVec3) -> f64 {
    (a - b).abs().max_element()
        / a.abs()
            .max_element()
            .max(b.abs().max_element())
            .max(1.0e-300)
}

#[test]
fn the_preset_has_its_published_numbers() {
    let kind = CarPaint {
        preset: Some(Preset::PolarisSilber),
        ..CarPaint::default()
    };
    let keys = keys(&kind);
    assert!(keys.coat.is_none());
    assert_eq!(keys.diffuse.to_array(), [0.055, 0.063, 0.071]);
    let specular = keys.specular.iter().map(DVec3::to_array);
    assert_eq!(
        specular.collect::<Vec<_>>(),
        [
            [0.065, 0.082, 0.088],
            [0.11, 0.11, 0.13],
            [0.008, 0.013, 0.015]
        ]
    );
    assert_eq!(keys.f0.to_array(), [1.0, 0.92, 0.9]);
    assert_eq!(keys.m.to_array(), [0.38, 0.17, 0.013]);
    assert!(kind.mistake().is_none());
    // Keys beside it count; without it all are needed.
    let other = CarPaint {
        m: Some(DVec3::splat(0.5)),
        ..kind
    };
    let parameters = other.parameters();
    assert!(parameters.contains(&("m", Value::Vector(DVec3::splat(0.5)))));
    assert!(parameters.contains(&("f0", Value::Vector(keys.f0))));
    let alone = CarPaint {
        preset: None,
        ..other
    };
    assert!(
        alone
            .mistake()
            .is_some_and(|mistake| mistake.what.contains("diffuse"))
    );
}

#[test]
fn the_places_are_on_flakes_and_beside() {
    for coated in [false, true] {
        let mut on = [0, 0];
        for kind in cases() {
            let paint = paint(&kind);
            let Some(flakes) = paint.flakes.filter(|_| paint.clearcoat.is_some() == coated) else {
                continue;
            };
            for offset in OFFSETS {
                let flake = flakes.normal_at(&surface(DVec3::Z, offset));
                on[usize::from(flake.is_some())] += 1;
            }
        }
        eprintln!("coated {coated}: {on:?}");
        assert!(on[0] > 0 && on[1] > 0, "coated {coated}: {on:?}");
    }
}

#[test]
fn values_are_those_of_the_printed_formula() {
    let mut random = Random::new("printed paint");
    for (case, kind) in cases().iter().enumerate() {
        let mut companion = 0.0f64;
        for _ in 0..20_000 {
            let n = random.direction();
            let at = surface(n, random.direction());
            let mut above = || {
                let w = random.direction();
                if w.dot(n) < 0.0 { -w } else { w }
            };
            let (o, i) = (above(), above());
            let value = kind.evaluate(&at, o, i).f_cos;
            let truth = n.dot(i) * Printed::of(kind, &at).value(o, i);
            // The tangent of an arc cosine, times an exponent of up to 700; and 1 - F where that is small.
            let off = relative(value, truth);
            assert!(
                off < 1.0e-6,
                "case {case}: {value} for {truth}, off by {off:e}"
            );
            companion = companion.max(relative(1.001 * value, truth));
        }
        assert!(companion > 1.0e-4);
    }
}

/// Angles of incidence.
const ANGLES: [f64; 3] = [0.0, 45.0, 80.0];

fn arrival(degrees: f64) -> DVec3 {
    let (sin, cos) = f64::to_radians(degrees).sin_cos();
    DVec3::new(0.6 * sin, 0.8 * sin, cos)
}

/// The mean of the weights of the twin's samples, over a grid of uniform numbers, the finest for the choice of a lobe.
fn mean_weight(kind: &dyn Bsdf, surface: &Surface, o: DVec3) -> DVec3 {
    const GRID: [u32; 3] = [24, 24, 256];
    let place = |i: u32, k: usize| (f64::from(i % GRID[k]) + 0.5) / f64::from(GRID[k]);
    let mut sum = DVec3::ZERO;
    let count: u32 = GRID.iter().product();
    for i in 0..count {
        let u = [
            place(i, 0),
            place(i / GRID[0], 1),
            place(i / GRID[0] / GRID[1], 2),
            0.5,
        ];
        sum += kind.sample(surface, o, u).weight;
    }
    sum / f64::from(count)
}

#[test]
fn samples_reflect_what_the_printed_formula_does() {
    // Both are grids: of weights that jump at the horizon and from lobe to lobe, within a cell of each.
    const ALLOWED: f64 = 6.0e-3;
    for (case, kind) in cases().iter().enumerate() {
        for (offset, degrees) in places(kind)
            .iter()
            .flat_map(|at| ANGLES.map(|angle| (at, angle)))
        {
            let at = surface(DVec3::Z, *offset);
            let o = arrival(degrees);
            let truth = Printed::of(kind, &at).reflected(o);
            let mean = mean_weight(&**kind, &at, o);
            let off = |mean: DVec3| (mean - truth).abs().max_element() / truth.max_element();
            let name = format!("case {case} at {offset}, {degrees} degrees");
            eprintln!("{name}: {mean} for {truth}, {:.1e}", off(mean));
            assert!(off(mean) < ALLOWED, "{name}: {mean} for {truth}");
            assert!(off(1.02 * mean) > ALLOWED);
            assert!(
                truth.cmple(kind.albedo() * (1.0 + 1.0e-6)).all(),
                "{name}: {truth}"
            );
        }
    }
}

#[test]
fn a_coat_that_reflects_all_hides_the_paint() {
    // In a denser medium, beyond the critical angle.
    let kind = CarPaint {
        clearcoat: Some(Clearcoat { ior: 1.0 }),
        preset: Some(Preset::PolarisSilber),
        ..CarPaint::default()
    };
    let at = Surface {
        eta: 1.0 / 1.5,
        ..surface(DVec3::Z, DVec3::ZERO)
    };
    let s = kind.sample(&at, arrival(60.0), [0.3, 0.4, 0.999_999, 0.5]);
    assert!(s.event.is(Event::DELTA));
    assert!((s.weight - DVec3::ONE).abs().max_element() < 1.0e-12);
    assert_eq!(
        kind.evaluate(&at, arrival(60.0), arrival(10.0)).f_cos,
        DVec3::ZERO
    );
    assert!(
        !kind
            .sample(&at, arrival(10.0), [0.3, 0.4, 0.999_999, 0.5])
            .event
            .is(Event::DELTA)
    );
}

/// Coated paint without lobes, whose samples have a finite variance by any integrator, under two lamps.
fn coated_ball(coat: &str) -> Scene {
    scene(&format!(
        "camera = {{ position = [0, 0, 4], look_at = [0, 0, 0], fov = 32 }}\n\
         image = {{ width = 24, height = 24 }}\nenvironment = {{ radiance = [0.3, 0.3, 0.3] }}\n\
         [material.paint]\ntype = \"car-paint\"\ndiffuse = [0.4, 0.4, 0.4]\n\
         specular = [[0, 0, 0], [0, 0, 0], [0, 0, 0]]\nf0 = [1, 1, 1]\nm = [0.5, 0.5, 0.5]\n{coat}\n\
         [material.lamp]\ntype = \"diffuse\"\nalbedo = [0, 0, 0]\nemission = [4, 4, 4]\n\
         [[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = \"paint\"\n\
         [[sphere]]\ncenter = [2, 3, 4]\nradius = 1.5\nmaterial = \"lamp\"\n\
         [[sphere]]\ncenter = [-4, 0, 1]\nradius = 1\nmaterial = \"lamp\"\n"
    ))
}

/// The image and its mean, from some seeds.
fn seen(scene: &Scene, integrator: Integrator) -> Blocks {
    let settings = Settings {
        integrator,
        ..settings(scene, 24, 24, 256)
    };
    blocks_of_seeds(gpu_renderer(scene, &settings), &settings, 1..9, 1)
}

#[test]
fn every_integrator_sees_the_coat() {
    let coated = coated_ball("clearcoat = { ior = 1.8 }");
    let truth = seen(&coated, Integrator::Bsdf);
    // Student's t with some 14 degrees of freedom, at 1e-4: 5.4.
    let off = |found: &Blocks| deviation(found.image, truth.image).abs();
    for integrator in [
        Integrator::Path,
        Integrator::Nee,
        Integrator::Lecture { termination: 0.2 },
    ] {
        let found = seen(&coated, integrator);
        let name = format!("a coat, {}", integrator.name());
        let _left = Left::of(&name, &found, &truth);
        let [[mean, variance], [wanted, own]] = [found.image, truth.image];
        let (error, own) = (variance.sqrt(), own.sqrt());
        let both = format!("{name}: {mean} +- {error} for {wanted} +- {own}");
        eprintln!("{both}");
        assert!(off(&found) < 5.4, "{both}");
        assert!(error < 0.01 * wanted, "{both}");
    }
    // Companion: without the coat's reflection, by an index that has hardly any.
    let other = coated_ball("clearcoat = { ior = 1.01 }");
    assert!(off(&seen(&other, Integrator::Path)) > 5.4);
}

/// What is said of a paint with these lines.
fn said(lines: &str) -> Result<Vec<String>, String> {
    let text = format!(
        "[camera]\nposition = [0, 0, 4]\nlook_at = [0, 0, 0]\nfov = 32\n[image]\nwidth = 24\nheight = 24\n\
         [environment]\nradiance = [1, 1, 1]\n[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = \"paint\"\n\
         [material.paint]\ntype = \"car-paint\"\n{lines}\n"
    );
    let loaded = load_str("paint.toml", &text).map_err(|e| e.to_string())?;
    Ok(loaded.warnings)
}

#[test]
fn mistakes_are_told_with_their_place() {
    let silver = "preset = \"polaris-silber\"";
    for (lines, told) in [
        ("diffuse = [0, 0, 0]".to_owned(), "needs `specular`"),
        ("preset = \"polaris-gold\"".into(), "polaris-silber"),
        (format!("{silver}\nm = [0.1, 0.1, 0.0]"), "0.001"),
        (format!("{silver}\nm = [0.1, -0.1, 0.1]"), "negative"),
        (format!("{silver}\nclearcoat = 1.5"), "must be a table"),
        (
            format!(
                "{silver}\nflakes = {{ density = 1, scale = 1e19, spread = 0, jitter = 0, color = [0, 0, 0] }}"
            ),
            "`scale`",
        ),
        (
            format!("{silver}\nclearcoats = {{ ior = 1.5 }}"),
            "`clearcoat`?",
        ),
        (
            format!("{silver}\nspecular = [[0, 0, 0]]"),
            "exactly 3 rows",
        ),
        (
            format!("{silver}\nclearcoat = {{ eta = 1.5 }}"),
            "unknown key `eta`",
        ),
        (format!("{silver}\nclearcoat = {{ ior = 0 }}"), "ior"),
        (
            format!("{silver}\nflakes = {{ density = 0.5 }}"),
            "`color` is missing",
        ),
        (
            format!(
                "{silver}\nflakes = {{ density = 2, scale = 1, spread = 0, jitter = 0, color = [0, 0, 0] }}"
            ),
            "density",
        ),
    ] {
        let error = said(&lines).expect_err(&lines);
        assert!(
            error.contains(told) && error.contains("paint.toml:"),
            "{lines}: {error}"
        );
    }
    // What is right, and what the model leaves out.
    assert_eq!(said(silver).expect("right"), [""; 0]);
    let coated = said(&format!("{silver}\nclearcoat = {{ ior = 1.5 }}")).expect("right");
    assert!(
        coated[0].contains("loses energy by design: no light goes between coat and paint"),
        "{coated:?}"
    );
    let flakes =
        "flakes = { density = 0.5, scale = 9, spread = 0.2, jitter = 0, color = [0.1, 0.1, 0.1] }";
    let flaked = said(&format!("{silver}\n{flakes}")).expect("right");
    assert!(
        flaked[0].contains("below the sphere's horizon"),
        "{flaked:?}"
    );
    let bright = said(&format!("{silver}\ndiffuse = [0.9, 0.9, 0.9]")).expect("right");
    assert!(bright[0].contains("gains energy"), "{bright:?}");
}

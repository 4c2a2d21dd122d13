//! Car paint; twin of `shaders/materials/car_paint.wesl`, which has the formulas and their source.

use glam::DVec3;
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::Deserialize;

use super::coat::{Clearcoat, Coat, lost_below};
use super::flakes::Flakes;
use super::ggx::Frame;
use super::paint::{Lobe, Paint};
use super::scattered::{ENERGY_SLACK, most_scattered};
use super::uniform::cosine_moment;
use super::{Bsdf, BsdfSample, BsdfValue, Form, MemberValue, Mistake, Surface, Value, schema};

mod cases;
mod forms;

pub(super) use cases::cases;
pub(super) use forms::FORMS;

pub(super) const NAME: &str = "car-paint";

/// The least width of a lobe: that of other microfacets.
const LEAST_M: f64 = super::ggx::LEAST_ALPHA;

/// Car paint after Günther et al.: a preset, or all of diffuse, specular, f0 and m; keys beside a preset
/// override it.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
pub struct CarPaint {
    /// A measured paint.
    #[serde(default)]
    #[schemars(with = "Preset")]
    pub preset: Option<Preset>,
    /// Albedo of the diffuse part.
    #[serde(default)]
    #[schemars(schema_with = "schema::share")]
    pub diffuse: Option<DVec3>,
    /// Colours of the three lobes; each reflects up to four times that.
    #[serde(default)]
    #[schemars(schema_with = "colors")]
    pub specular: Option<[DVec3; 3]>,
    /// Fresnel reflectance of the lobes at normal incidence.
    #[serde(default)]
    #[schemars(schema_with = "schema::plain_share")]
    pub f0: Option<DVec3>,
    /// Widths of the lobes: root mean square slopes of Beckmann facets.
    #[serde(default)]
    #[schemars(schema_with = "widths")]
    pub m: Option<DVec3>,
    /// A smooth coat over the paint, in the place of the third lobe.
    #[serde(default)]
    #[schemars(with = "Clearcoat")]
    pub clearcoat: Option<Clearcoat>,
    /// Flakes of metal; each is the third lobe where it is, also under a coat.
    #[serde(default)]
    #[schemars(with = "Flakes")]
    pub flakes: Option<Flakes>,
}

/// Paints by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[expect(missing_docs, reason = "the names say it")]
pub enum Preset {
    PolarisSilber,
}

fn colors(generator: &mut SchemaGenerator) -> Schema {
    schemars::json_schema!({
        "type": "array",
        "items": schema::plain_share(generator),
        "minItems": 3,
        "maxItems": 3,
    })
}

fn widths(_: &mut SchemaGenerator) -> Schema {
    schema::vector(LEAST_M, 1.0)
}

/// What there is under a coat, or alone.
#[derive(Clone, Copy, Debug)]
struct Base {
    diffuse: DVec3,
    specular: [DVec3; 3],
    f0: DVec3,
    m: DVec3,
}

/// Günther et al. 2005, for linear RGB.
const POLARIS_SILBER: Base = Base {
    diffuse: DVec3::new(0.055, 0.063, 0.071),
    specular: [
        DVec3::new(0.065, 0.082, 0.088),
        DVec3::new(0.11, 0.11, 0.13),
        DVec3::new(0.008, 0.013, 0.015),
    ],
    f0: DVec3::new(1.0, 0.92, 0.9),
    m: DVec3::new(0.38, 0.17, 0.013),
};

/// What is used for a key that is missing, which is a mistake.
const BLACK: Base = Base {
    diffuse: DVec3::ZERO,
    specular: [DVec3::ZERO; 3],
    f0: DVec3::ZERO,
    m: DVec3::ONE,
};

/// The paint on a flake of this normal in the surface's frame.
fn flaked(paint: &Paint, flakes: &Flakes, normal: DVec3) -> Paint {
    let mut paint = *paint;
    paint.lobes[2].color = 4.0 * flakes.color;
    paint.third_frame = Frame::around(normal);
    paint
}

impl CarPaint {
    fn base(&self) -> Base {
        let preset = match self.preset {
            Some(Preset::PolarisSilber) => POLARIS_SILBER,
            None => BLACK,
        };
        Base {
            diffuse: self.diffuse.unwrap_or(preset.diffuse),
            specular: self.specular.unwrap_or(preset.specular),
            f0: self.f0.unwrap_or(preset.f0),
            m: self.m.unwrap_or(preset.m),
        }
    }

    /// The colour of the third lobe; a coat has taken its place.
    fn third(&self) -> DVec3 {
        match self.clearcoat {
            Some(_) => DVec3::ZERO,
            None => self.base().specular[2],
        }
    }

    /// The same paint with that third lobe, without coat and flakes.
    fn bare(&self, third: DVec3) -> Self {
        let Base {
            diffuse,
            specular: [first, second, _],
            f0,
            m,
        } = self.base();
        Self {
            diffuse: Some(diffuse),
            specular: Some([first, second, third]),
            f0: Some(f0),
            m: Some(m),
            ..Self::default()
        }
    }

    fn paint(&self, normal: DVec3) -> Paint {
        let Base {
            diffuse,
            specular,
            f0,
            m,
        } = self.base();
        Paint {
            frame: Frame::around(normal),
            third_frame: Frame::around(DVec3::Z),
            diffuse,
            lobes: [0, 1, 2].map(|k| Lobe {
                color: 4.0 * if k == 2 { self.third() } else { specular[k] },
                f0: f0[k],
                m: m[k],
            }),
        }
    }
}

impl CarPaint {
    /// All of it at a point.
    fn paint_at(&self, surface: &Surface) -> Paint {
        let paint = self.paint(surface.normal);
        let flake = self
            .flakes
            .and_then(|flakes| Some((flakes, flakes.normal_within(surface, &paint.frame)?)));
        flake.map_or(paint, |(flakes, normal)| flaked(&paint, &flakes, normal))
    }

    fn coat(&self, paint: &Paint, surface: &Surface, wo: DVec3) -> Option<Coat> {
        let Clearcoat { ior } = self.clearcoat?;
        Some(Coat::over(paint, surface.eta * ior, wo))
    }
}

impl Bsdf for CarPaint {
    fn form(&self) -> &'static Form {
        &FORMS[usize::from(self.clearcoat.is_some()) + 2 * usize::from(self.flakes.is_some())]
    }

    fn parameters(&self) -> Vec<(&'static str, Value)> {
        let base = self.base();
        let mut parameters = vec![
            ("diffuse", Value::Vector(base.diffuse)),
            ("specular", Value::Vectors(base.specular.into())),
            ("f0", Value::Vector(base.f0)),
            ("m", Value::Vector(base.m)),
        ];
        if let Some(Clearcoat { ior }) = self.clearcoat {
            parameters.push(("clearcoat", Value::Table(vec![("ior", Value::Number(ior))])));
        }
        parameters.extend(self.flakes.map(|flakes| ("flakes", flakes.value())));
        parameters
    }

    fn anchored(&self, anchor: DVec3) -> Vec<MemberValue> {
        let flakes = self.flakes.iter();
        flakes.flat_map(|flakes| flakes.anchored(anchor)).collect()
    }

    fn mistake(&self) -> Option<Mistake> {
        if self.preset.is_some() {
            return None;
        }
        let needed = [
            (
                self.diffuse.is_some(),
                "a car paint without `preset` needs `diffuse`",
            ),
            (
                self.specular.is_some(),
                "a car paint without `preset` needs `specular`",
            ),
            (self.f0.is_some(), "a car paint without `preset` needs `f0`"),
            (self.m.is_some(), "a car paint without `preset` needs `m`"),
        ];
        let (_, what) = needed.into_iter().find(|(given, _)| !given)?;
        Some(Mistake {
            key: "type",
            what,
            help: "give `preset = \"polaris-silber\"`, or all of `diffuse`, `specular`, `f0` and `m`",
        })
    }

    fn members(&self) -> Vec<MemberValue> {
        let base = self.base();
        let [first, second, third] = base.specular;
        let mut members = vec![base.diffuse.into(), first.into(), second.into()];
        if self.clearcoat.is_none() {
            members.push(third.into());
        }
        members.extend([base.f0, base.m].map(MemberValue::from));
        members.extend(self.clearcoat.map(|coat| MemberValue::from(coat.ior)));
        members.extend(self.flakes.iter().flat_map(Flakes::members));
        members
    }

    // Of light along the normal, with all that facets send back.
    fn color(&self) -> DVec3 {
        let paint = self.paint(DVec3::Z);
        let lobes = paint.lobes.iter().map(|lobe| lobe.f0 * lobe.color);
        (paint.diffuse + lobes.sum::<DVec3>()).min(DVec3::ONE)
    }

    // A coat sends F back and lets at most 1 - F pass. A flake's lobe is about another normal than the cosine, and
    // its facets reflect up to 2 n.h/oh times what they would about their own: with n.i <= 2 oh (n.h) that is four
    // times, and the mean of 1/ch at most sqrt(1 + m^2).
    fn albedo(&self) -> DVec3 {
        let paint = self.paint(DVec3::Z);
        let flake = self.flakes.map_or(DVec3::ZERO, |flakes| {
            let lobe = flaked(&paint, &flakes, DVec3::Z);
            let third = lobe.lobes[2];
            lobe.albedo() + (4.0 * (1.0 + third.m * third.m).sqrt() - 1.0) * third.color
        });
        let below = paint.albedo().max(flake);
        match self.clearcoat {
            Some(_) => below.max(DVec3::ONE),
            None => below,
        }
    }

    // Of a lobe the weight under uniform directions is up to 2 ks D/cos_o: its square has a mean that grows
    // with -log(cos_o), and higher powers faster. Where a channel has none, with F and t = 1 - F of a coat over parts p,
    // the diffuse one being d: the delta lobe has at most the weight F + t sum max(p), max being over channels, and the
    // rest at most 2 cos_i d (t + F (F + t max(d))/(max(d) (F + t min(d)))), in which the last quotient is at most
    // 1 + t (max(d) - min(d))/F: that is linear in F. The mean of both is at most the larger.
    fn moment(&self, channel: usize, k: i32) -> f64 {
        let paint = self.paint(DVec3::Z);
        let flakes = self
            .flakes
            .is_some_and(|flakes| flakes.color[channel] > 0.0);
        let glossy = flakes || paint.lobes.iter().any(|lobe| lobe.color[channel] > 0.0);
        let diffuse = paint.diffuse[channel];
        match (glossy, k, self.clearcoat) {
            (_, ..=1, _) => self.albedo()[channel].powi(k),
            (true, ..) => f64::INFINITY,
            (_, _, None) => cosine_moment(k) * diffuse.powi(k),
            (_, _, Some(_)) => {
                let (least, most) = (paint.diffuse.min_element(), paint.diffuse.max_element());
                let over = match diffuse {
                    0.0 => 0.0,
                    diffuse => diffuse * f64::max(1.0 / most, 2.0 - least / most),
                };
                let lobes = paint.lobes.iter().map(|lobe| lobe.color.max_element());
                let flake = self
                    .flakes
                    .map_or(0.0, |flakes| 4.0 * flakes.color.max_element());
                let coat = f64::max(1.0, most + lobes.sum::<f64>() + flake);
                f64::max(coat.powi(k), cosine_moment(k) * over.powi(k))
            }
        }
    }

    fn sample(&self, surface: &Surface, wo: DVec3, u: [f64; 4]) -> BsdfSample {
        let paint = self.paint_at(surface);
        let u = [u[0], u[1], u[2]];
        match self.coat(&paint, surface, wo) {
            Some(coat) => coat.sample(&paint, wo, u),
            None => paint.sample(&paint.weights(wo), wo, u),
        }
    }

    fn delta_share(&self, surface: &Surface, wo: DVec3) -> f64 {
        let coat = self.coat(&self.paint_at(surface), surface, wo);
        coat.map_or(0.0, |coat| coat.share)
    }

    fn evaluate(&self, surface: &Surface, wo: DVec3, wi: DVec3) -> BsdfValue {
        let paint = self.paint_at(surface);
        match self.coat(&paint, surface, wo) {
            Some(coat) => coat.evaluate(&paint, wo, wi),
            None => paint.evaluate(&paint.weights(wo), wo, wi),
        }
    }

    fn warning(&self) -> Option<[String; 2]> {
        let bare = self.bare(self.third());
        let on_flake = self.flakes.map(|flakes| self.bare(flakes.color));
        let most = |paint: &Self| most_scattered(paint, DVec3::Y).max_element();
        let most = on_flake.as_ref().map_or(0.0, most).max(most(&bare));
        let mut said: Vec<[String; 2]> = Vec::new();
        if most > 1.0 + ENERGY_SLACK {
            said.push([
                format!("gains energy: the paint reflects up to {most:.3} times the light"),
                "diffuse + 4 times the sum of the colours in `specular`, the third being that of a flake where one \
                 is and none under a coat, must be at most about 1 in each channel"
                    .into(),
            ]);
        }
        if let Some(Clearcoat { ior }) = self.clearcoat {
            let lost = 100.0 * lost_below(&self.paint(DVec3::Z), ior);
            said.push([
                format!(
                    "loses energy by design: no light goes between coat and paint, {lost:.1} % of what arrives \
                     along the normal"
                ),
                "a lighter `diffuse` makes up for it".into(),
            ]);
        }
        if self.flakes.is_some_and(|flakes| flakes.spread > 0.0) {
            said.push([
                "flakes lose by design what they would send below the sphere's horizon".into(),
                "a lesser `spread` loses less".into(),
            ]);
        }
        let (said, help): (Vec<_>, Vec<_>) = said.into_iter().map(|[a, b]| (a, b)).unzip();
        (!said.is_empty()).then(|| [said.join("; "), help.join("; ")])
    }
}

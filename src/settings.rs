//! How a scene will be rendered, with every default decided; `job` checks it.

use std::ops::{Range, RangeInclusive};
use std::time::Duration;

use crate::sampler::Sampler;
use crate::scene::Scene;

/// Samples a pixel where neither the command line nor the scene says.
pub const DEFAULT_SPP: u64 = 256;
/// The cap where only an error or a time is asked for.
pub const MAXIMUM_SPP: u64 = 1 << 20;
/// Scattering events of a path where neither the command line nor the scene says.
pub const DEFAULT_MAX_BOUNCES: u32 = 64;
/// The lecture's probability of termination.
pub const DEFAULT_TERMINATION: f64 = 0.2;
/// What the lecture's probability of termination can be.
pub const TERMINATIONS: Range<f64> = 0.0..1.0;
/// What the distance of an [`Offset`] can be, in scene units.
const DISTANCES: RangeInclusive<f64> = 0.0..=1.0e20;

/// Everything that decides an image besides the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Width of the whole image, in pixels.
    pub width: u32,
    /// Height of the whole image, in pixels.
    pub height: u32,
    /// The part of the image that is rendered.
    pub crop: Rect,
    /// Sample indices to render, first and one past the last.
    pub samples: Range<u64>,
    /// Seed of the sample stream.
    pub seed: u64,
    /// The largest number of scattering events of a path.
    pub max_bounces: u32,
    /// The estimator.
    pub integrator: Integrator,
    /// How a direction to a light is drawn, of an estimator that [samples lights](Integrator::samples_lights);
    /// `None`: as it does where nobody says.
    pub light_sampling: Option<LightSampling>,
    /// How the random numbers of samples are placed.
    pub sampler: Sampler,
    /// Whether diffuse surfaces that paths come to from diffuse ones reflect by values of cells, drawn anew for every
    /// batch of samples and corrected without bias, where nothing [stands against it](crate::effects::cache_obstacle).
    pub radiance_cache: bool,
    /// Whether vertices look for images of lamps that smooth spheres make, where nothing
    /// [stands against it](crate::effects::image_obstacle).
    pub lamp_images: bool,
    /// Whether paths end by Russian roulette on their throughput; `None`: as the estimator has it. The lecture's
    /// has its own, and no other.
    pub roulette: Option<bool>,
    /// The form of the geometry in the kernel.
    pub geometry: GeometryChoice,
    /// What the image shows; `None`: light.
    pub view: Option<View>,
    /// How a path leaves a surface.
    pub offset: Offset,
    /// Whether a pilot decides where samples go; `samples` are then those a pixel on average, with it.
    pub adaptive: bool,
    /// Keep the light of each [kind of path](crate::film::LightClass) by itself.
    pub classes: bool,
    /// Keep normal, albedo and depth of what is seen first.
    pub features: bool,
    /// Stop when the estimated error is at most this.
    pub error: Option<f64>,
    /// Stop when rendering has taken this long.
    pub time: Option<Duration>,
}

impl Settings {
    /// Whether pixels keep anything beside their light.
    #[must_use]
    pub fn has_aovs(&self) -> bool {
        self.classes || self.features
    }

    /// Whether paths end by Russian roulette on their throughput.
    #[must_use]
    pub fn has_roulette(&self) -> bool {
        !self.integrator.is_lecture() && self.roulette != Some(false)
    }

    /// How a direction to a light is drawn where one is.
    #[must_use]
    pub fn light_sampling(&self) -> LightSampling {
        self.light_sampling.unwrap_or_default()
    }

    /// The defaults for `scene`.
    #[must_use]
    pub fn for_scene(scene: &Scene) -> Self {
        Self {
            width: scene.width,
            height: scene.height,
            crop: Rect::whole(scene.width, scene.height),
            samples: 0..scene.render.spp.unwrap_or(DEFAULT_SPP),
            seed: 0,
            max_bounces: scene.render.max_bounces.unwrap_or(DEFAULT_MAX_BOUNCES),
            integrator: Integrator::Path,
            light_sampling: None,
            sampler: Sampler::default(),
            radiance_cache: false,
            lamp_images: false,
            roulette: None,
            geometry: GeometryChoice::Auto,
            view: None,
            offset: Offset::Exact,
            adaptive: false,
            classes: false,
            features: false,
            error: None,
            time: None,
        }
    }
}

/// A rectangle of pixels; (0, 0) is the top left of the image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rect {
    /// Leftmost column.
    pub x: u32,
    /// Topmost row.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl Rect {
    /// All of an image of this size, in pixels.
    #[must_use]
    pub const fn whole(width: u32, height: u32) -> Self {
        Self {
            x: 0,
            y: 0,
            width,
            height,
        }
    }

    /// The number of pixels.
    #[must_use]
    pub fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// The rectangle cut into pieces of at most `side` x `side`, by rows.
    pub fn pieces(self, side: u32) -> impl Iterator<Item = Self> {
        let step = side as usize;
        (0..self.height).step_by(step).flat_map(move |dy| {
            (0..self.width).step_by(step).map(move |dx| Self {
                x: self.x + dx,
                y: self.y + dy,
                width: side.min(self.width - dx),
                height: side.min(self.height - dy),
            })
        })
    }
}

/// How light transport is estimated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Integrator {
    /// The lecture's estimator: uniform hemisphere, constant probability of termination.
    Lecture {
        /// Probability that a path ends at a vertex.
        termination: f64,
    },
    /// BSDF sampling with roulette on the throughput.
    Bsdf,
    /// The same, and at every vertex a direction to a light: both estimates of what lights send are
    /// weighted against each other.
    Path,
    /// The same, but what lights send is found by directions to them alone.
    Nee,
}

impl Integrator {
    /// All of them; the lecture's as it is where nobody says.
    pub const ALL: &'static [Self] = &[
        Self::Path,
        Self::Bsdf,
        Self::Nee,
        Self::Lecture {
            termination: DEFAULT_TERMINATION,
        },
    ];

    /// The same; if it is the lecture's, then with this probability of termination.
    #[must_use]
    pub fn with_termination(self, termination: f64) -> Self {
        match self {
            Self::Lecture { .. } => Self::Lecture { termination },
            other => other,
        }
    }

    /// Whether it is the lecture's.
    #[must_use]
    pub fn is_lecture(self) -> bool {
        matches!(self, Self::Lecture { .. })
    }

    /// Whether it looks for lights from every vertex.
    #[must_use]
    pub fn samples_lights(self) -> bool {
        matches!(self, Self::Path | Self::Nee)
    }

    /// The name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Lecture { .. } => "lecture",
            Self::Bsdf => "bsdf",
            Self::Path => "path",
            Self::Nee => "nee",
        }
    }
}

/// How a light and a direction to it are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LightSampling {
    /// A few lights by what they send to the vertex, many by power; a direction by projected solid
    /// angle.
    #[default]
    Projected,
    /// For comparison: lights by power, a direction by solid angle.
    Cone,
}

impl LightSampling {
    /// All of them.
    pub const ALL: &'static [Self] = &[Self::Projected, Self::Cone];

    /// The name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Projected => "projected",
            Self::Cone => "cone",
        }
    }
}

/// The form of the geometry in the kernel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GeometryChoice {
    /// By the number of spheres.
    Auto,
    /// Spheres as constants in the kernel.
    Baked,
    /// A loop over spheres in a texture.
    List,
    /// A tree.
    Bvh,
}

impl GeometryChoice {
    /// All of them.
    pub const ALL: &'static [Self] = &[Self::Auto, Self::Baked, Self::List, Self::Bvh];

    /// The name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Baked => "baked",
            Self::List => "list",
            Self::Bvh => "bvh",
        }
    }
}

/// What the image shows in the place of light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum View {
    /// Steps through the tree that a sample takes, over all its rays: a node's boxes, a leaf's spheres, or both.
    BvhCost,
}

impl View {
    /// All of them.
    pub const ALL: &'static [Self] = &[Self::BvhCost];

    /// The name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::BvhCost => "bvh-cost",
        }
    }
}

/// How a path leaves a surface without hitting it again.
///
/// All but `Exact` are for comparison: a hit is then a point of space in f32, the next ray starts
/// there, moved as said, and may hit every sphere, its own included.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Offset {
    /// Not at all: the path knows which sphere it is on, and on which side.
    #[default]
    Exact,
    /// The bare point.
    None,
    /// The point, moved back along the ray by a distance in scene units: the lecture's nudge.
    Back(f64),
    /// The point, moved along the normal by a distance in scene units, to the side that the path
    /// goes on to.
    Out(f64),
    /// The point, moved along the normal by some hundred ulp: Wächter and Binder 2019.
    Ulp,
}

impl Offset {
    /// Distances back along the ray and out along the normal, in scene units; `None` if it is not
    /// by a distance.
    #[must_use]
    pub fn distances(self) -> Option<[f64; 2]> {
        match self {
            Self::None => Some([0.0, 0.0]),
            Self::Back(x) => Some([x, 0.0]),
            Self::Out(x) => Some([0.0, x]),
            Self::Exact | Self::Ulp => None,
        }
    }

    /// Whether its distance, if it has one, is in range.
    #[must_use]
    pub fn is_valid(self) -> bool {
        let mut distances = self.distances().into_iter().flatten();
        distances.all(|x| DISTANCES.contains(&x))
    }

    /// The same in units of which `scale` make a scene unit.
    #[must_use]
    pub fn scaled(self, scale: f64) -> Self {
        match self {
            Self::Back(x) => Self::Back(x * scale),
            Self::Out(x) => Self::Out(x * scale),
            other => other,
        }
    }
}

impl std::fmt::Display for Offset {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Exact => f.write_str("exact"),
            Self::None => f.write_str("none"),
            Self::Back(x) => write!(f, "back:{x:?}"),
            Self::Out(x) => write!(f, "out:{x:?}"),
            Self::Ulp => f.write_str("ulp"),
        }
    }
}

impl std::str::FromStr for Offset {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (mode, distance) = text.split_once(':').unwrap_or((text, ""));
        let parsed = distance.parse::<f64>();
        match (mode, parsed) {
            ("exact", _) if mode == text => Ok(Self::Exact),
            ("none", _) if mode == text => Ok(Self::None),
            ("ulp", _) if mode == text => Ok(Self::Ulp),
            ("back" | "out", Ok(x)) if DISTANCES.contains(&x) => Ok(if mode == "back" {
                Self::Back(x)
            } else {
                Self::Out(x)
            }),
            ("back" | "out", _) => Err(format!(
                "'{mode}' takes a distance in scene units, from 0 to 1e20, as in {mode}:1e-4"
            )),
            _ => Err("exact, none, ulp, back:X or out:X, with a distance X".into()),
        }
    }
}

/// The two words that stand for the seed and the high word of the sample index in the sample
/// stream (`shaders/core/random.wesl`).
#[must_use]
pub fn stream_words(seed: u64, sample_high: u32) -> [u32; 2] {
    let both = split_mix(split_mix(seed) ^ u64::from(sample_high));
    [both as u32, (both >> 32) as u32]
}

/// The same two words for the paths of the radiance cache's pilots: those of samples that no image has.
#[must_use]
pub fn pilot_words(seed: u64, sample_high: u32) -> [u32; 2] {
    stream_words(seed, sample_high | 1 << 31)
}

/// A bijection in which every bit of `x` reaches every bit of the result: SplitMix64 of Steele, Lea
/// and Flood, "Fast Splittable Pseudorandom Number Generators" (OOPSLA 2014), with the constants of
/// Stafford's variant 13.
fn split_mix(x: u64) -> u64 {
    let mut z = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

//! What a path sees that hits nothing.

use std::fmt;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;
use toml::Spanned;

use super::file::{EnvironmentTable, GradientTable, ScaleValue};
use super::image;
use super::report::{Problem, Report};
use super::suggest::list;
use super::vector::vector;
use crate::image::Picture;
use crate::materials::schema::MAX_MAGNITUDE;

/// Light from everywhere.
#[derive(Clone, Debug, PartialEq)]
pub enum Environment {
    /// The same radiance from every direction.
    Constant(DVec3),
    /// Three colours by height.
    Gradient(Gradient),
    /// An image.
    Sky(Sky),
}

/// A sky by three radiances: above, mix(horizon, zenith, w.y) for the unit direction w; below, the ground's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gradient {
    /// From straight above, +y.
    pub zenith: DVec3,
    /// From the horizon.
    pub horizon: DVec3,
    /// From everywhere below the horizon.
    pub ground: DVec3,
}

/// An image all around the axis +y.
#[derive(Clone, PartialEq)]
pub struct Sky {
    name: String,
    image: Arc<Picture>,
    scale: DVec3,
    rotation: f64,
    brightest: f64,
    is_sound: bool,
}

impl Sky {
    /// The values of `image`, finite and not negative, times `scale`, turned by `rotation` degrees from +x towards +z.
    /// `name` is what messages call it.
    #[must_use]
    pub fn new(name: &str, image: Picture, scale: DVec3, rotation: f64) -> Self {
        let most = image
            .pixels
            .iter()
            .fold(DVec3::ZERO, |most, texel| most.max(radiance(texel)));
        let is_radiance = |x: &f32| x.is_finite() && *x >= 0.0;
        Self {
            name: name.to_owned(),
            is_sound: image.pixels.as_flattened().iter().all(is_radiance),
            image: Arc::new(image),
            scale,
            rotation: rotation.rem_euclid(360.0),
            brightest: (most * scale).max_element(),
        }
    }

    /// Whether all texels are finite and none is negative.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        self.is_sound
    }

    /// Refuses one that is too bright.
    pub(super) fn check_brightest(&self) -> Result<(), String> {
        if self.brightest <= MAX_MAGNITUDE {
            return Ok(());
        }
        Err(format!(
            "its brightest value times `scale` is {:e}, more than {MAX_MAGNITUDE:e}, the limit of a radiance",
            self.brightest
        ))
    }

    /// What messages call it: its file, as the scene names it.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The image, row 0 at the zenith; what is seen is it times [`scale`](Self::scale).
    #[must_use]
    pub fn image(&self) -> &Picture {
        &self.image
    }

    /// What the image's values are multiplied by.
    #[must_use]
    pub fn scale(&self) -> DVec3 {
        self.scale
    }

    /// In degrees, in [0, 360), from +x towards +z.
    #[must_use]
    pub fn rotation(&self) -> f64 {
        self.rotation
    }

    /// The radiance at the centre of a texel.
    #[must_use]
    pub fn texel(&self, column: u32, row: u32) -> DVec3 {
        let place = row as usize * self.image.width as usize + column as usize;
        radiance(&self.image.pixels[place]) * self.scale
    }
}

impl fmt::Debug for Sky {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Without its texels, which may be millions.
        formatter
            .debug_struct("Sky")
            .field("name", &self.name)
            .field("size", &[self.image.width, self.image.height])
            .field("scale", &self.scale)
            .field("rotation", &self.rotation)
            .finish_non_exhaustive()
    }
}

fn radiance(texel: &[f32; 3]) -> DVec3 {
    DVec3::from_array(texel.map(f64::from))
}

impl Environment {
    /// The radiance of a constant environment; `None` of any other.
    #[must_use]
    pub fn constant(&self) -> Option<DVec3> {
        match self {
            Self::Constant(radiance) => Some(*radiance),
            Self::Gradient(_) | Self::Sky(_) => None,
        }
    }

    /// The image; `None` if it is another one.
    #[must_use]
    pub fn sky(&self) -> Option<&Sky> {
        match self {
            Self::Sky(sky) => Some(sky),
            Self::Constant(_) | Self::Gradient(_) => None,
        }
    }

    /// The largest radiance of any channel from any direction.
    #[must_use]
    pub fn brightest(&self) -> f64 {
        match self {
            Self::Constant(radiance) => radiance.max_element(),
            Self::Gradient(Gradient {
                zenith,
                horizon,
                ground,
            }) => zenith.max(*horizon).max(*ground).max_element(),
            Self::Sky(sky) => sky.brightest,
        }
    }
}

/// What `[environment]` asks for; `None` for black, and after errors, which the report then holds. `files` gets what
/// it names, relative to `folder`.
pub(super) fn of_table(
    table: &Spanned<EnvironmentTable>,
    folder: &Path,
    files: &mut Vec<PathBuf>,
    report: &mut Report,
) -> Option<Environment> {
    let before = report.errors.len();
    let keys = table.get_ref();
    check_keys(keys, table.span(), report);
    // Nothing is read for a file with errors.
    let environment = match keys {
        _ if report.errors.len() > before => return None,
        EnvironmentTable {
            radiance: Some(radiance),
            ..
        } => Environment::Constant(vector(*radiance.get_ref())),
        EnvironmentTable {
            gradient: Some(gradient),
            ..
        } => Environment::Gradient(gradient_of(gradient.get_ref())),
        EnvironmentTable {
            image: Some(image), ..
        } if report.errors.is_empty() => Environment::Sky(sky(keys, image, folder, files, report)?),
        _ => return None,
    };
    Some(environment).filter(|environment| environment.brightest() > 0.0)
}

/// One of the three, and what goes with it.
fn check_keys(keys: &EnvironmentTable, whole: Range<usize>, report: &mut Report) {
    let ways = [
        ("radiance", keys.radiance.as_ref().map(Spanned::span)),
        ("gradient", keys.gradient.as_ref().map(Spanned::span)),
        ("image", keys.image.as_ref().map(Spanned::span)),
    ];
    let names = list(ways.iter().map(|(name, _)| *name), "or");
    let mut given = ways
        .into_iter()
        .filter_map(|(key, span)| Some((key, span?)));
    let Some((first, span)) = given.next() else {
        let message = format!("{names} is missing in `[environment]`");
        let help = "`radiance = [1.0, 1.0, 1.0]` is the same light from everywhere";
        report
            .errors
            .push(Problem::new(whole, message, "").help(help));
        return;
    };
    for (other, place) in given {
        let message = format!("`{other}` and `{first}` do not go together in `[environment]`");
        let problem = Problem::new(place, message, "").also(span.clone(), "the other one");
        report
            .errors
            .push(problem.help(format!("an environment is one of {names}")));
    }
    let of_images = [
        ("scale", keys.scale.as_ref().map(Spanned::span)),
        ("rotation", keys.rotation.as_ref().map(Spanned::span)),
        ("linear", keys.linear.as_ref().map(Spanned::span)),
    ];
    for (key, place) in of_images {
        if let Some(place) = place.filter(|_| keys.image.is_none()) {
            let message = format!("`{key}` needs an `image` in `[environment]`");
            let problem = Problem::new(place, message, "").also(span.clone(), "there is none");
            report.errors.push(problem.help(format!("remove `{key}`")));
        }
    }
}

fn gradient_of(table: &GradientTable) -> Gradient {
    Gradient {
        zenith: vector(table.zenith),
        horizon: vector(table.horizon),
        ground: vector(table.ground),
    }
}

fn sky(
    keys: &EnvironmentTable,
    image: &Spanned<String>,
    folder: &Path,
    files: &mut Vec<PathBuf>,
    report: &mut Report,
) -> Option<Sky> {
    let path = folder.join(image.get_ref());
    let linear = keys.linear.as_ref().is_some_and(|linear| *linear.get_ref());
    let scale = match keys.scale.as_ref().map(Spanned::get_ref) {
        None => DVec3::ONE,
        Some(ScaleValue::Number(scale)) => DVec3::splat(*scale),
        Some(ScaleValue::Channels(scale)) => vector(*scale),
    };
    let rotation = keys.rotation.as_ref().map_or(0.0, |angle| *angle.get_ref());
    let mut wrong = |text: String, help: Option<&str>| {
        let problem = Problem::new(image.span(), text, "");
        report.errors.push(match help {
            Some(help) => problem.help(help),
            None => problem,
        });
    };
    let texels = match image::load(&path, linear) {
        Ok(texels) => texels,
        Err(text) => {
            wrong(text, None);
            return None;
        }
    };
    files.push(path);
    let sky = Sky::new(image.get_ref(), texels, scale, rotation);
    if let Err(text) = sky.check_brightest() {
        wrong(text, Some("a smaller `scale` brings it below"));
        return None;
    }
    Some(sky)
}

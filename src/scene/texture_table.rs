//! Textures in scene files: tables in the place of materials' values, and the axes of images.

use std::collections::HashMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;
use serde::Deserialize;
use toml::Spanned;
use toml::de::{DeTable, DeValue, ValueDeserializer};

use super::file::ScaleValue;
use super::image;
use super::report::{Problem, Report};
use super::suggest::list;
use super::vector::vector;
use crate::image::Picture;
use crate::materials::schema::{axis_mistake, up};
use crate::materials::texturable::texturable;
use crate::materials::{Material, Mistake, Texturable, Texture, TextureImage};

/// A texture as the file has it.
#[derive(Debug, Deserialize)]
struct TextureTable {
    image: Option<Spanned<String>>,
    linear: Option<Spanned<bool>>,
    checker: Option<Spanned<[ScaleValue; 2]>>,
    noise: Option<Spanned<[ScaleValue; 2]>>,
    size: Option<Spanned<f64>>,
    octaves: Option<Spanned<u32>>,
}

/// The textures of a material, and its axis if it names one.
#[derive(Debug, Default)]
pub(super) struct MaterialTextures {
    /// With where each is.
    tables: Vec<(&'static Texturable, Range<usize>, TextureTable)>,
    axis: Option<Spanned<[f64; 3]>>,
}

/// By the names of the materials.
pub(super) type Textures = HashMap<String, MaterialTextures>;

/// Takes the textures out of a file whose shape is right, and leaves a value of the key in the place of each.
pub(super) fn take(root: &mut DeTable<'_>) -> Textures {
    let Some(DeValue::Table(materials)) = root.get_mut("material").map(Spanned::get_mut) else {
        return Textures::new();
    };
    let mut all = Textures::new();
    for (name, material) in materials.iter_mut() {
        let DeValue::Table(table) = material.get_mut() else {
            continue;
        };
        let textures = of_material(table);
        if !textures.tables.is_empty() || textures.axis.is_some() {
            all.insert(name.get_ref().to_string(), textures);
        }
    }
    all
}

fn of_material(table: &mut DeTable<'_>) -> MaterialTextures {
    let name = table.get("type").and_then(|name| name.get_ref().as_str());
    let name = name.map(str::to_owned);
    let axis = table.get("axis").cloned();
    let mut textures = MaterialTextures {
        axis: axis.and_then(|axis| Spanned::deserialize(ValueDeserializer::from(axis)).ok()),
        ..MaterialTextures::default()
    };
    let own = |key: &&Texturable| key.material.is_none() || key.material == name.as_deref();
    for key in texturable().iter().filter(own) {
        let value = table.get_mut(key.key);
        let Some(value) = value.filter(|value| value.get_ref().is_table()) else {
            continue;
        };
        // Within the limits of each key.
        let one = if key.number { "1.0" } else { "[1.0, 1.0, 1.0]" };
        let Ok(one) = DeValue::parse(one) else {
            continue;
        };
        let span = value.span();
        let found = std::mem::replace(value, one);
        if let Ok(table) = TextureTable::deserialize(ValueDeserializer::from(found)) {
            textures.tables.push((key, span, table));
        }
    }
    textures
}

/// Gives the materials their textures. `files` gets what they name, relative to `folder`.
pub(super) fn apply(
    mut all: Textures,
    materials: &mut [Material],
    folder: &Path,
    files: &mut Vec<PathBuf>,
    report: &mut Report,
) {
    let mut images = Images {
        folder,
        files,
        known: HashMap::new(),
    };
    for material in materials {
        let Some(textures) = all.remove(&material.name) else {
            continue;
        };
        let axis = axis_of(&textures, material, report);
        for &(key, ref span, ref table) in &textures.tables {
            let place = Place {
                key,
                span: span.clone(),
                material: &material.name,
            };
            if !check_keys(table, &place, report) {
                continue;
            }
            if let Some(texture) = texture(table, &place, axis, &mut images, report) {
                *material = material.clone().with_texture(key, texture);
            }
        }
    }
}

/// The axis of a material's images; what is wrong with it is said here, unless the material's type says it.
fn axis_of(textures: &MaterialTextures, material: &Material, report: &mut Report) -> DVec3 {
    let Some(given) = &textures.axis else {
        return up();
    };
    let axis = vector(*given.get_ref());
    let Some(Mistake { what, help, .. }) = axis_mistake(axis) else {
        return axis;
    };
    let own = material.kind.parameters();
    if !own.iter().any(|(key, _)| *key == "axis") {
        let name = material.name.escape_debug();
        let message = format!("{what} in `[material.{name}]`");
        let problem = Problem::new(given.span(), message, "").help(help);
        report.errors.push(problem);
    }
    up()
}

/// Where a texture is.
struct Place<'a> {
    key: &'static Texturable,
    span: Range<usize>,
    material: &'a str,
}

impl Place<'_> {
    fn name(&self) -> String {
        let material = self.material.escape_debug();
        format!("`{}` of `[material.{material}]`", self.key.key)
    }
}

/// One of the three, and what goes with it; whether that is so.
fn check_keys(table: &TextureTable, place: &Place<'_>, report: &mut Report) -> bool {
    let before = report.errors.len();
    let kinds = [
        ("image", table.image.as_ref().map(Spanned::span)),
        ("checker", table.checker.as_ref().map(Spanned::span)),
        ("noise", table.noise.as_ref().map(Spanned::span)),
    ];
    let names = list(kinds.iter().map(|(name, _)| *name), "or");
    let given = kinds.into_iter();
    let mut given = given.filter_map(|(key, span)| Some((key, span?)));
    let Some((first, span)) = given.next() else {
        let message = format!("{names} is missing in the texture {}", place.name());
        let help = match place.key.number {
            true => "`checker = [0.2, 0.5]` has two values in turn",
            false => "`checker = [[1.0, 1.0, 1.0], [0.5, 0.5, 0.5]]` has two colours in turn",
        };
        let problem = Problem::new(place.span.clone(), message, "").help(help);
        report.errors.push(problem);
        return false;
    };
    for (other, at) in given {
        let message = format!(
            "`{other}` and `{first}` do not go together in {}",
            place.name()
        );
        let problem = Problem::new(at, message, "").also(span.clone(), "the other one");
        report
            .errors
            .push(problem.help(format!("a texture is one of {names}")));
    }
    let patterns = ["checker", "noise"];
    let further = [
        (
            "linear",
            table.linear.as_ref().map(Spanned::span),
            &["image"][..],
        ),
        (
            "size",
            table.size.as_ref().map(Spanned::span),
            &patterns[..],
        ),
        (
            "octaves",
            table.octaves.as_ref().map(Spanned::span),
            &["noise"][..],
        ),
    ];
    for (key, at, of) in further {
        if let Some(at) = at.filter(|_| !of.contains(&first)) {
            let message = format!(
                "`{key}` needs {} in {}",
                list(of.iter().copied(), "or"),
                place.name()
            );
            let problem = Problem::new(at, message, "").also(span.clone(), "there is another kind");
            report.errors.push(problem.help(format!("remove `{key}`")));
        }
    }
    report.errors.len() == before
}

fn texture(
    table: &TextureTable,
    place: &Place<'_>,
    axis: DVec3,
    images: &mut Images<'_>,
    report: &mut Report,
) -> Option<Texture> {
    let values = |pair: &Spanned<[ScaleValue; 2]>| {
        pair.get_ref().map(|value| match value {
            ScaleValue::Number(number) => DVec3::splat(number + 0.0),
            ScaleValue::Channels(channels) => vector(channels),
        })
    };
    let size = table.size.as_ref().map_or(0.5, |size| *size.get_ref());
    if let Some(pair) = &table.checker {
        let values = values(pair);
        return Some(Texture::Checker { values, size });
    }
    if let Some(pair) = &table.noise {
        return Some(Texture::Noise {
            values: values(pair),
            size,
            octaves: table
                .octaves
                .as_ref()
                .map_or(4, |octaves| *octaves.get_ref()),
        });
    }
    let file = table.image.as_ref()?;
    let linear = table
        .linear
        .as_ref()
        .is_some_and(|linear| *linear.get_ref());
    // Nothing is read for a file with errors.
    if !report.errors.is_empty() {
        return None;
    }
    let mut wrong = |text: String| report.errors.push(Problem::new(file.span(), text, ""));
    let picture = images
        .picture(file.get_ref(), linear)
        .map_err(&mut wrong)
        .ok()?;
    if let Some(text) = beyond(&picture, place.key) {
        let shown = file.get_ref().escape_debug();
        wrong(format!("{shown}: {text} `{}`", place.key.key));
        return None;
    }
    let image = TextureImage::new(file.get_ref(), picture, place.key.number, axis);
    Some(Texture::Image(image))
}

/// What is wrong with the first texel that is beyond the limits of a key.
fn beyond(picture: &Picture, key: &Texturable) -> Option<String> {
    // As f32 has them.
    let limits = key.minimum as f32..=key.maximum as f32;
    let channels = if key.number { 1 } else { 3 };
    let fits = |texel: &[f32; 3]| texel[..channels].iter().all(|x| limits.contains(x));
    let place = picture.pixels.iter().position(|texel| !fits(texel))? as u32;
    let (column, row) = (place % picture.width, place / picture.width);
    let texel = &picture.pixels[place as usize][..channels];
    let what = match key.number {
        true => format!(
            "red value in column {column} of row {row} is {:?}",
            texel[0]
        ),
        false => format!("texel in column {column} of row {row} is {texel:?}"),
    };
    let (low, high) = (key.minimum, key.maximum);
    Some(format!(
        "its {what}, outside of [{low}, {high}], the limits of"
    ))
}

/// Images of a scene, each read once.
struct Images<'a> {
    folder: &'a Path,
    files: &'a mut Vec<PathBuf>,
    known: HashMap<(PathBuf, bool), Arc<Picture>>,
}

impl Images<'_> {
    fn picture(&mut self, file: &str, linear: bool) -> Result<Arc<Picture>, String> {
        let path = self.folder.join(file);
        let key = (path.clone(), linear);
        if let Some(known) = self.known.get(&key) {
            return Ok(Arc::clone(known));
        }
        let picture = Arc::new(image::load(&path, linear)?);
        self.files.push(path);
        self.known.insert(key, Arc::clone(&picture));
        Ok(picture)
    }
}

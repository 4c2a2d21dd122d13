//! Long lists of spheres in a scene file, parsed piece by piece: the parser's tree of a million spheres takes
//! three gigabytes.
//!
//! Text is cut before lines `[[sphere]]` that follow everything else. A cut within a string or an array leaves a
//! piece that is no TOML, and whatever is not plainly a head and a list of spheres is left to the parser as a
//! whole. So are mistakes, since it says what they are and where.

use std::sync::LazyLock;

use rayon::prelude::*;
use serde::Deserialize;
use toml::Spanned;
use toml::de::{DeTable, Deserializer};

use super::file::{SceneFile, SphereTable};
use super::names::{MaterialKeys, material_keys};
use super::report::Report;
use super::shape;
use super::texture_table::{self, Textures};

/// Before each sphere.
const HEADER: &str = "[[sphere]]";

/// Spheres of a piece.
const SPHERES: usize = 1024;

/// The part of a file that is a piece of the list.
#[derive(Deserialize)]
struct Piece {
    sphere: Vec<SphereTable>,
}

/// What a file holds, where the keys of its materials are, and their textures.
type Parts = (SceneFile, MaterialKeys, Textures);

/// That of a file; `None` if it is to be parsed as a whole.
pub(super) fn parse(text: &str, schema: &serde_json::Value) -> Option<Parts> {
    parse_by(SPHERES, text, schema)
}

fn parse_by(spheres: usize, text: &str, schema: &serde_json::Value) -> Option<Parts> {
    let starts = starts(text)?;
    let mut head = DeTable::parse(&text[..*starts.first()?]).ok()?;
    if head.get_ref().contains_key("sphere") {
        return None;
    }
    let keys = material_keys(head.get_ref());
    if !is_right(head.get_ref(), schema) {
        return None;
    }
    let textures = texture_table::take(head.get_mut());
    let mut file = SceneFile::deserialize(Deserializer::from(head)).ok()?;
    let count = starts.len();
    let pieces: Option<Vec<Vec<SphereTable>>> = (0..count.div_ceil(spheres))
        .into_par_iter()
        .map(|piece| {
            let start = starts[piece * spheres];
            let end = starts.get((piece + 1) * spheres);
            let end = end.copied().unwrap_or(text.len());
            list(&text[start..end], start)
        })
        .collect();
    file.sphere.reserve_exact(count);
    file.sphere.extend(pieces?.into_iter().flatten());
    Some((file, keys, textures))
}

/// Where the spheres begin; `None` if anything but spheres follows the first.
fn starts(text: &str) -> Option<Vec<usize>> {
    let mut starts = Vec::new();
    let mut at = 0;
    for line in text.split_inclusive('\n') {
        let words = line.trim();
        if words == HEADER {
            starts.push(at);
        } else if !starts.is_empty() && words.starts_with('[') {
            return None;
        }
        at += line.len();
    }
    Some(starts)
}

/// The spheres of a piece that begins at byte `start` of the file.
fn list(text: &str, start: usize) -> Option<Vec<SphereTable>> {
    // As in a whole file, of which a piece lacks most.
    static SCHEMA: LazyLock<serde_json::Value> = LazyLock::new(|| {
        let mut schema = super::file::json_schema();
        if let Some(root) = schema.as_object_mut() {
            root.remove("required");
        }
        schema
    });
    let root = DeTable::parse(text).ok()?;
    if root.get_ref().keys().any(|key| key.get_ref() != "sphere") {
        return None;
    }
    let Piece { mut sphere } = checked(root, &SCHEMA)?;
    for sphere in &mut sphere {
        move_by(start, &mut sphere.radius);
        move_by(start, &mut sphere.material);
        if let Some(priority) = &mut sphere.priority {
            move_by(start, priority);
        }
        if let Some(velocity) = &mut sphere.velocity {
            move_by(start, velocity);
        }
    }
    Some(sphere)
}

fn move_by<T: Default>(start: usize, value: &mut Spanned<T>) {
    let span = value.span();
    let inner = std::mem::take(value.get_mut());
    *value = Spanned::new(start + span.start..start + span.end, inner);
}

/// The table without any mistake against the schema.
fn checked<T: for<'de> Deserialize<'de>>(
    root: Spanned<DeTable<'_>>,
    schema: &serde_json::Value,
) -> Option<T> {
    if !is_right(root.get_ref(), schema) {
        return None;
    }
    T::deserialize(Deserializer::from(root)).ok()
}

fn is_right(root: &DeTable<'_>, schema: &serde_json::Value) -> bool {
    let mut report = Report::default();
    shape::check(root, schema, &mut report);
    report.errors.is_empty() && report.warnings.is_empty()
}

#[cfg(test)]
mod tests {
    use super::super::file::json_schema;
    use super::*;
    use crate::verify::Random;

    const HEAD: &str = "
[camera]
position = [0, 0, -5]
look_at = [0, 0, 0]
fov = 40
[image]
width = 4
height = 4
[material.a]
type = \"diffuse\"
albedo = [0.5, 0.5, 0.5]
";
    const SPHERE: &str = "[[sphere]]\ncenter = [1, 2, 3]  # a comment\nvelocity = [0, 1, 0]\nradius = 0.5\nmaterial = \"a\"\n";

    /// By pieces of two spheres, and as a whole.
    fn both(text: &str) -> (Option<String>, Option<String>) {
        let schema = json_schema();
        let pieces = parse_by(2, text, &schema).map(|(file, keys, _)| {
            let mut keys: Vec<_> = keys.into_iter().map(|k| format!("{k:?}")).collect();
            keys.sort();
            format!("{file:?} {keys:?}")
        });
        let whole = DeTable::parse(text).ok().and_then(|root| {
            let keys = material_keys(root.get_ref());
            let mut keys: Vec<_> = keys.into_iter().map(|k| format!("{k:?}")).collect();
            keys.sort();
            let file: SceneFile = checked(root, &schema)?;
            Some(format!("{file:?} {keys:?}"))
        });
        (pieces, whole)
    }

    #[test]
    fn pieces_are_the_whole() {
        let text = format!("{HEAD}{}", SPHERE.repeat(5));
        let (pieces, whole) = both(&text);
        assert!(pieces.is_some());
        assert_eq!(pieces, whole);
        // Companion: another radius, and another place of it.
        let place = text.rfind("0.5").expect("a radius");
        for other in ["0.6", "0.50"] {
            let mut text = text.clone();
            text.replace_range(place..place + 3, other);
            assert_ne!(both(&text).0, whole);
        }
    }

    #[test]
    fn what_is_not_plainly_a_list_is_parsed_as_a_whole() {
        let spheres = SPHERE.repeat(5);
        for text in [
            // Mistakes.
            format!("{HEAD}{spheres}radius = 1\n"),
            format!("{HEAD}{spheres}[camera]\nfov = 3\n"),
            format!("{HEAD}{}", spheres.replace("0.5", "-0.5")),
            format!("{HEAD}{spheres}raduis = 1\n"),
            // A list that is closed already, or is none.
            format!("sphere = []\n{HEAD}{spheres}"),
            format!("{HEAD}[sphere]\n{spheres}"),
            // The header within a string.
            format!("{HEAD}[material.b]\ntype = \"\"\"\n{spheres}\"\"\"\n"),
            // Something behind the spheres.
            format!("{HEAD}{spheres}[render]\nspp = 4\n"),
            HEAD.to_owned(),
        ] {
            assert_eq!(both(&text).0, None, "{text}");
        }
    }

    #[test]
    fn damaged_text_is_never_another_scene() {
        let mut random = Random::new("damaged lists of spheres");
        let text = format!("{HEAD}{}", SPHERE.repeat(5)).into_bytes();
        let marks = b"[]\"'=.#\n  11  22sc";
        let mut taken = 0;
        for round in 0..3000 {
            let mut text = text.clone();
            for _ in 0..1 + round % 3 {
                let [at, with, kind, _] = random.unit4().map(f64::from);
                let at = (at * text.len() as f64) as usize;
                let with = marks[(with * marks.len() as f64) as usize];
                match (kind * 3.0) as u32 {
                    0 => text[at] = with,
                    1 => text.insert(at, with),
                    _ => _ = text.remove(at),
                }
            }
            let text = String::from_utf8(text).expect("ASCII");
            let (pieces, whole) = both(&text);
            if pieces.is_some() {
                taken += 1;
                assert_eq!(pieces, whole, "{text}");
            }
        }
        assert!(taken > 100, "{taken}");
    }
}

//! `[[particles]]` of a scene file: what it asks for, and its spheres in the scene.

use std::ops::Range;
use std::path::Path;

use super::super::Sphere;
use super::super::color_map::Map;
use super::super::file::{ParticlesTable, RadiusValue};
use super::super::report::{Problem, Report};
use super::{Cloud, Coloring, Fault, RadiusBy, Request, Similarity};
use crate::materials::{self, Material, diffuse};
use crate::particles::Format;

/// What the table asks for, in its first frame unless it names one; `None` after errors, which the report then
/// holds.
pub(in crate::scene) fn request(
    table: &ParticlesTable,
    folder: &Path,
    report: &mut Report,
) -> Option<Request> {
    let before = report.errors.len();
    let mut wrong = |span: Range<usize>, message: &str, help: &str| {
        report
            .errors
            .push(Problem::new(span, message, "").help(help));
    };
    let coloring = coloring(table);
    match (&table.material, &table.color_by) {
        (None, None) => wrong(
            table.file.span(),
            "`[[particles]]` without `material` or `color_by`",
            "`material` names one of `[material.NAME]`; `color_by` is \"element\" or a column",
        ),
        (Some(material), Some(_)) => wrong(
            material.span(),
            "`material` and `color_by` do not go together",
            "colours have materials of their own: `material_type` is their type",
        ),
        _ => {}
    }
    let of_column = matches!(coloring, Coloring::Column { .. });
    let colored = table.color_by.is_some();
    let spans = [
        (
            table.map.as_ref().map(toml::Spanned::span),
            of_column,
            "`map` needs a column in `color_by`",
        ),
        (
            table.range.as_ref().map(toml::Spanned::span),
            of_column,
            "`range` needs a column in `color_by`",
        ),
        (
            table.material_type.as_ref().map(toml::Spanned::span),
            colored,
            "`material_type` needs `color_by`",
        ),
    ];
    for (span, fits, message) in spans {
        if let Some(span) = span.filter(|_| !fits) {
            wrong(span, message, "remove it, or add `color_by`");
        }
    }
    if let Some(range) = &table.range
        && range.get_ref()[0] >= range.get_ref()[1]
    {
        wrong(
            range.span(),
            "the first number of `range` must be less than the second",
            "write [low, high]",
        );
    }
    let transform = match &table.transform {
        None => Some(Similarity::IDENTITY),
        Some(rows) => {
            let similarity = Similarity::of_rows(*rows.get_ref());
            if similarity.is_none() {
                wrong(
                    rows.span(),
                    "`transform` would not leave spheres spheres",
                    "rows [s r, shift] with one scale s for all directions, and [0, 0, 0, 1] last",
                );
            }
            similarity
        }
    };
    let radius = table.radius.as_ref().map(|radius| match radius.get_ref() {
        RadiusValue::Number(number) => RadiusBy::Constant(*number),
        RadiusValue::Word(word) => RadiusBy::of_word(word),
    });
    let named = |name: &String| Format::ALL.into_iter().find(|format| format.name() == name);
    (report.errors.len() == before).then_some(Request {
        file: folder.join(table.file.get_ref()),
        format: table.format.as_ref().and_then(named),
        frame: table.frame.unwrap_or_default(),
        may_be_empty: false,
        radius,
        coloring,
        select: table.select.as_ref().map(|select| select.get_ref().clone()),
        transform: transform?,
    })
}

fn coloring(table: &ParticlesTable) -> Coloring {
    match table.color_by.as_ref().map(|word| word.get_ref().as_str()) {
        None => Coloring::None,
        Some("element") => Coloring::Element,
        Some(name) => {
            let map = table.map.as_ref().map(|map| map.get_ref().as_str());
            Coloring::Column {
                name: name.to_owned(),
                map: map.and_then(Map::of_name).unwrap_or_default(),
                range: table.range.as_ref().map(|range| *range.get_ref()),
            }
        }
    }
}

/// The warning of colours that mean something else in each frame.
pub(in crate::scene) fn flickering(table: &ParticlesTable) -> Option<Problem> {
    let Coloring::Column {
        range: None, name, ..
    } = coloring(table)
    else {
        return None;
    };
    let span = table.color_by.as_ref()?.span();
    let message = format!(
        "the colours of `{}` mean other values in each frame: those at the ends of the map are each frame's own",
        name.escape_debug()
    );
    Some(Problem::new(span, message, "").help("`range = [low, high]` fixes them"))
}

/// Adds the spheres of a cloud, and the materials of its colours.
pub(in crate::scene) fn add(
    cloud: Cloud,
    table: &ParticlesTable,
    material: Option<usize>,
    materials: &mut Vec<Material>,
    spheres: &mut Vec<Sphere>,
) {
    let wanted = table
        .material_type
        .as_ref()
        .map_or(diffuse::NAME, |name| name.get_ref().as_str());
    let first = material.unwrap_or(materials.len());
    materials.extend(colored(cloud.colors, wanted));
    spheres.extend(cloud.balls.into_iter().map(|ball| Sphere {
        center: ball.center,
        motion: glam::DVec3::ZERO,
        radius: ball.radius,
        material: first + ball.color,
        priority: None,
    }));
}

/// A material of the type `wanted` for each colour.
pub(in crate::scene) fn colored<'w>(
    colors: Vec<(String, glam::DVec3)>,
    wanted: &'w str,
) -> impl Iterator<Item = Material> + use<'w> {
    colors.into_iter().filter_map(move |(name, color)| {
        let kind = materials::ALL
            .iter()
            .find(|material| material.name == wanted)?;
        Some(Material::new(&name, kind.of_color(color)?))
    })
}

/// The fault at its place in the scene file.
pub(in crate::scene) fn problem(fault: &Fault, table: &ParticlesTable) -> Problem {
    let key = match fault.key {
        "color_by" => table.color_by.as_ref().map(toml::Spanned::span),
        "radius" => table.radius.as_ref().map(toml::Spanned::span),
        "select" => table.select.as_ref().map(toml::Spanned::span),
        "transform" => table.transform.as_ref().map(toml::Spanned::span),
        _ => None,
    };
    let whole = key.unwrap_or_else(|| table.file.span());
    let span = match &fault.span {
        // Within the quotes.
        Some(part) => whole.start + 1 + part.start..(whole.start + 1 + part.end).min(whole.end),
        None => whole,
    };
    let problem = Problem::new(span, &*fault.message, "");
    match &fault.help {
        Some(help) => problem.help(&**help),
        None => problem,
    }
}

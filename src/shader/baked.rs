//! Geometry form `baked`: the modules `geometry` and `attributes`, written for one scene. Every sphere is a few
//! constants in straight-line code, the nearest hit is kept by selection, and nothing is loaded.

use std::fmt::Write as _;

use glam::DVec3;

use super::bsdf::members;
use crate::effects::{Effect, Effects};
use crate::placement::cells::Chart;
use crate::placement::images::LampImage;
use crate::placement::{PlacedSphere, Placement, Side};
use crate::records::layout::light_weight;
use crate::records::material::MaterialRecord;
use crate::records::tables::SceneTables;
use crate::scene::Scene;

/// A WGSL literal of the f32 nearest to `value`.
pub(super) fn number(value: f64) -> String {
    format!("{:?}f", value as f32)
}

/// A WGSL vector of f32.
pub(super) fn vector(v: DVec3) -> String {
    format!("vec3f({}, {}, {})", number(v.x), number(v.y), number(v.z))
}

/// The module `geometry`: what a ray hits.
pub(super) fn geometry(placement: &Placement, effects: &Effects) -> String {
    let mut text = String::from("import package::scene::ray::{Ray, Hit, NO_HIT, NO_SPHERE};\n");
    let centered = placement.spheres.iter().any(|s| s.pole.is_none());
    if centered {
        text += "import package::scene::sphere::sphere_quadratic;\n";
    }
    if effects.has(Effect::Pole) && placement.poles > 0 {
        text += "import package::scene::sphere::pole_quadratic;\n";
    }
    let any = |sides: &[Side]| placement.spheres.iter().any(|s| sides.contains(&s.side));
    for (used, name) in [
        (effects.has(Effect::Motion), "scene::ray::anchors_apart"),
        (any(&[Side::Outside]), "scene::sphere::root_outside"),
        (any(&[Side::Inside]), "scene::sphere::root_interior"),
        (
            any(&[Side::Tracked, Side::Sign]),
            "scene::sphere::root_from",
        ),
        (any(&[Side::Tracked]), "media::is_within"),
    ] {
        if used {
            text += &format!("import package::{name};\n");
        }
    }
    closest_hit(&mut text, placement, effects);
    if effects.samples_light() {
        text += "fn lamp_hit(ray: Ray, lamp: u32, limb: f32) -> Hit {\n\
                 return closest_hit(ray);\n}\n";
    }
    text
}

/// The module `attributes`: what is known of each sphere, and of all lamps.
pub(super) fn attributes(scene: &Scene, placement: &Placement, effects: &Effects) -> String {
    let mut text = String::from(
        "import package::scene::ray::Frame;\n\
         import package::bsdf::Material;\n",
    );
    if effects.weighs_lights() {
        text += "import package::scene::ray::Vertex;\n\
                 import package::lights::{Weighed, weigh};\n\
                 import package::light::aim::aim_center;\n";
        if effects.has(Effect::Pole) {
            text += "import package::light::aim::aim_pole;\n";
        }
        if effects.has(Effect::Motion) {
            text += "import package::scene::ray::anchors_apart;\n";
        }
    }
    frame_of(&mut text, placement, effects);
    material_of(&mut text, scene, placement, effects);
    if effects.has(Effect::RadianceCache) {
        text.insert_str(0, "import package::cache::chart::Chart;\n");
        chart_of(&mut text, placement);
    }
    if effects.has(Effect::Lights) {
        light_weights(&mut text, placement, effects);
    }
    text
}

fn closest_hit(text: &mut String, placement: &Placement, effects: &Effects) {
    let interior = effects.has(Effect::Interior);
    *text += "fn closest_hit(ray: Ray) -> Hit {\n\
              let dd = dot(ray.direction, ray.direction);\n\
              var hit: Hit;\nhit.t = NO_HIT;\nhit.index = NO_SPHERE;\n";
    for (i, sphere) in placement.spheres.iter().enumerate() {
        let quadratic = match sphere.pole {
            Some(normal) => format!(
                "pole_quadratic(x, ray.direction, dd, {}, {})",
                vector(normal),
                number(1.0 / sphere.radius)
            ),
            None => format!(
                "sphere_quadratic(x, ray.direction, dd, {})",
                number(sphere.radius)
            ),
        };
        let inside = match sphere.side {
            Side::Outside => "false".to_owned(),
            Side::Inside => "true".to_owned(),
            Side::Tracked => within(placement, i),
            Side::Sign => "select(q.c < 0.0, ray.inward, own)".to_owned(),
        };
        let root = match sphere.side {
            Side::Outside => "root_outside(q.b, q.square, q.c, own)",
            Side::Inside => "root_interior(q.a, q.b, q.square, q.c, own)",
            Side::Tracked | Side::Sign => "root_from(inside, q, own)",
        };
        let known = if interior {
            format!("let inside = {inside};\n")
        } else {
            String::new()
        };
        let condition = can_be_hit(placement, effects, sphere);
        let closer = condition
            .as_ref()
            .map_or("t < hit.t", |_| "t < hit.t && can_be_hit");
        let condition = condition.map_or_else(String::new, |r| format!("let can_be_hit = {r};\n"));
        let _ = write!(
            text,
            "{{\nlet x = {} + ray.offset;\nlet q = {quadratic};\n\
             let own = ray.own == {i}u;\n{known}let t = {root};\n{condition}\
             let closer = {closer};\nhit.t = select(hit.t, t, closer);\n\
             hit.index = select(hit.index, {i}u, closer);\n",
            from_anchor("ray", sphere, effects),
        );
        if interior {
            *text += "hit.inside = select(hit.inside, inside, closer);\n";
        }
        *text += "}\n";
    }
    *text += "return hit;\n}\n";
}

/// The vector from a sphere's anchor to that of a ray or vertex `of`, at its time.
fn from_anchor(of: &str, sphere: &PlacedSphere, effects: &Effects) -> String {
    let anchor = vector(sphere.anchor);
    if effects.has(Effect::Motion) {
        let motion = vector(sphere.motion);
        return format!("anchors_apart({anchor}, {of}.anchor, {motion}, {of}.motion, {of}.time)");
    }
    format!("({of}.anchor - {anchor})")
}

/// Whether the ray runs inside the dielectric `index`.
fn within(placement: &Placement, index: usize) -> String {
    let level = placement.spheres[index].level;
    format!("is_within(ray.media, {index}u, {level}u)")
}

/// When a sphere can be hit that lies just within another, or has one just within it; see
/// `can_be_hit` in `shaders/scene/nearer.wesl`.
fn can_be_hit(placement: &Placement, effects: &Effects, sphere: &PlacedSphere) -> Option<String> {
    let container = sphere.container.map(|c| within(placement, c));
    let cores = sphere.cores.iter();
    let core = cores.map(|c| format!("!{}", within(placement, *c)));
    let conditions: Vec<String> = container.into_iter().chain(core).collect();
    (effects.has(Effect::Nested) && !conditions.is_empty()).then(|| conditions.join(" && "))
}

/// Writes `target`, whose value depends on the sphere, as a chain of selections. The most common
/// value is the start, so that a value that all share costs nothing.
fn choose(text: &mut String, target: &str, values: &[String]) {
    let mut distinct: Vec<(&String, Vec<usize>)> = Vec::new();
    for (i, value) in values.iter().enumerate() {
        match distinct.iter_mut().find(|(v, _)| *v == value) {
            Some((_, indices)) => indices.push(i),
            None => distinct.push((value, vec![i])),
        }
    }
    distinct.sort_by_key(|(_, indices)| std::cmp::Reverse(indices.len()));
    for (n, (value, indices)) in distinct.iter().enumerate() {
        if n == 0 {
            let _ = writeln!(text, "{target} = {value};");
        } else {
            let is: Vec<String> = indices.iter().map(|i| format!("index == {i}u")).collect();
            let _ = writeln!(
                text,
                "{target} = select({target}, {value}, {});",
                is.join(" || ")
            );
        }
    }
}

fn frame_of(text: &mut String, placement: &Placement, effects: &Effects) {
    let each = |value: &dyn Fn(&PlacedSphere) -> String| -> Vec<String> {
        placement.spheres.iter().map(value).collect()
    };
    *text += "fn frame_of(index: u32) -> Frame {\nvar frame: Frame;\n";
    choose(text, "frame.anchor", &each(&|s| vector(s.anchor)));
    choose(text, "frame.curvature", &each(&|s| number(1.0 / s.radius)));
    if effects.has(Effect::Pole) {
        choose(
            text,
            "frame.pole",
            &each(&|s| vector(s.pole.unwrap_or_default())),
        );
    }
    choose(
        text,
        "frame.radius",
        &each(&|s| number(if s.pole.is_some() { 0.0 } else { s.radius })),
    );
    if effects.has(Effect::Motion) {
        choose(text, "frame.motion", &each(&|s| vector(s.motion)));
    }
    *text += "return frame;\n}\n";
}

fn material_of(text: &mut String, scene: &Scene, placement: &Placement, effects: &Effects) {
    let tables = SceneTables::new(scene, placement);
    let spheres = 0..placement.spheres.len();
    let records: Vec<MaterialRecord> = spheres
        .map(|i| tables.of_sphere(i, scene, placement))
        .collect();
    choose_material(text, "material_of", &records, effects);
    if effects.has_mixes() {
        let parts: Vec<MaterialRecord> = tables.mixes.materials().cloned().collect();
        choose_material(text, "material_of_part", &parts, effects);
    }
    if effects.transmits() {
        let levels: Vec<String> = placement
            .spheres
            .iter()
            .map(|s| format!("{}u", s.level))
            .collect();
        *text += "fn level_of(index: u32) -> u32 {\nvar level: u32;\n";
        choose(text, "level", &levels);
        *text += "return level;\n}\n";
    }
}

/// The function `name`, which chooses one of `records`.
fn choose_material(text: &mut String, name: &str, records: &[MaterialRecord], effects: &Effects) {
    // Writing to a String cannot fail.
    let _ = writeln!(
        text,
        "fn {name}(index: u32) -> Material {{\nvar material: Material;"
    );
    for member in members(effects) {
        let values: Vec<String> = records.iter().map(|r| r.literal(member)).collect();
        choose(text, &format!("material.{}", member.name), &values);
    }
    *text += "return material;\n}\n";
}

/// The charts that the radiance cache's cells are of.
fn chart_of(text: &mut String, placement: &Placement) {
    let charts: Vec<Chart> = (0..placement.spheres.len())
        .map(|i| placement.chart(i))
        .collect();
    let each = |value: &dyn Fn(&Chart) -> String| charts.iter().map(value).collect::<Vec<_>>();
    *text += "fn chart_of(index: u32) -> Chart {\nvar chart: Chart;\n";
    choose(text, "chart.first", &each(&|c| format!("{}u", c.first)));
    choose(text, "chart.cells", &each(&|c| format!("{}u", c.side)));
    choose(
        text,
        "chart.diffuse",
        &each(&|c| format!("{}u", u32::from(c.diffuse))),
    );
    choose(
        text,
        "chart.width",
        &each(&|c| number(c.width.unwrap_or(0.0))),
    );
    for (i, name) in ["across", "down"].iter().enumerate() {
        choose(
            text,
            &format!("chart.{name}"),
            &each(&|c| vector(c.axes[i])),
        );
    }
    *text += "return chart;\n}\n";
}

/// The module `lamp_images`: the images of lamps that vertices look for, whatever the form of the geometry.
pub(super) fn images(placement: &Placement) -> String {
    let images = placement.images.as_deref().unwrap_or_default();
    let each = |value: &dyn Fn(&LampImage) -> String| images.iter().map(value).collect::<Vec<_>>();
    let mut text = format!(
        "import package::light::images::LampImage;\nconst LAMP_IMAGE_COUNT: u32 = {}u;\n\
         fn image_of(index: u32) -> LampImage {{\nvar image: LampImage;\n",
        images.len()
    );
    let word = |value: usize| format!("{value}u");
    choose(&mut text, "image.sphere", &each(&|i| word(i.sphere)));
    choose(&mut text, "image.way", &each(&|i| word(i.way as usize)));
    choose(&mut text, "image.lamp", &each(&|i| word(i.lamp)));
    choose(
        &mut text,
        "image.ior",
        &each(&|i| number(i.ior.unwrap_or(0.0))),
    );
    choose(
        &mut text,
        "image.strength",
        &each(&|i| number(i.strength * placement.radiance_scale)),
    );
    text += "return image;\n}\n";
    text
}

/// What spheres count for as lights, and unless they are drawn from a table, their weighing.
fn light_weights(text: &mut String, placement: &Placement, effects: &Effects) {
    let weight = |i: usize| number(light_weight(i, placement, effects));
    let weights: Vec<String> = (0..placement.spheres.len()).map(weight).collect();
    *text += "fn light_weight(index: u32) -> f32 {\nvar weight: f32;\n";
    choose(text, "weight", &weights);
    *text += "return weight;\n}\n";
    if !effects.weighs_lights() {
        return;
    }
    *text += "fn weigh_lights(vertex: Vertex, own: u32, u: f32) -> Weighed {\n\
              var chosen: Weighed;\nchosen.v = u;\n";
    for light in &placement.lights.table {
        let sphere = &placement.spheres[light.sphere];
        let x = format!("{} + vertex.offset", from_anchor("vertex", sphere, effects));
        let aim = match sphere.pole {
            Some(normal) => format!(
                "aim_pole({x}, {}, {})",
                vector(normal),
                number(1.0 / sphere.radius)
            ),
            None => format!("aim_center({x}, {})", number(sphere.radius)),
        };
        let _ = writeln!(
            text,
            "chosen = weigh(chosen, vertex, own, {aim}, {}, {}u);",
            weights[light.sphere], light.sphere
        );
    }
    *text += "return chosen;\n}\n";
}

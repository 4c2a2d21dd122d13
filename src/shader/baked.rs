//! Geometry form `baked`: the module `scene/baked`, written for one scene. Every sphere is a few
//! constants in straight-line code, the nearest hit is kept by selection, and nothing is loaded.

use std::fmt::Write as _;

use glam::DVec3;

use crate::effects::Effects;
use crate::gpu::layout::MaterialRecord;
use crate::placement::{PlacedSphere, Placement, Side};
use crate::scene::Scene;

/// A WGSL literal of the f32 nearest to `value`.
pub(super) fn number(value: f64) -> String {
    format!("{:?}f", value as f32)
}

/// A WGSL vector of f32.
pub(super) fn vector(v: DVec3) -> String {
    format!("vec3f({}, {}, {})", number(v.x), number(v.y), number(v.z))
}

pub(super) fn geometry(scene: &Scene, placement: &Placement, effects: &Effects) -> String {
    let mut text = String::from(
        "import package::scene::ray::{Ray, Hit, Root, Frame, NO_HIT, NO_SPHERE};\n\
         import package::scene::material::Material;\n",
    );
    let centered = placement.spheres.iter().any(|s| s.pole.is_none());
    if centered {
        text += "import package::scene::sphere::sphere_quadratic;\n";
    }
    if effects.has("pole") && placement.poles > 0 {
        text += "import package::scene::sphere::pole_quadratic;\n";
    }
    if placement.spheres.iter().any(|s| s.side == Side::Outside) {
        text += "import package::scene::sphere::root_outside;\n";
    }
    if placement.spheres.iter().any(|s| s.side != Side::Outside) {
        text += "import package::scene::sphere::root_from;\n";
    }
    closest_hit(&mut text, placement, effects);
    frame_of(&mut text, placement, effects);
    material_of(&mut text, scene, placement, effects);
    text
}

fn closest_hit(text: &mut String, placement: &Placement, effects: &Effects) {
    let interior = effects.has("interior");
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
        let root = if sphere.side == Side::Outside {
            format!("let t = root_outside(q.b, q.square, q.c, ray.own == {i}u);")
        } else {
            format!(
                "let root = root_from({}u, q.a, q.b, q.square, q.c, ray.own == {i}u, ray.inward);\n\
                 let t = root.t;",
                sphere.side as u32
            )
        };
        let _ = write!(
            text,
            "{{\nlet x = (ray.anchor - {}) + ray.offset;\nlet q = {quadratic};\n{root}\n\
             let closer = t < hit.t;\nhit.t = select(hit.t, t, closer);\n\
             hit.index = select(hit.index, {i}u, closer);\n",
            vector(sphere.anchor),
        );
        if interior {
            let inside = if sphere.side == Side::Outside {
                "false"
            } else {
                "root.inside"
            };
            let _ = writeln!(text, "hit.inside = select(hit.inside, {inside}, closer);");
        }
        *text += "}\n";
    }
    *text += "return hit;\n}\n";
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
    if effects.has("pole") {
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
    *text += "return frame;\n}\n";
}

fn material_of(text: &mut String, scene: &Scene, placement: &Placement, effects: &Effects) {
    let records: Vec<MaterialRecord> = placement
        .spheres
        .iter()
        .map(|s| MaterialRecord::new(&scene.materials[s.material]))
        .collect();
    *text += "fn material_of(index: u32) -> Material {\nvar material: Material;\n";
    for name in MaterialRecord::members(effects) {
        let values: Vec<String> = records.iter().map(|r| r.literal(name)).collect();
        choose(text, &format!("material.{name}"), &values);
    }
    *text += "return material;\n}\n";
    if effects.has("priority") {
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

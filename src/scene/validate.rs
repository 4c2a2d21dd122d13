//! From a file whose shape is right to a [`Scene`]: what concerns several values at once.

use std::collections::{BTreeSet, HashMap};
use std::ops::Range;

use glam::DVec3;
use toml::Spanned;

use super::check::{TINY, all_tiny, no_priority, tiny_help};
use super::file::{CameraTable, HandednessName, MaterialTable, SceneFile, SphereTable};
use super::motion::{check_motion, shutter};
use super::names::{MaterialKeys, unknown_material};
use super::parsed::{Parsed, Place};
use super::report::{Problem, Report, SHOWN};
use super::texture_table::{self, Textures};
use super::vector::vector;
use super::view::{Fault, SHORTEST};
use super::{
    Camera, Handedness, RenderDefaults, Scene, Sphere, environment, measured, mix, particles,
};
use crate::materials::{Material, Mistake};

/// What a file holds whose files are at that place; `None` after errors, which the report then holds.
pub(super) fn scene(
    file: SceneFile,
    keys: &MaterialKeys,
    textures: Textures,
    place: Place<'_>,
    report: &mut Report,
) -> Option<Parsed> {
    let camera = camera(&file.camera, report);
    let mut materials: Vec<_> = file
        .material
        .into_iter()
        .map(|(name, table)| {
            let span = name.span();
            let material = material(name.into_inner(), table);
            if let Some(Mistake { key, what, help }) = material.kind.mistake() {
                let at = keys.get(&(material.name.clone(), key.to_owned()));
                let at = at.unwrap_or(&span).clone();
                let message = format!("{what} in `[material.{}]`", material.name.escape_debug());
                report.errors.push(Problem::new(at, message, "").help(help));
            }
            (span, material)
        })
        .collect();
    // The map is ordered by name; the order of the file is what people expect to see.
    materials.sort_by_key(|(span, _)| span.start);
    let (spans, mut materials): (Vec<_>, Vec<_>) = materials.into_iter().unzip();

    let names: HashMap<&str, usize> = materials
        .iter()
        .enumerate()
        .map(|(index, material)| (material.name.as_str(), index))
        .collect();
    let [opens, closes] = shutter(&file.camera, report);
    let mut spheres = Vec::with_capacity(file.sphere.len());
    let mut used = BTreeSet::new();
    let mut looked_up = 0..SHOWN;
    for sphere in &file.sphere {
        let Some(&index) = names.get(sphere.material.get_ref().as_str()) else {
            // All materials are looked through for what was meant, so only where that is shown: the
            // spheres come in the order of the file, and the rest is counted.
            let problem = match looked_up.next() {
                Some(_) => unknown_material(sphere.material.get_ref(), &materials),
                None => Problem::new(0..0, "unknown material", ""),
            };
            report.errors.push(Problem {
                span: sphere.material.span(),
                ..problem
            });
            continue;
        };
        used.insert(index);
        let dielectric = materials[index].kind.transmits();
        if let Some(priority) = sphere.priority.as_ref().filter(|_| !dielectric) {
            let message = no_priority(&materials[index]);
            let problem = Problem::new(priority.span(), message, "")
                .also(
                    sphere.material.span(),
                    format!("a {} material", materials[index].kind.name()),
                )
                .help("remove `priority`: it decides which dielectric fills an overlap");
            report.errors.push(problem);
        }
        let velocity = sphere.velocity.as_ref();
        let velocity = velocity.map_or(DVec3::ZERO, |v| vector(*v.get_ref()));
        spheres.push(Sphere {
            center: vector(sphere.center) + 0.5 * (opens + closes) * velocity + 0.0,
            motion: (closes - opens) * velocity + 0.0,
            radius: *sphere.radius.get_ref(),
            material: index,
            priority: sphere.priority.as_ref().map(|priority| *priority.get_ref()),
        });
    }

    // Those of the file: colours of particles come after them.
    let own = materials.len();
    let mut files = Vec::new();
    let mut frames: Option<u64> = None;
    for table in &file.particles {
        let request = particles::request(table, place.folder, report);
        let material = match &table.material {
            None => None,
            Some(name) => match materials[..own]
                .iter()
                .position(|m| m.name == *name.get_ref())
            {
                Some(index) => Some(index),
                None => {
                    let problem = unknown_material(name.get_ref(), &materials[..own]);
                    report.errors.push(Problem {
                        span: name.span(),
                        ..problem
                    });
                    continue;
                }
            },
        };
        // Nothing is read for a file with errors.
        let Some(mut request) = request.filter(|_| report.errors.is_empty()) else {
            continue;
        };
        used.extend(material);
        files.push(request.file.clone());
        if let Some(frame) = place.frame.filter(|_| table.frame.is_none()) {
            match request.frames() {
                Ok(there) if there > 1 => {
                    request.frame = frame;
                    request.may_be_empty = true;
                    frames = Some(frames.map_or(there, |other| other.min(there)));
                    report.warnings.extend(particles::flickering(table));
                }
                Ok(_) => {}
                Err(fault) => {
                    report.errors.push(particles::problem(&fault, table));
                    continue;
                }
            }
        }
        match particles::gather(&request) {
            Ok(cloud) => particles::add(cloud, table, material, &mut materials, &mut spheres),
            Err(fault) => report.errors.push(particles::problem(&fault, table)),
        }
    }
    used.extend(own..materials.len());
    if all_tiny(&spheres) {
        let largest =
            largest(&file.sphere).map(|radius| (radius.span(), ": this is the largest `radius`"));
        let particles = file.particles.first().map(|table| (table.file.span(), ""));
        let (span, which) = largest.or(particles).unwrap_or_default();
        let problem = Problem::new(span, format!("{TINY}{which}"), "");
        report.errors.push(problem.help(tiny_help()));
    }

    texture_table::apply(
        textures,
        &mut materials[..own],
        place.folder,
        &mut files,
        report,
    );
    measured::apply(
        &mut materials[..own],
        keys,
        place.folder,
        &mut files,
        report,
    );
    mix::apply(&mut materials[..own], keys, &mut used, report);
    let environment = file.environment.as_ref();
    let environment = environment
        .and_then(|table| environment::of_table(table, place.folder, &mut files, report));
    let scene = Scene {
        camera: camera?,
        width: file.image.width,
        height: file.image.height,
        render: RenderDefaults {
            spp: file.render.spp,
            max_bounces: file.render.max_bounces,
        },
        environment,
        materials,
        spheres,
    };
    if report.errors.is_empty() {
        check_motion(&scene, &file.camera, &file.sphere, report);
    }
    // All that it refuses has been said with its place.
    if report.errors.is_empty()
        && let Err(error) = scene.check()
    {
        report
            .errors
            .push(Problem::new(0..0, error.to_string(), ""));
    }
    if !report.errors.is_empty() {
        return None;
    }
    warn(&scene, &spans, &used, report);
    Some(Parsed {
        scene,
        files,
        frames,
    })
}

/// The largest radius; the first of several.
fn largest(spheres: &[SphereTable]) -> Option<&Spanned<f64>> {
    let radii = spheres.iter().map(|sphere| &sphere.radius);
    radii.reduce(|a, b| if b.get_ref() > a.get_ref() { b } else { a })
}

fn camera(table: &CameraTable, report: &mut Report) -> Option<Camera> {
    let position = vector(*table.position.get_ref());
    let look_at = vector(*table.look_at.get_ref());
    let up = table
        .up
        .as_ref()
        .map_or(DVec3::Y, |up| vector(*up.get_ref()));
    let errors = report.errors.len();
    let fault = Fault::of_view(position, look_at, up);
    report
        .errors
        .extend(fault.map(|fault| of_view(fault, table, look_at - position)));
    let aperture = table
        .aperture_radius
        .as_ref()
        .map_or(0.0, |radius| *radius.get_ref());
    if let Some(radius) = table.aperture_radius.as_ref().filter(|_| aperture > 0.0)
        && table.focus_distance.is_none()
    {
        let message = "`focus_distance` is missing: a lens needs it";
        let distance = (look_at - position).length();
        let problem = Problem::new(radius.span(), message, "the lens is asked for here");
        report.errors.push(problem.help(match distance {
            0.0 => "`aperture_radius = 0.0` is a pinhole".to_owned(),
            _ => format!(
                "`focus_distance = {distance:?}` focuses on `look_at`; \
                 `aperture_radius = 0.0` is a pinhole"
            ),
        }));
    }
    let focus_distance = table.focus_distance.as_ref();
    if let Some(distance) = focus_distance
        && let Some(fault) = Fault::of_lens(aperture, *distance.get_ref())
    {
        let problem = Problem::new(distance.span(), fault.what(), "");
        report
            .errors
            .push(problem.help(fault.help(look_at - position)));
    }
    (report.errors.len() == errors).then(|| Camera {
        position,
        look_at,
        up: of_use(up),
        fov: table.fov,
        handedness: match table.handedness {
            HandednessName::Right => Handedness::Right,
            HandednessName::Left => Handedness::Left,
        },
        aperture_radius: aperture + 0.0,
        focus_distance: focus_distance
            .map_or_else(|| (look_at - position).length(), |d| *d.get_ref()),
    })
}

/// A fault of the view along `axis`, where it is.
fn of_view(fault: Fault, table: &CameraTable, axis: DVec3) -> Problem {
    let at_point = |label| {
        let problem = Problem::new(table.look_at.span(), fault.what(), "");
        problem.also(table.position.span(), label)
    };
    let problem = match (fault, &table.up) {
        (Fault::TooNear, _) => at_point("the position"),
        (Fault::NoDirection, _) => return at_point("the same point"),
        (_, Some(up)) => Problem::new(up.span(), fault.what(), ""),
        // Without the key the default is at fault, and what it collides with is shown.
        (_, None) => {
            let what = fault
                .what()
                .replacen("`up`", "`up`, (0, 1, 0) by default,", 1);
            Problem::new(table.look_at.span(), what, "")
        }
    };
    problem.help(fault.help(axis))
}

/// The vector, made longer by a power of two if computing with it would lose it.
fn of_use(vector: DVec3) -> DVec3 {
    if vector.abs().max_element() < SHORTEST {
        vector * 2_f64.powi(900)
    } else {
        vector
    }
}

fn material(name: String, table: MaterialTable) -> Material {
    Material {
        emission: table.emission + 0.0,
        ..Material::new(&name, table.kind)
    }
}

fn warn(scene: &Scene, spans: &[Range<usize>], used: &BTreeSet<usize>, report: &mut Report) {
    let warnings = &mut report.warnings;
    let lit = |index: &usize| scene.materials[*index].emission != DVec3::ZERO;
    if scene.environment.is_none() && !used.iter().any(lit) {
        let problem = Problem::new(0..0, "the scene has no light: the image will be black", "");
        warnings.push(problem.help(
            "give a sphere's material an `emission`, or add `[environment]` with a `radiance`",
        ));
    }
    if scene.spheres.is_empty() {
        let problem = Problem::new(
            0..0,
            "the scene has no spheres: only the environment is seen",
            "",
        );
        warnings.push(
            problem.help("spheres are tables `[[sphere]]` with `center`, `radius` and `material`"),
        );
    }
    for (index, (material, span)) in scene.materials.iter().zip(spans).enumerate() {
        if !used.contains(&index) {
            let message = format!(
                "material \"{}\" is used by no sphere",
                material.name.escape_debug()
            );
            warnings.push(Problem::new(span.clone(), message, ""));
        }
        if let Some([what, help]) = material.warning() {
            let message = format!("material \"{}\" {what}", material.name.escape_debug());
            warnings.push(Problem::new(span.clone(), message, "").help(help));
        }
    }
}

//! A scene in words, for `scene check`.

use std::collections::BTreeMap;
use std::fmt::{self, Write};

use glam::DVec3;

use super::load::Loaded;
use super::{Environment, Gradient, Handedness, Scene};
use crate::materials::measured::Measured;
use crate::materials::texturable::EMISSION;
use crate::materials::{Bsdf as _, MaterialKind, Texture, Textured};
use crate::numbers::significant;

/// So many lights are listed one by one.
const LIGHTS_LISTED: usize = 8;

/// And so many textures.
const TEXTURES_LISTED: usize = 16;

/// And so many measured materials.
const TABLES_LISTED: usize = 16;

/// The summary that `scene check` prints: image, camera, spheres by material, lights. Lines end
/// with a newline; the warnings are not in it.
#[must_use]
pub fn summary(loaded: &Loaded) -> String {
    let mut text = String::new();
    // Writing to a String cannot fail.
    let _ = write(&mut text, loaded);
    text
}

fn write(text: &mut String, loaded: &Loaded) -> fmt::Result {
    let scene = &loaded.scene;
    writeln!(text, "scene        {} ({})", loaded.name, loaded.hash)?;
    write!(
        text,
        "image        {} x {} pixels",
        scene.width, scene.height
    )?;
    if let Some(spp) = scene.render.spp {
        write!(text, ", {} a pixel", counted(spp, "sample"))?;
    }
    if let Some(bounces) = scene.render.max_bounces {
        write!(text, ", at most {}", counted(bounces, "bounce"))?;
    }
    writeln!(text)?;
    camera(text, scene)?;
    writeln!(text, "spheres      {}", scene.spheres.len())?;

    let mut counts: BTreeMap<&str, (usize, usize)> = BTreeMap::new();
    for sphere in &scene.spheres {
        counts
            .entry(scene.materials[sphere.material].kind.name())
            .or_default()
            .0 += 1;
    }
    for material in &scene.materials {
        counts.entry(material.kind.name()).or_default().1 += 1;
    }
    for (kind, (spheres, materials)) in counts {
        let spheres = counted(spheres, "sphere");
        writeln!(
            text,
            "  {kind:<10} {spheres}, {}",
            counted(materials, "material")
        )?;
    }
    textures(text, scene)?;
    motion(text, scene)?;
    tables(text, scene)?;
    lights(text, scene)
}

fn motion(text: &mut String, scene: &Scene) -> fmt::Result {
    let moving = scene.spheres.iter().map(|sphere| sphere.motion);
    let moving: Vec<f64> = moving
        .filter(|motion| *motion != DVec3::ZERO)
        .map(DVec3::length)
        .collect();
    if moving.is_empty() {
        return Ok(());
    }
    let longest = moving.iter().copied().fold(0.0, f64::max);
    writeln!(
        text,
        "motion       {}, by up to {} while the shutter is open",
        counted(moving.len(), "sphere"),
        significant(longest)
    )
}

fn tables(text: &mut String, scene: &Scene) -> fmt::Result {
    let all: Vec<(&str, &Measured)> = scene
        .materials
        .iter()
        .filter_map(|material| match &material.kind {
            MaterialKind::Measured(measured) => Some((material.name.as_str(), measured)),
            _ => None,
        })
        .collect();
    if all.is_empty() {
        return Ok(());
    }
    writeln!(text, "measured     {}", all.len())?;
    for (name, measured) in all.iter().take(TABLES_LISTED) {
        let file = measured.file.escape_debug();
        let most = significant(measured.albedo().max_element());
        writeln!(
            text,
            "  {name}: {file}, which scatters at most {most} of the light"
        )?;
    }
    if all.len() > TABLES_LISTED {
        writeln!(text, "  and {} more", all.len() - TABLES_LISTED)?;
    }
    Ok(())
}

fn textures(text: &mut String, scene: &Scene) -> fmt::Result {
    let all = scene.materials.iter();
    let all: Vec<_> = all
        .flat_map(|material| material.textures.iter().map(move |t| (&material.name, t)))
        .collect();
    if all.is_empty() {
        return Ok(());
    }
    writeln!(text, "textures     {}", all.len())?;
    for (name, Textured { key, texture }) in all.iter().take(TEXTURES_LISTED) {
        let what = match texture {
            Texture::Checker { size, .. } => format!("a checker of cells of {size}"),
            Texture::Noise { size, octaves, .. } => {
                format!(
                    "a noise of cells of {size}, {}",
                    counted(u64::from(*octaves), "octave")
                )
            }
            Texture::Image(image) => {
                let (picture, name) = (image.image(), image.name().escape_debug());
                format!("{name}, {} x {} texels", picture.width, picture.height)
            }
        };
        writeln!(text, "  {} of {name}: {what}", key.key)?;
    }
    if all.len() > TEXTURES_LISTED {
        writeln!(text, "  and {} more", all.len() - TEXTURES_LISTED)?;
    }
    Ok(())
}

fn camera(text: &mut String, scene: &Scene) -> fmt::Result {
    let camera = &scene.camera;
    write!(
        text,
        "camera       at {} to {}, fov {} degrees, {}",
        triple(camera.position),
        triple(camera.look_at),
        camera.fov,
        match camera.handedness {
            Handedness::Right => "right-handed",
            Handedness::Left => "left-handed",
        }
    )?;
    if camera.aperture_radius > 0.0 {
        let (radius, distance) = (camera.aperture_radius, camera.focus_distance);
        writeln!(text, ", lens of radius {radius} focused at {distance}")
    } else {
        writeln!(text, ", pinhole")
    }
}

fn lights(text: &mut String, scene: &Scene) -> fmt::Result {
    let mut by_material: BTreeMap<usize, usize> = BTreeMap::new();
    for sphere in &scene.spheres {
        if scene.materials[sphere.material].emission != DVec3::ZERO {
            *by_material.entry(sphere.material).or_default() += 1;
        }
    }
    let spheres: usize = by_material.values().sum();
    match (spheres, &scene.environment) {
        (0, None) => writeln!(text, "lights       none")?,
        (0, Some(_)) => writeln!(text, "lights       the environment")?,
        (count, None) => writeln!(text, "lights       {}", counted(count, "sphere"))?,
        (count, Some(_)) => writeln!(
            text,
            "lights       the environment and {}",
            counted(count, "sphere")
        )?,
    }
    if let Some(environment) = &scene.environment {
        writeln!(text, "  environment {}", in_words(environment))?;
    }
    for (&index, &count) in by_material.iter().take(LIGHTS_LISTED) {
        let material = &scene.materials[index];
        let emission = triple(material.emission);
        let spheres = counted(count, "sphere");
        let up_to = match material.texture(EMISSION) {
            Some(_) => "up to ",
            None => "",
        };
        writeln!(
            text,
            "  {} with radiance {up_to}{emission}: {spheres}",
            material.name
        )?;
    }
    if by_material.len() > LIGHTS_LISTED {
        writeln!(
            text,
            "  and {} more materials",
            by_material.len() - LIGHTS_LISTED
        )?;
    }
    Ok(())
}

fn in_words(environment: &Environment) -> String {
    match environment {
        Environment::Constant(radiance) => format!("with radiance {}", triple(*radiance)),
        Environment::Gradient(Gradient {
            zenith,
            horizon,
            ground,
        }) => {
            let [zenith, horizon, ground] =
                [zenith, horizon, ground].map(|radiance| triple(*radiance));
            format!(
                "with radiance {zenith} at the zenith, {horizon} at the horizon, {ground} below"
            )
        }
        Environment::Sky(sky) => {
            let (image, name) = (sky.image(), sky.name().escape_debug());
            let mut text = format!("{name}, {} x {} texels", image.width, image.height);
            if sky.scale() != DVec3::ONE {
                text += &format!(", times {}", triple(sky.scale()));
            }
            if sky.rotation() != 0.0 {
                text += &format!(", turned by {} degrees", sky.rotation());
            }
            format!(
                "{text}, with radiance up to {}",
                significant(environment.brightest())
            )
        }
    }
}

fn triple(vector: DVec3) -> String {
    format!("({}, {}, {})", vector.x, vector.y, vector.z)
}

fn counted<N: fmt::Display + PartialEq + From<u8>>(count: N, noun: &str) -> String {
    let plural = if count == N::from(1) { "" } else { "s" };
    format!("{count} {noun}{plural}")
}

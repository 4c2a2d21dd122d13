//! What holds of every scene, whoever made it.
//!
//! A scene file is held to it as it is read, with the place of each mistake. A scene that was made or changed in
//! code is held to the same here, by the limits of the same schema.

use glam::DVec3;
use serde_json::Value as Schema;

use super::environment::{Environment, Gradient};
use super::file::schema;
use super::motion::Fault;
use super::range::{Limits, show};
use super::view::{self, SHORTEST};
use super::{Camera, MAX_SIDE, Scene, Sphere};
use crate::error::{Error, Result};
use crate::image::Picture;
use crate::materials::material::parameter;
use crate::materials::mix::Weight;
use crate::materials::texturable::{EMISSION, WEIGHT, texturable_key};
use crate::materials::{Material, MaterialKind, Mistake, Texturable, Texture, Textured, Value};

/// What is wrong, in words.
type Fine<T = ()> = std::result::Result<T, String>;

impl Scene {
    /// Checks what is checked of a scene file: that every number is in its range, that every sphere has a material,
    /// and that the values go together. Takes time in proportion to the number of spheres.
    ///
    /// # Errors
    /// [`Error::Placement`] with the first thing that is wrong.
    pub fn check(&self) -> Result<()> {
        whole(self).map_err(Error::Placement)
    }
}

fn whole(scene: &Scene) -> Fine {
    let of_image = properties("image");
    number("`width`", &of_image["width"], scene.width.into())?;
    number("`height`", &of_image["height"], scene.height.into())?;
    let of_render = properties("render");
    if let Some(spp) = scene.render.spp {
        number("`spp`", &of_render["spp"], spp as f64)?;
    }
    if let Some(bounces) = scene.render.max_bounces {
        number("`max_bounces`", &of_render["max_bounces"], bounces.into())?;
    }
    camera(&scene.camera).map_err(|fault| format!("the camera's {fault}"))?;
    if let Some(around) = &scene.environment {
        environment(around).map_err(|fault| format!("the environment's {fault}"))?;
    }
    for of_scene in &scene.materials {
        material(of_scene)?;
    }
    spheres(scene)
}

/// The schemas of the keys of a table of the file.
fn properties(table: &str) -> &'static Schema {
    &schema()["properties"][table]["properties"]
}

fn number(name: &str, schema: &Schema, number: f64) -> Fine {
    let limits = Limits::of(schema);
    if limits.rounded().hold(number) && number.is_finite() {
        return Ok(());
    }
    let wanted = limits.wanted(number);
    Err(format!("{name} must be {wanted}, and is {}", show(number)))
}

fn vector(name: &str, schema: &Schema, vector: DVec3) -> Fine {
    let mut channels = vector.to_array().into_iter();
    channels.try_for_each(|x| number(name, &schema["items"], x))
}

fn camera(camera: &Camera) -> Fine {
    let keys = properties("camera");
    vector("`position`", &keys["position"], camera.position)?;
    vector("`look_at`", &keys["look_at"], camera.look_at)?;
    number("`fov`", &keys["fov"], camera.fov)?;
    number(
        "`aperture_radius`",
        &keys["aperture_radius"],
        camera.aperture_radius,
    )?;
    if camera.aperture_radius > 0.0 {
        number(
            "`focus_distance`",
            &keys["focus_distance"],
            camera.focus_distance,
        )?;
    }
    if let Some(fault) = view::Fault::of(camera) {
        let help = fault.help(camera.look_at - camera.position);
        let help = if help.is_empty() {
            help
        } else {
            format!("; {help}")
        };
        return Err(format!("view: {}{help}", fault.what()));
    }
    // The loader makes one that is shorter longer.
    let longest = camera.up.abs().max_element();
    if !(SHORTEST..=1.0 / SHORTEST).contains(&longest) || !camera.up.is_finite() {
        return Err(format!(
            "`up` is too long or too short to compute with: {}",
            camera.up
        ));
    }
    Ok(())
}

fn environment(environment: &Environment) -> Fine {
    let keys = properties("environment");
    match environment {
        Environment::Constant(radiance) => vector("`radiance`", &keys["radiance"], *radiance),
        Environment::Gradient(Gradient {
            zenith,
            horizon,
            ground,
        }) => {
            let keys = &keys["gradient"]["properties"];
            vector("`zenith`", &keys["zenith"], *zenith)?;
            vector("`horizon`", &keys["horizon"], *horizon)?;
            vector("`ground`", &keys["ground"], *ground)
        }
        Environment::Sky(sky) => {
            vector("`scale`", &keys["scale"], sky.scale())?;
            number("`rotation`", &keys["rotation"], sky.rotation())?;
            picture(sky.image(), sky.is_sound())?;
            sky.check_brightest()
                .map_err(|fault| format!("image: {fault}"))
        }
    }
}

/// An image that is looked up. Whether its texels are finite and not negative is known from when it was made.
fn picture(picture: &Picture, is_sound: bool) -> Fine {
    let Picture {
        width,
        height,
        pixels,
    } = picture;
    let sides = 1..=MAX_SIDE;
    let fills = pixels.len() as u64 == u64::from(*width) * u64::from(*height);
    if !sides.contains(width) || !sides.contains(height) || !fills {
        let count = pixels.len();
        return Err(format!(
            "image has {count} texels and {width} x {height}; a side has 1 to {MAX_SIDE}"
        ));
    }
    match is_sound {
        true => Ok(()),
        false => Err(
            "image has a texel that is negative or not finite; what is looked up is neither".into(),
        ),
    }
}

fn material(material: &Material) -> Fine {
    let named = |fault| format!("material \"{}\": {fault}", material.name.escape_debug());
    of_material(material).map_err(named)
}

fn of_material(material: &Material) -> Fine {
    let kind = &material.kind;
    // First whether all is there that the rest is made of.
    if let Some(Mistake { what, help, .. }) = kind.mistake() {
        return Err(format!("{what}; {help}"));
    }
    if let Some(lacking) = kind.lacking() {
        return Err(lacking.to_owned());
    }
    let types = &schema()["properties"]["material"]["additionalProperties"]["oneOf"];
    let types = types.as_array().into_iter().flatten();
    let mut types = types.map(|schema| &schema["properties"]);
    let keys = types.find(|keys| keys["type"]["const"] == kind.name());
    let keys = keys.unwrap_or(&Schema::Null);
    vector("`emission`", &keys[EMISSION], material.emission)?;
    for (key, own) in kind.parameters() {
        value(key, &keys[key], &own)?;
    }
    for (place, textured) in material.textures.iter().enumerate() {
        let Textured { key, texture } = textured;
        let name = key.key;
        if texturable_key(kind.name(), name) != Some(*key) {
            return Err(format!(
                "`{name}` is no texture of a {} material",
                kind.name()
            ));
        }
        if material.textures[..place].iter().any(|t| t.key == *key) {
            return Err(format!("`{name}` has two textures"));
        }
        of_texture(key, &keys[name], texture)?;
        if !has_largest(material, textured) {
            return Err(format!(
                "`{name}` is a texture, and the material's own value is not its largest one"
            ));
        }
    }
    for part in kind.parts() {
        self::material(&part.material)?;
        for factor in &part.inner {
            match &factor.weight {
                Weight::Number(weight) => number("`weight`", &keys[WEIGHT], *weight)?,
                Weight::Texture(texture) => {
                    if let Some(key) = texturable_key(kind.name(), WEIGHT) {
                        of_texture(key, &keys[WEIGHT], texture)?;
                    }
                }
            }
        }
    }
    Ok(())
}

/// Whether the material has the largest value of one of its textures in the key's place.
fn has_largest(material: &Material, Textured { key, texture }: &Textured) -> bool {
    let largest = texture.largest();
    if key.key == EMISSION {
        return material.emission == largest;
    }
    let with: MaterialKind = material.kind.with(&[parameter(key, largest)]);
    with.parameters() == material.kind.parameters()
}

fn value(key: &str, schema: &Schema, value: &Value) -> Fine {
    let name = format!("`{key}`");
    match value {
        Value::Number(x) => number(&name, schema, *x),
        Value::Vector(v) => vector(&name, schema, *v),
        Value::Pair(pair) => {
            let mut numbers = pair.to_array().into_iter();
            numbers.try_for_each(|x| number(&name, &schema["items"], x))
        }
        Value::Vectors(all) => {
            let mut all = all.iter();
            all.try_for_each(|v| vector(&name, &schema["items"], *v))
        }
        // What they stand for is looked at itself.
        Value::Names(_) | Value::File { .. } => Ok(()),
        Value::Table(values) => values
            .iter()
            .try_for_each(|(key, inner)| self::value(key, &schema["properties"][*key], inner)),
    }
}

fn of_texture(key: &Texturable, schema: &Schema, texture: &Texture) -> Fine {
    let name = format!("`{}`", key.key);
    // Of a vector its channels' limits.
    let limits = if key.number { schema } else { &schema["items"] };
    let channels = if key.number { 1 } else { 3 };
    let both = [texture.least(), texture.largest()];
    for value in both.map(|value| value.to_array()) {
        let mut channels = value.into_iter().take(channels);
        channels.try_for_each(|x| number(&name, limits, x))?;
    }
    let of_patterns = &schema["properties"];
    match texture {
        Texture::Checker { size, .. } => number("`size`", &of_patterns["size"], *size),
        Texture::Noise { size, octaves, .. } => {
            number("`size`", &of_patterns["size"], *size)?;
            number("`octaves`", &of_patterns["octaves"], (*octaves).into())
        }
        Texture::Image(image) => {
            picture(image.image(), image.is_sound())?;
            match image.axis().is_normalized() {
                true => Ok(()),
                false => Err(format!("the axis of the image {name} has no direction")),
            }
        }
    }
}

/// Whether no sphere is large enough to compute with.
pub(super) fn all_tiny(spheres: &[Sphere]) -> bool {
    !spheres.is_empty() && spheres.iter().all(|sphere| sphere.radius < SHORTEST)
}

/// What that is called, and what to do about it.
pub(super) const TINY: &str = "the spheres are too small to compute with";

/// See [`TINY`].
pub(super) fn tiny_help() -> String {
    format!("one of them must have at least {SHORTEST:e}")
}

/// Of a sphere with a priority that is of that material.
pub(super) fn no_priority(material: &Material) -> String {
    let name = &material.name;
    format!("`priority` needs a dielectric, and `{name}` is none")
}

fn spheres(scene: &Scene) -> Fine {
    let keys = &schema()["properties"]["sphere"]["items"]["properties"];
    // Once, for there may be millions.
    let centers = Limits::of(&keys["center"]["items"]).rounded();
    let radii = Limits::of(&keys["radius"]).rounded();
    let within = |sphere: &Sphere| {
        let center = sphere.center.to_array();
        center.iter().all(|x| centers.hold(*x)) && radii.hold(sphere.radius)
    };
    for (place, sphere) in (1..).zip(&scene.spheres) {
        let named = |fault: String| format!("sphere {place}{fault}");
        if !within(sphere) {
            vector(": `center`", &keys["center"], sphere.center).map_err(named)?;
            number(": `radius`", &keys["radius"], sphere.radius).map_err(named)?;
        }
        let Some(material) = scene.materials.get(sphere.material) else {
            let (index, count) = (sphere.material, scene.materials.len());
            return Err(named(format!(
                " has the material of index {index}, and there are {count}"
            )));
        };
        if sphere.priority.is_some() && !material.kind.transmits() {
            return Err(named(format!(": {}", no_priority(material))));
        }
        if !sphere.motion.is_finite() {
            return Err(named(" moves by what is no number".into()));
        }
        if let Some(fault) = Fault::of(scene, sphere) {
            return Err(named(format!(" {}: {}", fault.what(), fault.help())));
        }
    }
    match all_tiny(&scene.spheres) {
        true => Err(format!("{TINY}; {}", tiny_help())),
        false => Ok(()),
    }
}

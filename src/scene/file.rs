//! The schema of a scene file: the tables, keys, units, ranges and defaults.
//!
//! These declarations are the only place that knows them. [`json_schema`] publishes them, and the
//! loader checks a file against that same schema (`scene::shape`), so what `scene schema` prints
//! is what the loader enforces. What a schema cannot say, because it concerns two values at once,
//! is in `scene::validate`.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::LazyLock;

use glam::DVec3;
use schemars::transform::RecursiveTransform;
use schemars::{JsonSchema, Schema, SchemaGenerator, generate::SchemaSettings, json_schema};
use serde::Deserialize;
use serde_json::{Value, json};
use toml::Spanned;

use crate::materials::schema::{MAX_MAGNITUDE, axis, radiance, texture, vector};
use crate::materials::{self, MaterialKind, diffuse, schemas};
use crate::particles::Format;
use crate::scene::color_map::Map;

/// The largest width and height of an image, in pixels.
pub const MAX_SIDE: u32 = 65_536;
/// The largest number of samples a pixel, and the largest sample index.
pub const MAX_SPP: u64 = 1 << 48;
/// The largest number of bounces of a path: far more than any path survives roulette for.
pub const MAX_BOUNCES: u32 = 65_535;
/// The largest number of a frame of a trajectory.
const MAX_FRAME: u64 = u32::MAX as u64;

/// A scene of spheres for gpu-trace.
///
/// Lengths are in scene units, colours are linear RGB, radiances are in W/(sr m²) per channel.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "gpu-trace scene")]
pub(super) struct SceneFile {
    /// The camera.
    pub(super) camera: CameraTable,
    /// The image.
    pub(super) image: ImageTable,
    /// Rendering options; the command line wins over them.
    #[serde(default)]
    #[schemars(with = "RenderTable")]
    pub(super) render: RenderTable,
    /// What a path sees that hits nothing; black without this table.
    #[schemars(with = "EnvironmentTable")]
    #[serde(default)]
    pub(super) environment: Option<Spanned<EnvironmentTable>>,
    /// The materials, by name.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, MaterialTable>")]
    pub(super) material: BTreeMap<Spanned<String>, MaterialTable>,
    /// The spheres.
    #[serde(default)]
    pub(super) sphere: Vec<SphereTable>,
    /// Files of particles, each of which is a sphere.
    #[serde(default)]
    pub(super) particles: Vec<ParticlesTable>,
}

/// A pinhole or thin-lens camera.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct CameraTable {
    /// Centre of the lens.
    #[schemars(schema_with = "point")]
    pub(super) position: Spanned<[f64; 3]>,
    /// A point on the view axis, different from the position.
    #[schemars(schema_with = "point")]
    pub(super) look_at: Spanned<[f64; 3]>,
    /// Upward direction, not parallel to the view axis.
    #[serde(default)]
    #[schemars(schema_with = "point", extend("default" = [0.0, 1.0, 0.0]))]
    pub(super) up: Option<Spanned<[f64; 3]>>,
    /// Vertical, full angle of view, in degrees.
    #[schemars(extend("exclusiveMinimum" = 0.0, "exclusiveMaximum" = 180.0))]
    pub(super) fov: f64,
    /// Which way image right is: forward × up ("right") or up × forward ("left").
    #[serde(default)]
    #[schemars(with = "HandednessName", extend("default" = "right"))]
    pub(super) handedness: HandednessName,
    /// Radius of the thin lens; 0 is a pinhole.
    #[serde(default)]
    #[schemars(with = "f64", range(min = 0.0, max = MAX_MAGNITUDE), extend("default" = 0.0))]
    pub(super) aperture_radius: Option<Spanned<f64>>,
    /// Distance of the plane in focus along the view axis; needed with a lens.
    #[serde(default)]
    #[schemars(with = "f64", range(max = MAX_MAGNITUDE), extend("exclusiveMinimum" = 0.0))]
    pub(super) focus_distance: Option<Spanned<f64>>,
    /// When the shutter opens and closes; spheres with a `velocity` are at center + t velocity, t from the one to
    /// the other.
    #[serde(default)]
    #[schemars(schema_with = "ends", extend("default" = [0.0, 0.0]))]
    pub(super) shutter: Option<Spanned<[f64; 2]>>,
}

/// Which way image right is.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(super) enum HandednessName {
    #[default]
    Right,
    Left,
}

/// The image.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct ImageTable {
    /// Width in pixels.
    #[schemars(range(min = 1, max = MAX_SIDE))]
    pub(super) width: u32,
    /// Height in pixels.
    #[schemars(range(min = 1, max = MAX_SIDE))]
    pub(super) height: u32,
}

/// Rendering options; the command line wins over them.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RenderTable {
    /// Samples a pixel.
    #[serde(default)]
    #[schemars(with = "u64", range(min = 1, max = MAX_SPP))]
    pub(super) spp: Option<u64>,
    /// The largest number of scattering events of a path; emission is seen after each.
    #[serde(default)]
    #[schemars(with = "u32", range(min = 0, max = MAX_BOUNCES))]
    pub(super) max_bounces: Option<u32>,
}

/// What a path sees that hits nothing: one of `radiance`, `gradient` and `image`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(extend("anyOf" = [
    { "required": ["radiance"] }, { "required": ["gradient"] }, { "required": ["image"] },
]))]
pub(super) struct EnvironmentTable {
    /// Radiance from every direction.
    #[serde(default)]
    #[schemars(schema_with = "radiance")]
    pub(super) radiance: Option<Spanned<[f64; 3]>>,
    /// Radiance by height.
    #[serde(default)]
    #[schemars(with = "GradientTable")]
    pub(super) gradient: Option<Spanned<GradientTable>>,
    /// An EXR, PNG or JPEG file of radiances, all around the axis +y; relative to the scene file's folder.
    #[serde(default)]
    #[schemars(with = "String")]
    pub(super) image: Option<Spanned<String>>,
    /// What the image's values are multiplied by: a number, or one for each channel.
    #[serde(default)]
    #[schemars(schema_with = "scale")]
    pub(super) scale: Option<Spanned<ScaleValue>>,
    /// By how much the image is turned about +y, from +x towards +z, in degrees.
    #[serde(default)]
    #[schemars(
        with = "f64",
        range(min = -MAX_MAGNITUDE, max = MAX_MAGNITUDE),
        extend("default" = 0.0)
    )]
    pub(super) rotation: Option<Spanned<f64>>,
    /// Whether the values of PNG and JPEG files are linear; without this key they are sRGB. EXR files are linear.
    #[serde(default)]
    #[schemars(with = "bool", extend("default" = false))]
    pub(super) linear: Option<Spanned<bool>>,
}

/// A number or one for each channel.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(untagged)]
pub(super) enum ScaleValue {
    Number(f64),
    Channels([f64; 3]),
}

/// Radiance by height: mix(horizon, zenith, w.y) above for the direction w, `ground` below.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct GradientTable {
    /// Radiance from straight above, +y.
    #[schemars(schema_with = "radiance")]
    pub(super) zenith: [f64; 3],
    /// Radiance from the horizon.
    #[schemars(schema_with = "radiance")]
    pub(super) horizon: [f64; 3],
    /// Radiance from everywhere below the horizon.
    #[schemars(schema_with = "radiance")]
    pub(super) ground: [f64; 3],
}

/// A material: `type` decides which other keys it has. Any material may emit.
#[derive(Debug, Deserialize)]
pub(super) struct MaterialTable {
    /// How it scatters light.
    #[serde(flatten)]
    pub(super) kind: MaterialKind,
    /// Radiance emitted on both sides of the surface.
    #[serde(default)]
    pub(super) emission: DVec3,
}

impl JsonSchema for MaterialTable {
    fn schema_name() -> Cow<'static, str> {
        "MaterialTable".into()
    }

    /// One of the materials' schemas, with what all have in common.
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let mut emission = radiance(generator);
        emission.insert("default".into(), json!([0.0, 0.0, 0.0]));
        emission.insert(
            "description".into(),
            json!("Radiance emitted on both sides of the surface."),
        );
        texture(&mut emission);
        let mut common_axis = axis(generator);
        common_axis.insert(
            "description".into(),
            json!("The axis about which images are on spheres."),
        );
        let with_common = |(name, mut schema): (&str, Schema)| {
            let object = schema.ensure_object();
            let properties = object.get_mut("properties");
            if let Some(properties) = properties.and_then(Value::as_object_mut) {
                properties.insert("type".into(), json!({ "type": "string", "const": name }));
                properties.insert("emission".into(), emission.as_value().clone());
                let axis = properties.entry("axis");
                axis.or_insert_with(|| common_axis.as_value().clone());
            }
            let required = object.entry("required").or_insert(json!([]));
            if let Some(required) = required.as_array_mut() {
                required.insert(0, "type".into());
            }
            object.insert("additionalProperties".into(), json!(false));
            object.remove("title");
            object.remove("$schema");
            schema
        };
        let variants: Vec<Schema> = schemas(generator).into_iter().map(with_common).collect();
        json_schema!({
            "description": "A material: `type` decides which other keys it has. Any material may emit.",
            "oneOf": variants,
        })
    }
}

/// A sphere.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct SphereTable {
    /// Its centre, at time 0.
    #[schemars(schema_with = "point")]
    pub(super) center: [f64; 3],
    /// Its velocity: at time t it is at center + t velocity.
    #[serde(default)]
    #[schemars(schema_with = "point", extend("default" = [0.0, 0.0, 0.0]))]
    pub(super) velocity: Option<Spanned<[f64; 3]>>,
    /// Its radius.
    #[schemars(with = "f64", range(max = MAX_MAGNITUDE), extend("exclusiveMinimum" = 0.0))]
    pub(super) radius: Spanned<f64>,
    /// The name of its material.
    #[schemars(with = "String")]
    pub(super) material: Spanned<String>,
    /// Which dielectric fills the space where several overlap: the highest wins. Without it
    /// smaller spheres win over larger ones. Only dielectric spheres may have one.
    #[serde(default)]
    #[schemars(with = "i32", range(min = i32::MIN, max = i32::MAX))]
    pub(super) priority: Option<Spanned<i32>>,
}

/// A file of particles, each of which is a sphere.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct ParticlesTable {
    /// The file, plain or gzip; relative to the scene file's folder.
    #[schemars(with = "String")]
    pub(super) file: Spanned<String>,
    /// Its format; by its ending without this key.
    #[serde(default)]
    #[schemars(schema_with = "format_names")]
    pub(super) format: Option<String>,
    /// Which frame of a trajectory; 0 is the first.
    #[serde(default)]
    #[schemars(with = "u64", range(min = 0, max = MAX_FRAME), extend("default" = 0))]
    pub(super) frame: Option<u64>,
    /// The radius: a number, the name of a column, or the elements' "vdw" or "covalent" radii in ångström.
    /// Without this key a column `radius`, else "vdw".
    #[serde(default)]
    #[schemars(schema_with = "radius")]
    pub(super) radius: Option<Spanned<RadiusValue>>,
    /// The name of the material of all; or `color_by`.
    #[serde(default)]
    #[schemars(with = "String")]
    pub(super) material: Option<Spanned<String>>,
    /// What colours them: "element", or the name of a column.
    #[serde(default)]
    #[schemars(with = "String")]
    pub(super) color_by: Option<Spanned<String>>,
    /// The colour map of a column.
    #[serde(default)]
    #[schemars(schema_with = "map_names")]
    pub(super) map: Option<Spanned<String>>,
    /// The values of the column at the map's ends; without this key its least and largest.
    #[serde(default)]
    #[schemars(schema_with = "ends")]
    pub(super) range: Option<Spanned<[f64; 2]>>,
    /// The type of the material of each colour.
    #[serde(default)]
    #[schemars(schema_with = "colored_types")]
    pub(super) material_type: Option<Spanned<String>>,
    /// From the file's coordinates to the scene's: a 4x4 matrix by rows, of a rotation, a shift and one scale
    /// for all directions.
    #[serde(default)]
    #[schemars(schema_with = "matrix")]
    pub(super) transform: Option<Spanned<[[f64; 4]; 4]>>,
    /// Which particles are kept, as in "0 < x < 10 and element != H".
    #[serde(default)]
    #[schemars(with = "String")]
    pub(super) select: Option<Spanned<String>>,
}

/// A number or a word.
#[derive(Clone, Debug, Deserialize)]
#[serde(untagged)]
pub(super) enum RadiusValue {
    Number(f64),
    Word(String),
}

fn radius(_: &mut SchemaGenerator) -> Schema {
    json_schema!({ "type": ["number", "string"], "exclusiveMinimum": 0.0, "maximum": MAX_MAGNITUDE })
}

fn scale(_: &mut SchemaGenerator) -> Schema {
    json_schema!({
        "type": ["number", "array"],
        "minimum": 0.0,
        "maximum": MAX_MAGNITUDE,
        "items": { "type": "number", "minimum": 0.0, "maximum": MAX_MAGNITUDE },
        "minItems": 3,
        "maxItems": 3,
        "default": 1.0,
    })
}

fn words<'w>(words: impl Iterator<Item = &'w str>, default: Option<&str>) -> Schema {
    let words: Vec<&str> = words.collect();
    let mut schema = json_schema!({ "type": "string", "enum": words });
    if let Some(default) = default {
        schema.insert("default".into(), json!(default));
    }
    schema
}

fn format_names(_: &mut SchemaGenerator) -> Schema {
    words(Format::ALL.iter().map(|format| format.name()), None)
}

fn map_names(_: &mut SchemaGenerator) -> Schema {
    words(
        Map::ALL.iter().map(|map| map.name()),
        Some(Map::default().name()),
    )
}

fn colored_types(_: &mut SchemaGenerator) -> Schema {
    let colored = materials::ALL
        .iter()
        .filter(|material| material.has_colors());
    words(colored.map(|material| material.name), Some(diffuse::NAME))
}

fn numbers(count: usize) -> serde_json::Value {
    json!({
        "type": "array",
        "items": { "type": "number", "minimum": -MAX_MAGNITUDE, "maximum": MAX_MAGNITUDE },
        "minItems": count,
        "maxItems": count,
    })
}

fn ends(_: &mut SchemaGenerator) -> Schema {
    let Value::Object(schema) = numbers(2) else {
        return Schema::default();
    };
    schema.into()
}

fn matrix(_: &mut SchemaGenerator) -> Schema {
    json_schema!({ "type": "array", "items": numbers(4), "minItems": 4, "maxItems": 4 })
}

fn point(_: &mut SchemaGenerator) -> Schema {
    vector(-MAX_MAGNITUDE, MAX_MAGNITUDE)
}

/// The same for the whole run of the program.
pub(super) fn schema() -> &'static serde_json::Value {
    static SCHEMA: LazyLock<serde_json::Value> = LazyLock::new(json_schema);
    &SCHEMA
}

/// The JSON schema of a scene file (draft 2020-12), without references to follow.
#[must_use]
pub fn json_schema() -> serde_json::Value {
    SchemaSettings::draft2020_12()
        .with(|settings| settings.inline_subschemas = true)
        .with_transform(RecursiveTransform(|schema: &mut Schema| {
            // TOML has no null: an absent key is absent.
            if schema
                .get("default")
                .is_some_and(serde_json::Value::is_null)
            {
                schema.remove("default");
            }
        }))
        .into_generator()
        .into_root_schema_for::<SceneFile>()
        .to_value()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_published_schema_describes_every_key() {
        fn walk(path: &str, schema: &serde_json::Value) {
            for (key, value) in schema["properties"].as_object().into_iter().flatten() {
                let path = format!("{path}.{key}");
                let described = value["description"].as_str().is_some_and(|d| !d.is_empty());
                assert!(
                    described || value["const"].is_string(),
                    "{path} has no description"
                );
                assert!(
                    value
                        .get("default")
                        .is_none_or(|default| !default.is_null()),
                    "{path}"
                );
                walk(&path, value);
                walk(&path, &value["items"]);
                for variant in value["additionalProperties"]["oneOf"]
                    .as_array()
                    .into_iter()
                    .flatten()
                {
                    walk(&path, variant);
                }
            }
            assert!(schema["properties"].is_null() || schema["additionalProperties"] == false);
        }
        let schema = json_schema();
        walk("", &schema);
        let fov = &schema["properties"]["camera"]["properties"]["fov"];
        assert_eq!(fov["exclusiveMaximum"], 180.0);
    }
}

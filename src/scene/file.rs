//! The schema of a scene file: the tables, keys, units, ranges and defaults.
//!
//! These declarations are the only place that knows them. [`json_schema`] publishes them, and the
//! loader checks a file against that same schema (`scene::shape`), so what `scene schema` prints
//! is what the loader enforces. What a schema cannot say, because it concerns two values at once,
//! is in `scene::validate`.

use std::collections::BTreeMap;

use schemars::transform::RecursiveTransform;
use schemars::{JsonSchema, Schema, generate::SchemaSettings, json_schema};
use serde::Deserialize;
use toml::Spanned;

/// The largest magnitude of any number: its square still fits the f64 in which scenes are kept,
/// and it fits the f32 of the GPU.
pub const MAX_MAGNITUDE: f64 = 1e20;
/// The largest width and height of an image, in pixels.
pub const MAX_SIDE: u32 = 65_536;
/// The largest number of samples a pixel, and the largest sample index.
pub const MAX_SPP: u64 = 1 << 48;
/// The largest number of bounces of a path: far more than any path survives roulette for.
pub const MAX_BOUNCES: u32 = 65_535;

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
    /// The constant environment; black without this table.
    #[schemars(with = "EnvironmentTable")]
    #[serde(default)]
    pub(super) environment: Option<EnvironmentTable>,
    /// The materials, by name.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, MaterialTable>")]
    pub(super) material: BTreeMap<Spanned<String>, MaterialTable>,
    /// The spheres.
    #[serde(default)]
    pub(super) sphere: Vec<SphereTable>,
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

/// A constant environment.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct EnvironmentTable {
    /// Radiance from every direction.
    #[schemars(schema_with = "radiance")]
    pub(super) radiance: [f64; 3],
}

/// A material: `type` decides which other keys it has. Any material may emit.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(
    tag = "type",
    rename_all = "lowercase",
    rename_all_fields = "snake_case",
    deny_unknown_fields
)]
pub(super) enum MaterialTable {
    /// Lambert's law: BRDF = albedo/π.
    Diffuse {
        /// Share of the light that is scattered.
        #[schemars(schema_with = "share")]
        albedo: [f64; 3],
        /// Radiance emitted on both sides of the surface.
        #[serde(default)]
        #[schemars(schema_with = "emission")]
        emission: [f64; 3],
    },
    /// A perfect mirror.
    Mirror {
        /// Share of the light that is reflected.
        #[schemars(schema_with = "share")]
        reflectance: [f64; 3],
        /// Radiance emitted on both sides of the surface.
        #[serde(default)]
        #[schemars(schema_with = "emission")]
        emission: [f64; 3],
    },
    /// Smooth glass.
    Dielectric {
        /// Absolute refractive index (vacuum 1).
        #[schemars(range(max = MAX_MAGNITUDE), extend("exclusiveMinimum" = 0.0))]
        ior: f64,
        /// Radiance emitted on both sides of the surface.
        #[serde(default)]
        #[schemars(schema_with = "emission")]
        emission: [f64; 3],
    },
    /// The lecture's reflective material: albedo/π, plus µ · specular within ε of the mirror
    /// direction.
    Reflective {
        /// Albedo of the diffuse part.
        #[schemars(schema_with = "share")]
        albedo: [f64; 3],
        /// Colour of the lobe.
        #[schemars(schema_with = "share")]
        specular: [f64; 3],
        /// Size of the lobe: one minus the cosine of its half-angle.
        #[schemars(range(max = 1.0), extend("exclusiveMinimum" = 0.0))]
        epsilon: f64,
        /// Value of the BRDF in the lobe for specular = 1, in 1/sr.
        #[schemars(range(min = 0.0, max = MAX_MAGNITUDE))]
        mu: f64,
        /// Radiance emitted on both sides of the surface.
        #[serde(default)]
        #[schemars(schema_with = "emission")]
        emission: [f64; 3],
    },
}

/// A sphere.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct SphereTable {
    /// Its centre.
    #[schemars(schema_with = "point")]
    pub(super) center: [f64; 3],
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

fn vector(minimum: f64, maximum: f64) -> Schema {
    json_schema!({
        "type": "array",
        "items": { "type": "number", "minimum": minimum, "maximum": maximum },
        "minItems": 3,
        "maxItems": 3,
    })
}

fn point(_: &mut schemars::SchemaGenerator) -> Schema {
    vector(-MAX_MAGNITUDE, MAX_MAGNITUDE)
}

fn share(_: &mut schemars::SchemaGenerator) -> Schema {
    vector(0.0, 1.0)
}

fn radiance(_: &mut schemars::SchemaGenerator) -> Schema {
    vector(0.0, MAX_MAGNITUDE)
}

fn emission(generator: &mut schemars::SchemaGenerator) -> Schema {
    let mut schema = radiance(generator);
    schema.insert("default".to_owned(), serde_json::json!([0.0, 0.0, 0.0]));
    schema
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

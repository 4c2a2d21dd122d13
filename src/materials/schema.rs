//! Schemas of numbers in scene files, with their limits.

use glam::DVec3;
use schemars::{Schema, SchemaGenerator, json_schema};
use serde_json::json;

use super::Mistake;

/// The largest magnitude of any number: its square still fits the f64 in which scenes are kept,
/// and it fits the f32 of the GPU.
pub const MAX_MAGNITUDE: f64 = 1e20;

/// Three numbers within these limits.
#[must_use]
pub fn vector(minimum: f64, maximum: f64) -> Schema {
    json_schema!({
        "type": "array",
        "items": { "type": "number", "minimum": minimum, "maximum": maximum },
        "minItems": 3,
        "maxItems": 3,
    })
}

/// A share of the light, by channel; it may be a texture.
pub fn share(generator: &mut SchemaGenerator) -> Schema {
    let mut schema = plain_share(generator);
    texture(&mut schema);
    schema
}

/// A share of the light, by channel, that is no texture.
pub fn plain_share(_: &mut SchemaGenerator) -> Schema {
    vector(0.0, 1.0)
}

/// The least size of a texture's cells: their number across the largest sphere is an f32.
const LEAST_SIZE: f64 = 1e-18;

/// The most octaves of a noise: beyond, they are below the digits of an f32.
pub const MOST_OCTAVES: u32 = 16;

/// Lets a colour or a number, of which this is the schema, be a texture as well: a table of `image`, `checker` or
/// `noise`. What has been through this is [texturable](super::texturable).
pub fn texture(schema: &mut Schema) {
    let mut value = schema.clone();
    value.remove("default");
    let pair = json!({ "type": "array", "items": value, "minItems": 2, "maxItems": 2 });
    let described = |mut schema: serde_json::Value, text: &str| {
        schema["description"] = json!(text);
        schema
    };
    let properties = json!({
        "image": {
            "type": "string",
            "description": "An EXR, PNG or JPEG file about the material's axis; relative to the scene file's folder.",
        },
        "linear": {
            "type": "boolean",
            "default": false,
            "description": "Whether the values of PNG and JPEG files are linear; without this key they are sRGB.",
        },
        "checker": described(pair.clone(), "The values of the cells of a cubic lattice about the sphere's centre, in turn."),
        "noise": described(pair, "The values between which a gradient noise on the offset from the sphere's centre varies."),
        "size": {
            "type": "number",
            "minimum": LEAST_SIZE,
            "maximum": MAX_MAGNITUDE,
            "default": 0.5,
            "description": "The size of a cell of `checker`, or of the coarsest cells of `noise`, in scene units.",
        },
        "octaves": {
            "type": "integer",
            "minimum": 1,
            "maximum": MOST_OCTAVES,
            "default": 4,
            "description": "How many noises are summed, each of half the size and half the strength of the one before.",
        },
    });
    let kind = schema.get("type").cloned().unwrap_or_default();
    schema.insert("type".into(), json!([kind, "object"]));
    schema.insert("properties".into(), properties);
    schema.insert("additionalProperties".into(), json!(false));
}

/// A radiance.
pub fn radiance(_: &mut SchemaGenerator) -> Schema {
    vector(0.0, MAX_MAGNITUDE)
}

/// What a medium absorbs per unit length, and its default.
pub fn absorption(_: &mut SchemaGenerator) -> Schema {
    let mut schema = vector(0.0, MAX_MAGNITUDE);
    schema.insert("default".into(), serde_json::json!([0.0, 0.0, 0.0]));
    schema
}

/// An axis, and its default.
pub fn axis(_: &mut SchemaGenerator) -> Schema {
    let mut schema = vector(-MAX_MAGNITUDE, MAX_MAGNITUDE);
    schema.insert("default".into(), serde_json::json!([0.0, 1.0, 0.0]));
    schema
}

/// The default of an axis.
#[must_use]
pub fn up() -> DVec3 {
    DVec3::Y
}

/// The unit vector along an axis, not 0, that may be so short that its square is no f64.
#[must_use]
pub fn along(axis: DVec3) -> DVec3 {
    (axis / axis.abs().max_element()).normalize()
}

/// What is wrong with an axis.
#[must_use]
pub fn axis_mistake(axis: DVec3) -> Option<Mistake> {
    (axis == DVec3::ZERO).then_some(Mistake {
        key: "axis",
        what: "`axis` has no direction: its length is 0",
        help: "`axis = [0.0, 1.0, 0.0]` is the default",
    })
}

//! Schemas of numbers in scene files, with their limits.

use glam::DVec3;
use schemars::{Schema, SchemaGenerator, json_schema};

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

/// A share of the light, by channel.
pub fn share(_: &mut SchemaGenerator) -> Schema {
    vector(0.0, 1.0)
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

/// What is wrong with an axis.
#[must_use]
pub fn axis_mistake(axis: DVec3) -> Option<Mistake> {
    (axis == DVec3::ZERO).then_some(Mistake {
        key: "axis",
        what: "`axis` has no direction: its length is 0",
        help: "`axis = [0.0, 1.0, 0.0]` is the default",
    })
}

//! What writing and reading of EXR files agree on. Layers follow the convention that every viewer
//! knows: channel `R` of the layer `stderr` is the channel `stderr.R`.

use exr::math::Vec2;
use exr::meta::attribute::Chromaticities;

/// Precedes the names of our attributes, which keeps them apart from those of the standard.
pub const ATTRIBUTE_PREFIX: &str = "gpu-trace:";

/// The layer with the standard error of each value.
pub const STDERR: &str = "stderr";

/// The channels of a colour.
pub const RGB: &[&str] = &["R", "G", "B"];

/// A channel's name in the file; an empty `layer` is none.
#[must_use]
pub fn channel_name(layer: &str, channel: &str) -> String {
    match layer {
        "" => channel.to_owned(),
        layer => format!("{layer}.{channel}"),
    }
}

/// The layer of a channel of that name: what stands before the last point.
#[must_use]
pub fn layer_of(name: &str) -> &str {
    name.rsplit_once('.').map_or("", |(layer, _)| layer)
}

/// What readers assume where a file does not say so.
pub(crate) const REC_709: Chromaticities = Chromaticities {
    red: Vec2(0.64, 0.33),
    green: Vec2(0.30, 0.60),
    blue: Vec2(0.15, 0.06),
    white: Vec2(0.3127, 0.3290),
};

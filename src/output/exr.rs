//! OpenEXR: linear 32-bit floats, bit for bit, with layers and attributes.
//!
//! One part, scan lines, ZIP compression (lossless).

use std::collections::HashSet;
use std::io::{self, Cursor};

use exr::meta::attribute::{AttributeValue, Text};
use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, Layer as ExrLayer,
    LayerAttributes, LineOrder, Vec2, WritableImage,
};

use super::{Metadata, Value};
use crate::image::Picture;
use crate::image::exr::{ATTRIBUTE_PREFIX, REC_709, RGB, channel_name};

/// Channels that belong together, beside the image itself.
#[derive(Clone, Copy, Debug)]
pub struct Layer<'a> {
    /// As in `stderr`; empty for channels without a layer.
    pub name: &'a str,
    /// The channels, as in `["R", "G", "B"]`, `["X", "Y", "Z"]` or `["Z"]`.
    pub channels: &'a [&'a str],
    /// The values of all channels of a pixel, then the next pixel, row by row from the top left:
    /// `width * height * channels.len()` values. `pixels.as_flattened()` makes them of arrays.
    pub values: &'a [f32],
}

/// The bytes of an EXR file with the picture as `R G B`, the channels of `layers`, the attribute
/// `software`, and each entry of the metadata as the attribute `gpu-trace:NAME`: a `double` for a
/// number, an `int` for an integer or, beyond that type's range, its digits as a `string`.
///
/// The order of attributes in the file varies from run to run: compare pixels, not bytes.
///
/// # Errors
/// If a layer has another size than the picture, a channel name is empty or used twice, or the size
/// is beyond what EXR can hold.
pub fn encode(picture: &Picture, layers: &[Layer<'_>], metadata: &Metadata) -> io::Result<Vec<u8>> {
    let main = Layer {
        name: "",
        channels: RGB,
        values: picture.pixels.as_flattened(),
    };
    let mut names = HashSet::new();
    let mut channels = Vec::new();
    for layer in std::iter::once(&main).chain(layers) {
        if layer.values.len() != picture.pixels.len() * layer.channels.len() {
            return Err(invalid(format!(
                "the layer '{}' has another size",
                layer.name
            )));
        }
        for (index, channel) in layer.channels.iter().enumerate() {
            let name = channel_name(layer.name, channel);
            if channel.is_empty() || !names.insert(name.clone()) {
                return Err(invalid(format!(
                    "the channel name '{name}' is empty or used twice"
                )));
            }
            let stride = layer.channels.len();
            let samples = layer
                .values
                .iter()
                .skip(index)
                .step_by(stride)
                .copied()
                .collect();
            channels.push(AnyChannel::new(text(&name), FlatSamples::F32(samples)));
        }
    }

    let size = Vec2(picture.width as usize, picture.height as usize);
    let encoding = Encoding {
        compression: Compression::ZIP16,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let channels = AnyChannels::sort(channels.into_iter().collect());
    let layer = ExrLayer::new(size, attributes(metadata), encoding, channels);
    let mut image = Image::from_layer(layer);
    image.attributes.chromaticities = Some(REC_709);

    let mut bytes = Cursor::new(Vec::new());
    image
        .write()
        .to_buffered(&mut bytes)
        .map_err(|error| match error {
            exr::error::Error::Io(error) => error,
            other => io::Error::other(other),
        })?;
    Ok(bytes.into_inner())
}

fn attributes(metadata: &Metadata) -> LayerAttributes {
    let mut attributes = LayerAttributes {
        software_name: Some(text(Metadata::SOFTWARE)),
        ..LayerAttributes::default()
    };
    for (name, value) in metadata.entries() {
        let value = match value {
            Value::Text(value) => AttributeValue::Text(text(value)),
            Value::Number(value) => AttributeValue::F64(*value),
            Value::Integer(value) => i32::try_from(*value).map_or_else(
                |_| AttributeValue::Text(text(&value.to_string())),
                AttributeValue::I32,
            ),
        };
        attributes
            .other
            .insert(text(&format!("{ATTRIBUTE_PREFIX}{name}")), value);
    }
    attributes
}

/// EXR asks for UTF-8, which the crate takes for bytes.
fn text(text: &str) -> Text {
    Text::from_slice_unchecked(text.as_bytes())
}

fn invalid(text: String) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, text)
}

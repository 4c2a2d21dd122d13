//! EXR of any origin: scan lines or tiles, any compression that the crate knows, halves, floats or
//! integers, one part or several.
//!
//! The image is the display window. Colours are as they are stored, which for EXR is linear and
//! multiplied by alpha.

use std::collections::{BTreeMap, HashSet};
use std::io::{self, Cursor};

use exr::block::UncompressedBlock;
use exr::block::reader::{ChunksReader as _, Reader};
use exr::compression::Compression;
use exr::meta::attribute::{AttributeValue, SampleType, Text};
use exr::meta::header::Header;
use exr::prelude::{Vec2, f16};

use super::{Encoding, Input, check_size};
use crate::error::{invalid, shown};
use crate::image::exr::{ATTRIBUTE_PREFIX, REC_709, STDERR, channel_name, layer_of};
use crate::image::{Format, Picture};

type Source<'a> = Reader<Cursor<&'a [u8]>>;

/// Reads the one colour image that the file holds, of at most `most` pixels, and the layer `stderr` beside it.
pub(super) fn decode(bytes: &[u8], most: u64) -> io::Result<Input> {
    let reader = exr::block::read(Cursor::new(bytes), false).map_err(corrupt)?;
    let choice = choose(reader.headers())?;
    let header = reader.headers()[choice.part].clone();
    let window = Window::of(&header)?;
    let pixel_bytes = header.channels.list.iter();
    let pixel_bytes = pixel_bytes.map(|c| c.sample_type.bytes_per_sample() as u64);
    let Vec2(width, height) = header.layer_size;
    check_size(
        width as u64,
        height as u64,
        pixel_bytes.sum::<u64>().max(12),
        ratio(header.compression),
        bytes.len(),
        most,
    )?;
    let mut wanted = choice.colour.to_vec();
    wanted.extend(choice.stderr.iter().flatten());
    let planes = read_planes(reader, choice.part, &header, &wanted)?;
    let picture = |first: usize| {
        let (width, height) = (window.width, window.height);
        let pixel = |i: usize| {
            let at = window.index(i % width as usize, i / width as usize);
            [0, 1, 2].map(|c| planes[first + c][at])
        };
        let count = width as usize * height as usize;
        Picture::new(width, height, (0..count).map(pixel).collect())
    };
    let mut input = Input::new(Format::Exr, Encoding::Linear, picture(0));
    input.stderr = choice.stderr.map(|_| picture(3));
    input.about = about(&header);
    input.notes = notes(&header, &choice);
    Ok(input)
}

/// What a compression packs by, at most: deflate 1032; the others less but for DWA, which deflates
/// what it has packed already.
fn ratio(compression: Compression) -> u64 {
    match compression {
        Compression::DWAA(_) | Compression::DWAB(_) => 1 << 15,
        _ => 1032,
    }
}

/// Where the colours are.
struct Choice {
    part: usize,
    /// Indices of the channels of red, green and blue; three times the same for grey.
    colour: [usize; 3],
    /// The same of the layer `stderr`.
    stderr: Option<[usize; 3]>,
    /// How many further channels this part has, besides alpha.
    others: usize,
}

/// The one image in RGB or grey: channels without a layer if there are such, else the only layer.
fn choose(headers: &[Header]) -> io::Result<Choice> {
    let flat = || {
        headers
            .iter()
            .enumerate()
            .filter(|(_, header)| !header.deep)
    };
    let mut found: Vec<(String, Choice)> = Vec::new();
    for (part, header) in flat() {
        let names: Vec<String> = header
            .channels
            .list
            .iter()
            .map(|c| c.name.to_string())
            .collect();
        let mut layers: Vec<&str> = names.iter().map(|name| layer_of(name)).collect();
        layers.sort_unstable();
        layers.dedup();
        // Channels without a layer are the image; the layers beside them belong to it.
        if layers.contains(&"") && channels(&names, "").is_some() {
            layers = vec![""];
        }
        let stderr = channels(&names, STDERR);
        for layer in layers.into_iter().filter(|&layer| layer != STDERR) {
            let Some(colour) = channels(&names, layer) else {
                continue;
            };
            let mut used = colour.to_vec();
            used.extend(stderr.iter().flatten());
            let part_name = header.own_attributes.layer_name.as_ref();
            let part_name = part_name.map_or(String::new(), Text::to_string);
            let name = [part_name.as_str(), layer].join(".");
            let further = |(index, name): &(usize, &String)| *name != "A" && !used.contains(index);
            let others = names.iter().enumerate().filter(further).count();
            found.push((
                shown(name.trim_matches('.')),
                Choice {
                    part,
                    colour,
                    stderr,
                    others,
                },
            ));
        }
    }
    if found.len() > 1 {
        let names: Vec<&str> = found
            .iter()
            .take(8)
            .map(|(name, _)| name.as_str())
            .collect();
        return Err(invalid(format!(
            "it holds several images: {}; save one of them in a file of its own",
            names.join(", ")
        )));
    }
    match found.pop() {
        Some((_, choice)) => {
            let list = &headers[choice.part].channels.list;
            if choice
                .colour
                .iter()
                .any(|&c| list[c].sampling != Vec2(1, 1))
            {
                return Err(invalid(
                    "its channels are subsampled, which is not supported",
                ));
            }
            Ok(choice)
        }
        None if flat().next().is_none() => Err(invalid("it holds deep data, which is no image")),
        None => Err(invalid(
            "it has neither the channels R, G and B nor Y alone",
        )),
    }
}

/// The indices of a layer's red, green and blue, or three times its grey.
fn channels(names: &[String], layer: &str) -> Option<[usize; 3]> {
    let find = |channel: &str| {
        let name = channel_name(layer, channel);
        names.iter().position(|n| n.eq_ignore_ascii_case(&name))
    };
    match [find("R"), find("G"), find("B")] {
        [Some(red), Some(green), Some(blue)] => Some([red, green, blue]),
        // With RY and BY it would be chroma, not grey.
        _ if find("RY").is_some() || find("BY").is_some() => None,
        _ => find("Y").map(|grey| [grey; 3]),
    }
}

/// Where the image lies in the pixels that the file holds.
struct Window {
    width: u32,
    height: u32,
    /// Columns and rows of the data left of and above the image.
    left: usize,
    top: usize,
    /// Columns of the data.
    stride: usize,
}

impl Window {
    fn of(header: &Header) -> io::Result<Self> {
        let display = header.shared_attributes.display_window;
        let data = (header.own_attributes.layer_position, header.layer_size);
        let inside = |axis: fn(Vec2<i64>) -> i64| {
            let wide = |v: Vec2<i32>| axis(Vec2(v.0.into(), v.1.into()));
            let size = |v: Vec2<usize>| axis(Vec2(v.0 as i64, v.1 as i64));
            let before = wide(display.position).checked_sub(wide(data.0))?;
            let after = size(data.1)
                .checked_sub(before)?
                .checked_sub(size(display.size))?;
            (before >= 0 && after >= 0).then_some(before as usize)
        };
        let sizes = (u32::try_from(display.size.0), u32::try_from(display.size.1));
        match (inside(|v| v.0), inside(|v| v.1), sizes) {
            (Some(left), Some(top), (Ok(width), Ok(height))) if width > 0 && height > 0 => {
                Ok(Self {
                    width,
                    height,
                    left,
                    top,
                    stride: data.1.0,
                })
            }
            _ => Err(invalid(format!(
                "its data window, {}x{} pixels at {},{}, does not cover its display window, {}x{} \
                 at {},{}: the image is not whole",
                data.1.0,
                data.1.1,
                data.0.0,
                data.0.1,
                display.size.0,
                display.size.1,
                display.position.0,
                display.position.1
            ))),
        }
    }

    /// The index of a pixel of the image in the data.
    fn index(&self, x: usize, y: usize) -> usize {
        (self.top + y) * self.stride + self.left + x
    }
}

/// The values of the wanted channels, each of the size of the data window.
fn read_planes(
    reader: Source<'_>,
    part: usize,
    header: &Header,
    wanted: &[usize],
) -> io::Result<Vec<Vec<f32>>> {
    let Vec2(width, height) = header.layer_size;
    let chunks = reader
        .filter_chunks(false, |_, tile, block| {
            block.layer == part && tile.level_index == Vec2(0, 0)
        })
        .map_err(corrupt)?;
    let mut planes = vec![vec![0.0; width * height]; wanted.len()];
    let mut seen = HashSet::new();
    let mut filled = 0;
    for block in chunks.sequential_decompressor(false) {
        let block = block.map_err(corrupt)?;
        let Vec2(x, y) = block.index.pixel_position;
        let size = block.index.pixel_size;
        let fits = x + size.0 <= width && y + size.1 <= height;
        // Offsets that are damaged lead to blocks of something else, or twice to the same.
        if block.index.layer != part || block.index.level != Vec2(0, 0) || !fits {
            return Err(invalid("its table of blocks is damaged"));
        }
        if !seen.insert((x, y)) {
            return Err(invalid("it holds a block of pixels twice"));
        }
        filled += size.0 * size.1;
        copy_lines(&block, header, wanted, &mut planes)?;
    }
    if filled != width * height {
        return Err(invalid("blocks of its pixels are missing"));
    }
    Ok(planes)
}

fn copy_lines(
    block: &UncompressedBlock,
    header: &Header,
    wanted: &[usize],
    planes: &mut [Vec<f32>],
) -> io::Result<()> {
    let width = header.layer_size.0;
    for line in block.lines(&header.channels) {
        let at = line.location;
        let start = at.position.1 * width + at.position.0;
        let samples: Result<Vec<f32>, _> = match header.channels.list[at.channel].sample_type {
            _ if !wanted.contains(&at.channel) => continue,
            SampleType::F32 => line.read_samples::<f32>().collect(),
            SampleType::F16 => line
                .read_samples::<f16>()
                .map(|v| Ok(v?.to_f32()))
                .collect(),
            SampleType::U32 => line.read_samples::<u32>().map(|v| Ok(v? as f32)).collect(),
        };
        let samples = samples.map_err(corrupt)?;
        for (plane, _) in planes
            .iter_mut()
            .zip(wanted)
            .filter(|(_, w)| **w == at.channel)
        {
            plane[start..start + samples.len()].copy_from_slice(&samples);
        }
    }
    Ok(())
}

/// Our own attributes, without their prefix.
fn about(header: &Header) -> BTreeMap<String, String> {
    let own = header.own_attributes.other.iter();
    own.chain(&header.shared_attributes.other)
        .filter_map(|(name, value)| {
            let name = name.to_string().strip_prefix(ATTRIBUTE_PREFIX)?.to_owned();
            let value = match value {
                AttributeValue::Text(text) => text.to_string(),
                AttributeValue::F64(number) => number.to_string(),
                AttributeValue::F32(number) => number.to_string(),
                AttributeValue::I32(number) => number.to_string(),
                _ => return None,
            };
            Some((name, value))
        })
        .collect()
}

fn notes(header: &Header, choice: &Choice) -> Vec<String> {
    let mut notes = Vec::new();
    let near = |a: Vec2<f32>, b: Vec2<f32>| (a.0 - b.0).abs() < 0.005 && (a.1 - b.1).abs() < 0.005;
    if header.shared_attributes.chromaticities.is_some_and(|c| {
        !(near(c.red, REC_709.red) && near(c.green, REC_709.green) && near(c.blue, REC_709.blue))
    }) {
        notes.push("its primaries are not those of sRGB: compared channel by channel".into());
    }
    if choice.others > 0 {
        notes.push(format!("{} further channels are left out", choice.others));
    }
    let window = &header.shared_attributes.display_window;
    if window.size != header.layer_size {
        notes.push("pixels outside its display window are left out".into());
    }
    notes
}

fn corrupt(error: exr::error::Error) -> io::Error {
    match error {
        exr::error::Error::Io(error) if error.kind() != io::ErrorKind::UnexpectedEof => error,
        exr::error::Error::Io(_) => invalid("the file ends early"),
        other => invalid(shown(&other.to_string())),
    }
}

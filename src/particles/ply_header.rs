//! What the header of a PLY file says: encoding, elements and their properties.
//!
//! Source: G. Turk, "The PLY Polygon File Format" (1994), with the types' later names (`int8`, `float32`).

use super::lines::{Line, Lines, whole};
use super::mistake::{Mistake, word as shown};

/// The longest header, in properties.
const MOST_PROPERTIES: usize = 10_000;

/// How values are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// The type of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

/// What an element has.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Property {
    /// One number with a name.
    Scalar(String, Scalar),
    /// A count of this type, and as many numbers of that.
    List(Scalar, Scalar),
}

/// A kind of things in the file, one after the other.
pub(super) struct Group<'a> {
    pub(super) name: &'a [u8],
    pub(super) count: u64,
    pub(super) properties: Vec<Property>,
    /// The line that announces it.
    pub(super) line: Line<'a>,
}

/// The header.
pub(super) struct Header<'a> {
    pub(super) encoding: Encoding,
    pub(super) groups: Vec<Group<'a>>,
}

impl Scalar {
    fn of_name(name: &[u8]) -> Option<Self> {
        match name {
            b"char" | b"int8" => Some(Self::I8),
            b"uchar" | b"uint8" => Some(Self::U8),
            b"short" | b"int16" => Some(Self::I16),
            b"ushort" | b"uint16" => Some(Self::U16),
            b"int" | b"int32" => Some(Self::I32),
            b"uint" | b"uint32" => Some(Self::U32),
            b"float" | b"float32" => Some(Self::F32),
            b"double" | b"float64" => Some(Self::F64),
            _ => None,
        }
    }

    /// Its length in bytes.
    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// The number that begins `bytes`, if they are enough.
    pub(super) fn read(self, bytes: &[u8], big: bool) -> Option<f64> {
        let mut ordered = [0; 8];
        let size = self.size();
        ordered[..size].copy_from_slice(bytes.get(..size)?);
        if big {
            ordered[..size].reverse();
        }
        let [a, b, c, d, ..] = ordered;
        Some(match self {
            Self::I8 => i8::from_le_bytes([a]).into(),
            Self::U8 => a.into(),
            Self::I16 => i16::from_le_bytes([a, b]).into(),
            Self::U16 => u16::from_le_bytes([a, b]).into(),
            Self::I32 => i32::from_le_bytes([a, b, c, d]).into(),
            Self::U32 => u32::from_le_bytes([a, b, c, d]).into(),
            Self::F32 => f32::from_le_bytes([a, b, c, d]).into(),
            Self::F64 => f64::from_le_bytes(ordered),
        })
    }
}

impl<'a> Header<'a> {
    /// Reads the lines up to `end_header`.
    pub(super) fn read(lines: &mut Lines<'a>) -> Result<Self, Mistake> {
        let first = lines.want(|| "`ply`".into())?;
        if first.bytes.trim_ascii() != b"ply" {
            return Err(first.mistake("a PLY file begins with the line `ply`"));
        }
        let mut encoding = None;
        let mut groups: Vec<Group<'a>> = Vec::new();
        let mut properties = 0;
        loop {
            let line = lines.want(|| "`end_header`".into())?;
            let words: Vec<&[u8]> = line.words().take(6).collect();
            match words[..] {
                [] | [b"comment" | b"obj_info", ..] => {}
                [b"format", name, version] => {
                    encoding = Some(match (name, version) {
                        (b"ascii", b"1.0") => Encoding::Ascii,
                        (b"binary_little_endian", b"1.0") => Encoding::LittleEndian,
                        (b"binary_big_endian", b"1.0") => Encoding::BigEndian,
                        _ => {
                            return Err(line.mistake(
                                "wanted ascii, binary_little_endian or binary_big_endian, and 1.0",
                            ));
                        }
                    });
                }
                [b"element", name, count] => groups.push(Group {
                    name,
                    count: whole(count)
                        .ok_or_else(|| line.mistake("wanted the number of elements"))?,
                    properties: Vec::new(),
                    line,
                }),
                [b"property", ref rest @ ..] => {
                    let group = groups.last_mut().ok_or_else(|| {
                        line.mistake("wanted `element` before the first property")
                    })?;
                    properties += 1;
                    if properties > MOST_PROPERTIES {
                        return Err(line
                            .mistake(format!("there are more than {MOST_PROPERTIES} properties")));
                    }
                    group.properties.push(property(line, rest)?);
                }
                [b"end_header"] => {
                    let encoding =
                        encoding.ok_or_else(|| line.mistake("wanted `format` before this"))?;
                    return Ok(Self { encoding, groups });
                }
                [word, ..] => {
                    return Err(line.mistake(format!(
                        "`{}` and what follows it is no line of a header",
                        shown(word)
                    )));
                }
            }
        }
    }
}

fn property(line: Line<'_>, words: &[&[u8]]) -> Result<Property, Mistake> {
    let scalar = |name: &[u8]| {
        Scalar::of_name(name)
            .ok_or_else(|| line.mistake(format!("the type `{}` is not known", shown(name))))
    };
    match words {
        [b"list", count, item, _] => {
            let count = scalar(count)?;
            if matches!(count, Scalar::F32 | Scalar::F64) {
                return Err(line.mistake("wanted a whole type for the length of a list"));
            }
            Ok(Property::List(count, scalar(item)?))
        }
        [kind, name] => Ok(Property::Scalar(
            String::from_utf8_lossy(name).into_owned(),
            scalar(kind)?,
        )),
        _ => Err(line.mistake("wanted `property type name` or `property list type type name`")),
    }
}

//! PLY: the element `vertex`, whose properties `x`, `y` and `z` are positions and whose other numbers are columns;
//! as text, one vertex a line, or binary of either byte order. Lists and other elements are left out.
//!
//! Source: as of the header (`ply_header`).

use super::Particles;
use super::lines::{Lines, whole};
use super::mistake::{Mistake, word as shown};
use super::ply_header::{Encoding, Group, Header, Property, Scalar};
use super::table::{Kind, Table};

pub(super) fn parse(bytes: &[u8]) -> Result<Particles, Mistake> {
    let mut lines = Lines::new(bytes);
    let header = Header::read(&mut lines)?;
    let place = header
        .groups
        .iter()
        .position(|group| group.name == b"vertex");
    let Some(place) = place else {
        return Err(lines
            .last()
            .mistake("the header ends without `element vertex`"));
    };
    let (before, vertex) = (&header.groups[..place], &header.groups[place]);
    let columns = vertex.properties.iter().map(|property| match property {
        Property::Scalar(name, _) if ["x", "y", "z"].contains(&name.as_str()) => {
            (name.clone(), Kind::Coordinate)
        }
        Property::Scalar(name, _) => (name.clone(), Kind::Number),
        Property::List(..) => (String::new(), Kind::Skipped),
    });
    let mut table = Table::new(columns.collect()).map_err(|fault| vertex.line.mistake(fault))?;
    let last = place + 1 == header.groups.len();
    match header.encoding {
        Encoding::Ascii => {
            for group in before {
                lines.skip(group.count, &format!("element `{}`", shown(group.name)))?;
            }
            read_text(&mut lines, vertex, &mut table, last)?;
        }
        Encoding::LittleEndian | Encoding::BigEndian => {
            let mut data = Data {
                bytes,
                at: bytes.len() - lines.rest().len(),
                big: header.encoding == Encoding::BigEndian,
            };
            for group in before {
                data.skip(group)?;
            }
            data.read(vertex, &mut table)?;
            // Some programs end the file as if it were text.
            if last && !data.rest().trim_ascii().is_empty() {
                return Err(Mistake::at_byte(
                    data.at,
                    format!("the file goes on behind its {} vertices", vertex.count),
                ));
            }
        }
    }
    Ok(table.finish(false))
}

fn read_text(
    lines: &mut Lines<'_>,
    vertex: &Group<'_>,
    table: &mut Table,
    last: bool,
) -> Result<(), Mistake> {
    for index in 0..vertex.count {
        let line = lines.want(|| format!("vertex {} of {}", index + 1, vertex.count))?;
        let mut words = line.words();
        for (column, property) in vertex.properties.iter().enumerate() {
            let short = || line.mistake("the vertex has fewer values than the header names");
            let word = words.next().ok_or_else(short)?;
            let Property::List(..) = property else {
                table
                    .push(column, word)
                    .map_err(|fault| line.mistake(fault))?;
                continue;
            };
            let length = whole(word)
                .ok_or_else(|| line.mistake("wanted the length of a list, a whole number"))?;
            for _ in 0..length {
                words.next().ok_or_else(short)?;
            }
        }
        if words.next().is_some() {
            return Err(line.mistake("the vertex has more values than the header names"));
        }
    }
    match lines.peek_filled()? {
        Some(line) if last => Err(line.mistake(format!(
            "the file goes on behind its {} vertices",
            vertex.count
        ))),
        _ => Ok(()),
    }
}

/// The binary part of a file.
struct Data<'a> {
    bytes: &'a [u8],
    at: usize,
    big: bool,
}

impl<'a> Data<'a> {
    fn rest(&self) -> &'a [u8] {
        &self.bytes[self.at..]
    }

    fn ended(&self, group: &Group<'_>, index: u64) -> Mistake {
        Mistake::at_byte(
            self.bytes.len(),
            format!(
                "the file ends within element {} of {} of `{}`",
                index.saturating_add(1),
                group.count,
                shown(group.name)
            ),
        )
    }

    /// The next number; `None` at the end.
    fn take(&mut self, scalar: Scalar) -> Option<f64> {
        let value = scalar.read(self.rest(), self.big)?;
        self.at += scalar.size();
        Some(value)
    }

    /// Leaves out a list; `None` at the end.
    fn skip_list(&mut self, count: Scalar, item: Scalar) -> Option<()> {
        // A negative length is none, and far beyond the end.
        let length = self.take(count).filter(|length| *length >= 0.0)? as usize;
        self.advance(length.checked_mul(item.size())?)
    }

    fn advance(&mut self, length: usize) -> Option<()> {
        self.at = self
            .at
            .checked_add(length)
            .filter(|at| *at <= self.bytes.len())?;
        Some(())
    }

    /// Leaves out all elements of a group.
    fn skip(&mut self, group: &Group<'_>) -> Result<(), Mistake> {
        let fixed: Option<usize> = group
            .properties
            .iter()
            .map(|property| match property {
                Property::Scalar(_, scalar) => Some(scalar.size()),
                Property::List(..) => None,
            })
            .sum();
        if let Some(size) = fixed {
            let length = usize::try_from(group.count).ok();
            let length = length.and_then(|count| count.checked_mul(size));
            return length
                .and_then(|length| self.advance(length))
                .ok_or_else(|| self.ended(group, group.count.saturating_sub(1)));
        }
        for index in 0..group.count {
            for property in &group.properties {
                match property {
                    Property::Scalar(_, scalar) => self.advance(scalar.size()),
                    Property::List(count, item) => self.skip_list(*count, *item),
                }
                .ok_or_else(|| self.ended(group, index))?;
            }
        }
        Ok(())
    }

    fn read(&mut self, vertex: &Group<'_>, table: &mut Table) -> Result<(), Mistake> {
        for index in 0..vertex.count {
            for (column, property) in vertex.properties.iter().enumerate() {
                let start = self.at;
                match property {
                    Property::Scalar(_, scalar) => {
                        let value = self.take(*scalar);
                        let value = value.ok_or_else(|| self.ended(vertex, index))?;
                        table.push_number(column, value).map_err(|fault| {
                            Mistake::at_byte(
                                start,
                                format!("{fault}, in vertex {index} (0 is the first)"),
                            )
                        })?;
                    }
                    Property::List(count, item) => self
                        .skip_list(*count, *item)
                        .ok_or_else(|| self.ended(vertex, index))?,
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;

//! XYZ: a count, a comment, and for each particle `symbol x y z` and more; frame after frame.
//!
//! Extended XYZ names its columns in the comment (`xyz_properties`). Source:
//! <https://github.com/libAtoms/extxyz>. Plain XYZ has no names for what follows the position: these numbers
//! are `column_5` and so on, counted in words of the line, where every particle has them.

use super::Particles;
use super::lines::{Line, Lines, whole};
use super::mistake::{Mistake, word as shown};
use super::table::{Kind, Table};
use super::xyz_properties::properties;

/// What the first line of a frame holds.
const COUNT: &str = "the number of particles";

pub(super) fn parse(bytes: &[u8], frame: u64) -> Result<Particles, Mistake> {
    let mut lines = Lines::new(bytes);
    for index in 0.. {
        let Some(count) = begin(&mut lines, index)? else {
            return Err(Mistake::no_frame(index, frame));
        };
        if index == frame {
            return read(&mut lines, count);
        }
        skip(&mut lines, count)?;
    }
    Err(Mistake::no_frame(u64::MAX, frame))
}

pub(super) fn frames(bytes: &[u8]) -> Result<u64, Mistake> {
    let mut lines = Lines::new(bytes);
    let mut frames = 0;
    while let Some(count) = begin(&mut lines, frames)? {
        skip(&mut lines, count)?;
        frames += 1;
    }
    Ok(frames)
}

/// The number of particles of the next frame, if there is one.
fn begin(lines: &mut Lines<'_>, frame: u64) -> Result<Option<u64>, Mistake> {
    match lines.take_filled()? {
        Some(line) if frame == 0 => line
            .count(COUNT)
            .map(Some)
            .map_err(|mistake| mistake.help("it is the first line of an XYZ file")),
        Some(line) => line.count(COUNT).map(Some).map_err(|mistake| {
            mistake.help("is the number of particles of the frame before too small?")
        }),
        None if frame == 0 => Err(lines.ended(COUNT)),
        None => Ok(None),
    }
}

fn skip(lines: &mut Lines<'_>, count: u64) -> Result<(), Mistake> {
    lines.want(|| "a comment".into())?;
    lines.skip(count, "particle")
}

fn read(lines: &mut Lines<'_>, count: u64) -> Result<Particles, Mistake> {
    let comment = lines.want(|| "a comment".into())?;
    let named = properties(comment.bytes).map_err(|fault| comment.mistake(fault))?;
    let extended = named.is_some();
    let columns = match named {
        Some(columns) => columns,
        None => plain(lines.clone().take()?.filter(|_| count > 0)),
    };
    let mut table = Table::new(columns).map_err(|fault| comment.mistake(fault))?;
    let wanted = table.columns();
    for index in 0..count {
        let line = lines.want(|| format!("particle {} of {count}", index + 1))?;
        let mut words = line.words();
        let mut found = 0;
        while found < wanted
            && let Some(word) = words.next()
        {
            table
                .push(found, word)
                .map_err(|fault| line.mistake(fault))?;
            found += 1;
        }
        let least = if extended { wanted } else { 4 };
        if found < least || (extended && words.next().is_some()) {
            return Err(mismatch(line, least, extended));
        }
        (found..wanted).for_each(|column| table.leave_out(column));
    }
    after(lines, count)?;
    Ok(table.finish(false))
}

/// The columns of plain XYZ, as many as the first particle has words.
fn plain(first: Option<Line<'_>>) -> Vec<(String, Kind)> {
    let more = first.map_or(0, |line| line.words().count());
    let mut columns = vec![("symbol".into(), Kind::Element)];
    columns.extend(["x", "y", "z"].map(|axis| (axis.into(), Kind::Coordinate)));
    columns.extend((5..=more).map(|number| (format!("column_{number}"), Kind::Any)));
    columns
}

fn mismatch(line: Line<'_>, wanted: usize, extended: bool) -> Mistake {
    let found = line.words().count();
    if extended {
        return line.mistake(format!(
            "the particle has {found} values; `Properties` names {wanted}"
        ));
    }
    line.mistake("wanted a symbol and three coordinates")
}

/// Refuses what is no frame behind one.
fn after(lines: &Lines<'_>, count: u64) -> Result<(), Mistake> {
    let Some(line) = lines.peek_filled()? else {
        return Ok(());
    };
    let mut words = line.words();
    if words.next().and_then(whole).is_some() && words.next().is_none() {
        return Ok(());
    }
    Err(line.mistake(format!(
        "the frame has more than the {count} particles it announces, or something else follows it; wanted \
         the count of the next frame instead of `{}`",
        shown(line.bytes)
    )))
}

#[cfg(test)]
mod tests;

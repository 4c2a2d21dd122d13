//! The data files of LAMMPS: a title, counts and a box, sections. Only the section `Atoms` is read, of the
//! styles atomic, charge, bond, angle, molecular, full and sphere.
//!
//! Source: <https://docs.lammps.org/read_data.html>. Columns have the names of dumps: `id`, `mol`, `type`, `q`,
//! `diameter`, `density`, image flags `ix iy iz`; of `diameter` a column `radius` is made.

use super::Particles;
use super::lines::{Line, Lines, whole};
use super::mistake::{Mistake, word as shown};
use super::table::{Kind, Table};

const ATOMIC: &[&str] = &["id", "type", "x", "y", "z"];

/// The columns of each style, without image flags.
const STYLES: [(&str, &[&str]); 7] = [
    ("atomic", ATOMIC),
    ("charge", &["id", "type", "q", "x", "y", "z"]),
    ("bond", &["id", "mol", "type", "x", "y", "z"]),
    ("angle", &["id", "mol", "type", "x", "y", "z"]),
    ("molecular", &["id", "mol", "type", "x", "y", "z"]),
    ("full", &["id", "mol", "type", "q", "x", "y", "z"]),
    (
        "sphere",
        &["id", "type", "diameter", "density", "x", "y", "z"],
    ),
];
/// What may stand behind the columns of a style: how often the atom left the box.
const IMAGE_FLAGS: [&str; 3] = ["ix", "iy", "iz"];

pub(super) fn parse(bytes: &[u8]) -> Result<Particles, Mistake> {
    let mut lines = Lines::new(bytes);
    // The title may say anything.
    lines.take()?;
    let mut count = None;
    while let Some(line) = lines.take_filled()? {
        let (content, comment) = split_comment(line);
        let mut words = content.words();
        let (first, second) = (words.next(), words.next());
        if first == Some(b"Atoms") && second.is_none() {
            let count = count.ok_or_else(|| {
                line.mistake("wanted the number of atoms before this, as in `100 atoms`")
            })?;
            return read(&mut lines, count, style(line, comment)?);
        }
        if second == Some(b"atoms") {
            count = Some(
                first
                    .and_then(whole)
                    .ok_or_else(|| line.mistake("wanted the number of atoms, a whole number"))?,
            );
        }
    }
    Err(lines.ended("the section `Atoms`"))
}

/// What stands before `#`, and what behind.
fn split_comment(line: Line<'_>) -> (Line<'_>, Option<&[u8]>) {
    match line.bytes.iter().position(|byte| *byte == b'#') {
        None => (line, None),
        Some(at) => {
            let bytes = &line.bytes[..at];
            (Line { bytes, ..line }, Some(&line.bytes[at + 1..]))
        }
    }
}

/// The columns of the style that the line of the section names; `None` if it names none.
fn style(
    line: Line<'_>,
    comment: Option<&[u8]>,
) -> Result<Option<&'static [&'static str]>, Mistake> {
    let comment = comment.unwrap_or_default().trim_ascii();
    let Some(name) = comment.split(u8::is_ascii_whitespace).next() else {
        return Ok(None);
    };
    if name.is_empty() {
        return Ok(None);
    }
    let known = STYLES.iter().find(|(style, _)| style.as_bytes() == name);
    known.map(|(_, columns)| Some(*columns)).ok_or_else(|| {
        let styles = STYLES.map(|(style, _)| style).join(", ");
        line.mistake(format!("the atom style `{}` is not known", shown(name)))
            .help(format!(
                "known are {styles}; a dump has names for any style"
            ))
    })
}

fn read(
    lines: &mut Lines<'_>,
    count: u64,
    style: Option<&'static [&'static str]>,
) -> Result<Particles, Mistake> {
    let mut table = None;
    for index in 0..count {
        let line = lines
            .take_filled()?
            .ok_or_else(|| lines.ended(&format!("atom {} of {count}", index + 1)))?;
        let (line, _) = split_comment(line);
        let table = match &mut table {
            Some(table) => table,
            none => none.insert(columns(line, style)?),
        };
        let wanted = table.columns();
        let found = line.words().count();
        if found != wanted {
            return Err(line.mistake(format!(
                "the line has {found} values; wanted the {wanted} values of atom {} of {count}",
                index + 1
            )));
        }
        for (column, word) in line.words().enumerate() {
            table
                .push(column, word)
                .map_err(|fault| line.mistake(fault))?;
        }
    }
    match lines.peek_filled()? {
        Some(line) if line.words().next().and_then(whole).is_some() => Err(line.mistake(format!(
            "there are more than the {count} atoms that the header announces"
        ))),
        _ => Ok(table.map_or_else(Particles::default, |table| table.finish(true))),
    }
}

/// The columns of an atom's line.
fn columns(line: Line<'_>, style: Option<&'static [&'static str]>) -> Result<Table, Mistake> {
    let words: Vec<&[u8]> = line.words().take(20).collect();
    let flags = |from: usize| {
        let integer = |word: &&[u8]| {
            let text = str::from_utf8(word).ok();
            text.is_some_and(|text| text.parse::<i64>().is_ok())
        };
        words.len() == from + 3 && words[from..].iter().all(integer)
    };
    let names = match style {
        Some(names) => names,
        // No other style that is read has so few, or this many with flags.
        None if words.len() == ATOMIC.len() || flags(ATOMIC.len()) => ATOMIC,
        None => {
            return Err(line
                .mistake(format!(
                    "{} values do not say the atom style",
                    line.words().count()
                ))
                .help("write it behind the section's name, as in `Atoms # full`"));
        }
    };
    let flags: &[&str] = if flags(names.len()) {
        &IMAGE_FLAGS
    } else {
        &[]
    };
    let named = names.iter().chain(flags);
    let columns = named.map(|name| ((*name).to_owned(), Kind::of_name(name)));
    Table::new(columns.collect()).map_err(|fault| line.mistake(fault))
}

#[cfg(test)]
mod tests;

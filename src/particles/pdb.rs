//! PDB: the records ATOM and HETATM in fixed columns.
//!
//! Source: wwPDB, "Atomic Coordinate Entry Format", version 3.3, chapter 9,
//! <https://www.wwpdb.org/documentation/file-format-content/format33/sect9.html>. Models are frames; what ends
//! with END is one too, as programs of simulations write it. Of alternate locations, those without a letter and
//! those of the first letter in a residue are kept.
//!
//! Columns: `serial`, `chain` (0, 1, ... in order of appearance), `residue` (its sequence number), `x`, `y`,
//! `z`, `occupancy`, `b_factor`.

use std::collections::HashMap;

use super::Particles;
use super::element::Element;
use super::lines::{Line, Lines, number};
use super::mistake::Mistake;
use super::table::{Kind, Table};

/// The columns that are kept, and where each stands (0 is the first).
const COLUMNS: [(&str, Kind, usize, usize); 8] = [
    // The blank before the name is used where there are more than 99 999 atoms.
    ("serial", Kind::Any, 6, 12),
    ("chain", Kind::Any, 21, 22),
    ("residue", Kind::Any, 22, 26),
    ("x", Kind::Coordinate, 30, 38),
    ("y", Kind::Coordinate, 38, 46),
    ("z", Kind::Coordinate, 46, 54),
    ("occupancy", Kind::Any, 54, 60),
    ("b_factor", Kind::Any, 60, 66),
];
/// Which of these is the chain.
const CHAIN: usize = 1;

/// What a line is to frames.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Record {
    Atom,
    /// A frame begins or ends.
    Border,
    Other,
}

impl Record {
    fn of(line: Line<'_>) -> Self {
        let name = line.bytes.get(..6).unwrap_or(line.bytes).trim_ascii_end();
        match name {
            b"ATOM" | b"HETATM" => Self::Atom,
            // A serial number may touch it.
            _ if name.starts_with(b"HETATM") => Self::Atom,
            b"MODEL" | b"ENDMDL" | b"END" => Self::Border,
            _ => Self::Other,
        }
    }
}

pub(super) fn parse(bytes: &[u8], frame: u64) -> Result<Particles, Mistake> {
    let columns = COLUMNS.map(|(name, kind, ..)| (name.to_owned(), kind));
    let mut table = Table::new(columns.into()).map_err(Mistake::of_file)?;
    let mut chains = HashMap::new();
    let mut alternates = Alternates::default();
    let mut found = false;
    let frames = walk(bytes, |index, line| {
        if index == frame {
            found = true;
            if alternates.keep(line) {
                read_atom(&mut table, &mut chains, line)?;
            }
        }
        Ok(index <= frame)
    })?;
    if !found {
        return Err(Mistake::no_frame(frames, frame));
    }
    Ok(table.finish(false))
}

pub(super) fn frames(bytes: &[u8]) -> Result<u64, Mistake> {
    walk(bytes, |_, _| Ok(true))
}

/// Calls `visit` with every atom and the number of its frame until that says no. How many frames there are.
fn walk<'a>(
    bytes: &'a [u8],
    mut visit: impl FnMut(u64, Line<'a>) -> Result<bool, Mistake>,
) -> Result<u64, Mistake> {
    let mut lines = Lines::new(bytes);
    let (mut frame, mut atoms) = (0, false);
    while let Some(line) = lines.take()? {
        match Record::of(line) {
            Record::Atom => {
                atoms = true;
                if !visit(frame, line)? {
                    break;
                }
            }
            Record::Border if atoms => {
                atoms = false;
                frame += 1;
            }
            _ => {}
        }
    }
    match frame + u64::from(atoms) {
        0 => Err(lines.ended("a record ATOM or HETATM")),
        frames => Ok(frames),
    }
}

/// What stands in columns of a line, without blanks; nothing where the line is shorter.
fn field(line: Line<'_>, start: usize, end: usize) -> &[u8] {
    let end = end.min(line.bytes.len());
    line.bytes.get(start..end).unwrap_or_default().trim_ascii()
}

fn read_atom<'a>(
    table: &mut Table,
    chains: &mut HashMap<&'a [u8], usize>,
    line: Line<'a>,
) -> Result<(), Mistake> {
    for (column, (_, kind, start, end)) in COLUMNS.into_iter().enumerate() {
        let word = field(line, start, end);
        let pushed = match kind {
            Kind::Coordinate if word.is_empty() => Err(format!(
                "wanted a coordinate in the columns {} to {end}",
                start + 1
            )),
            Kind::Coordinate => table.push(column, word),
            _ if column == CHAIN => {
                let next = chains.len();
                table.push_number(column, *chains.entry(word).or_insert(next) as f64)
            }
            // Blanks, or stars where a number was too long.
            _ => table.push_number(column, number(word).unwrap_or(f64::NAN)),
        };
        pushed.map_err(|fault| line.mistake(fault))?;
    }
    table.push_element(element(line));
    Ok(())
}

/// The element by the columns 77 and 78, else by the name of the atom.
fn element(line: Line<'_>) -> Option<Element> {
    symbol(field(line, 76, 78)).or_else(|| by_name(line))
}

fn symbol(word: &[u8]) -> Option<Element> {
    // Old files have the number of the line there.
    Element::of_word(word).filter(|_| word.iter().all(u8::is_ascii_alphabetic))
}

/// The element by the atom's name: its symbol ends in the second of the name's four columns.
fn by_name(line: Line<'_>) -> Option<Element> {
    let name = line.bytes.get(12..16)?;
    let residue = field(line, 17, 20);
    let letters = name.trim_ascii_start();
    let skipped = letters.iter().take_while(|byte| byte.is_ascii_digit());
    let letters = &letters[skipped.count()..];
    let single = symbol(letters.get(..1)?);
    let pair = name
        .get(..2)
        .filter(|pair| pair.iter().all(u8::is_ascii_alphabetic));
    let Some(pair) = pair else {
        return single.or_else(|| symbol(letters.get(..2)?));
    };
    // Names of four letters begin a column early: hydrogens, as in HG21.
    let long = name.iter().all(|byte| !byte.is_ascii_whitespace());
    if long && pair[0].eq_ignore_ascii_case(&b'H') {
        return symbol(b"H");
    }
    // In the chains of ATOM records two letters are mostly names that are not in their columns, as in `CA  `;
    // ions have their residue's name, and selenium is part of some residues.
    let trusted = line.bytes.starts_with(b"HETATM")
        || residue.eq_ignore_ascii_case(name.trim_ascii())
        || pair.eq_ignore_ascii_case(b"SE");
    symbol(pair).filter(|_| trusted).or(single)
}

/// Which letters of alternate locations are kept.
#[derive(Default)]
struct Alternates<'a> {
    residue: &'a [u8],
    letter: Option<u8>,
}

impl<'a> Alternates<'a> {
    fn keep(&mut self, line: Line<'a>) -> bool {
        let residue = line.bytes.get(21..27).unwrap_or_default();
        if residue != self.residue {
            *self = Self {
                residue,
                letter: None,
            };
        }
        match line.bytes.get(16) {
            None | Some(b' ') => true,
            Some(letter) => *self.letter.get_or_insert(*letter) == *letter,
        }
    }
}

#[cfg(test)]
mod tests;

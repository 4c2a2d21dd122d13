//! mmCIF: the category `_atom_site` of a CIF file.
//!
//! Source: <https://mmcif.wwpdb.org/dictionaries/mmcif_pdbx_v50.dic/Categories/atom_site.html>. Columns, models
//! and alternate locations are those of PDB files, by the names of their authors (`auth_`) where there are such.

use std::collections::HashMap;

use super::Particles;
use super::cif::{Token, TokenKind, Tokens};
use super::element::Element;
use super::lines::number;
use super::mistake::Mistake;
use super::table::{Kind, Table};

/// The most tags of a category.
const MOST_TAGS: usize = 1000;

/// The columns that are kept, and their tags in lower case: the first that there is.
const COLUMNS: [(&str, Kind, &[&str]); 8] = [
    ("serial", Kind::Any, &["id"]),
    ("chain", Kind::Any, &["auth_asym_id", "label_asym_id"]),
    ("residue", Kind::Any, &["auth_seq_id", "label_seq_id"]),
    ("x", Kind::Coordinate, &["cartn_x"]),
    ("y", Kind::Coordinate, &["cartn_y"]),
    ("z", Kind::Coordinate, &["cartn_z"]),
    ("occupancy", Kind::Any, &["occupancy"]),
    ("b_factor", Kind::Any, &["b_iso_or_equiv"]),
];

pub(super) fn parse(bytes: &[u8], frame: u64) -> Result<Particles, Mistake> {
    let mut atoms = Atoms::find(bytes)?;
    let mut reader = Reader::new(&atoms)?;
    let mut row = Vec::new();
    while atoms.next_row(&mut row)? {
        if atoms.model(&row) == frame {
            reader.read(&row)?;
        }
    }
    let frames = atoms.count()?;
    if frame >= frames {
        return Err(Mistake::no_frame(frames, frame));
    }
    Ok(reader.table.finish(false))
}

pub(super) fn frames(bytes: &[u8]) -> Result<u64, Mistake> {
    let mut atoms = Atoms::find(bytes)?;
    let mut row = Vec::new();
    while atoms.next_row(&mut row)? {
        atoms.model(&row);
    }
    atoms.count()
}

/// The rows of `_atom_site`.
struct Atoms<'a> {
    tokens: Tokens<'a>,
    /// The tags behind the category's name, in lower case, and the first as it stands.
    tags: Vec<String>,
    first: Token<'a>,
    /// Values without a loop: the only row.
    single: Option<Vec<Token<'a>>>,
    /// Where the number of the model stands.
    model: Option<usize>,
    models: HashMap<&'a [u8], u64>,
    /// The model of the last row and its number.
    last: Option<(&'a [u8], u64)>,
}

/// The tag behind the name of the category.
fn tag(token: Token<'_>) -> Option<String> {
    const CATEGORY: &[u8] = b"atom_site.";
    if token.kind != TokenKind::Tag || token.bytes.len() > 200 {
        return None;
    }
    let (head, tail) = token.bytes.split_at_checked(CATEGORY.len())?;
    head.eq_ignore_ascii_case(CATEGORY)
        .then(|| String::from_utf8_lossy(tail).to_ascii_lowercase())
}

impl<'a> Atoms<'a> {
    fn find(bytes: &'a [u8]) -> Result<Self, Mistake> {
        let mut tokens = Tokens::new(bytes);
        let mut crystal: Option<Token<'_>> = None;
        let mut looped = false;
        loop {
            let Some(token) = tokens.take()? else {
                let end = tokens.ended("the category `_atom_site` of mmCIF");
                return Err(match crystal {
                    None => end,
                    Some(token) => token.line.mistake(
                        "these are fractional coordinates of a crystal; wanted mmCIF, with `_atom_site.Cartn_x`",
                    ),
                });
            };
            if let Some(tag) = tag(token) {
                return Self::begin(tokens, token, tag, looped);
            }
            looped = token.kind == TokenKind::Loop;
            if token.kind == TokenKind::Tag
                && token.bytes.eq_ignore_ascii_case(b"atom_site_fract_x")
            {
                crystal = Some(token);
            }
        }
    }

    /// Reads the tags, and the values if there is no loop.
    fn begin(
        mut tokens: Tokens<'a>,
        first: Token<'a>,
        name: String,
        looped: bool,
    ) -> Result<Self, Mistake> {
        let mut tags = vec![name];
        let mut values = Vec::new();
        loop {
            if !looped {
                let value = tokens.take()?.filter(|token| token.is_value());
                values
                    .push(value.ok_or_else(|| first.line.mistake("wanted a value behind a tag"))?);
            }
            let Some(token) = tokens.peek()? else {
                break;
            };
            let Some(tag) = tag(token) else {
                break;
            };
            if tags.len() == MOST_TAGS {
                return Err(token.line.mistake(format!(
                    "there are more than {MOST_TAGS} tags `_atom_site.`"
                )));
            }
            tags.push(tag);
            tokens.take()?;
        }
        let single = (!looped).then_some(values);
        let model = tags.iter().position(|tag| tag == "pdbx_pdb_model_num");
        Ok(Self {
            tokens,
            tags,
            first,
            single,
            model,
            models: HashMap::new(),
            last: None,
        })
    }

    /// The next row, if there is one.
    fn next_row(&mut self, row: &mut Vec<Token<'a>>) -> Result<bool, Mistake> {
        row.clear();
        if let Some(single) = &mut self.single {
            std::mem::swap(row, single);
            return Ok(row.len() == self.tags.len());
        }
        while row.len() < self.tags.len() {
            match self.tokens.peek()? {
                Some(token) if token.is_value() => row.push(token),
                _ if row.is_empty() => return Ok(false),
                Some(token) => {
                    return Err(token
                        .line
                        .mistake(format!("wanted {}", self.incomplete(row.len()))));
                }
                None => return Err(self.tokens.ended(&self.incomplete(row.len()))),
            }
            self.tokens.take()?;
        }
        Ok(true)
    }

    fn incomplete(&self, found: usize) -> String {
        format!(
            "{} values of an atom; the loop has {} tags, and this row {found} values",
            self.tags.len(),
            self.tags.len()
        )
    }

    /// How many models there were.
    fn count(&self) -> Result<u64, Mistake> {
        match self.models.len() as u64 {
            0 => Err(self.first.line.mistake("no atom follows these tags")),
            models => Ok(models),
        }
    }

    /// Which frame a row belongs to.
    fn model(&mut self, row: &[Token<'a>]) -> u64 {
        let name = self.model.map_or(&b""[..], |column| row[column].bytes);
        if let Some((last, frame)) = self.last
            && last == name
        {
            return frame;
        }
        let next = self.models.len() as u64;
        let frame = *self.models.entry(name).or_insert(next);
        self.last = Some((name, frame));
        frame
    }
}

/// The atoms of a frame as they are read.
struct Reader<'a> {
    table: Table,
    /// Where each of the columns stands.
    places: [Option<usize>; COLUMNS.len()],
    element: Option<usize>,
    alternate: Option<usize>,
    /// Where residues have what tells them apart: chain, number, insertion code.
    identity: [Option<usize>; 3],
    chains: HashMap<&'a [u8], usize>,
    residue: [&'a [u8]; 3],
    letter: Option<&'a [u8]>,
}

impl<'a> Reader<'a> {
    fn new(atoms: &Atoms<'a>) -> Result<Self, Mistake> {
        let place = |names: &[&str]| {
            let mut found = names
                .iter()
                .filter_map(|name| atoms.tags.iter().position(|tag| tag == name));
            found.next()
        };
        let places = COLUMNS.map(|(_, _, tags)| place(tags));
        let columns = COLUMNS.iter().zip(places);
        let columns = columns.map(|((name, kind, _), place)| match place {
            Some(_) => ((*name).to_owned(), *kind),
            None => ((*name).to_owned(), Kind::Skipped),
        });
        let table = Table::new(columns.collect()).map_err(|fault| {
            atoms
                .first
                .line
                .mistake(fault)
                .help("mmCIF has coordinates as `_atom_site.Cartn_x`, `Cartn_y` and `Cartn_z`")
        })?;
        Ok(Self {
            table,
            places,
            element: place(&["type_symbol"]),
            alternate: place(&["label_alt_id"]),
            identity: [
                place(COLUMNS[1].2),
                place(COLUMNS[2].2),
                place(&["pdbx_pdb_ins_code"]),
            ],
            chains: HashMap::new(),
            residue: [b""; 3],
            letter: None,
        })
    }

    fn read(&mut self, row: &[Token<'a>]) -> Result<(), Mistake> {
        if !self.keep(row) {
            return Ok(());
        }
        for (column, ((name, kind, _), place)) in COLUMNS.iter().zip(self.places).enumerate() {
            let Some(token) = place.map(|place| row[place]) else {
                continue;
            };
            let pushed = match kind {
                Kind::Coordinate if token.is_missing() => {
                    Err(format!("the coordinate {name} is missing"))
                }
                Kind::Coordinate => self.table.push(column, without_uncertainty(token.bytes)),
                _ if *name == "chain" => {
                    let next = self.chains.len();
                    let chain = *self.chains.entry(token.bytes).or_insert(next);
                    self.table.push_number(column, chain as f64)
                }
                _ => {
                    let value = number(without_uncertainty(token.bytes));
                    self.table.push_number(column, value.unwrap_or(f64::NAN))
                }
            };
            pushed.map_err(|fault| token.line.mistake(fault))?;
        }
        let element = self
            .element
            .and_then(|place| Element::of_word(row[place].bytes));
        self.table.push_element(element);
        Ok(())
    }

    /// Whether an atom is at the first of its alternate locations.
    fn keep(&mut self, row: &[Token<'a>]) -> bool {
        let Some(token) = self.alternate.map(|place| row[place]) else {
            return true;
        };
        let residue = self
            .identity
            .map(|place| place.map_or(&b""[..], |place| row[place].bytes));
        if residue != self.residue {
            (self.residue, self.letter) = (residue, None);
        }
        token.is_missing() || *self.letter.get_or_insert(token.bytes) == token.bytes
    }
}

/// A number without its standard uncertainty, as in `1.234(5)`.
fn without_uncertainty(word: &[u8]) -> &[u8] {
    match word.iter().position(|byte| *byte == b'(') {
        Some(at) if word.ends_with(b")") => &word[..at],
        _ => word,
    }
}

#[cfg(test)]
mod tests;

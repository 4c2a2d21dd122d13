//! CSV: a line of names, and a line of values for each particle, between commas, semicolons or tabs.
//!
//! Source: RFC 4180, with the crate `csv`. The columns `x`, `y` and `z` must be there and `element` may be, in
//! capitals or not; so are `radius` and `diameter` recognised. `#` may stand before the names, and before lines
//! that say something else. A value that is left out is NaN, and
//! a line without any is no particle.

use ::csv::{ByteRecord, Reader, ReaderBuilder};

use super::Particles;
use super::lines::{Line, Lines};
use super::mistake::Mistake;
use super::table::{Kind, Table};

/// What may stand between values.
const DELIMITERS: [u8; 3] = [b',', b';', b'\t'];

pub(super) fn parse(bytes: &[u8]) -> Result<Particles, Mistake> {
    let mut lines = Lines::new(bytes);
    let (header, delimiter, names) = header(&mut lines)?;
    let kind = |name: &String| match name.is_empty() {
        true => Kind::Skipped,
        false => Kind::of_name(name),
    };
    let columns = names.into_iter().map(|name| {
        let kind = kind(&name);
        (name, kind)
    });
    let mut table = Table::new(columns.collect()).map_err(|fault| {
        header
            .mistake(fault)
            .help("the first line names the columns, as in `x,y,z,radius`")
    })?;
    let body = lines.rest();
    let mut reader = reader(body, delimiter);
    let mut record = ByteRecord::new();
    loop {
        let start = reader.position().byte();
        let place = |record: &ByteRecord| {
            let position = record.position();
            let line = position.map_or(1, ::csv::Position::line);
            let byte = position.map_or(start, ::csv::Position::byte);
            line_at(body, byte, header.number + line)
        };
        match reader.read_byte_record(&mut record) {
            Ok(true) => {}
            Ok(false) => break,
            Err(error) => return Err(place(&record).mistake(error.to_string())),
        }
        // Spreadsheets write such lines below the last value.
        if record.iter().all(|field| field.trim_ascii().is_empty()) {
            continue;
        }
        if record.len() != table.columns() {
            return Err(place(&record).mistake(format!(
                "the line has {} values; the first line names {}",
                record.len(),
                table.columns()
            )));
        }
        for (column, field) in record.iter().enumerate() {
            let field = field.trim_ascii();
            table.push_or_missing(column, field).map_err(|fault| {
                let mistake = place(&record).mistake(fault);
                match delimiter != b',' && field.contains(&b',') {
                    true => mistake.help("decimals stand behind a point, not a comma"),
                    false => mistake,
                }
            })?;
        }
    }
    Ok(table.finish(false))
}

fn reader(bytes: &[u8], delimiter: u8) -> Reader<&[u8]> {
    ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .delimiter(delimiter)
        .comment(Some(b'#'))
        .from_reader(bytes)
}

/// The first line from a byte on that is neither blank nor a comment: such lines count to the record behind them.
fn line_at(bytes: &[u8], byte: u64, number: u64) -> Line<'_> {
    let rest = usize::try_from(byte)
        .ok()
        .and_then(|byte| bytes.get(byte..));
    let lines = rest.unwrap_or_default().split(|byte| *byte == b'\n');
    (number..)
        .zip(lines)
        .map(|(number, line)| Line {
            bytes: line.strip_suffix(b"\r").unwrap_or(line),
            number,
        })
        .find(|line| !line.bytes.is_empty() && !line.bytes.starts_with(b"#"))
        .unwrap_or(Line { bytes: b"", number })
}

/// The line of names, what stands between them, and the names: the first line that is no comment, or a comment
/// before it that names x, y and z.
fn header<'a>(lines: &mut Lines<'a>) -> Result<(Line<'a>, u8, Vec<String>), Mistake> {
    loop {
        let line = lines
            .take_filled()?
            .ok_or_else(|| lines.ended("a line with the names of the columns"))?;
        let text = line.bytes.trim_ascii_start();
        let comment = text.starts_with(b"#");
        let hashes = text.iter().take_while(|byte| **byte == b'#').count();
        let text = &text[hashes..];
        let count = |delimiter: u8| text.iter().filter(|byte| **byte == delimiter).count();
        // The first of several that are as frequent.
        let delimiter = DELIMITERS
            .into_iter()
            .rev()
            .max_by_key(|delimiter| count(*delimiter))
            .unwrap_or(b',');
        let names = names(text, delimiter).map_err(|fault| line.mistake(fault))?;
        let has = |axis: &str| names.iter().any(|name| name == axis);
        if !comment || ["x", "y", "z"].into_iter().all(has) {
            return Ok((line, delimiter, names));
        }
    }
}

/// The names of a line, those that mean something in lower case.
fn names(text: &[u8], delimiter: u8) -> Result<Vec<String>, String> {
    let mut record = ByteRecord::new();
    let mut reader = ReaderBuilder::new()
        .has_headers(false)
        .delimiter(delimiter)
        .from_reader(text);
    reader
        .read_byte_record(&mut record)
        .map_err(|error| error.to_string())?;
    let name = |field: &[u8]| {
        let name = String::from_utf8_lossy(field.trim_ascii()).into_owned();
        let lower = name.to_ascii_lowercase();
        match Kind::of_name(&lower) {
            Kind::Any => name,
            _ => lower,
        }
    };
    Ok(record.iter().map(name).collect())
}

#[cfg(test)]
mod tests;

//! The columns that the comment of extended XYZ names:
//! `Properties=species:S:1:pos:R:3:radius:R:1`, among other keys.

use super::mistake::word as shown;
use super::table::Kind;

/// The most columns of one file.
const MOST_COLUMNS: u64 = 10_000;

/// The columns, one for each word of a line; `None` if the comment names none.
///
/// # Errors
/// What is wrong with them.
pub(super) fn properties(comment: &[u8]) -> Result<Option<Vec<(String, Kind)>>, String> {
    let Some(value) = value_of(comment, b"Properties") else {
        return Ok(None);
    };
    let text = str::from_utf8(value).map_err(|_| "`Properties` is not UTF-8".to_owned())?;
    let parts: Vec<&str> = text.split(':').map(str::trim).collect();
    let mut columns = Vec::new();
    let mut elements = None;
    for part in parts.chunks(3) {
        let [name, kind, size] = part else {
            return Err(malformed(text));
        };
        let size: u64 = size.parse().map_err(|_| malformed(text))?;
        if size == 0 || size > MOST_COLUMNS - columns.len() as u64 {
            return Err(format!(
                "`Properties` names {size} values `{}`; wanted 1 or more, and {MOST_COLUMNS} columns at most",
                shown(name.as_bytes())
            ));
        }
        let kind = match *kind {
            "R" | "I" => Kind::Number,
            "L" => Kind::Logical,
            "S" => Kind::Skipped,
            _ => return Err(malformed(text)),
        };
        let start = columns.len();
        match (*name, size, kind) {
            ("pos", 3, Kind::Number) => {
                columns.extend(["x", "y", "z"].map(|axis| (axis.to_owned(), Kind::Coordinate)));
            }
            ("pos", ..) => return Err("`Properties` must have `pos:R:3`".into()),
            (_, 1, _) => columns.push(((*name).to_owned(), kind)),
            (_, 3, _) => {
                columns.extend(["x", "y", "z"].map(|axis| (format!("{name}_{axis}"), kind)));
            }
            _ => columns.extend((1..=size).map(|index| (format!("{name}_{index}"), kind))),
        }
        if size == 1 && matches!(*name, "species" | "element") && kind == Kind::Skipped {
            elements = Some(start);
        }
    }
    // Atomic numbers say it too.
    let numbers = || {
        columns
            .iter()
            .position(|(name, kind)| name == "Z" && *kind == Kind::Number)
    };
    if let Some(column) = elements.or_else(numbers) {
        columns[column].1 = Kind::Element;
    }
    if !columns.iter().any(|(_, kind)| *kind == Kind::Coordinate) {
        return Err("`Properties` must have `pos:R:3`".into());
    }
    Ok(Some(columns))
}

fn malformed(text: &str) -> String {
    format!(
        "`Properties` is `{}`; wanted groups of name, type (`S`, `R`, `I` or `L`) and size, as in \
         `species:S:1:pos:R:3`",
        shown(text.as_bytes())
    )
}

/// The value of a key in a comment of `key=value` and bare words; values may be in quotes or brackets.
fn value_of<'a>(comment: &'a [u8], wanted: &[u8]) -> Option<&'a [u8]> {
    let mut rest = comment;
    loop {
        rest = rest.trim_ascii_start();
        let (key, after) = token(rest, true)?;
        rest = after.trim_ascii_start();
        let Some(after) = rest.strip_prefix(b"=") else {
            continue;
        };
        let (value, after) = token(after.trim_ascii_start(), false).unwrap_or((b"", b""));
        if key.eq_ignore_ascii_case(wanted) {
            return Some(value);
        }
        rest = after;
    }
}

/// The first word or quoted text, without its quotes, and what follows; a key ends at `=` too.
fn token(text: &[u8], key: bool) -> Option<(&[u8], &[u8])> {
    let close = match text.first()? {
        b'"' => Some(b'"'),
        b'\'' => Some(b'\''),
        b'{' => Some(b'}'),
        b'[' => Some(b']'),
        _ => None,
    };
    if let Some(close) = close {
        let inner = &text[1..];
        let end = (0..inner.len())
            .find(|&at| inner[at] == close && (at == 0 || inner[at - 1] != b'\\'))
            .unwrap_or(inner.len());
        return Some((&inner[..end], inner.get(end + 1..).unwrap_or_default()));
    }
    let end = text
        .iter()
        .position(|byte| byte.is_ascii_whitespace() || (key && *byte == b'='))
        .unwrap_or(text.len());
    // A word of no length would be found again for ever.
    let end = if end == 0 { 1 } else { end };
    Some(text.split_at(end))
}

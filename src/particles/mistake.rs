//! What is wrong with a particle file, and where.

use std::fmt;

/// What is wrong with a particle file, and where.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mistake {
    /// What is wrong, and what was expected.
    pub message: String,
    /// Where.
    pub place: Place,
    /// What can be done about it, where that is known.
    pub help: Option<String>,
}

/// A place in a file, after decompression.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// A line of text.
    Line {
        /// Which; 1 is the first.
        number: u64,
        /// The line as it may be shown: shortened, control characters escaped.
        text: String,
    },
    /// A position in a binary file, in bytes from its start.
    Byte(u64),
    /// The file as a whole.
    File,
}

/// Why a particle file gives no particles.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The system cannot read it.
    #[error(transparent)]
    Io(#[from] std::io::Error),
    /// What it holds is wrong.
    #[error(transparent)]
    Mistake(#[from] Mistake),
}

impl Mistake {
    /// One of the file as a whole.
    pub(super) fn of_file(message: impl Into<String>) -> Self {
        Self {
            message: message.into(),
            place: Place::File,
            help: None,
        }
    }

    /// One at a byte.
    pub(super) fn at_byte(byte: usize, message: impl Into<String>) -> Self {
        Self {
            place: Place::Byte(byte as u64),
            ..Self::of_file(message)
        }
    }

    /// The same with help.
    pub(super) fn help(self, help: impl Into<String>) -> Self {
        Self {
            help: Some(help.into()),
            ..self
        }
    }

    /// That a file of `frames` frames has none of this number.
    pub(super) fn no_frame(frames: u64, frame: u64) -> Self {
        let plural = if frames == 1 { "frame" } else { "frames" };
        Self::of_file(format!(
            "the file has {frames} {plural}, and no frame {frame}"
        ))
        .help("0 is the first frame")
    }
}

impl fmt::Display for Mistake {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.place {
            Place::Line { number, text } if text.is_empty() => {
                write!(formatter, "line {number}: ")?
            }
            Place::Line { number, text } => write!(formatter, "line {number}: `{text}`: ")?,
            Place::Byte(byte) => write!(formatter, "byte {byte}: ")?,
            Place::File => {}
        }
        formatter.write_str(&self.message)?;
        match &self.help {
            Some(help) => write!(formatter, " ({help})"),
            None => Ok(()),
        }
    }
}

impl std::error::Error for Mistake {}

/// The first `most` characters of a piece of a file as a message may show them: control characters escaped,
/// the end marked by `…` where it is cut.
pub(super) fn shown(bytes: &[u8], most: usize) -> String {
    // A character has at most 4 bytes.
    let head = String::from_utf8_lossy(&bytes[..bytes.len().min(4 * most)]);
    let mut text = String::new();
    let mut length = 0;
    for character in head.trim().chars() {
        let escaped: String = match character {
            '\'' | '"' | '\\' => character.into(),
            _ => character.escape_debug().collect(),
        };
        length += escaped.chars().count();
        if length > most {
            return text + "…";
        }
        text += &escaped;
    }
    if bytes.len() > 4 * most {
        text.push('…');
    }
    text
}

/// A word as a message may show it.
pub(super) fn word(bytes: &[u8]) -> String {
    shown(bytes, 40)
}

#[cfg(test)]
mod tests {
    use super::{Mistake, Place, shown};

    #[test]
    fn a_mistake_names_its_place() {
        let mut mistake = Mistake::of_file("the coordinate `nan` is not finite");
        assert_eq!(mistake.to_string(), "the coordinate `nan` is not finite");
        mistake.place = Place::Line {
            number: 7,
            text: "C 1.0 nan 2".into(),
        };
        assert_eq!(
            mistake.to_string(),
            "line 7: `C 1.0 nan 2`: the coordinate `nan` is not finite"
        );
        assert_eq!(
            Mistake::at_byte(9, "a").help("b").to_string(),
            "byte 9: a (b)"
        );
    }

    #[test]
    fn what_is_shown_is_short_and_harmless() {
        assert_eq!(
            shown(b" a\tb\x1b[2J\xff\" ", 160),
            "a\\tb\\u{1b}[2J\u{fffd}\""
        );
        assert_eq!(shown("é".repeat(200).as_bytes(), 3), "ééé…");
        assert_eq!(shown(b"abcd", 4), "abcd");
        assert_eq!(shown(b"abcde", 4), "abcd…");
        assert_eq!(shown(&[b' '; 1000], 4), "…");
        assert!(shown(&[0; 1000], 160).chars().count() <= 161);
    }
}

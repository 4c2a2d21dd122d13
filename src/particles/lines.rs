//! The lines of a text file and their words.

use super::mistake::{self, Mistake, Place};

/// The longest line of any text file, in bytes. Those of particles have some hundred.
const LONGEST_LINE: usize = 1 << 20;
/// How much of a line a message shows, in characters.
const SHOWN: usize = 160;

/// What is left of a text file.
#[derive(Clone)]
pub(super) struct Lines<'a> {
    rest: &'a [u8],
    last: Line<'a>,
}

/// A line without its end.
#[derive(Clone, Copy)]
pub(super) struct Line<'a> {
    /// Its bytes.
    pub(super) bytes: &'a [u8],
    /// Which; 1 is the first.
    pub(super) number: u64,
}

impl<'a> Lines<'a> {
    /// All lines; a byte order mark of UTF-8 is left out.
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self {
            rest: bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes),
            last: Line {
                bytes: b"",
                number: 0,
            },
        }
    }

    /// The next line, if there is one.
    pub(super) fn take(&mut self) -> Result<Option<Line<'a>>, Mistake> {
        if self.rest.is_empty() {
            return Ok(None);
        }
        let length = self.rest.iter().position(|byte| *byte == b'\n');
        let (line, rest) = match length {
            Some(length) => (&self.rest[..length], &self.rest[length + 1..]),
            None => (self.rest, &self.rest[self.rest.len()..]),
        };
        self.rest = rest;
        self.last = Line {
            bytes: line.strip_suffix(b"\r").unwrap_or(line),
            number: self.last.number + 1,
        };
        if line.len() > LONGEST_LINE {
            return Err(self.last.mistake(format!(
                "the line has {} bytes; a line has {LONGEST_LINE} at most",
                line.len()
            )));
        }
        Ok(Some(self.last))
    }

    /// The next line that is not blank, if there is one.
    pub(super) fn take_filled(&mut self) -> Result<Option<Line<'a>>, Mistake> {
        while let Some(line) = self.take()? {
            if !line.bytes.trim_ascii().is_empty() {
                return Ok(Some(line));
            }
        }
        Ok(None)
    }

    /// The next line that is not blank, left where it is.
    pub(super) fn peek_filled(&self) -> Result<Option<Line<'a>>, Mistake> {
        self.clone().take_filled()
    }

    /// The next line, which must hold `what`.
    pub(super) fn want(&mut self, what: impl FnOnce() -> String) -> Result<Line<'a>, Mistake> {
        self.take()?.ok_or_else(|| self.ended(&what()))
    }

    /// Leaves out `count` lines; `what` they must hold.
    pub(super) fn skip(&mut self, count: u64, what: &str) -> Result<(), Mistake> {
        for index in 0..count {
            self.want(|| format!("{what} {} of {count}", index + 1))?;
        }
        Ok(())
    }

    /// That the file ends where `what` should follow.
    pub(super) fn ended(&self, what: &str) -> Mistake {
        if self.last.number == 0 {
            return Mistake::of_file(format!("the file is empty; wanted {what}"));
        }
        self.last
            .mistake(format!("the file ends here; wanted {what}"))
    }

    /// The line that was taken last.
    pub(super) fn last(&self) -> Line<'a> {
        self.last
    }

    /// What follows the lines that were taken.
    pub(super) fn rest(&self) -> &'a [u8] {
        self.rest
    }
}

impl<'a> Line<'a> {
    /// The words between spaces.
    pub(super) fn words(self) -> Words<'a> {
        Words(self.bytes)
    }

    /// That this line is wrong.
    pub(super) fn mistake(self, message: impl Into<String>) -> Mistake {
        Mistake {
            message: message.into(),
            place: Place::Line {
                number: self.number,
                text: mistake::shown(self.bytes, SHOWN),
            },
            help: None,
        }
    }

    /// The line as a whole number; `what` it counts.
    pub(super) fn count(self, what: &str) -> Result<u64, Mistake> {
        let mut words = self.words();
        words
            .next()
            .filter(|_| words.next().is_none())
            .and_then(whole)
            .ok_or_else(|| self.mistake(format!("wanted {what}, a whole number")))
    }
}

/// Words between spaces, tabs and the like.
pub(super) struct Words<'a>(&'a [u8]);

impl<'a> Iterator for Words<'a> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<&'a [u8]> {
        let start = self.0.iter().position(|byte| !byte.is_ascii_whitespace())?;
        let rest = &self.0[start..];
        let length = rest.iter().position(u8::is_ascii_whitespace);
        let (word, rest) = rest.split_at(length.unwrap_or(rest.len()));
        self.0 = rest;
        Some(word)
    }
}

/// A word as a whole number.
pub(super) fn whole(word: &[u8]) -> Option<u64> {
    str::from_utf8(word).ok()?.parse().ok()
}

/// A word as a number, which may be infinite or NaN; Fortran's `1.5D+00` is one too.
pub(super) fn number(word: &[u8]) -> Option<f64> {
    let text = str::from_utf8(word).ok()?;
    text.parse().ok().or_else(|| {
        let fortran = word
            .iter()
            .all(|byte| matches!(byte, b'0'..=b'9' | b'+' | b'-' | b'.' | b'd' | b'D'));
        fortran.then(|| text.replace(['d', 'D'], "e").parse().ok())?
    })
}

#[cfg(test)]
mod tests {
    use super::{LONGEST_LINE, Lines, number};
    use crate::particles::mistake::Place;

    #[test]
    fn lines_end_in_every_way() {
        let mut lines = Lines::new(b"\xef\xbb\xbfa\r\n\n \t b  c");
        let mut found = Vec::new();
        while let Some(line) = lines.take().expect("no line is long") {
            found.push((line.number, line.bytes));
        }
        let wanted: [(u64, &[u8]); 3] = [(1, b"a"), (2, b""), (3, b" \t b  c")];
        assert_eq!(found, wanted);
        assert!(lines.last().words().eq([b"b", b"c"]));
        let end = lines.ended("more");
        assert!(matches!(end.place, Place::Line { number: 3, .. }), "{end}");
        let empty = Lines::new(b"").ended("more");
        assert_eq!(empty.to_string(), "the file is empty; wanted more");
    }

    #[test]
    fn a_line_may_not_be_endless() {
        assert!(Lines::new(&vec![b'a'; LONGEST_LINE]).take().is_ok());
        let long = vec![b'a'; LONGEST_LINE + 1];
        let mistake = Lines::new(&long).take().err().expect("a mistake");
        assert!(mistake.to_string().len() < 400, "{mistake}");
    }

    #[test]
    fn numbers_are_of_every_program() {
        for (word, value) in [
            ("1", Some(1.0)),
            ("-1.5e-3", Some(-1.5e-3)),
            ("+.5", Some(0.5)),
            ("1.5D+01", Some(15.0)),
            ("1d2", Some(100.0)),
            ("inf", Some(f64::INFINITY)),
            ("d", None),
            ("1,5", None),
            ("", None),
            ("0x10", None),
        ] {
            assert_eq!(number(word.as_bytes()), value, "{word}");
        }
        assert!(number(b"NaN").is_some_and(f64::is_nan));
        assert_eq!(number(b"\xff"), None);
    }
}

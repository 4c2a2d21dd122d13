//! The words of CIF 1.1.
//!
//! Source: <https://www.iucr.org/resources/cif/spec/version1.1/cifsyntax>.

use super::lines::{Line, Lines};
use super::mistake::Mistake;

/// A word of a CIF file and the line it begins in.
#[derive(Clone, Copy)]
pub(super) struct Token<'a> {
    pub(super) kind: TokenKind,
    /// The bytes: without quotes, and without `_` of a tag.
    pub(super) bytes: &'a [u8],
    pub(super) line: Line<'a>,
}

/// What a word is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum TokenKind {
    /// `data_` and what else opens or ends a block.
    Block,
    /// `loop_`.
    Loop,
    /// A name.
    Tag,
    /// A value without quotes.
    Bare,
    /// A value in quotes, or a text field.
    Quoted,
}

impl Token<'_> {
    /// Whether it is a value.
    pub(super) fn is_value(self) -> bool {
        matches!(self.kind, TokenKind::Bare | TokenKind::Quoted)
    }

    /// Whether it stands for a value that is not known or not there.
    pub(super) fn is_missing(self) -> bool {
        self.kind == TokenKind::Bare && matches!(self.bytes, b"?" | b".")
    }
}

/// The words that are left.
pub(super) struct Tokens<'a> {
    lines: Lines<'a>,
    line: Line<'a>,
    /// What is left of the line.
    rest: &'a [u8],
    peeked: Option<Token<'a>>,
}

impl<'a> Tokens<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        let lines = Lines::new(bytes);
        Self {
            line: lines.last(),
            lines,
            rest: b"",
            peeked: None,
        }
    }

    /// That the file ends where `what` should follow.
    pub(super) fn ended(&self, what: &str) -> Mistake {
        self.lines.ended(what)
    }

    /// The next word, left where it is.
    pub(super) fn peek(&mut self) -> Result<Option<Token<'a>>, Mistake> {
        if self.peeked.is_none() {
            self.peeked = self.scan()?;
        }
        Ok(self.peeked)
    }

    /// The next word.
    pub(super) fn take(&mut self) -> Result<Option<Token<'a>>, Mistake> {
        match self.peeked.take() {
            Some(token) => Ok(Some(token)),
            None => self.scan(),
        }
    }

    fn scan(&mut self) -> Result<Option<Token<'a>>, Mistake> {
        loop {
            self.rest = self.rest.trim_ascii_start();
            if !matches!(self.rest.first(), None | Some(b'#')) {
                break;
            }
            let before = self.lines.rest();
            let Some(line) = self.lines.take()? else {
                return Ok(None);
            };
            (self.line, self.rest) = (line, line.bytes);
            if line.bytes.starts_with(b";") {
                return self.text_field(before).map(Some);
            }
        }
        let token = |kind, bytes| Token {
            kind,
            bytes,
            line: self.line,
        };
        if let [quote @ (b'"' | b'\''), inner @ ..] = self.rest {
            // A quote ends the value only before a space.
            let end = (0..inner.len()).find(|&at| {
                inner[at] == *quote && inner.get(at + 1).is_none_or(u8::is_ascii_whitespace)
            });
            let Some(end) = end else {
                return Err(self.line.mistake("the quote does not end in its line"));
            };
            let token = token(TokenKind::Quoted, &inner[..end]);
            self.rest = &inner[end + 1..];
            return Ok(Some(token));
        }
        let end = self.rest.iter().position(u8::is_ascii_whitespace);
        let (word, rest) = self.rest.split_at(end.unwrap_or(self.rest.len()));
        let token = if let Some(tag) = word.strip_prefix(b"_") {
            token(TokenKind::Tag, tag)
        } else if word.eq_ignore_ascii_case(b"loop_") {
            token(TokenKind::Loop, word)
        } else if is_block(word) {
            token(TokenKind::Block, word)
        } else {
            token(TokenKind::Bare, word)
        };
        self.rest = rest;
        Ok(Some(token))
    }

    /// The text between `;` at the start of the line and the next such line; `before` begins with the first.
    fn text_field(&mut self, before: &'a [u8]) -> Result<Token<'a>, Mistake> {
        let first = self.line;
        loop {
            let length = before.len() - self.lines.rest().len();
            let Some(line) = self.lines.take()? else {
                return Err(first.mistake("the text field does not end: wanted a line with `;`"));
            };
            if let Some(rest) = line.bytes.strip_prefix(b";") {
                (self.line, self.rest) = (line, rest);
                let text = before.get(1..length).unwrap_or_default();
                return Ok(Token {
                    kind: TokenKind::Quoted,
                    bytes: text.trim_ascii_end(),
                    line: first,
                });
            }
        }
    }
}

fn is_block(word: &[u8]) -> bool {
    let begins = |name: &[u8]| {
        word.get(..name.len())
            .is_some_and(|head| head.eq_ignore_ascii_case(name))
    };
    begins(b"data_") || begins(b"save_") || begins(b"global_") || begins(b"stop_")
}

#[cfg(test)]
mod tests {
    use super::TokenKind::{Bare, Block, Loop, Quoted, Tag};
    use super::{TokenKind, Tokens};

    fn tokens(text: &str) -> Result<Vec<(TokenKind, String, u64)>, String> {
        let mut tokens = Tokens::new(text.as_bytes());
        let mut found = Vec::new();
        loop {
            match tokens.take() {
                Ok(Some(t)) => found.push((
                    t.kind,
                    String::from_utf8_lossy(t.bytes).into_owned(),
                    t.line.number,
                )),
                Ok(None) => return Ok(found),
                Err(mistake) => return Err(mistake.to_string()),
            }
        }
    }

    #[test]
    fn words_are_those_of_the_syntax() {
        let text = "data_1ABC # not this\nLOOP_\n_a.b _c\n'O5'' \"a 'b'\" ? a#b\n;text # in\n it\n; x\n;\n;";
        let wanted: Vec<(TokenKind, &str, u64)> = vec![
            (Block, "data_1ABC", 1),
            (Loop, "LOOP_", 2),
            (Tag, "a.b", 3),
            (Tag, "c", 3),
            (Quoted, "O5'", 4),
            (Quoted, "a 'b'", 4),
            (Bare, "?", 4),
            (Bare, "a#b", 4),
            (Quoted, "text # in\n it", 5),
            (Bare, "x", 7),
            (Quoted, "", 8),
        ];
        let found = tokens(text).expect("words");
        let found: Vec<_> = found.iter().map(|(k, t, n)| (*k, t.as_str(), *n)).collect();
        assert_eq!(found, wanted);
    }

    #[test]
    fn what_does_not_end_is_a_mistake() {
        for text in ["a 'b\nc'", "a \"", "a\n;text\nb"] {
            let mistake = tokens(text).expect_err(text);
            assert!(mistake.contains("end"), "{mistake}");
        }
    }
}

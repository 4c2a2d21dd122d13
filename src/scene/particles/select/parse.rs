//! Expressions as they are written.

use std::ops::Range;

use super::condition::{Compare, Condition, Number};
use crate::particles::{Element, Particles};

/// Expressions within each other, at most: a bound for the stack.
const DEEPEST: usize = 64;

/// What is wrong with an expression: where in its text, and what.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in super::super) struct Mistake {
    /// Bytes of the expression's text.
    pub(in super::super) span: Range<usize>,
    /// What is wrong.
    pub(in super::super) message: String,
}

/// The expression `text` on the columns of `particles`.
pub(super) fn condition_of(text: &str, particles: &Particles) -> Result<Condition, Mistake> {
    let mut parser = Parser {
        tokens: tokens(text)?,
        next: 0,
        end: text.len(),
        particles,
        depth: 0,
    };
    let condition = parser.any()?;
    match parser.peek() {
        None => Ok(condition),
        Some(_) => Err(parser.expected("`and`, `or` or the end")),
    }
}

struct Token<'t> {
    text: &'t str,
    start: usize,
}

fn tokens(text: &str) -> Result<Vec<Token<'_>>, Mistake> {
    let mut all = Vec::new();
    let mut start = 0;
    while let Some(first) = text[start..].chars().next() {
        let rest = &text[start..];
        let word = |c: char| c.is_alphanumeric() || "_.[]".contains(c);
        let length = if first.is_whitespace() {
            start += first.len_utf8();
            continue;
        } else if first.is_ascii_digit() || first == '.' {
            number_length(rest)
        } else if first == '"' || first == '\'' {
            let end = rest[1..].find(first).ok_or_else(|| Mistake {
                span: start..text.len(),
                message: "a quote without its end".into(),
            })?;
            end + 2
        } else if word(first) {
            rest.find(|c| !word(c)).unwrap_or(rest.len())
        } else if ["<=", ">=", "==", "!="]
            .iter()
            .any(|two| rest.starts_with(two))
        {
            2
        } else if "<>+-*/()".contains(first) {
            1
        } else {
            let message = format!("`{}` means nothing here", first.escape_debug());
            let span = start..start + first.len_utf8();
            return Err(Mistake { span, message });
        };
        all.push(Token {
            text: &rest[..length],
            start,
        });
        start += length;
    }
    Ok(all)
}

/// The length of the number that `text` begins with.
fn number_length(text: &str) -> usize {
    let mut before = ' ';
    let part = |c: char| {
        let sign = (c == '+' || c == '-') && (before == 'e' || before == 'E');
        before = c;
        c.is_ascii_alphanumeric() || c == '.' || c == '_' || sign
    };
    let mut part = part;
    text.find(|c| !part(c)).unwrap_or(text.len())
}

struct Parser<'t> {
    tokens: Vec<Token<'t>>,
    next: usize,
    /// Length of the text.
    end: usize,
    particles: &'t Particles,
    depth: usize,
}

impl<'t> Parser<'t> {
    fn peek(&self) -> Option<&'t str> {
        self.tokens.get(self.next).map(|token| token.text)
    }

    /// The next token if it is `text`.
    fn take(&mut self, text: &str) -> bool {
        let found = self.peek() == Some(text);
        self.next += usize::from(found);
        found
    }

    /// A mistake at the next token.
    fn mistake(&self, message: String) -> Mistake {
        let span = match self.tokens.get(self.next) {
            Some(token) => token.start..token.start + token.text.len(),
            None => self.end..self.end,
        };
        Mistake { span, message }
    }

    fn expected(&self, what: &str) -> Mistake {
        self.mistake(format!("expected {what}"))
    }

    /// Runs `inner` one level deeper.
    fn deeper<T>(
        &mut self,
        inner: impl FnOnce(&mut Self) -> Result<T, Mistake>,
    ) -> Result<T, Mistake> {
        if self.depth == DEEPEST {
            return Err(self.mistake(format!("more than {DEEPEST} levels deep")));
        }
        self.depth += 1;
        let result = inner(self);
        self.depth -= 1;
        result
    }

    fn any(&mut self) -> Result<Condition, Mistake> {
        let mut conditions = vec![self.all()?];
        while self.take("or") {
            conditions.push(self.all()?);
        }
        Ok(Condition::Any(conditions))
    }

    fn all(&mut self) -> Result<Condition, Mistake> {
        let mut conditions = vec![self.one()?];
        while self.take("and") {
            conditions.push(self.one()?);
        }
        Ok(Condition::All(conditions))
    }

    fn one(&mut self) -> Result<Condition, Mistake> {
        self.deeper(|parser| {
            if parser.take("not") {
                return Ok(Condition::Not(Box::new(parser.one()?)));
            }
            if parser.peek() == Some("element") {
                parser.next += 1;
                return parser.element();
            }
            // A parenthesis may hold a condition or a number: if no condition, then a number.
            let before = parser.next;
            if parser.take("(") {
                let inner = parser.any();
                if inner.is_ok() && parser.take(")") {
                    return inner;
                }
                parser.next = before;
            }
            parser.chain()
        })
    }

    fn element(&mut self) -> Result<Condition, Mistake> {
        let different = self.take("!=");
        if !different && !self.take("==") {
            return Err(self.expected("`==` or `!=` after `element`"));
        }
        let symbol = self.peek().unwrap_or_default().trim_matches(['"', '\'']);
        let Some(element) = Element::of_symbol(symbol) else {
            return Err(self.expected("the symbol of a chemical element, as in `element == Fe`"));
        };
        if self.particles.elements.is_none() {
            return Err(self.mistake("the file says no elements".into()));
        }
        self.next += 1;
        let is = Condition::Is(element);
        Ok(match different {
            true => Condition::Not(Box::new(is)),
            false => is,
        })
    }

    fn chain(&mut self) -> Result<Condition, Mistake> {
        let first = self.sum()?;
        let mut rest = Vec::new();
        while let Some(compare) = self.peek().and_then(Compare::of).filter(|_| rest.len() < 2) {
            self.next += 1;
            rest.push((compare, self.sum()?));
        }
        match rest.is_empty() {
            true => Err(self.expected("a comparison: < <= > >= == !=")),
            false => Ok(Condition::Chain(first, rest)),
        }
    }

    fn sum(&mut self) -> Result<Number, Mistake> {
        self.binary(["+", "-"], Self::product)
    }

    fn product(&mut self) -> Result<Number, Mistake> {
        self.binary(["*", "/"], Self::value)
    }

    fn binary(
        &mut self,
        operators: [&str; 2],
        operand: fn(&mut Self) -> Result<Number, Mistake>,
    ) -> Result<Number, Mistake> {
        let mut left = operand(self)?;
        let mut count = 0;
        while let Some(operator) = self.peek().filter(|token| operators.contains(token)) {
            count += 1;
            if count > DEEPEST {
                return Err(self.mistake(format!("more than {DEEPEST} terms")));
            }
            self.next += 1;
            let operator = operator.chars().next().unwrap_or('+');
            left = Number::Binary(operator, Box::new(left), Box::new(operand(self)?));
        }
        Ok(left)
    }

    fn value(&mut self) -> Result<Number, Mistake> {
        self.deeper(|parser| {
            if parser.take("-") {
                return Ok(Number::Minus(Box::new(parser.value()?)));
            }
            if parser.take("(") {
                let inner = parser.sum()?;
                return match parser.take(")") {
                    true => Ok(inner),
                    false => Err(parser.expected("`)`")),
                };
            }
            let word = parser.peek().unwrap_or_default();
            let number = match word.parse::<f64>() {
                Ok(value) if word.starts_with(|c: char| c.is_ascii_digit() || c == '.') => {
                    Number::Value(value)
                }
                _ => Number::Column(parser.column(word)?),
            };
            parser.next += 1;
            Ok(number)
        })
    }

    fn column(&self, word: &str) -> Result<usize, Mistake> {
        let name = word.trim_matches(['"', '\'']);
        let columns = &self.particles.columns;
        columns
            .iter()
            .position(|column| column.name == name)
            .ok_or_else(|| {
                let names: Vec<_> = columns.iter().map(|c| c.name.as_str()).collect();
                self.expected(&format!("a number or a column: {}", names.join(", ")))
            })
    }
}

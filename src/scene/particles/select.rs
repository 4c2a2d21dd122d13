//! `select`: which particles are kept, as an expression on their columns and elements.
//!
//!     any      = all { "or" all }
//!     all      = one { "and" one }
//!     one      = "not" one | "(" any ")" | "element" ("==" | "!=") SYMBOL | sum compare sum [ compare sum ]
//!     compare  = "<" | "<=" | ">" | ">=" | "==" | "!="
//!     sum      = product { ("+" | "-") product }
//!     product  = value { ("*" | "/") value }
//!     value    = NUMBER | COLUMN | "-" value | "(" sum ")"
//!
//! So `0 < x < 10 and element != H` is a slab without hydrogen, `x + 2*z <= 4` a half-space.

use std::ops::Range;

use crate::particles::{Element, Particles};

/// Expressions within each other, at most: a bound for the stack.
const DEEPEST: usize = 64;

/// What is wrong with an expression: where in its text, and what.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Mistake {
    /// Bytes of the expression's text.
    pub(super) span: Range<usize>,
    /// What is wrong.
    pub(super) message: String,
}

/// An expression whose names are columns of certain particles.
#[derive(Debug)]
pub(super) struct Selection(Condition);

#[derive(Debug)]
enum Condition {
    Any(Vec<Condition>),
    All(Vec<Condition>),
    Not(Box<Condition>),
    /// Whether the element is this one.
    Is(Element),
    /// Sums, each of which compares with the next.
    Chain(Number, Vec<(Compare, Number)>),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Compare {
    Less,
    AtMost,
    Greater,
    AtLeast,
    Equal,
    Different,
}

#[derive(Debug)]
enum Number {
    Value(f64),
    Column(usize),
    Minus(Box<Number>),
    Binary(char, Box<Number>, Box<Number>),
}

impl Selection {
    /// The expression `text` on the columns of `particles`.
    pub(super) fn parse(text: &str, particles: &Particles) -> Result<Self, Mistake> {
        let mut parser = Parser {
            tokens: tokens(text)?,
            next: 0,
            end: text.len(),
            particles,
            depth: 0,
        };
        let condition = parser.any()?;
        match parser.peek() {
            None => Ok(Self(condition)),
            Some(_) => Err(parser.expected("`and`, `or` or the end")),
        }
    }

    /// Whether particle `index` is kept.
    pub(super) fn keeps(&self, particles: &Particles, index: usize) -> bool {
        self.0.holds(particles, index)
    }
}

impl Condition {
    fn holds(&self, particles: &Particles, index: usize) -> bool {
        match self {
            Self::Any(all) => all.iter().any(|c| c.holds(particles, index)),
            Self::All(all) => all.iter().all(|c| c.holds(particles, index)),
            Self::Not(inner) => !inner.holds(particles, index),
            Self::Is(element) => particles
                .elements
                .as_ref()
                .is_some_and(|elements| elements[index] == Some(*element)),
            Self::Chain(first, rest) => {
                let mut left = first.value(particles, index);
                rest.iter().all(|(compare, number)| {
                    let right = number.value(particles, index);
                    let holds = compare.holds(left, right);
                    left = right;
                    holds
                })
            }
        }
    }
}

impl Compare {
    fn of(token: &str) -> Option<Self> {
        Some(match token {
            "<" => Self::Less,
            "<=" => Self::AtMost,
            ">" => Self::Greater,
            ">=" => Self::AtLeast,
            "==" => Self::Equal,
            "!=" => Self::Different,
            _ => return None,
        })
    }

    #[expect(
        clippy::float_cmp,
        reason = "numbers of a file are compared as they stand there"
    )]
    fn holds(self, a: f64, b: f64) -> bool {
        match self {
            Self::Less => a < b,
            Self::AtMost => a <= b,
            Self::Greater => a > b,
            Self::AtLeast => a >= b,
            Self::Equal => a == b,
            Self::Different => a != b,
        }
    }
}

impl Number {
    fn value(&self, particles: &Particles, index: usize) -> f64 {
        match self {
            Self::Value(value) => *value,
            Self::Column(column) => particles.columns[*column].values[index],
            Self::Minus(inner) => -inner.value(particles, index),
            Self::Binary(operator, a, b) => {
                let (a, b) = (a.value(particles, index), b.value(particles, index));
                match operator {
                    '+' => a + b,
                    '-' => a - b,
                    '*' => a * b,
                    _ => a / b,
                }
            }
        }
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

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::Selection;
    use crate::particles::{Column, Element, Particles};

    fn particles() -> Particles {
        let column = |name: &str, values: [f64; 3]| Column {
            name: name.into(),
            values: values.into(),
        };
        Particles {
            positions: vec![DVec3::ZERO; 3],
            elements: Some(["C", "H", "Xx"].map(Element::of_symbol).to_vec()),
            columns: vec![
                column("x", [0.0, 1.0, 2.0]),
                column("c_pe[1]", [-3.0, 0.0, 3.0]),
            ],
        }
    }

    fn kept(text: &str) -> Vec<usize> {
        let particles = particles();
        let selection = Selection::parse(text, &particles).expect(text);
        (0..3).filter(|i| selection.keeps(&particles, *i)).collect()
    }

    #[test]
    fn expressions_mean_what_they_say() {
        let cases: [(&str, &[usize]); 16] = [
            ("x < 1", &[0]),
            ("x <= 1", &[0, 1]),
            ("0 < x < 2", &[1]),
            ("x == 0 or x == 2", &[0, 2]),
            ("not x == 0 and x != 2", &[1]),
            ("not (x == 0 or x == 2)", &[1]),
            ("element == C", &[0]),
            ("element != 'H'", &[0, 2]),
            ("(x + 1) * 2 > 3", &[1, 2]),
            ("x + 1 * 2 > 3", &[2]),
            ("-x - -1 > 0", &[0]),
            ("c_pe[1]/3 <= -1e0", &[0]),
            ("\"c_pe[1]\" > 1.5e-3", &[2]),
            ("((x) < (1))", &[0]),
            ("4-2-1 == x", &[1]),
            ("8/4/2 == x", &[1]),
        ];
        for (text, wanted) in cases {
            assert_eq!(kept(text), wanted, "{text}");
        }
    }

    #[test]
    fn mistakes_are_at_their_place() {
        let particles = particles();
        for (text, start, says) in [
            ("", 0, "a number or a column"),
            ("x", 1, "a comparison"),
            ("x <", 3, "a number or a column: x, c_pe[1]"),
            ("y < 1", 0, "a column"),
            ("x < 1 x", 6, "the end"),
            ("element < C", 8, "`=="),
            ("element == Q", 11, "symbol"),
            ("x < (1", 6, "`)`"),
            ("x < 1 ; 2", 6, "means nothing"),
            ("x < 'y", 4, "without its end"),
            ("0 < x < 1 < 2", 10, "the end"),
        ] {
            let mistake = Selection::parse(text, &particles).expect_err(text);
            assert_eq!(mistake.span.start, start, "{text}: {}", mistake.message);
            assert!(
                mistake.message.contains(says),
                "{text}: {}",
                mistake.message
            );
        }
        let deep = "(".repeat(100_000);
        assert!(Selection::parse(&deep, &particles).is_err());
        let long = format!("0{} < 1", "+x".repeat(100_000));
        assert!(Selection::parse(&long, &particles).is_err());
    }
}

//! Expressions as they are asked of a particle.

use crate::particles::{Element, Particles};

#[derive(Debug)]
pub(super) enum Condition {
    Any(Vec<Condition>),
    All(Vec<Condition>),
    Not(Box<Condition>),
    /// Whether the element is this one.
    Is(Element),
    /// Sums, each of which compares with the next.
    Chain(Number, Vec<(Compare, Number)>),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Compare {
    Less,
    AtMost,
    Greater,
    AtLeast,
    Equal,
    Different,
}

#[derive(Debug)]
pub(super) enum Number {
    Value(f64),
    Column(usize),
    Minus(Box<Number>),
    Binary(char, Box<Number>, Box<Number>),
}

impl Condition {
    pub(super) fn holds(&self, particles: &Particles, index: usize) -> bool {
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
    pub(super) fn of(token: &str) -> Option<Self> {
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
    pub(super) fn holds(self, a: f64, b: f64) -> bool {
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
    pub(super) fn value(&self, particles: &Particles, index: usize) -> f64 {
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

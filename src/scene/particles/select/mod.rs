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

mod condition;
mod parse;

use crate::particles::Particles;

use condition::Condition;
use parse::condition_of;

pub(super) use parse::Mistake;

/// An expression whose names are columns of certain particles.
#[derive(Debug)]
pub(super) struct Selection(Condition);

impl Selection {
    /// The expression `text` on the columns of `particles`.
    pub(super) fn parse(text: &str, particles: &Particles) -> Result<Self, Mistake> {
        condition_of(text, particles).map(Self)
    }

    /// Whether particle `index` is kept.
    pub(super) fn keeps(&self, particles: &Particles, index: usize) -> bool {
        self.0.holds(particles, index)
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

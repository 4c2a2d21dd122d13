//! A chemical element.

use super::element_table::{ELEMENTS, Row};

/// A chemical element, by its atomic number (1 to 118).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Element(u8);

impl Element {
    /// The element of an atomic number.
    #[must_use]
    pub const fn of_number(number: u8) -> Option<Self> {
        match number {
            1..=118 => Some(Self(number)),
            _ => None,
        }
    }

    /// The element of a symbol, as in `Fe`, `FE` or `fe`. `D` and `T` are hydrogen.
    #[must_use]
    pub fn of_symbol(symbol: &str) -> Option<Self> {
        if ["D", "T"].iter().any(|h| h.eq_ignore_ascii_case(symbol)) {
            return Some(Self(1));
        }
        (1..)
            .zip(&ELEMENTS)
            .find(|(_, row)| row.0.eq_ignore_ascii_case(symbol))
            .map(|(number, _)| Self(number))
    }

    /// The element that a file names by a symbol or by an atomic number.
    pub(super) fn of_word(word: &[u8]) -> Option<Self> {
        let word = str::from_utf8(word).ok()?.trim();
        match word.as_bytes().first()? {
            b'0'..=b'9' => word.parse().ok().and_then(Self::of_number),
            _ if word.len() <= 2 => Self::of_symbol(word),
            _ => None,
        }
    }

    /// Its atomic number.
    #[must_use]
    pub const fn number(self) -> u8 {
        self.0
    }

    /// Its symbol, as in `Fe`.
    #[must_use]
    pub fn symbol(self) -> &'static str {
        self.row().0
    }

    /// Its name by IUPAC, as in `iron`.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.row().1
    }

    /// Its colour in Jmol, after Corey, Pauling and Koltun: sRGB, 8 bits a channel. Beyond meitnerium (109)
    /// Jmol has none but the pink of unknown elements.
    ///
    /// Source: <https://jmol.sourceforge.net/jscolors/>.
    #[must_use]
    pub fn color(self) -> [u8; 3] {
        let [_, red, green, blue] = self.row().2.to_be_bytes();
        [red, green, blue]
    }

    /// Its van der Waals radius in ångström; `None` where it is not known.
    ///
    /// Source: S. Alvarez, "A cartography of the van der Waals territories", Dalton Trans. 42 (2013) 8617,
    /// which has metals too, all by one method; for carbon 1.77, where Bondi (1964) has 1.70.
    #[must_use]
    pub fn van_der_waals(self) -> Option<f64> {
        self.row().3
    }

    /// Its covalent radius in ångström; `None` where it is not known.
    ///
    /// Source: B. Cordero et al., "Covalent radii revisited", Dalton Trans. (2008) 2832: sp³ carbon,
    /// manganese, iron and cobalt of low spin.
    #[must_use]
    pub fn covalent(self) -> Option<f64> {
        self.row().4
    }

    fn row(self) -> &'static Row {
        // An element is made of 1 to 118 only.
        &ELEMENTS[usize::from(self.0) - 1]
    }
}

#[cfg(test)]
mod tests {
    use super::Element;

    fn of(symbol: &str) -> Element {
        Element::of_symbol(symbol).expect("an element")
    }

    #[test]
    fn symbols_and_numbers_are_each_others_inverse() {
        for number in 1..=118 {
            let element = Element::of_number(number).expect("an element");
            let symbol = element.symbol();
            for text in [symbol, &symbol.to_lowercase(), &symbol.to_uppercase()] {
                assert_eq!(Element::of_symbol(text), Some(element), "{text}");
                assert_eq!(Element::of_word(text.as_bytes()), Some(element), "{text}");
            }
            assert_eq!(
                Element::of_word(number.to_string().as_bytes()),
                Some(element)
            );
            assert!(!element.name().is_empty());
        }
        for none in ["", "X", "Xx", "C1", "carbon", "0", "119", "256", "é", " "] {
            assert_eq!(Element::of_symbol(none), None, "{none}");
            assert_eq!(Element::of_word(none.as_bytes()), None, "{none}");
        }
        assert_eq!(Element::of_number(0), None);
        assert_eq!(Element::of_number(119), None);
        assert_eq!(of("D"), of("H"));
    }

    #[test]
    fn the_table_has_the_numbers_of_its_sources() {
        for (symbol, name, number, color, van_der_waals, covalent) in [
            ("H", "hydrogen", 1, [255, 255, 255], Some(1.2), Some(0.31)),
            ("C", "carbon", 6, [144, 144, 144], Some(1.77), Some(0.76)),
            ("N", "nitrogen", 7, [48, 80, 248], Some(1.66), Some(0.71)),
            ("O", "oxygen", 8, [255, 13, 13], Some(1.5), Some(0.66)),
            ("Fe", "iron", 26, [224, 102, 51], Some(2.44), Some(1.32)),
            ("Au", "gold", 79, [255, 209, 35], Some(2.32), Some(1.36)),
            ("Cm", "curium", 96, [120, 92, 227], Some(3.05), Some(1.69)),
            ("Mt", "meitnerium", 109, [235, 0, 38], None, None),
            ("Og", "oganesson", 118, [255, 20, 147], None, None),
        ] {
            let element = of(symbol);
            assert_eq!(element.number(), number, "{symbol}");
            assert_eq!(element.name(), name, "{symbol}");
            assert_eq!(element.color(), color, "{symbol}");
            assert_eq!(element.van_der_waals(), van_der_waals, "{symbol}");
            assert_eq!(element.covalent(), covalent, "{symbol}");
        }
        // No radius is in another unit, and no bond is longer than its atoms.
        for element in (1..=118).filter_map(Element::of_number) {
            let radius = element.covalent();
            assert!(radius.is_none_or(|radius| (0.2..3.0).contains(&radius)));
            let outer = element.van_der_waals();
            assert!(outer.is_none_or(|outer| (1.1..4.0).contains(&outer)));
            assert!(outer.zip(radius).is_none_or(|(outer, r)| outer > r));
        }
    }
}

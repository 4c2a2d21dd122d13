//! The rows of a file on their way to particles.

use std::collections::HashSet;

use glam::DVec3;

use super::lines::number;
use super::mistake::word as shown;
use super::{Column, Element, Particles};

/// The largest magnitude of a coordinate, as in scene files.
pub(super) const LARGEST: f64 = 1e20;

/// What stands in a column of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// The coordinate along x, y or z: finite, and at most [`LARGEST`].
    Coordinate,
    /// A number in every row.
    Number,
    /// Numbers, or words that are left out with the column.
    Any,
    /// `T` or `F`, as 1 or 0.
    Logical,
    /// Symbols of elements, or atomic numbers.
    Element,
    /// Nothing that is kept.
    Skipped,
}

impl Kind {
    /// What a column of this name holds where a file names its columns and nothing else.
    pub(super) fn of_name(name: &str) -> Self {
        match name {
            "x" | "y" | "z" => Self::Coordinate,
            "element" => Self::Element,
            // Radii may come from elsewhere: a broken one must not do so in silence.
            "radius" | "diameter" => Self::Number,
            _ => Self::Any,
        }
    }
}

/// The values of particles, column by column.
pub(super) struct Table {
    names: Vec<String>,
    kinds: Vec<Kind>,
    values: Vec<Vec<f64>>,
    elements: Vec<Option<Element>>,
    axes: [usize; 3],
}

impl Table {
    /// An empty table. The columns of coordinates must be named `x`, `y` and `z`, in any order.
    ///
    /// # Errors
    /// What is wrong if one of these is missing or two columns have one name.
    pub(super) fn new(columns: Vec<(String, Kind)>) -> Result<Self, String> {
        let mut seen = HashSet::new();
        for (name, kind) in &columns {
            if *kind != Kind::Skipped && !seen.insert(name.as_str()) {
                return Err(format!(
                    "two columns are named `{}`",
                    shown(name.as_bytes())
                ));
            }
        }
        let place = |axis: &str| {
            columns
                .iter()
                .position(|(name, kind)| name == axis && *kind == Kind::Coordinate)
                .ok_or_else(|| format!("there is no column `{axis}`"))
        };
        let axes = [place("x")?, place("y")?, place("z")?];
        let (names, kinds): (Vec<_>, Vec<_>) = columns.into_iter().unzip();
        Ok(Self {
            values: vec![Vec::new(); names.len()],
            elements: Vec::new(),
            names,
            kinds,
            axes,
        })
    }

    /// How many columns there are.
    pub(super) fn columns(&self) -> usize {
        self.kinds.len()
    }

    /// Reads the next value of a column from a word.
    ///
    /// # Errors
    /// What is wrong with it.
    pub(super) fn push(&mut self, column: usize, word: &[u8]) -> Result<(), String> {
        let value = match self.kinds[column] {
            Kind::Skipped => return Ok(()),
            Kind::Element => {
                self.elements.push(Element::of_word(word));
                return Ok(());
            }
            Kind::Coordinate => match number(word) {
                Some(value) => return self.push_number(column, value),
                None => {
                    return Err(format!("the coordinate `{}` is not a number", shown(word)));
                }
            },
            Kind::Number => number(word).ok_or_else(|| {
                format!(
                    "the {} `{}` is not a number",
                    self.name(column),
                    shown(word)
                )
            })?,
            Kind::Logical => match word {
                b"T" | b"True" | b"true" | b"TRUE" | b"1" => 1.0,
                b"F" | b"False" | b"false" | b"FALSE" | b"0" => 0.0,
                _ => {
                    return Err(format!(
                        "the {} `{}` is neither `T` nor `F`",
                        self.name(column),
                        shown(word)
                    ));
                }
            },
            Kind::Any => match number(word) {
                Some(value) => value,
                None => {
                    self.leave_out(column);
                    return Ok(());
                }
            },
        };
        self.values[column].push(value);
        Ok(())
    }

    /// As [`Self::push`]; an empty word is NaN in a column that may hold anything.
    ///
    /// # Errors
    /// What is wrong with it.
    pub(super) fn push_or_missing(&mut self, column: usize, word: &[u8]) -> Result<(), String> {
        match self.kinds[column] {
            Kind::Any if word.is_empty() => self.push_number(column, f64::NAN),
            _ => self.push(column, word),
        }
    }

    /// Appends a number to a column of numbers.
    ///
    /// # Errors
    /// What is wrong with it if it is a coordinate.
    pub(super) fn push_number(&mut self, column: usize, value: f64) -> Result<(), String> {
        match self.kinds[column] {
            Kind::Skipped => return Ok(()),
            Kind::Coordinate => coordinate(value)?,
            _ => {}
        }
        self.values[column].push(value);
        Ok(())
    }

    /// Appends an element.
    pub(super) fn push_element(&mut self, element: Option<Element>) {
        self.elements.push(element);
    }

    /// Leaves out a column.
    pub(super) fn leave_out(&mut self, column: usize) {
        self.kinds[column] = Kind::Skipped;
        self.values[column] = Vec::new();
    }

    /// Replaces the position of the last particle by a function of it.
    ///
    /// # Errors
    /// What is wrong with the new one.
    pub(super) fn place(&mut self, place: impl FnOnce(DVec3) -> DVec3) -> Result<(), String> {
        let last = |axis: usize| self.values[axis].last().copied().unwrap_or(f64::NAN);
        let placed = place(DVec3::from(self.axes.map(last)));
        for (axis, value) in self.axes.into_iter().zip(placed.to_array()) {
            coordinate(value)?;
            if let Some(last) = self.values[axis].last_mut() {
                *last = value;
            }
        }
        Ok(())
    }

    /// The particles, with a column `radius` made of `diameter` if `halve` and there is none.
    pub(super) fn finish(mut self, halve: bool) -> Particles {
        let [x, y, z] = self.axes.map(|axis| &self.values[axis]);
        let positions: Vec<DVec3> = (x.iter().zip(y).zip(z))
            .map(|((&x, &y), &z)| DVec3::new(x, y, z))
            .collect();
        let named = |name: &str| self.names.iter().position(|n| n == name);
        if halve
            && named("radius").is_none()
            && let Some(diameter) = named("diameter")
        {
            let radii = self.values[diameter].iter().map(|d| d / 2.0).collect();
            self.names.push("radius".into());
            self.kinds.push(Kind::Number);
            self.values.push(radii);
        }
        let kept = |kind: &Kind| !matches!(kind, Kind::Skipped | Kind::Element);
        let columns = self.names.into_iter().zip(self.values).zip(&self.kinds);
        Particles {
            columns: columns
                .filter(|(_, kind)| kept(kind))
                .map(|((name, values), _)| Column { name, values })
                .collect(),
            elements: Some(self.elements).filter(|e| e.iter().any(Option::is_some)),
            positions,
        }
    }

    fn name(&self, column: usize) -> String {
        shown(self.names[column].as_bytes())
    }
}

/// Refuses a number that is no coordinate.
fn coordinate(value: f64) -> Result<(), String> {
    if value.abs() <= LARGEST {
        return Ok(());
    }
    Err(if value.is_finite() {
        format!("the coordinate `{value:e}` is beyond {LARGEST:e}")
    } else {
        format!("the coordinate `{value}` is not finite")
    })
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::{Kind, Table};

    fn table(names: &[&str]) -> Result<Table, String> {
        let kind = |name: &&str| ((*name).to_owned(), Kind::of_name(name));
        Table::new(names.iter().map(kind).collect())
    }

    fn row(table: &mut Table, text: &str) -> Result<(), String> {
        let mut words = text.split(' ').enumerate();
        words.try_for_each(|(column, word)| table.push(column, word.as_bytes()))
    }

    #[test]
    fn columns_keep_their_order_and_words_are_left_out() {
        let mut table = table(&["z", "element", "who", "x", "y", "diameter"]).expect("a table");
        row(&mut table, "3 C a 1 2 4").expect("a row");
        row(&mut table, "6 Xx 7 4 5 3").expect("a row");
        table.place(|p| p * 2.0).expect("a place");
        let particles = table.finish(true);
        let positions = [DVec3::new(1.0, 2.0, 3.0), DVec3::new(8.0, 10.0, 12.0)];
        assert_eq!(particles.positions, positions);
        let names: Vec<&str> = particles.columns.iter().map(|c| c.name.as_str()).collect();
        assert_eq!(names, ["z", "x", "y", "diameter", "radius"]);
        assert_eq!(particles.column("z"), Some(&[3.0, 12.0][..]));
        assert_eq!(particles.column("radius"), Some(&[2.0, 1.5][..]));
        let elements = particles.elements.expect("one is known");
        assert_eq!(elements[0].map(|e| e.symbol()), Some("C"));
        assert_eq!(elements[1], None);
    }

    #[test]
    fn what_is_no_coordinate_is_refused() {
        for (word, wanted) in [
            ("nan", "`NaN` is not finite"),
            ("-inf", "`-inf` is not finite"),
            ("1e400", "is not finite"),
            ("1.0000001e20", "is beyond 1e20"),
            ("one", "`one` is not a number"),
        ] {
            let mut table = table(&["x", "y", "z"]).expect("a table");
            let fault = row(&mut table, &format!("0 {word} 0")).expect_err(word);
            assert!(fault.contains(wanted), "{fault}");
        }
        let mut table = table(&["x", "y", "z"]).expect("a table");
        row(&mut table, "1e20 -1e20 0").expect("just so");
        assert!(table.place(|p| p * 2.0).is_err());
    }

    #[test]
    fn radii_are_numbers() {
        let mut table = table(&["x", "y", "z", "radius"]).expect("a table");
        let fault = row(&mut table, "0 0 0 big").expect_err("no number");
        assert_eq!(fault, "the radius `big` is not a number");
    }

    #[test]
    fn columns_are_there_once() {
        assert!(table(&["x", "y", "z", "a", "b"]).is_ok());
        for names in [
            &["x", "y"][..],
            &["x", "y", "z", "a", "a"],
            &["x", "x", "y", "z"],
        ] {
            assert!(table(names).is_err(), "{names:?}");
        }
    }
}

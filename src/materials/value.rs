//! Values of parameters, and materials with other ones.

use glam::{DVec2, DVec3};
use serde::de::value::{Error, MapDeserializer, SeqDeserializer};
use serde::de::{DeserializeOwned, IntoDeserializer, Visitor};
use serde::{Deserializer, forward_to_deserialize_any};

/// The value of a parameter.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A number.
    Number(f64),
    /// A colour or a vector.
    Vector(DVec3),
    /// Two numbers.
    Pair(DVec2),
    /// Several colours or vectors.
    Vectors(Vec<DVec3>),
    /// Names of other materials.
    Names(Vec<String>),
    /// The name of a file, and a hash of what of it counts.
    File {
        /// As the scene file has it.
        name: String,
        /// That is the same for files with other names and the same content.
        content: u64,
    },
    /// An inline table.
    Table(Vec<(&'static str, Value)>),
}

/// The material of type `T` with these parameters, some of them with other values.
///
/// # Panics
/// If these are no parameters of such a material.
pub(super) fn made_of<T: DeserializeOwned>(
    mut parameters: Vec<(&'static str, Value)>,
    changes: &[(&'static str, Value)],
) -> T {
    for (key, value) in changes {
        match parameters.iter_mut().find(|(own, _)| own == key) {
            Some((_, own)) => *own = value.clone(),
            None => parameters.push((key, value.clone())),
        }
    }
    let table = MapDeserializer::<_, Error>::new(parameters.into_iter());
    T::deserialize(table).expect("a material has the parameters that it names")
}

impl IntoDeserializer<'_, Error> for Value {
    type Deserializer = Self;

    fn into_deserializer(self) -> Self {
        self
    }
}

impl<'de> Deserializer<'de> for Value {
    type Error = Error;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        match self {
            Self::Number(number) => visitor.visit_f64(number),
            Self::Vector(v) => visitor.visit_seq(SeqDeserializer::new(v.to_array().into_iter())),
            Self::Pair(v) => visitor.visit_seq(SeqDeserializer::new(v.to_array().into_iter())),
            Self::Vectors(all) => {
                visitor.visit_seq(SeqDeserializer::new(all.into_iter().map(Self::Vector)))
            }
            Self::Names(names) => visitor.visit_seq(SeqDeserializer::new(names.into_iter())),
            Self::File { name, .. } => visitor.visit_string(name),
            Self::Table(values) => visitor.visit_map(MapDeserializer::new(values.into_iter())),
        }
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        visitor.visit_some(self)
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf unit
        unit_struct newtype_struct seq tuple tuple_struct map struct enum identifier ignored_any
    }
}

#[cfg(test)]
mod tests {
    use crate::materials::ALL;

    #[test]
    fn materials_are_what_their_parameters_say() {
        for kind in ALL.iter().flat_map(|material| (material.cases)()) {
            let again = kind.with(&[]);
            assert_eq!(again.parameters(), kind.parameters());
            assert_eq!(again.members(), kind.members());
            assert_eq!(again.form(), kind.form());
        }
    }
}

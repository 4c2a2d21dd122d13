//! Which keys of materials may be textures.

use std::sync::LazyLock;

use schemars::SchemaGenerator;

use super::{ALL, Form, Member, Value, schema};

/// Emission, which all materials have.
pub const EMISSION: &str = "emission";
/// The key that decides whether a surface is smooth.
pub const ROUGHNESS: &str = "roughness";
/// The key of a mix that says how much of it the second material is.
pub const WEIGHT: &str = "weight";

/// A key of one type of materials whose value may be a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Texturable {
    /// The type in scene files; `None`: of all.
    pub material: Option<&'static str>,
    /// The key.
    pub key: &'static str,
    /// Whether it is a number, so that the red channel counts; else a colour.
    pub number: bool,
    /// The least value.
    pub minimum: f64,
    /// The largest one.
    pub maximum: f64,
}

/// All of them. A material's are those that its schema says may be a table like a texture: what has been through
/// [`schema::texture`].
pub fn texturable() -> &'static [Texturable] {
    static KEYS: LazyLock<Vec<Texturable>> = LazyLock::new(|| {
        let mut keys = vec![Texturable {
            material: None,
            key: EMISSION,
            number: false,
            minimum: 0.0,
            maximum: schema::MAX_MAGNITUDE,
        }];
        for material in ALL {
            let schema = (material.schema)(&mut SchemaGenerator::default());
            let properties = schema.get("properties").and_then(|p| p.as_object());
            for (key, value) in properties.into_iter().flatten() {
                if value["properties"]["checker"].is_null() {
                    continue;
                }
                let number = value["type"][0] == "number";
                let limits = if number { value } else { &value["items"] };
                keys.push(Texturable {
                    material: Some(material.name),
                    key: kept(key),
                    number,
                    minimum: limits["minimum"].as_f64().unwrap_or(f64::NEG_INFINITY),
                    maximum: limits["maximum"].as_f64().unwrap_or(f64::INFINITY),
                });
            }
        }
        keys
    });
    &KEYS
}

/// The names of all keys that may be textures, each once.
pub fn textured_keys() -> &'static [&'static str] {
    static NAMES: LazyLock<Vec<&'static str>> = LazyLock::new(|| {
        let mut names: Vec<&str> = texturable().iter().map(|t| t.key).collect();
        names.sort_unstable();
        names.dedup();
        names
    });
    &NAMES
}

/// The key of a type of materials, if it may be a texture.
#[must_use]
pub fn texturable_key(material: &str, key: &str) -> Option<&'static Texturable> {
    let mut all = texturable().iter();
    all.find(|t| t.key == key && t.material.is_none_or(|own| own == material))
}

impl Form {
    /// The keys of its material that may be textures, without emission.
    pub fn texturable(&self) -> impl Iterator<Item = &'static Texturable> {
        let own = self.material;
        texturable().iter().filter(move |t| t.material == Some(own))
    }

    /// The member that has the value of a key that may be a texture: the colour or vector of that name, or else the
    /// colour that all have; of a number one of its own ([`key_member`]).
    #[must_use]
    pub fn textured_member(&self, key: &Texturable) -> Member {
        let own = Member::vector(key.key);
        match key.number {
            true => key_member(key.key),
            false if self.members.contains(&own) => own,
            false => Member::vector("color"),
        }
    }

    /// The members that a kernel has of it beside its own where the keys of which `is_textured` says so are textures:
    /// numbers of the scene file from which others follow.
    pub fn members_of_keys(&self, is_textured: impl Fn(&str) -> bool) -> Vec<Member> {
        let textured: Vec<_> = self.texturable().filter(|t| is_textured(t.key)).collect();
        if textured.is_empty() {
            return Vec::new();
        }
        let numbers = textured.iter().filter(|t| t.number).map(|t| t.key);
        let read = self.derives.into_iter().flatten().copied();
        let mut keys: Vec<&'static str> = numbers.chain(read).collect();
        keys.sort_unstable();
        keys.dedup();
        keys.into_iter().map(key_member).collect()
    }
}

/// The member with the number of a key of a scene file, which other members are made of.
#[must_use]
pub fn key_member(key: &str) -> Member {
    Member::scalar(named("key", key))
}

/// The member that says which texture a key is.
#[must_use]
pub fn texture_member(key: &str) -> Member {
    Member::word(named("texture", key))
}

/// The member with the code of the form that a surface has where its roughness is 0.
#[must_use]
pub fn smooth_kind() -> Member {
    Member::word("smooth_kind")
}

/// The name of the effect of a key that is a texture.
#[must_use]
pub fn flag(key: &str) -> &'static str {
    named("textured", key)
}

/// The members with the numbers among these parameters.
pub fn key_values(parameters: Vec<(&'static str, Value)>) -> impl Iterator<Item = (Member, f64)> {
    parameters
        .into_iter()
        .filter_map(|(key, value)| match value {
            Value::Number(number) => Some((key_member(key), number)),
            _ => None,
        })
}

/// `what_key`.
fn named(what: &str, key: &str) -> &'static str {
    kept(&format!("{what}_{key}"))
}

/// A text for as long as the program runs, each once.
fn kept(text: &str) -> &'static str {
    use std::collections::BTreeSet;
    use std::sync::Mutex;
    static ALL: Mutex<BTreeSet<&'static str>> = Mutex::new(BTreeSet::new());
    let mut all = ALL
        .lock()
        .unwrap_or_else(std::sync::PoisonError::into_inner);
    if let Some(known) = all.get(text) {
        return known;
    }
    let text: &'static str = Box::leak(text.to_owned().into_boxed_str());
    all.insert(text);
    text
}

//! Checks a parsed scene file against the schema: keys, types, lengths and ranges.
//!
//! The schema is the JSON schema that `scene::file` declares, so this file knows no key by name.
//! Unlike a deserialiser it reports every mistake of a file, each with its place.

use std::ops::Range;

use serde_json::{Map, Value};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::range::{number, range};
use super::report::{Problem, Report};
use super::suggest::{list, nearest};

/// Reports everything in which the file differs from the schema.
pub(super) fn check(root: &DeTable<'_>, schema: &Value, report: &mut Report) {
    let place = Place {
        path: String::new(),
        name: "the scene file".to_owned(),
        header: 0..0,
    };
    table(root, schema, &place, report);
}

/// A table: its dotted path, empty for the whole file; how messages name it; where it begins.
struct Place {
    path: String,
    name: String,
    header: Range<usize>,
}

fn table(table: &DeTable<'_>, schema: &Value, place: &Place, report: &mut Report) {
    let Some(schema) = variant(table, schema, place, report) else {
        return;
    };
    let properties = &schema["properties"];
    for (key, value) in table {
        let name: &str = key.get_ref();
        if let Some(property) = properties.get(name) {
            check_value(name, value, property, place, report);
        } else if let Some(entry) = schema.get("additionalProperties").filter(|a| a.is_object()) {
            check_value(&quoted_key(name), value, entry, place, report);
        } else {
            report
                .errors
                .push(unknown_key(name, key.span(), properties, place));
        }
    }
    for key in schema["required"].as_array().into_iter().flatten() {
        let key = key.as_str().unwrap_or_default();
        if !table.contains_key(key) {
            // A misspelt key has been reported, with this one as the suggestion.
            let misspelt = table.keys().any(|other| {
                let other: &str = other.get_ref();
                properties.get(other).is_none()
                    && nearest(other, keys(properties.as_object())) == Some(key)
            });
            if !misspelt {
                report
                    .errors
                    .push(missing_key(key, &properties[key], place));
            }
        }
    }
}

/// The schema that holds for a table: of a `oneOf`, the variant that its `type` names.
fn variant<'s>(
    table: &DeTable<'_>,
    schema: &'s Value,
    place: &Place,
    report: &mut Report,
) -> Option<&'s Value> {
    let Some(variants) = schema["oneOf"].as_array() else {
        return Some(schema);
    };
    let tag = |variant: &'s Value| variant["properties"]["type"]["const"].as_str();
    let tags = || variants.iter().filter_map(tag);
    let Some(value) = table.get("type") else {
        // The type is guessed by the keys that are there.
        let fits = variants.iter().find(|variant| {
            table.len() > usize::from(table.contains_key("emission"))
                && table.keys().all(|key| {
                    let key: &str = key.get_ref();
                    variant["properties"].get(key).is_some()
                })
        });
        let problem = Problem::new(
            place.header.clone(),
            format!("`type` is missing in {}", place.name),
            "",
        );
        report.errors.push(match fits.and_then(tag) {
            Some(tag) => problem.help(format!("add `type = \"{tag}\"`")),
            None => problem.help(format!("add `type`: one of {}", list(tags(), "or"))),
        });
        return None;
    };
    let Some(name) = value.get_ref().as_str() else {
        report.errors.push(wrong_type("type", value, "a string"));
        return None;
    };
    let found = variants.iter().find(|variant| tag(variant) == Some(name));
    let Some(found) = found else {
        report
            .errors
            .push(unknown_choice("type", name, value.span(), tags()));
        return None;
    };
    // A key of another type is a misunderstanding rather than a typing error, and is explained.
    let mut clean = true;
    for key in table.keys() {
        let key_name: &str = key.get_ref();
        if found["properties"].get(key_name).is_some() {
            continue;
        }
        let owners = variants
            .iter()
            .filter(|variant| variant["properties"].get(key_name).is_some())
            .filter_map(tag);
        let owners = list(owners, "and");
        if !owners.is_empty() {
            clean = false;
            let message = format!("a {name} material has no `{key_name}`");
            let label = format!("belongs to {owners}");
            let own = found["properties"].as_object();
            report.errors.push(
                Problem::new(key.span(), message, label)
                    .also(value.span(), "the type is chosen here")
                    .help(format!("{name} takes {}", list(keys(own), "and"))),
            );
        }
    }
    // With such a key the other complaints about this table would say the same again.
    clean.then_some(found)
}

fn check_value(
    name: &str,
    value: &Spanned<DeValue<'_>>,
    schema: &Value,
    place: &Place,
    report: &mut Report,
) {
    let kind = match schema["type"].as_array() {
        // A number, or a word, or an array, or a table.
        Some(kinds) => kinds
            .iter()
            .filter_map(Value::as_str)
            .find(|kind| match value.get_ref() {
                DeValue::String(_) => *kind == "string",
                DeValue::Array(_) => *kind == "array",
                DeValue::Table(_) => *kind == "object",
                _ => *kind == "number",
            })
            .or(kinds[0].as_str())
            .unwrap_or("number"),
        None => schema["type"].as_str().unwrap_or("object"),
    };
    match (kind, value.get_ref()) {
        ("object", DeValue::Table(inner)) => {
            let path = match place.path.as_str() {
                "" => name.to_owned(),
                outer => format!("{outer}.{name}"),
            };
            let place = Place {
                name: format!("`[{path}]`"),
                path,
                header: value.span(),
            };
            table(inner, schema, &place, report);
        }
        ("array", DeValue::Array(items)) => {
            length(name, value.span(), items.len(), schema, report);
            for item in items.iter() {
                if let DeValue::Table(inner) = item.get_ref() {
                    let place = Place {
                        path: name.to_owned(),
                        name: format!("this `[[{name}]]`"),
                        header: item.span(),
                    };
                    table(inner, &schema["items"], &place, report);
                } else {
                    check_value(name, item, &schema["items"], place, report);
                }
            }
        }
        ("number", DeValue::Integer(_) | DeValue::Float(_)) | ("integer", DeValue::Integer(_)) => {
            if let Some(problem) = range(name, value, schema) {
                report.errors.push(problem);
            }
        }
        ("boolean", DeValue::Boolean(_)) => {}
        ("string", DeValue::String(text)) => {
            let choices = schema["enum"].as_array();
            let choices = || choices.into_iter().flatten().filter_map(Value::as_str);
            if choices().next().is_some() && !choices().any(|choice| choice == text) {
                report
                    .errors
                    .push(unknown_choice(name, text, value.span(), choices()));
            }
        }
        ("object", DeValue::Array(_)) => {
            let problem = wrong_type(name, value, "one table");
            report
                .errors
                .push(problem.help(format!("write `[{name}]`, with one bracket")));
        }
        ("array", _) if schema["items"]["type"] == "object" => {
            let problem = wrong_type(name, value, "an array of tables");
            report
                .errors
                .push(problem.help(format!("write `[[{name}]]`, with two brackets")));
        }
        ("array", DeValue::Integer(_) | DeValue::Float(_)) => {
            let number = number(value.get_ref()).unwrap_or_default();
            let problem = wrong_type(name, value, &an_array(schema));
            report.errors.push(match schema["minItems"].as_u64() {
                Some(3) => problem.help(format!(
                    "for the same value three times write `[{number}, {number}, {number}]`"
                )),
                _ => problem,
            });
        }
        ("integer", DeValue::Float(_)) => {
            let problem = wrong_type(name, value, "an integer");
            report
                .errors
                .push(problem.help("write it without a decimal point or exponent"));
        }
        ("number" | "integer", DeValue::String(text)) if text.trim().parse::<f64>().is_ok() => {
            let problem = wrong_type(name, value, &format!("a{} {kind}", n(kind)));
            report.errors.push(problem.help("remove the quotes"));
        }
        ("array", _) => report
            .errors
            .push(wrong_type(name, value, &an_array(schema))),
        ("object", _) => report.errors.push(wrong_type(name, value, "a table")),
        _ => {
            let wanted = format!("a{} {kind}", n(kind));
            report.errors.push(wrong_type(name, value, &wanted));
        }
    }
}

/// What a vector or a matrix is.
fn an_array(schema: &Value) -> String {
    let count = |schema: &Value| schema["minItems"].as_u64().unwrap_or_default();
    if schema["items"]["type"] == "string" {
        return format!("an array of {} names", count(schema));
    }
    match count(&schema["items"]) {
        0 => format!("an array of {} numbers", count(schema)),
        inner => format!("an array of {} arrays of {inner} numbers", count(schema)),
    }
}

/// The "n" of "an".
fn n(word: &str) -> &'static str {
    if word.starts_with('i') { "n" } else { "" }
}

fn length(name: &str, span: Range<usize>, length: usize, schema: &Value, report: &mut Report) {
    let Some(wanted) = schema["minItems"].as_u64() else {
        return;
    };
    if length as u64 != wanted {
        let what = match schema["items"]["minItems"].as_u64() {
            // Of a texture.
            Some(_) if wanted == 2 => "values",
            Some(_) => "rows",
            None if schema["items"]["type"] == "string" => "names",
            None => "numbers",
        };
        let has = if length == 0 {
            "none".to_owned()
        } else {
            length.to_string()
        };
        report.errors.push(Problem::new(
            span,
            format!("`{name}` must have exactly {wanted} {what}"),
            format!("has {has}"),
        ));
    }
}

fn unknown_key(name: &str, span: Range<usize>, properties: &Value, place: &Place) -> Problem {
    let known = || keys(properties.as_object());
    let label =
        nearest(name, known()).map_or_else(String::new, |key| format!("did you mean `{key}`?"));
    let message = format!("unknown key `{}` in {}", name.escape_debug(), place.name);
    Problem::new(span, message, label).help(format!("the keys here are {}", list(known(), "and")))
}

fn missing_key(key: &str, schema: &Value, place: &Place) -> Problem {
    let message = format!("`{key}` is missing in {}", place.name);
    let problem = Problem::new(place.header.clone(), message, "");
    let description = schema["description"].as_str().unwrap_or_default();
    let kind = schema["type"].as_str().or(schema["type"][0].as_str());
    let example = match kind {
        Some("object") => {
            let inner = schema["required"].as_array();
            let inner = inner.into_iter().flatten().filter_map(Value::as_str);
            format!("add a table `[{key}]` with {}", list(inner, "and"))
        }
        Some("array") => format!("add `{key} = […, …, …]`: {}", lower_first(description)),
        _ => format!("add `{key} = …`: {}", lower_first(description)),
    };
    problem.help(example.trim_end_matches('.'))
}

fn lower_first(text: &str) -> String {
    let line = text.lines().next().unwrap_or_default();
    let mut chars = line.chars();
    chars.next().map_or_else(String::new, |first| {
        first.to_lowercase().chain(chars).collect()
    })
}

fn wrong_type(name: &str, value: &Spanned<DeValue<'_>>, wanted: &str) -> Problem {
    let is = match value.get_ref() {
        DeValue::String(_) => "a string",
        DeValue::Integer(_) => "an integer",
        DeValue::Float(_) => "a number",
        DeValue::Boolean(_) => "a boolean",
        DeValue::Datetime(_) => "a date",
        DeValue::Array(_) => "an array",
        DeValue::Table(_) => "a table",
    };
    Problem::new(
        value.span(),
        format!("`{name}` must be {wanted}"),
        format!("this is {is}"),
    )
}

fn unknown_choice<'c>(
    name: &str,
    text: &str,
    span: Range<usize>,
    choices: impl Iterator<Item = &'c str> + Clone,
) -> Problem {
    let label = nearest(text, choices.clone())
        .map_or_else(String::new, |choice| format!("did you mean \"{choice}\"?"));
    let message = format!("unknown {name} \"{}\"", text.escape_debug());
    Problem::new(span, message, label).help(format!("`{name}` is one of {}", list(choices, "or")))
}

/// A key as TOML would write it in a header.
fn quoted_key(name: &str) -> String {
    let bare = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if !name.is_empty() && name.chars().all(bare) {
        name.to_owned()
    } else {
        format!("{name:?}")
    }
}

fn keys(object: Option<&Map<String, Value>>) -> impl Iterator<Item = &str> + Clone {
    object
        .into_iter()
        .flat_map(|object| object.keys().map(String::as_str))
}

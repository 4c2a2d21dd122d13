//! Checks a number of a scene file against the bounds of the schema.

use serde_json::Value;
use toml::Spanned;
use toml::de::DeValue;

use super::report::Problem;
use crate::materials::schema::MAX_MAGNITUDE;

/// What is wrong with a number's value, if anything.
pub(super) fn range(name: &str, value: &Spanned<DeValue<'_>>, schema: &Value) -> Option<Problem> {
    let number = number(value.get_ref()).unwrap_or(f64::NAN);
    let integer = schema["type"] == "integer";
    let bound = |key: &str| schema[key].as_f64();
    let (minimum, above) = (bound("minimum"), bound("exclusiveMinimum"));
    let (maximum, below) = (bound("maximum"), bound("exclusiveMaximum"));
    // Not a number is in no range, whichever way the comparison is written.
    let inside = minimum.is_none_or(|m| number >= m)
        && above.is_none_or(|m| number > m)
        && maximum.is_none_or(|m| number <= m)
        && below.is_none_or(|m| number < m);
    // The decoder reads integers as i64, also for keys that take any number.
    let fits = match value.get_ref() {
        DeValue::Integer(digits) => {
            i64::from_str_radix(digits.as_str(), digits.radix()).is_ok() || integer
        }
        _ => true,
    };
    if inside && fits && number.is_finite() {
        return None;
    }
    let noun = if integer { "an integer " } else { "" };
    let low = minimum.or(above).unwrap_or(f64::NEG_INFINITY);
    let high = maximum.or(below).unwrap_or(f64::INFINITY);
    let wanted = if !number.is_finite() && (number.is_nan() || !integer) {
        "a finite number".to_owned()
    } else if inside {
        "written as a decimal number, with a point".to_owned()
    } else if low.is_finite() && (high < MAX_MAGNITUDE || low < 0.0) {
        let open = if above.is_some() { '(' } else { '[' };
        let close = if below.is_some() { ')' } else { ']' };
        format!("{noun}in {open}{}, {}{close}", show(low), show(high))
    } else if number > high {
        format!("at most {}", show(high))
    } else if above.is_some() {
        format!("greater than {}", show(low))
    } else {
        format!("at least {}", show(low))
    };
    let label = if number.is_nan() {
        "not a number".to_owned()
    } else if number.is_infinite() {
        let written = value.get_ref().as_float().map_or("", |f| f.as_str());
        let named = written.contains("inf");
        (if named {
            "infinite"
        } else {
            "too large for 64 bits"
        })
        .to_owned()
    } else if inside {
        "too many digits for an integer".to_owned()
    } else if number > high || below.is_some_and(|m| number >= m) {
        "too large".to_owned()
    } else if number < 0.0 && low >= 0.0 {
        "negative".to_owned()
    } else {
        "too small".to_owned()
    };
    Some(Problem::new(
        value.span(),
        format!("`{name}` must be {wanted}"),
        label,
    ))
}

/// A bound as people write it: 65536, 0.5, 1e20.
fn show(bound: f64) -> String {
    if bound.abs() >= 1e16 {
        format!("{bound:e}")
    } else {
        format!("{bound}")
    }
}

/// The number of a TOML integer or float; `None` for other values.
pub(super) fn number(value: &DeValue<'_>) -> Option<f64> {
    match value {
        DeValue::Float(float) => float.as_str().parse().ok(),
        DeValue::Integer(integer) if integer.radix() == 10 => integer.as_str().parse().ok(),
        // Longer than i128 is far outside of every range.
        DeValue::Integer(integer) => Some(
            i128::from_str_radix(integer.as_str(), integer.radix())
                .map_or(f64::MAX, |integer| integer as f64),
        ),
        _ => None,
    }
}

//! Checks a number of a scene file against the bounds of the schema.

use serde_json::Value;
use toml::Spanned;
use toml::de::DeValue;

use super::report::Problem;
use crate::materials::schema::MAX_MAGNITUDE;

/// Between which bounds a number of a schema is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    low: f64,
    high: f64,
    /// Whether the bounds themselves are not among the values.
    open: [bool; 2],
    integer: bool,
}

impl Limits {
    /// Those of a number's schema.
    pub(super) fn of(schema: &Value) -> Self {
        let bound = |key: &str| schema[key].as_f64();
        let (minimum, above) = (bound("minimum"), bound("exclusiveMinimum"));
        let (maximum, below) = (bound("maximum"), bound("exclusiveMaximum"));
        Self {
            low: minimum.or(above).unwrap_or(f64::NEG_INFINITY),
            high: maximum.or(below).unwrap_or(f64::INFINITY),
            open: [above.is_some(), below.is_some()],
            integer: schema["type"] == "integer",
        }
    }

    /// The same as f32 has them: values that were f32 may be at such a bound.
    pub(super) fn rounded(self) -> Self {
        let [low, high] = [self.low, self.high].map(|bound| f64::from(bound as f32));
        Self {
            low: self.low.min(low),
            high: self.high.max(high),
            ..self
        }
    }

    /// Whether a number is within. What is no number is in no range.
    pub(super) fn hold(self, number: f64) -> bool {
        let [above, below] = self.open;
        let is_high = if above {
            number > self.low
        } else {
            number >= self.low
        };
        let is_low = if below {
            number < self.high
        } else {
            number <= self.high
        };
        is_high && is_low
    }

    /// What a number that is not within must be.
    pub(super) fn wanted(self, number: f64) -> String {
        let Self { low, high, .. } = self;
        let noun = if self.integer { "an integer " } else { "" };
        if !number.is_finite() && (number.is_nan() || !self.integer) {
            "a finite number".to_owned()
        } else if low.is_finite() && (high < MAX_MAGNITUDE || low < 0.0) {
            let open = if self.open[0] { '(' } else { '[' };
            let close = if self.open[1] { ')' } else { ']' };
            format!("{noun}in {open}{}, {}{close}", show(low), show(high))
        } else if number > high {
            format!("at most {}", show(high))
        } else if self.open[0] {
            format!("greater than {}", show(low))
        } else {
            format!("at least {}", show(low))
        }
    }
}

/// What is wrong with a number's value, if anything.
pub(super) fn range(name: &str, value: &Spanned<DeValue<'_>>, schema: &Value) -> Option<Problem> {
    let number = number(value.get_ref()).unwrap_or(f64::NAN);
    let limits = Limits::of(schema);
    let inside = limits.hold(number);
    // The decoder reads integers as i64, also for keys that take any number.
    let fits = match value.get_ref() {
        DeValue::Integer(digits) => {
            i64::from_str_radix(digits.as_str(), digits.radix()).is_ok() || limits.integer
        }
        _ => true,
    };
    if inside && fits && number.is_finite() {
        return None;
    }
    let wanted = match inside && number.is_finite() {
        true => "written as a decimal number, with a point".to_owned(),
        false => limits.wanted(number),
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
    } else if number > limits.high || limits.open[1] && number >= limits.high {
        "too large".to_owned()
    } else if number < 0.0 && limits.low >= 0.0 {
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

/// A number as people write it: 65536, 0.5, 1e20.
pub(super) fn show(bound: f64) -> String {
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

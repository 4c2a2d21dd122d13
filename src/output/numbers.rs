//! Numbers as people read them.

/// A fraction with three digits, as in `1.23 %`.
#[must_use]
pub fn percent(fraction: f64) -> String {
    format!("{} %", significant(100.0 * fraction))
}

/// A number with three digits.
#[must_use]
pub fn significant(number: f64) -> String {
    if number == 0.0 {
        return "0".into();
    }
    if !number.is_finite() {
        return number.to_string();
    }
    // Rounded first: 0.9999 has the exponent of 1.
    let rounded = format!("{number:.2e}");
    match rounded.split_once('e').map(|(_, e)| e.parse::<i32>()) {
        Some(Ok(exponent @ -4..5)) => {
            let decimals = (2 - exponent).max(0) as usize;
            format!("{number:.decimals$}")
        }
        _ => rounded,
    }
}

#[cfg(test)]
mod tests {
    use super::significant;

    #[test]
    fn numbers_have_three_digits() {
        for (number, text) in [
            (0.0, "0"),
            (-0.0, "0"),
            (0.99996, "1.00"),
            (-0.012345, "-0.0123"),
            (12.345, "12.3"),
            (99_999.0, "1.00e5"),
            (12_345.0, "12345"),
            (0.000_012, "1.20e-5"),
            (f64::INFINITY, "inf"),
        ] {
            assert_eq!(significant(number), text);
        }
    }
}

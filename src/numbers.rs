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

/// Seconds as people say them: `0.123 s`, `12.3 s`, `12 min 30 s`, `3 h 12 min`, `5 d 2 h`.
#[must_use]
pub fn duration(seconds: f64) -> String {
    if seconds < 99.95 || !seconds.is_finite() {
        return format!("{} s", significant(seconds));
    }
    let whole = |unit: f64| (seconds / unit).round() as u64;
    match whole(1.0) {
        0..7200 => format!("{} min {} s", whole(1.0) / 60, whole(1.0) % 60),
        7200..172_800 => format!("{} h {} min", whole(60.0) / 60, whole(60.0) % 60),
        _ => format!("{} d {} h", whole(3600.0) / 24, whole(3600.0) % 24),
    }
}

#[cfg(test)]
mod tests {
    use super::{duration, significant};

    #[test]
    fn durations_are_short() {
        for (seconds, text) in [
            (0.01234, "0.0123 s"),
            (99.94, "99.9 s"),
            (99.96, "1 min 40 s"),
            (3599.6, "60 min 0 s"),
            (7199.4, "119 min 59 s"),
            (7229.0, "2 h 0 min"),
            (7231.0, "2 h 1 min"),
            (10_799.0, "3 h 0 min"),
            (200_000.0, "2 d 8 h"),
        ] {
            assert_eq!(duration(seconds), text);
        }
    }

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

//! Values of options that have a form of their own, parsed as they are typed.

use std::ops::Range;
use std::time::Duration;

use crate::settings::Rect;

/// The largest side of an image: the sample stream packs a pixel into 32 bits.
const SIDE: u32 = 65536;

/// `1%` or `0.01`: a fraction above 0.
pub(super) fn error(text: &str) -> Result<f64, String> {
    let (number, scale) = match text.strip_suffix('%') {
        Some(number) => (number.trim_end(), 0.01),
        None => (text, 1.0),
    };
    let value = number
        .parse::<f64>()
        .map_err(|_| "not a number; try 1% or 0.01")?
        * scale;
    if !(value.is_finite() && value > 0.0) {
        return Err("an error to reach is above 0; try 1% or 0.01".into());
    }
    if value >= 1.0 {
        return Err(format!(
            "{} % is no error to aim for; for {value} % write {value}%",
            value * 100.0
        ));
    }
    Ok(value)
}

/// `30s`, `2m`, `1h 30m`, or a number of seconds.
pub(super) fn time(text: &str) -> Result<Duration, String> {
    let seconds = text.parse::<f64>().ok().map(Duration::try_from_secs_f64);
    let duration = match seconds {
        Some(duration) => duration.map_err(|e| e.to_string())?,
        None => humantime::parse_duration(text).map_err(|e| format!("{e}; try 30s or 2m"))?,
    };
    if duration.is_zero() {
        return Err("no time at all".into());
    }
    Ok(duration)
}

/// A number of samples, at least 1.
pub(super) fn count(text: &str) -> Result<u64, String> {
    match text.parse::<u64>() {
        Ok(0) => Err("at least 1".into()),
        Ok(n) if n > 1 << 48 => Err("at most 2^48".into()),
        Ok(n) => Ok(n),
        Err(e) => Err(e.to_string()),
    }
}

/// `A..B`: from sample index A up to, not including, B.
pub(super) fn range(text: &str) -> Result<Range<u64>, String> {
    let form = "write A..B, as in 0..256 (B is not included)";
    let (a, b) = text.split_once("..").ok_or(form)?;
    let parse = |n: &str| n.trim().parse::<u64>().map_err(|_| form.to_owned());
    let range = parse(a)?..parse(b)?;
    if range.is_empty() {
        return Err(format!("no sample lies in {text}; {form}"));
    }
    if range.end > 1 << 48 {
        return Err("sample indices go up to 2^48".into());
    }
    Ok(range)
}

/// `WxH`, in pixels.
pub(super) fn size(text: &str) -> Result<(u32, u32), String> {
    let form = "write WIDTHxHEIGHT, as in 640x480";
    let (w, h) = text.split_once(['x', 'X', '×']).ok_or(form)?;
    let parse = |n: &str| n.trim().parse::<u32>().map_err(|_| form.to_owned());
    let (w, h) = (parse(w)?, parse(h)?);
    if w == 0 || h == 0 {
        return Err("an image has at least one pixel".into());
    }
    if w > SIDE || h > SIDE {
        return Err(format!("at most {SIDE} pixels a side"));
    }
    Ok((w, h))
}

/// `X,Y,WxH`, in pixels from the top left.
pub(super) fn crop(text: &str) -> Result<Rect, String> {
    let form = "write X,Y,WIDTHxHEIGHT, as in 100,50,64x64";
    let mut parts = text.splitn(3, ',');
    let mut number = || -> Result<u32, String> {
        parts
            .next()
            .and_then(|n| n.trim().parse().ok())
            .ok_or_else(|| form.to_owned())
    };
    let (x, y) = (number()?, number()?);
    let (width, height) = size(parts.next().ok_or(form)?.trim())?;
    Ok(Rect {
        x,
        y,
        width,
        height,
    })
}

/// A probability, in [0, 1).
pub(super) fn termination(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(p) if (0.0..1.0).contains(&p) => Ok(p),
        Ok(_) => Err("a probability of termination is at least 0 and below 1".into()),
        Err(e) => Err(e.to_string()),
    }
}

/// Exposure in EV steps.
pub(super) fn exposure(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(ev) if ev.abs() <= 100.0 => Ok(ev),
        Ok(_) => Err("an exposure lies between -100 and 100 EV".into()),
        Err(e) => Err(e.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_fractions_or_percent() {
        assert_eq!(error("1%"), Ok(0.01));
        assert_eq!(error("0.5 %"), Ok(0.005));
        assert_eq!(error("0.02"), Ok(0.02));
        for wrong in ["", "%", "0", "-1%", "nan", "inf", "2", "150%", "one"] {
            assert!(error(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn times_have_units_or_are_seconds() {
        assert_eq!(time("30s"), Ok(Duration::from_secs(30)));
        assert_eq!(time("1h 30m"), Ok(Duration::from_secs(5400)));
        assert_eq!(time("0.5"), Ok(Duration::from_millis(500)));
        for wrong in ["", "0", "0s", "-3", "nan", "ten", "1e300"] {
            assert!(time(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn ranges_sizes_and_crops() {
        assert_eq!(range("16..48"), Ok(16..48));
        assert_eq!(size("640x480"), Ok((640, 480)));
        assert_eq!(
            crop("1,2,3x4"),
            Ok(Rect {
                x: 1,
                y: 2,
                width: 3,
                height: 4
            })
        );
        for wrong in ["", "3", "5..5", "6..5", "a..b", "0..=5", "-1..2"] {
            assert!(range(wrong).is_err(), "{wrong}");
        }
        for wrong in ["", "640", "0x4", "4x0", "x", "70000x1", "-1x5"] {
            assert!(size(wrong).is_err(), "{wrong}");
        }
        for wrong in ["", "1,2", "1,2,3", "1,2,0x4", "a,2,3x4", "1,2,3x4,5"] {
            assert!(crop(wrong).is_err(), "{wrong}");
        }
    }
}

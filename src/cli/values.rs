//! Values of options that have a form of their own, parsed as they are typed.

use std::ops::Range;
use std::time::Duration;

use glam::DVec3;

use crate::materials::schema::MAX_MAGNITUDE;
use crate::scene::trajectory::Frames;
use crate::scene::{MAX_SIDE, MAX_SPP};
use crate::settings::{Rect, TERMINATIONS};

/// One past the largest sample index.
const SAMPLES: u64 = MAX_SPP;

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
        // Without a sign, percent were probably meant.
        let meant = match text.ends_with('%') {
            true => String::from("aim for less than 100%"),
            false => format!("for {text} % write {text}%"),
        };
        return Err(format!(
            "{} % is no error to aim for; {meant}",
            value * 100.0
        ));
    }
    Ok(value)
}

/// `1%` or `0.01`: a fraction of 0 or more. Numbers above 1 need the sign, or percent were meant.
pub(super) fn tolerance(text: &str) -> Result<f64, String> {
    let (number, scale) = match text.strip_suffix('%') {
        Some(number) => (number.trim_end(), 0.01),
        None => (text, 1.0),
    };
    let value = number
        .parse::<f64>()
        .map_err(|_| "not a number; try 1% or 0.01")?
        * scale;
    if !(value.is_finite() && value >= 0.0) {
        return Err("a tolerance is 0 or more; try 1% or 0.01".into());
    }
    if scale == 1.0 && value > 1.0 {
        return Err(format!(
            "{} % is very much; for {text} % write {text}%",
            value * 100.0
        ));
    }
    Ok(value)
}

/// Pixels per degree of visual angle.
pub(super) fn pixels_per_degree(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(ppd) if (1.0..=1000.0).contains(&ppd) => Ok(ppd),
        _ => Err("a number from 1 to 1000, as in 67".into()),
    }
}

/// `30s`, `2m`, `1h 30m`, or a number of seconds.
pub(super) fn time(text: &str) -> Result<Duration, String> {
    let form = "try 30s, 2m, or a number of seconds";
    let seconds = text.parse::<f64>().ok().map(Duration::try_from_secs_f64);
    let duration = match seconds {
        Some(duration) => {
            duration.map_err(|_| format!("no time that can be waited for; {form}"))?
        }
        None => humantime::parse_duration(text).map_err(|e| format!("{e}; {form}"))?,
    };
    if duration.is_zero() {
        return Err(format!("no time at all; {form}"));
    }
    Ok(duration)
}

/// A number of samples, at least 1.
pub(super) fn count(text: &str) -> Result<u64, String> {
    match text.parse::<u64>() {
        Ok(n @ 1..=SAMPLES) => Ok(n),
        _ => Err("a whole number from 1 to 2^48, as in 256".into()),
    }
}

/// A seed: any 64 bits.
pub(super) fn seed(text: &str) -> Result<u64, String> {
    text.parse()
        .map_err(|_| "a whole number from 0 to 2^64 - 1".into())
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
    if range.end > SAMPLES {
        return Err("sample indices go up to 2^48".into());
    }
    Ok(range)
}

/// `A..B..STEP`, `A..B`, `A..` or `A....STEP`: each STEP-th frame from A up to, not including, B or the end.
pub(super) fn frames(text: &str) -> Result<Frames, String> {
    let form =
        "write A..B..STEP, as in 0..100..10 (100 is not included), A..B, or A.. for all from A on";
    let number = |n: &str| n.trim().parse::<u64>().map_err(|_| form.to_owned());
    let (first, rest) = text.split_once("..").ok_or(form)?;
    let (end, step) = match rest.split_once("..") {
        Some((end, step)) => (end, number(step)?),
        None => (rest, 1),
    };
    let frames = Frames {
        first: number(first)?,
        end: (!end.trim().is_empty()).then(|| number(end)).transpose()?,
        step,
    };
    if step == 0 || frames.end.is_some_and(|end| end <= frames.first) {
        return Err(format!("no frame lies in {text}; {form}"));
    }
    Ok(frames)
}

/// `white`, `black` or `R,G,B`: a radiance.
pub(super) fn background(text: &str) -> Result<DVec3, String> {
    let wrong = || {
        format!(
            "neither white nor black nor three numbers from 0 to {MAX_MAGNITUDE:e}, as in 0.5,0.6,1"
        )
    };
    let numbers: Vec<f64> = match text {
        "white" => vec![1.0; 3],
        "black" => vec![0.0; 3],
        _ => {
            let numbers = text.split(',').map(|number| number.trim().parse());
            numbers.collect::<Result<_, _>>().map_err(|_| wrong())?
        }
    };
    let [r, g, b] = numbers[..] else {
        return Err(wrong());
    };
    let fits = [r, g, b].iter().all(|x| (0.0..=MAX_MAGNITUDE).contains(x));
    // Without negative zeros.
    if fits {
        Ok(DVec3::new(r, g, b) + 0.0)
    } else {
        Err(wrong())
    }
}

/// `WxH`, in pixels.
pub(super) fn size(text: &str) -> Result<(u32, u32), String> {
    extent(text, "write WIDTHxHEIGHT, as in 640x480")
}

/// A width and a height; `form` says how to write what they are part of.
fn extent(text: &str, form: &str) -> Result<(u32, u32), String> {
    let (w, h) = text.split_once(['x', 'X', '×']).ok_or(form)?;
    let parse = |n: &str| n.trim().parse::<u32>().map_err(|_| form.to_owned());
    let (w, h) = (parse(w)?, parse(h)?);
    if w == 0 || h == 0 {
        return Err(format!("an image has at least one pixel; {form}"));
    }
    if w > MAX_SIDE || h > MAX_SIDE {
        return Err(format!("at most {MAX_SIDE} pixels a side; {form}"));
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
    let (width, height) = extent(parts.next().ok_or(form)?.trim(), form)?;
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
        Ok(p) if TERMINATIONS.contains(&p) => Ok(p),
        _ => Err("a probability from 0 to below 1, as in 0.2".into()),
    }
}

/// Exposure in EV steps.
pub(super) fn exposure(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(ev) if ev.abs() <= 100.0 => Ok(ev),
        _ => Err("a number from -100 to 100, as in 1.5".into()),
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
    fn percent_is_suggested_where_it_was_meant() {
        assert!(error("2").is_err_and(|text| text.contains("for 2 % write 2%")));
        assert!(error("200%").is_err_and(|text| !text.contains("write")));
    }

    #[test]
    fn tolerances_may_be_none_or_large() {
        assert_eq!(tolerance("1%"), Ok(0.01));
        assert_eq!(tolerance("0"), Ok(0.0));
        assert_eq!(tolerance("150 %"), Ok(1.5));
        assert!(tolerance("2").is_err_and(|text| text.contains("write 2%")));
        for wrong in ["", "%", "-1%", "nan", "inf", "1e400", "much"] {
            assert!(tolerance(wrong).is_err(), "{wrong}");
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

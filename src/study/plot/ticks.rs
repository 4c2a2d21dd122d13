//! The grid of logarithmic axes.

/// A line of the grid.
pub(super) struct Tick {
    /// Its value.
    pub(super) at: f64,
    /// Whether it is a strong one.
    pub(super) major: bool,
    /// Whether it has a number.
    pub(super) labelled: bool,
}

/// Ticks at 1 to 9 times powers of ten; where a decade has `room`, 2 and 5 have numbers too.
pub(super) fn decades([low, high]: [f64; 2], room: bool) -> Vec<Tick> {
    let powers = low.log10().floor() as i32..=high.log10().ceil() as i32;
    let ticks = powers.flat_map(|power| {
        (1..10).map(move |digit| Tick {
            at: f64::from(digit) * 10f64.powi(power),
            major: digit == 1,
            labelled: digit == 1 || room && (digit == 2 || digit == 5),
        })
    });
    ticks.filter(|t| (low..=high).contains(&t.at)).collect()
}

/// Ticks at powers of two, `room` pixels apart; so many of them have numbers as fit.
pub(super) fn doublings([low, high]: [f64; 2], room: f64) -> Vec<Tick> {
    let step = match 38.0 / room {
        n if n < 1.0 => 1,
        n if n < 2.0 => 2,
        _ => 4,
    };
    let powers = low.log2().ceil() as i32..=high.log2().floor() as i32;
    let tick = |power: i32| Tick {
        at: 2f64.powi(power),
        major: power % step == 0,
        labelled: power % step == 0,
    };
    powers.map(tick).collect()
}

/// A number of a tick, which has one digit or is a whole power of two.
pub(super) fn plain(value: f64) -> String {
    let decimals = (-(value * 1.000_001).log10().floor()).max(0.0) as usize;
    format!("{value:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_have_short_numbers() {
        for (value, text) in [
            (0.01, "0.01"),
            (0.5, "0.5"),
            (1.0, "1"),
            (1024.0, "1024"),
            (0.1 * 100.0, "10"),
        ] {
            assert_eq!(plain(value), text);
        }
        let labelled = |ticks: Vec<Tick>| ticks.iter().filter(|t| t.labelled).count();
        assert_eq!(labelled(decades([0.9, 11.0], true)), 4);
        assert_eq!(labelled(decades([0.01, 1000.0], false)), 6);
        assert_eq!(labelled(doublings([1.0, 1024.0], 30.0)), 6);
    }
}

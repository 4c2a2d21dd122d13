//! Where values lie in the picture.

use super::Curve;

pub(super) const HEIGHT: f64 = 400.0;
pub(super) const LEFT: f64 = 58.0;
pub(super) const TOP: f64 = 58.0;
pub(super) const BOTTOM: f64 = 50.0;
/// Width of a character of a label, on average.
const CHARACTER: f64 = 7.0;

/// Where values lie in the picture.
pub(super) struct Frame {
    /// What the horizontal axis runs over.
    pub(super) x: [f64; 2],
    /// The same of the vertical one.
    pub(super) y: [f64; 2],
    /// Of the plot.
    pub(super) width: f64,
    /// The room beside the frame, where labels go on.
    pub(super) right: f64,
}

impl Frame {
    /// The frame of `curves` in a plot of width `whole`; `None` if there is no point.
    pub(super) fn of(curves: &[Curve], whole: f64) -> Option<Self> {
        let points = || curves.iter().flat_map(|c| &c.points);
        let bands = || curves.iter().flat_map(|c| &c.band);
        let x = range(points().map(|p| p.0))?;
        let y = range(
            points()
                .map(|p| p.1)
                .chain(bands().flat_map(|b| [b.1, b.2])),
        )?;
        let (x, y) = (padded(x, 1.25), padded(y, 1.25));
        let room = whole - LEFT;
        let right = curves.iter().filter_map(|curve| {
            let end = share(x, curve.points.last()?.0);
            Some(room - (room - 16.0 - width(&curve.label)) / end)
        });
        Some(Self {
            x,
            y,
            width: whole,
            right: right.fold(14.0, f64::max).min(0.45 * whole),
        })
    }

    /// The place of a value on the horizontal axis.
    pub(super) fn x(&self, value: f64) -> f64 {
        LEFT + share(self.x, value) * (self.width - LEFT - self.right)
    }

    /// The same on the vertical one.
    pub(super) fn y(&self, value: f64) -> f64 {
        HEIGHT - BOTTOM - share(self.y, value) * (HEIGHT - TOP - BOTTOM)
    }
}

fn share(range: [f64; 2], value: f64) -> f64 {
    (value / range[0]).ln() / (range[1] / range[0]).ln()
}

/// Width of a label, on average.
pub(super) fn width(label: &str) -> f64 {
    CHARACTER * label.chars().count() as f64
}

fn range(values: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    let (mut low, mut high) = (f64::MAX, 0.0_f64);
    for value in values.filter(|v| *v > 0.0 && v.is_finite()) {
        (low, high) = (low.min(value), high.max(value));
    }
    (high > 0.0).then_some([low, high])
}

fn padded([low, high]: [f64; 2], factor: f64) -> [f64; 2] {
    [low / factor, high * factor]
}

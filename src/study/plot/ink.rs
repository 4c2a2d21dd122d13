//! Colours as plain attributes, which every viewer of SVG knows, and on top of them the colours of dark
//! surroundings in a style sheet, which browsers know.

use std::fmt::Write as _;

/// A colour, by what it is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ink {
    /// What is drawn on.
    Paper,
    /// Text to read first.
    Text,
    /// All other text, and the frame.
    Dim,
    /// Strong lines of the grid.
    Grid,
    /// Fine lines of the grid.
    Fine,
    /// A curve, by its index; colours come again after [`CURVES`].
    Curve(usize),
}

/// Colours of curves in light and dark surroundings: Okabe and Ito's (2008), which people with any common
/// form of colour blindness can tell apart, made darker or lighter until text in them has a contrast of 4.5.
/// Their order keeps neighbours apart; markers differ as well.
const COLOURS: [[&str; 2]; CURVES] = [
    ["#0060a8", "#5db2ff"],
    ["#b84300", "#ff8f4d"],
    ["#00734f", "#35c99a"],
    ["#9a3f86", "#e795cf"],
    ["#7f5a00", "#e8b93a"],
    ["#1f6f94", "#8fd3f5"],
    ["#55606b", "#b4bcc6"],
    ["#8c1a3a", "#ff8095"],
];

/// How many curves have a colour of their own.
pub(super) const CURVES: usize = 8;

impl Ink {
    fn all() -> impl Iterator<Item = Self> {
        let fixed = [Self::Paper, Self::Text, Self::Dim, Self::Grid, Self::Fine];
        fixed.into_iter().chain((0..CURVES).map(Self::Curve))
    }

    /// In light and in dark surroundings.
    fn colours(self) -> [&'static str; 2] {
        match self {
            Self::Paper => ["#ffffff", "#14181c"],
            Self::Text => ["#1c2127", "#e8ecf0"],
            Self::Dim => ["#5b6570", "#a3adb8"],
            Self::Grid => ["#d9dee3", "#39424b"],
            Self::Fine => ["#eef1f3", "#232a31"],
            Self::Curve(index) => COLOURS[index % CURVES],
        }
    }

    fn name(self) -> String {
        match self {
            Self::Paper => "paper".into(),
            Self::Text => "text".into(),
            Self::Dim => "dim".into(),
            Self::Grid => "grid".into(),
            Self::Fine => "fine".into(),
            Self::Curve(index) => format!("c{}", index % CURVES),
        }
    }
}

/// The attributes of an element that is filled with one colour and outlined with another, where there are
/// such.
pub(super) fn paint(fill: Option<Ink>, stroke: Option<Ink>) -> String {
    let parts = [("fill", fill), ("stroke", stroke)];
    let parts = || parts.iter().filter_map(|(what, ink)| Some((what, (*ink)?)));
    let classes: Vec<String> = parts()
        .map(|(what, ink)| format!("{what}-{}", ink.name()))
        .collect();
    let mut text = format!("class=\"{}\"", classes.join(" "));
    for (what, ink) in parts() {
        let _ = write!(text, " {what}=\"{}\"", ink.colours()[0]);
    }
    if fill.is_none() {
        text += " fill=\"none\"";
    }
    text
}

/// As [`paint`], for what is only filled.
pub(super) fn fill(ink: Ink) -> String {
    paint(Some(ink), None)
}

/// As [`paint`], for lines.
pub(super) fn stroke(ink: Ink) -> String {
    paint(None, Some(ink))
}

/// The style sheet of all plots, for a page that holds several: dark colours where those are wanted.
#[must_use]
pub fn style() -> String {
    let mut rules = String::new();
    for ink in Ink::all() {
        let (name, [_, dark]) = (ink.name(), ink.colours());
        for what in ["fill", "stroke"] {
            let _ = write!(rules, ".plot .{what}-{name}{{{what}:{dark}}}");
        }
    }
    format!("@media (prefers-color-scheme:dark){{{rules}}}")
}

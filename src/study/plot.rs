//! Curves on two logarithmic axes as SVG: real text, labels at the curves, light and dark.

use std::fmt::Write as _;

use super::ticks::{decades, doublings, plain};

/// A plot.
#[derive(Clone, Debug)]
pub struct Plot {
    /// What it shows.
    pub title: String,
    /// Of what, smaller.
    pub subtitle: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The curves, in the order of their colours.
    pub curves: Vec<Curve>,
}

/// What runs along the horizontal axis; the vertical one is always the error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// Seconds of wall time.
    Seconds,
    /// Samples a pixel.
    Samples,
}

/// One series.
#[derive(Clone, Debug)]
pub struct Curve {
    /// Its name, shown at its end.
    pub label: String,
    /// (x, error), both positive, x growing.
    pub points: Vec<(f64, f64)>,
    /// (x, low, high): the spread of the runs.
    pub band: Vec<(f64, f64, f64)>,
}

/// Width of a file, and of a plot in a page: there the text must be readable on a phone.
const WIDE: f64 = 640.0;
const NARROW: f64 = 460.0;
const HEIGHT: f64 = 400.0;
const LEFT: f64 = 58.0;
const TOP: f64 = 58.0;
const BOTTOM: f64 = 50.0;
/// Width of a character of a label, on average, and the height of a line.
const CHARACTER: f64 = 7.0;
const LINE: f64 = 15.0;

/// Colours in light and dark surroundings: Okabe and Ito's (2008), which people with any common form of
/// colour blindness can tell apart, made darker or lighter until text in them has a contrast of 4.5.
/// Their order keeps neighbours apart; markers differ as well.
const COLOURS: [(&str, &str); 8] = [
    ("#0060a8", "#5db2ff"),
    ("#b84300", "#ff8f4d"),
    ("#00734f", "#35c99a"),
    ("#9a3f86", "#e795cf"),
    ("#7f5a00", "#e8b93a"),
    ("#1f6f94", "#8fd3f5"),
    ("#55606b", "#b4bcc6"),
    ("#8c1a3a", "#ff8095"),
];

/// The style sheet of all plots, for a page that holds several.
#[must_use]
pub fn style() -> String {
    let mut light = String::new();
    let mut dark = String::new();
    let mut classes = String::new();
    for (i, (on_light, on_dark)) in COLOURS.iter().enumerate() {
        let _ = write!(light, "--s{i}:{on_light};");
        let _ = write!(dark, "--s{i}:{on_dark};");
        let _ = write!(classes, ".plot .s{i}{{--c:var(--s{i})}}");
    }
    format!(
        ".plot{{--bg:#fff;--ink:#1c2127;--dim:#5b6570;--grid:#d9dee3;--fine:#eef1f3;{light}\
         font:13px system-ui,-apple-system,'Segoe UI',Roboto,'DejaVu Sans',sans-serif}}\
         @media(prefers-color-scheme:dark){{.plot{{--bg:#14181c;--ink:#e8ecf0;--dim:#a3adb8;\
         --grid:#39424b;--fine:#232a31;{dark}}}}}{classes}\
         .plot .bg{{fill:var(--bg)}}.plot text{{fill:var(--ink)}}\
         .plot .title{{font-size:15px;font-weight:600}}.plot .dim{{fill:var(--dim)}}\
         .plot .grid{{stroke:var(--grid)}}.plot .fine{{stroke:var(--fine)}}\
         .plot .frame{{fill:none;stroke:var(--dim)}}\
         .plot .guide{{stroke:var(--dim);stroke-dasharray:2 4}}\
         .plot .band{{fill:var(--c);opacity:.14}}\
         .plot .line{{fill:none;stroke:var(--c);stroke-width:2;stroke-linejoin:round}}\
         .plot .more{{stroke-dasharray:7 3}}\
         .plot .mark{{fill:var(--c);stroke:var(--bg);stroke-width:.75}}\
         .plot .leader{{stroke:var(--c);opacity:.5}}\
         .plot .label{{fill:var(--c);paint-order:stroke;stroke:var(--bg);stroke-width:4;\
         stroke-linejoin:round}}"
    )
}

/// Where values lie in the picture.
struct Frame {
    x: [f64; 2],
    y: [f64; 2],
    /// The plot's, and the room to the right of the curves.
    width: f64,
    right: f64,
}

impl Frame {
    fn x(&self, value: f64) -> f64 {
        LEFT + share(self.x, value) * (self.width - LEFT - self.right)
    }

    fn y(&self, value: f64) -> f64 {
        HEIGHT - BOTTOM - share(self.y, value) * (HEIGHT - TOP - BOTTOM)
    }
}

fn share(range: [f64; 2], value: f64) -> f64 {
    (value / range[0]).ln() / (range[1] / range[0]).ln()
}

impl Plot {
    /// A file of its own.
    #[must_use]
    pub fn file(&self) -> String {
        let inside = self.content(WIDE);
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"plot\" viewBox=\"0 0 {WIDE} {HEIGHT}\" \
             width=\"{WIDE}\" height=\"{HEIGHT}\" role=\"img\" aria-label=\"{}\"><style>{}</style>{inside}\
             </svg>\n",
            escape(&self.title),
            style()
        )
    }

    /// For a page that has the [`style`].
    #[must_use]
    pub fn inline(&self) -> String {
        format!(
            "<svg class=\"plot\" viewBox=\"0 0 {NARROW} {HEIGHT}\" role=\"img\" aria-label=\"{}\">{}</svg>",
            escape(&self.title),
            self.content(NARROW)
        )
    }

    fn content(&self, width: f64) -> String {
        let mut out = format!(
            "<title>{title}</title><rect class=\"bg\" width=\"{width}\" height=\"{HEIGHT}\" rx=\"6\"/>\
             <text class=\"title\" x=\"16\" y=\"26\">{title}</text>\
             <text class=\"dim\" x=\"16\" y=\"44\">{}</text>",
            escape(&self.subtitle),
            title = escape(&self.title),
        );
        let Some(frame) = self.frame(width) else {
            let _ = write!(
                out,
                "<text class=\"dim\" x=\"16\" y=\"80\">no error is known yet</text>"
            );
            return out;
        };
        self.axes(&mut out, &frame);
        self.guide(&mut out, &frame);
        for (i, curve) in self.curves.iter().enumerate() {
            draw(&mut out, &frame, i, curve);
        }
        self.labels(&mut out, &frame);
        out
    }

    fn frame(&self, whole: f64) -> Option<Frame> {
        let points = || self.curves.iter().flat_map(|c| &c.points);
        let bands = || self.curves.iter().flat_map(|c| &c.band);
        let x = range(points().map(|p| p.0))?;
        let y = range(
            points()
                .map(|p| p.1)
                .chain(bands().flat_map(|b| [b.1, b.2])),
        )?;
        let (x, y) = (padded(x, 1.25), padded(y, 1.25));
        let room = whole - LEFT;
        let right = self.curves.iter().filter_map(|curve| {
            let end = share(x, curve.points.last()?.0);
            Some(room - (room - 16.0 - width(&curve.label)) / end)
        });
        Some(Frame {
            x,
            y,
            width: whole,
            right: right.fold(14.0, f64::max).min(0.45 * whole),
        })
    }

    fn axes(&self, out: &mut String, frame: &Frame) {
        let (bottom, right) = (HEIGHT - BOTTOM, frame.width - frame.right);
        let samples = self.x == Axis::Samples;
        let across = if samples {
            doublings(frame.x, frame.x(2.0) - frame.x(1.0))
        } else {
            decades(frame.x, frame.x(10.0) - frame.x(1.0) > 130.0)
        };
        for tick in &across {
            let x = frame.x(tick.at);
            let class = if tick.major { "grid" } else { "fine" };
            let _ = write!(
                out,
                "<path class=\"{class}\" d=\"M{x:.1} {TOP}V{bottom}\"/>"
            );
            if tick.labelled {
                let text = if samples {
                    plain(tick.at)
                } else {
                    format!("{} s", plain(tick.at))
                };
                let y = bottom + 17.0;
                let _ = write!(
                    out,
                    "<text class=\"dim\" x=\"{x:.1}\" y=\"{y}\" text-anchor=\"middle\">{text}</text>"
                );
            }
        }
        let tall = frame.y(1.0) - frame.y(10.0);
        for tick in decades(frame.y, tall > 60.0) {
            let y = frame.y(tick.at);
            let class = if tick.major { "grid" } else { "fine" };
            let _ = write!(
                out,
                "<path class=\"{class}\" d=\"M{LEFT} {y:.1}H{right:.1}\"/>"
            );
            if tick.labelled {
                let (x, y) = (LEFT - 7.0, y + 4.0);
                let text = plain(100.0 * tick.at);
                let _ = write!(
                    out,
                    "<text class=\"dim\" x=\"{x}\" y=\"{y:.1}\" text-anchor=\"end\">{text} %</text>"
                );
            }
        }
        let (wide, high) = (right - LEFT, bottom - TOP);
        let name = if samples {
            "samples a pixel"
        } else {
            "wall time, setup and compilation included"
        };
        let middle = LEFT + 0.5 * wide;
        let _ = write!(
            out,
            "<rect class=\"frame\" x=\"{LEFT}\" y=\"{TOP}\" width=\"{wide:.1}\" height=\"{high}\"/>\
             <text class=\"dim\" x=\"{middle:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{name}</text>",
            HEIGHT - 12.0
        );
    }

    /// The law of independent samples, just below all curves.
    fn guide(&self, out: &mut String, frame: &Frame) {
        let points = self.curves.iter().flat_map(|c| &c.points);
        let scale = 0.82 * points.map(|(x, y)| y * x.sqrt()).fold(f64::MAX, f64::min);
        // Where it enters and leaves the frame.
        let from = frame.x[0].max((scale / frame.y[1]).powi(2));
        let to = frame.x[1].min((scale / frame.y[0]).powi(2));
        if from >= to {
            return;
        }
        let at = |x: f64| (frame.x(x), frame.y(scale / x.sqrt()));
        let ((x1, y1), (x2, y2)) = (at(from), at(to));
        let (x, y) = at((from * from * to).cbrt());
        let name = if self.x == Axis::Samples {
            "1/√N"
        } else {
            "1/√t"
        };
        let _ = write!(
            out,
            "<path class=\"guide\" d=\"M{x1:.1} {y1:.1}L{x2:.1} {y2:.1}\"/>\
             <text class=\"dim\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{name}</text>",
            x - 4.0,
            y + 12.0
        );
    }

    /// Each name at its curve's end, moved apart where they would meet.
    fn labels(&self, out: &mut String, frame: &Frame) {
        let ends = self.curves.iter().enumerate();
        let mut ends: Vec<(usize, f64, f64, f64)> = ends
            .filter_map(|(i, curve)| {
                let (x, y) = *curve.points.last()?;
                Some((i, frame.x(x), frame.y(y), frame.y(y)))
            })
            .collect();
        ends.sort_by(|a, b| a.2.total_cmp(&b.2));
        let meet = |a: &(usize, f64, f64, f64), b: &(usize, f64, f64, f64)| {
            let (left, right) = if a.1 <= b.1 { (a, b) } else { (b, a) };
            right.1 < left.1 + 16.0 + width(&self.curves[left.0].label)
        };
        // From the bottom up, so that nothing is pushed below the axis.
        let mut floor = vec![HEIGHT - BOTTOM - 2.0; ends.len()];
        for i in (0..ends.len()).rev() {
            ends[i].3 = ends[i].3.min(floor[i]);
            for j in 0..i {
                if meet(&ends[i], &ends[j]) {
                    floor[j] = floor[j].min(ends[i].3 - LINE);
                }
            }
        }
        for (i, x, end, y) in ends {
            let (from, to) = (x + 5.0, x + 9.0);
            let slot = i % COLOURS.len();
            if (y - end).abs() > 2.0 {
                let _ = write!(
                    out,
                    "<path class=\"leader s{slot}\" d=\"M{from:.1} {end:.1}L{to:.1} {y:.1}\"/>"
                );
            }
            let _ = write!(
                out,
                "<text class=\"label s{slot}\" x=\"{:.1}\" y=\"{:.1}\">{}</text>",
                x + 11.0,
                y + 4.0,
                escape(&self.curves[i].label)
            );
        }
    }
}

fn draw(out: &mut String, frame: &Frame, index: usize, curve: &Curve) {
    let slot = index % COLOURS.len();
    let more = if index < COLOURS.len() { "" } else { " more" };
    if curve.band.len() > 1 {
        let upper = curve.band.iter().map(|(x, _, high)| (*x, *high));
        let lower = curve.band.iter().rev().map(|(x, low, _)| (*x, *low));
        let d = path(frame, upper.chain(lower));
        let _ = write!(out, "<path class=\"band s{slot}\" d=\"{d}Z\"/>");
    }
    let d = path(frame, curve.points.iter().copied());
    let _ = write!(out, "<path class=\"line s{slot}{more}\" d=\"{d}\"/>");
    let marks: String = curve
        .points
        .iter()
        .map(|(x, y)| mark(index, frame.x(*x), frame.y(*y)))
        .collect();
    let _ = write!(out, "<path class=\"mark s{slot}\" d=\"{marks}\"/>");
}

fn path(frame: &Frame, points: impl Iterator<Item = (f64, f64)>) -> String {
    let mut d = String::new();
    for (x, y) in points {
        let letter = if d.is_empty() { 'M' } else { 'L' };
        let _ = write!(d, "{letter}{:.1} {:.1}", frame.x(x), frame.y(y));
    }
    d
}

/// A marker: circle, square, triangle, diamond, in turns.
fn mark(index: usize, x: f64, y: f64) -> String {
    match index % 4 {
        0 => format!(
            "M{:.1} {y:.1}a3.4 3.4 0 1 0 6.8 0a3.4 3.4 0 1 0-6.8 0",
            x - 3.4
        ),
        1 => format!("M{:.1} {:.1}h6v6h-6Z", x - 3.0, y - 3.0),
        2 => format!("M{x:.1} {:.1}l3.9 6.6h-7.8Z", y - 4.2),
        _ => format!("M{x:.1} {:.1}l4.2 4.2l-4.2 4.2l-4.2-4.2Z", y - 4.2),
    }
}

fn width(label: &str) -> f64 {
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

/// Text as HTML and SVG take it.
#[must_use]
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot(labels: &[&str]) -> Plot {
        let curve = |(i, label): (usize, &&str)| Curve {
            label: (*label).into(),
            points: (0..10)
                .map(|k| {
                    let n = 2f64.powi(k);
                    (
                        n * (1.0 + 0.01 * i as f64),
                        (0.5 + 0.001 * i as f64) / n.sqrt(),
                    )
                })
                .collect(),
            band: Vec::new(),
        };
        Plot {
            title: "Error & <time>".into(),
            subtitle: String::new(),
            x: Axis::Samples,
            curves: labels.iter().enumerate().map(curve).collect(),
        }
    }

    /// The numbers after `name` of every element that has `class`.
    fn places(svg: &str, class: &str, name: &str) -> Vec<f64> {
        svg.split('<')
            .filter(|e| e.contains(&format!("class=\"{class}")))
            .filter_map(|e| {
                e.split(&format!(" {name}=\""))
                    .nth(1)?
                    .split('"')
                    .next()?
                    .parse()
                    .ok()
            })
            .collect()
    }

    #[test]
    fn labels_do_not_cover_each_other_and_stay_inside() {
        let names = ["a", "b", "a longer name", "d", "e", "f", "g", "h", "i"];
        let svg = plot(&names).file();
        let mut rows = places(&svg, "label", "y");
        assert_eq!(rows.len(), names.len());
        rows.sort_by(f64::total_cmp);
        assert!(
            rows.windows(2).all(|w| w[1] - w[0] >= LINE - 0.2),
            "{rows:?}"
        );
        assert!(rows[0] > TOP && rows[8] < HEIGHT - BOTTOM + 5.0, "{rows:?}");
        let ends = places(&svg, "label", "x");
        assert!(
            ends.iter().zip(names).all(|(x, n)| x + width(n) <= WIDE),
            "{ends:?}"
        );
    }

    #[test]
    fn text_is_text_and_escaped() {
        let svg = plot(&["a"]).file();
        assert!(svg.contains("Error &amp; &lt;time&gt;</text>"));
        assert!(
            svg.contains(">256</text>") && svg.contains(">10 %</text>"),
            "{svg}"
        );
        // The name space is the one address; nothing is fetched.
        assert_eq!(svg.matches("http").count(), 1);
    }

    #[test]
    fn nothing_to_show_is_said() {
        let mut empty = plot(&["a"]);
        empty.curves[0].points.clear();
        assert!(empty.file().contains("no error is known yet"));
    }
}

//! Curves on two logarithmic axes as SVG: real text, labels at the curves, light and dark.

mod frame;
mod ink;
mod ticks;

use std::fmt::Write as _;

pub use ink::style;

use frame::{BOTTOM, Frame, HEIGHT, LEFT, TOP, width};
use ink::{CURVES, Ink, fill, paint, stroke};
use ticks::{decades, doublings, plain};

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
/// The font of all text, as attributes.
const FONT: &str = "font-family=\"system-ui,-apple-system,'Segoe UI',Roboto,'DejaVu Sans',sans-serif\" \
                    font-size=\"13\"";
/// The height of a line of labels.
const LINE: f64 = 15.0;

impl Plot {
    /// A file of its own.
    #[must_use]
    pub fn file(&self) -> String {
        let inside = self.content(WIDE);
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"plot\" viewBox=\"0 0 {WIDE} {HEIGHT}\" \
             width=\"{WIDE}\" height=\"{HEIGHT}\" {FONT} role=\"img\" aria-label=\"{}\">\
             <style>{}</style>{inside}</svg>\n",
            escape(&self.title),
            style()
        )
    }

    /// For a page that has the [`style`].
    #[must_use]
    pub fn inline(&self) -> String {
        format!(
            "<svg class=\"plot\" viewBox=\"0 0 {NARROW} {HEIGHT}\" {FONT} role=\"img\" aria-label=\"{}\">{}</svg>",
            escape(&self.title),
            self.content(NARROW)
        )
    }

    fn content(&self, width: f64) -> String {
        let dim = fill(Ink::Dim);
        let mut out = format!(
            "<title>{title}</title><rect {paper} width=\"{width}\" height=\"{HEIGHT}\" rx=\"6\"/>\
             <text {} font-size=\"15\" font-weight=\"600\" x=\"16\" y=\"26\">{title}</text>\
             <text {dim} x=\"16\" y=\"44\">{}</text>",
            fill(Ink::Text),
            escape(&self.subtitle),
            title = escape(&self.title),
            paper = fill(Ink::Paper),
        );
        let Some(frame) = Frame::of(&self.curves, width) else {
            let _ = write!(
                out,
                "<text {dim} x=\"16\" y=\"80\">no error is known yet</text>"
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

    fn axes(&self, out: &mut String, frame: &Frame) {
        let (bottom, right) = (HEIGHT - BOTTOM, frame.width - frame.right);
        let samples = self.x == Axis::Samples;
        let dim = fill(Ink::Dim);
        let line = |major: bool| stroke(if major { Ink::Grid } else { Ink::Fine });
        let across = if samples {
            doublings(frame.x, frame.x(2.0) - frame.x(1.0))
        } else {
            decades(frame.x, frame.x(10.0) - frame.x(1.0) > 130.0)
        };
        for tick in &across {
            let x = frame.x(tick.at);
            let line = line(tick.major);
            let _ = write!(out, "<path {line} d=\"M{x:.1} {TOP}V{bottom}\"/>");
            if tick.labelled {
                let text = if samples {
                    plain(tick.at)
                } else {
                    format!("{} s", plain(tick.at))
                };
                let y = bottom + 17.0;
                let _ = write!(
                    out,
                    "<text {dim} x=\"{x:.1}\" y=\"{y}\" text-anchor=\"middle\">{text}</text>"
                );
            }
        }
        let tall = frame.y(1.0) - frame.y(10.0);
        for tick in decades(frame.y, tall > 60.0) {
            let y = frame.y(tick.at);
            let line = line(tick.major);
            let _ = write!(out, "<path {line} d=\"M{LEFT} {y:.1}H{right:.1}\"/>");
            if tick.labelled {
                let (x, y) = (LEFT - 7.0, y + 4.0);
                let text = plain(100.0 * tick.at);
                let _ = write!(
                    out,
                    "<text {dim} x=\"{x}\" y=\"{y:.1}\" text-anchor=\"end\">{text} %</text>"
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
            "<rect {} x=\"{LEFT}\" y=\"{TOP}\" width=\"{wide:.1}\" height=\"{high}\"/>\
             <text {dim} x=\"{middle:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{name}</text>",
            stroke(Ink::Dim),
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
            "<path {} stroke-dasharray=\"2 4\" d=\"M{x1:.1} {y1:.1}L{x2:.1} {y2:.1}\"/>\
             <text {} x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{name}</text>",
            stroke(Ink::Dim),
            fill(Ink::Dim),
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
            if (y - end).abs() > 2.0 {
                let _ = write!(
                    out,
                    "<path {} opacity=\".5\" d=\"M{from:.1} {end:.1}L{to:.1} {y:.1}\"/>",
                    stroke(Ink::Curve(i))
                );
            }
            let _ = write!(
                out,
                "<text {} paint-order=\"stroke\" stroke-width=\"4\" stroke-linejoin=\"round\" x=\"{:.1}\" \
                 y=\"{:.1}\">{}</text>",
                paint(Some(Ink::Curve(i)), Some(Ink::Paper)),
                x + 11.0,
                y + 4.0,
                escape(&self.curves[i].label)
            );
        }
    }
}

fn draw(out: &mut String, frame: &Frame, index: usize, curve: &Curve) {
    let ink = Ink::Curve(index);
    let more = match index < CURVES {
        true => "",
        false => " stroke-dasharray=\"7 3\"",
    };
    if curve.band.len() > 1 {
        let upper = curve.band.iter().map(|(x, _, high)| (*x, *high));
        let lower = curve.band.iter().rev().map(|(x, low, _)| (*x, *low));
        let d = path(frame, upper.chain(lower));
        let _ = write!(out, "<path {} opacity=\".14\" d=\"{d}Z\"/>", fill(ink));
    }
    let d = path(frame, curve.points.iter().copied());
    let _ = write!(
        out,
        "<path {} stroke-width=\"2\" stroke-linejoin=\"round\"{more} d=\"{d}\"/>",
        stroke(ink)
    );
    let marks: String = curve
        .points
        .iter()
        .map(|(x, y)| mark(index, frame.x(*x), frame.y(*y)))
        .collect();
    let _ = write!(
        out,
        "<path {} stroke-width=\".75\" d=\"{marks}\"/>",
        paint(Some(ink), Some(Ink::Paper))
    );
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

    /// The numbers after `name` of every label.
    fn places(svg: &str, name: &str) -> Vec<f64> {
        svg.split('<')
            .filter(|e| e.contains("paint-order"))
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
        let mut rows = places(&svg, "y");
        assert_eq!(rows.len(), names.len());
        rows.sort_by(f64::total_cmp);
        assert!(
            rows.windows(2).all(|w| w[1] - w[0] >= LINE - 0.2),
            "{rows:?}"
        );
        assert!(rows[0] > TOP && rows[8] < HEIGHT - BOTTOM + 5.0, "{rows:?}");
        let ends = places(&svg, "x");
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

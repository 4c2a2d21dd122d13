//! The report: one HTML file that needs nothing else, for a phone as well as for a desk.

use std::fmt::Write as _;
use std::io;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;

use super::pictures::Shot;
use super::plot::{Plot, escape, style};
use super::table::Table;
use crate::compare::{HeatMap, heat_colour};
use crate::image::{Format, Picture};
use crate::numbers::percent;
use crate::output::{Contents, Metadata};

/// What the report says.
#[derive(Debug)]
pub struct Report<'a> {
    /// Heading.
    pub title: String,
    /// The result in a sentence or two.
    pub lead: String,
    /// What reading the figures must not miss.
    pub notices: Vec<String>,
    /// Names and values: scene, device, ...
    pub facts: Vec<(&'static str, String)>,
    /// The plots.
    pub plots: &'a [Plot],
    /// The tables, in order.
    pub tables: &'a [Table],
    /// Images under headings, each with a sentence.
    pub galleries: &'a [Gallery],
    /// The reference.
    pub reference: &'a Picture,
    /// EV steps that brighten the images.
    pub exposure: f64,
    /// The command that makes it again.
    pub command: String,
}

/// Images with one scale of differences.
#[derive(Debug)]
pub struct Gallery {
    /// Heading.
    pub title: String,
    /// What is shown.
    pub note: String,
    /// The images.
    pub shots: Vec<Shot>,
    /// Whether the images themselves are worth a look, beside their differences.
    pub images: bool,
}

const PAGE: &str = "\
:root{color-scheme:light dark;--bg:#f5f6f8;--card:#fff;--ink:#1c2127;--dim:#5b6570;--rule:#d9dee3;--warn:#8a4b00}
@media(prefers-color-scheme:dark){:root{--bg:#0d1013;--card:#14181c;--ink:#e8ecf0;--dim:#a3adb8;--rule:#39424b;--warn:#ffb366}}
*{box-sizing:border-box}
body{margin:0;background:var(--bg);color:var(--ink);font:16px/1.5 system-ui,-apple-system,'Segoe UI',Roboto,'DejaVu Sans',sans-serif}
main{max-width:1160px;margin:0 auto;padding:20px 16px 48px}
h1{font-size:1.6rem;line-height:1.2;margin:.2em 0}
h2{font-size:1.15rem;margin:2em 0 .3em}
p{margin:.3em 0 .8em;max-width:72ch}
.lead{font-size:1.1rem}
.note,figcaption,dt{color:var(--dim);font-size:.9rem}
.notice{color:var(--warn)}
dl{display:grid;grid-template-columns:max-content 1fr;gap:.15em 1em;margin:1em 0;font-size:.95rem}
dd{margin:0;overflow-wrap:anywhere}
.plots{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,460px),1fr));gap:16px}
.plot{display:block;width:100%;height:auto;border-radius:6px}
.scroll{overflow-x:auto;background:var(--card);border-radius:6px;max-width:100%;width:max-content}
table{border-collapse:collapse;font-size:.9rem;font-variant-numeric:tabular-nums}
th,td{padding:.35em .8em;text-align:right;white-space:nowrap;border-top:1px solid var(--rule)}
thead th{border-top:0;font-weight:600}
th:first-child{text-align:left;position:sticky;left:0;background:var(--card)}
tbody th{font-weight:500}
.shots{display:grid;grid-template-columns:repeat(auto-fill,minmax(150px,1fr));gap:14px}
.shots.wide{grid-template-columns:repeat(auto-fill,minmax(min(100%,300px),1fr))}
@media(max-width:520px){.plots{margin:0 -12px}}
figure{margin:0}
.pair{display:grid;grid-auto-flow:column;grid-auto-columns:1fr;gap:4px}
figure img{display:block;width:100%;height:auto;image-rendering:pixelated;border-radius:4px}
figcaption b{color:var(--ink);font-weight:600}
.scale{display:flex;align-items:center;gap:.6em;margin:.2em 0 .8em;font-size:.9rem;color:var(--dim)}
.scale span:nth-child(2){flex:0 1 180px;height:12px;border-radius:3px}
pre{background:var(--card);padding:.8em;border-radius:6px;white-space:pre-wrap;overflow-wrap:anywhere;font-size:.85rem}
";

const METHOD: &str = "\
<h2>How to read this</h2>
<p>Both axes of the plots are logarithmic: a line that falls by one decade of error over two of samples \
follows 1/√N, and a line that flattens has a bias, which no number of samples removes. The band is the 5 % to \
95 % range of the runs; with few seeds it is close to their extremes. Lower is better, and at one time the lower \
line is the better way to spend it.</p>
<dl>
<dt>relRMSE</dt><dd>sqrt of the mean over pixels and channels of (m − r)²/(r² + (0.1 M)²), image m, reference r, its \
mean M. Over several seeds: the root of the mean square, or the median where the variance is infinite.</dd>
<dt>MSE</dt><dd>mean of (m − r)² over pixels and channels, over the seeds. Means and fits are of this.</dd>
<dt>Reference</dt><dd>its own noise is in every measured error. Where its standard errors are known they are \
subtracted as variances, and errors within two standard errors of what is left are not shown.</dd>
<dt>Time</dt><dd>wall time of one run: opening the device, placing the scene, linking, compiling and rendering. \
Measuring errors, keeping images and rendering the reference are not in it. Runs of all series take turns.</dd>
<dt>Slope</dt><dd>least squares in the logarithms, from 16 samples a pixel on.</dd>
<dt>Bias</dt><dd>MSE = b² + v/N by weighted least squares. With the sampler sobol, v/N is the sum over its scrambles' \
lengths L = 4, 16, 64 of v<sub>L</sub> n<sub>L</sub>/N², with n<sub>L</sub> of the N samples in scrambles of length L: \
exact where scrambles are whole; v is that of the longest.</dd>
<dt>Intervals</dt><dd>bootstrap over the runs, 1000 resamples, percentiles widened for small numbers (Hesterberg 2015). \
Called 95 %, they hold the truth in some 93 % of all cases with 8 seeds and 87 % with 4; with fewer there are none, nor where a figure is unknown in more than a tenth of the resamples. \
Intervals of b also hold the noise of the reference.</dd>
<dt>Equal time</dt><dd>errors and times between points lie on straight lines in the logarithms; images are \
rendered with just the samples that fit.</dd>
</dl>
";

impl Report<'_> {
    /// The file.
    ///
    /// # Errors
    /// If an image is too large for PNG.
    pub fn html(&self) -> io::Result<String> {
        let title = escape(&self.title);
        let mut out = format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\n\
             <title>{title}</title>\n<link rel=\"icon\" href=\"data:,\">\n<style>\n{PAGE}{}\n</style>\n</head>\n\
             <body>\n<main>\n<h1>{title}</h1>\n<p class=\"lead\">{}</p>\n",
            style(),
            escape(&self.lead)
        );
        for notice in &self.notices {
            let _ = writeln!(out, "<p class=\"notice\">{}</p>", escape(notice));
        }
        out += "<div class=\"plots\">\n";
        for plot in self.plots {
            out += &plot.inline();
            out.push('\n');
        }
        out += "</div>\n";
        for table in self
            .tables
            .iter()
            .filter(|t| t.head.len() > 1 && !t.rows.is_empty())
        {
            add_table(&mut out, table);
        }
        for gallery in self.galleries.iter().filter(|g| !g.shots.is_empty()) {
            self.add_gallery(&mut out, gallery)?;
        }
        let reference = self.image(self.reference, "the reference")?;
        let _ = write!(
            out,
            "<h2>The reference</h2>\n<div class=\"shots\"><figure>{reference}</figure></div>\n{METHOD}<h2>What was \
             measured</h2>\n<dl>\n"
        );
        for (name, value) in &self.facts {
            let _ = writeln!(out, "<dt>{name}</dt><dd>{}</dd>", escape(value));
        }
        let _ = write!(
            out,
            "</dl>\n<p class=\"note\">Made by</p>\n<pre>{}</pre>\n</main>\n</body>\n</html>\n",
            escape(&self.command)
        );
        Ok(out)
    }

    fn add_gallery(&self, out: &mut String, gallery: &Gallery) -> io::Result<()> {
        let wide = if gallery.images { " wide" } else { "" };
        let _ = write!(
            out,
            "<h2>{}</h2>\n<p class=\"note\">{}</p>\n{}<div class=\"shots{wide}\">\n",
            escape(&gallery.title),
            escape(&gallery.note),
            scale(&gallery.shots)
        );
        for shot in &gallery.shots {
            let image = match gallery.images {
                true => self.image(&shot.picture, &shot.label)?,
                false => String::new(),
            };
            let what = format!("difference map of {}", shot.label);
            let map = tag(
                &shot.difference.encode()?,
                &what,
                shot.picture.width,
                shot.picture.height,
            );
            let _ = writeln!(
                out,
                "<figure><div class=\"pair\">{image}{map}</div><figcaption><b>{}</b><br>{}</figcaption></figure>",
                escape(&shot.label),
                escape(&shot.caption)
            );
        }
        out.push_str("</div>\n");
        Ok(())
    }

    fn image(&self, picture: &Picture, what: &str) -> io::Result<String> {
        let contents = Contents {
            picture,
            layers: &[],
            metadata: &Metadata::new(),
            exposure: self.exposure,
        };
        Ok(tag(
            &contents.encode(Format::Png)?,
            what,
            picture.width,
            picture.height,
        ))
    }
}

fn tag(png: &[u8], what: &str, width: u32, height: u32) -> String {
    format!(
        "<img alt=\"{}\" width=\"{width}\" height=\"{height}\" src=\"data:image/png;base64,{}\">",
        escape(what),
        STANDARD.encode(png)
    )
}

/// What the colours of difference maps mean.
fn scale(shots: &[Shot]) -> String {
    let Some(HeatMap { range, .. }) = shots.first().map(|s| &s.difference) else {
        return String::new();
    };
    let stops: Vec<String> = (0..=8)
        .map(|i| {
            let [r, g, b] = heat_colour(f64::from(i) / 8.0);
            format!("rgb({r},{g},{b})")
        })
        .collect();
    format!(
        "<div class=\"scale\"><span>0</span><span style=\"background:linear-gradient(90deg,{})\"></span><span>{} \
         relative error of a pixel</span></div>\n",
        stops.join(","),
        percent(*range)
    )
}

fn add_table(out: &mut String, table: &Table) {
    let _ = write!(
        out,
        "<h2>{}</h2>\n<p class=\"note\">{}</p>\n<div class=\"scroll\"><table>\n<thead><tr>",
        escape(&table.title),
        escape(&table.note)
    );
    for name in &table.head {
        let _ = write!(out, "<th scope=\"col\">{}</th>", escape(name));
    }
    out.push_str("</tr></thead>\n<tbody>\n");
    for row in &table.rows {
        for (i, cell) in row.iter().enumerate() {
            let cell = escape(cell);
            let _ = match i {
                0 => write!(out, "<tr><th scope=\"row\">{cell}</th>"),
                _ => write!(out, "<td>{cell}</td>"),
            };
        }
        out.push_str("</tr>\n");
    }
    out.push_str("</tbody>\n</table></div>\n");
}

//! What a study shows: pages and plots, as browsers and other viewers take them.

use std::fs;
use std::io::Write as _;
use std::path::Path;
use std::process::Command;

use gpu_trace::study::plot::style;
use resvg::tiny_skia::{Pixmap, PremultipliedColorU8, Transform};
use resvg::usvg::{Options, Tree};
use serde_json::{Value, json};

use super::SMALL;
use crate::cli_support::Folder;

/// That every element is closed, in order, as HTML and SVG want it.
pub(crate) fn balanced(text: &str) {
    const VOID: [&str; 4] = ["meta", "link", "img", "br"];
    let mut open: Vec<&str> = Vec::new();
    for tag in text.split('<').skip(1) {
        let (inside, _) = tag.split_once('>').expect("every tag ends");
        let name = inside.split([' ', '\n']).next().unwrap_or_default();
        if let Some(name) = name.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name));
        } else if !inside.ends_with('/') && !name.starts_with('!') && !VOID.contains(&name) {
            open.push(name);
        }
    }
    assert!(open.is_empty(), "{open:?}");
}

/// That nothing is fetched from anywhere.
pub(crate) fn self_contained(html: &str) {
    for what in [
        "http:", "https:", "file:", "//", "@import", "<script", "url(",
    ] {
        let outside = html.split("base64,").enumerate().map(|(i, part)| match i {
            // What follows is base64 up to the quote.
            0 => part,
            _ => part.split_once('"').map_or("", |(_, rest)| rest),
        });
        let found = outside.into_iter().find(|part| part.contains(what));
        assert!(found.is_none(), "{what} in the report");
    }
    for source in html
        .split("src=\"")
        .skip(1)
        .chain(html.split("href=\"").skip(1))
    {
        assert!(
            source.starts_with("data:"),
            "{}",
            &source[..40.min(source.len())]
        );
    }
}

/// That a viewer without style sheets draws the paper and the first `curves` curves of a plot in their
/// colours.
pub(crate) fn drawn(svg: &str, curves: usize) -> Result<(), String> {
    const PAPER: [u8; 3] = [0xff, 0xff, 0xff];
    const CURVES: [[u8; 3]; 4] = [
        [0x00, 0x60, 0xa8],
        [0xb8, 0x43, 0x00],
        [0x00, 0x73, 0x4f],
        [0x9a, 0x3f, 0x86],
    ];
    let tree = Tree::from_str(svg, &Options::default()).map_err(|e| e.to_string())?;
    let size = tree.size().to_int_size();
    let mut pixels = Pixmap::new(size.width(), size.height()).ok_or("no size")?;
    resvg::render(&tree, Transform::default(), &mut pixels.as_mut());
    let count = |[r, g, b]: [u8; 3]| {
        let same =
            |p: &&PremultipliedColorU8| [p.red(), p.green(), p.blue(), p.alpha()] == [r, g, b, 255];
        pixels.pixels().iter().filter(same).count()
    };
    let all = pixels.pixels().len();
    if count(PAPER) < all / 2 {
        return Err(format!("{} of {all} pixels are paper", count(PAPER)));
    }
    // A curve has markers, too: its line alone is some hundred pixels long, and most are mixed with
    // what is beneath.
    match CURVES[..curves].iter().position(|c| count(*c) < 60) {
        Some(curve) => Err(format!("curve {curve} has {} pixels", count(CURVES[curve]))),
        None => Ok(()),
    }
}

#[test]
fn the_plot_in_the_documents_is_drawn_by_every_viewer() {
    let svg = include_str!("../../docs/images/error-time.svg");
    balanced(svg);
    assert!(svg.contains(&style()), "as the program draws it today");
    drawn(svg, 4).unwrap_or_else(|e| panic!("{e}"));
    // Companions: a curve without its colour, and colours that only a browser knows, are seen.
    let without = drawn(&svg.replace("#00734f", "none"), 4).expect_err("a curve is missing");
    assert!(without.starts_with("curve 2 has 0"), "{without}");
    let variables = svg
        .replace("#ffffff", "var(--paper)")
        .replace("<style>", "<style>.plot{--paper:#ffffff}");
    let black = drawn(&variables, 4).expect_err("the paper is black");
    assert!(black.starts_with("0 of"), "{black}");
}

/// The browser, where one is installed.
fn chromium() -> Option<&'static str> {
    let names = [
        "chromium",
        "chromium-browser",
        "google-chrome",
        "google-chrome-stable",
    ];
    names.into_iter().find(|name| {
        let version = Command::new(name).arg("--version").output();
        version.is_ok_and(|output| output.status.success())
    })
}

/// The report in a frame of 390 pixels, and what a script finds in there.
fn probe(browser: &str, folder: &Path, report: &str) -> Value {
    let framed = report.replace('&', "&amp;").replace('"', "&quot;");
    let page = format!(
        "<!doctype html><meta charset=utf-8><body style=\"margin:0\"><iframe id=f width=390 height=844 \
         style=\"border:0\" srcdoc=\"{framed}\"></iframe><pre id=found></pre><script>\
         const errors=[];f.contentWindow.addEventListener('error',e=>errors.push(String(e.message||e.target.src)),true);\
         f.onload=()=>{{const d=f.contentDocument,w=f.contentWindow,r=d.documentElement;\
         const text=[...d.querySelectorAll('svg text')].map(t=>t.getBoundingClientRect());\
         const box=[...d.querySelectorAll('svg.plot')].map(s=>s.getBoundingClientRect());\
         found.textContent='FOUND'+JSON.stringify({{width:w.innerWidth,scroll:r.scrollWidth,errors,\
         images:d.images.length,loaded:[...d.images].filter(i=>i.complete&&i.naturalWidth>0).length,\
         plots:box.length,labels:text.length,\
         outside:text.filter(t=>t.right>390||t.left<0).length,\
         smallest:Math.min(...text.map(t=>t.height))}})+'END'}};</script>"
    );
    let file = folder.join("frame.html");
    fs::write(&file, page).expect("the folder can be written to");
    let output = Command::new(browser)
        .args([
            "--headless=new",
            "--no-sandbox",
            "--disable-gpu",
            "--dump-dom",
            "--enable-logging=stderr",
        ])
        .arg("--virtual-time-budget=5000")
        .arg(format!(
            "--user-data-dir={}",
            folder.join("profile").display()
        ))
        .arg(&file)
        .output()
        .expect("the browser starts");
    let stderr = String::from_utf8_lossy(&output.stderr);
    let console: Vec<&str> = stderr.lines().filter(|l| l.contains("CONSOLE")).collect();
    assert!(console.is_empty(), "{console:?}");
    let dom = String::from_utf8_lossy(&output.stdout).into_owned();
    // The script itself has the word as well, further down.
    let found = dom
        .split("FOUND{")
        .nth(1)
        .and_then(|f| f.split("}END").next());
    let found = found.map(|f| format!("{{{f}}}"));
    let found = found.unwrap_or_else(|| panic!("the frame was not loaded: {stderr}"));
    serde_json::from_str(&found).unwrap_or_else(|e| panic!("{e}: {found}"))
}

#[test]
fn the_report_can_be_read_on_a_phone() {
    let Some(browser) = chromium() else {
        // Past the harness, which shows nothing of tests that pass.
        let _ = writeln!(
            std::io::stderr(),
            "SKIPPED: no Chromium is installed, so that nothing has rendered the report of converge"
        );
        return;
    };
    let folder = Folder::with_scene();
    let arguments = "--integrators bsdf,lecture --backends cpu -o s";
    folder.run(&format!("converge {SMALL} {arguments}"));
    let html = String::from_utf8(folder.read("s/report.html")).expect("text");
    let found = probe(browser, &folder.path(""), &html);
    assert_eq!(found["width"], json!(390), "{found}");
    // A phone's scroll bar lies over the page, this one beside it.
    assert!(
        found["scroll"].as_u64() <= Some(390),
        "it is wider than the phone: {found}"
    );
    assert_eq!(found["errors"], json!([]));
    assert_eq!(
        (&found["plots"], &found["outside"]),
        (&json!(2), &json!(0)),
        "{found}"
    );
    assert_eq!(found["images"], found["loaded"], "{found}");
    assert!(
        found["images"].as_u64() > Some(4) && found["labels"].as_u64() > Some(20),
        "{found}"
    );
    assert!(
        found["smallest"].as_f64() > Some(10.0),
        "text too small to read: {found}"
    );

    // The companion: what is too wide, and an image that is none, are seen.
    let spoilt = html
        .replacen("<main>", "<main><p style=\"width:500px\">wide</p>", 1)
        .replacen(
            "data:image/png;base64,iVBOR",
            "data:image/png;base64,AAAA",
            1,
        );
    let found = probe(browser, &folder.path(""), &spoilt);
    assert!(found["scroll"].as_u64() > Some(390), "{found}");
    assert!(
        found["loaded"].as_u64() < found["images"].as_u64(),
        "{found}"
    );
}

//! What `compare` prints.

use std::fmt::Write as _;

use crate::cli::format::{percent, significant};
use crate::compare::{Bias, Errors, HeatMap, Known, Report, ZTest};
use crate::input::Input;
use crate::output::Target;

/// A line on a file, and one for each note.
pub(super) fn heading(letter: char, input: &Input) -> String {
    let picture = &input.picture;
    let mut text = format!(
        "{letter}  {}: {}x{}, {}, {}",
        input.path.display(),
        picture.width,
        picture.height,
        input.format.name(),
        input.encoding
    );
    if let Some(scene) = input.about.get("scene") {
        let _ = write!(text, ", scene {}", scene.escape_debug());
    }
    if let Some(spp) = input.about.get("spp") {
        let _ = write!(text, ", {} spp", spp.escape_debug());
    }
    if input.stderr.is_some() {
        text += ", with standard errors";
    }
    text.push('\n');
    for note in &input.notes {
        let _ = writeln!(text, "   note: {note}");
    }
    text
}

pub(super) fn figures(report: &Report) -> String {
    let mut text = String::new();
    let mut row = |name: &str, value: String, more: String| {
        let line = format!("{name:<11}{value:<12}{more}");
        let _ = writeln!(text, "{}", line.trim_end());
    };
    let bad = &report.non_finite;
    if bad.either > 0 {
        let more = format!(
            "pixels hold a NaN or an infinity, {} of A and {} of B; left out below",
            bad.image, bad.reference
        );
        row("NOT FINITE", bad.either.to_string(), more);
    }
    match &report.errors {
        None => row(
            "errors",
            "unknown".into(),
            "no pixel is finite in both".into(),
        ),
        Some(errors) => error_rows(errors, &mut row),
    }
    let at = format!("at {} EV", report.exposure);
    let clips = format!("{at}, where {} of B is clipped", percent(report.clipped));
    let more = format!("{} pixels a degree, {clips}", report.pixels_per_degree);
    let unknown = |why: &str| ("unknown".to_owned(), why.to_owned());
    let (value, more) = match report.flip {
        Some(flip) => (format!("{flip:.4}"), more),
        None => unknown("pixels are not finite"),
    };
    row("FLIP", value, more);
    let (value, more) = match report.ssim {
        Some(ssim) => (format!("{ssim:.4}"), format!("luma of sRGB values, {at}")),
        None if bad.either > 0 => unknown("pixels are not finite"),
        None => unknown("the image is smaller than 11x11"),
    };
    row("SSIM", value, more);
    match &report.z {
        Some(test) => z_rows(test, &mut row),
        None => row(
            "z-test",
            "unknown".into(),
            "neither file holds standard errors".into(),
        ),
    }
    text
}

fn error_rows(errors: &Errors, row: &mut impl FnMut(&str, String, String)) {
    let [x, y] = errors.worst_at;
    let worst = format!("worst pixel {} at {x},{y}", percent(errors.worst));
    row("relRMSE", percent(errors.relrmse), worst);
    row("MAPE", percent(errors.mape), String::new());
    let mean = format!("the mean of B is {}", significant(errors.reference_mean));
    row("MSE", significant(errors.mse), mean);
    let Bias {
        overall,
        red,
        green,
        blue,
    } = errors.bias;
    let signed = |bias: Option<f64>| match bias {
        Some(bias) if bias > 0.0 => format!("+{}", percent(bias)),
        Some(bias) => percent(bias),
        None => "unknown".into(),
    };
    let channels = format!(
        "red {}, green {}, blue {}",
        signed(red),
        signed(green),
        signed(blue)
    );
    row("bias", signed(overall), channels);
}

fn z_rows(test: &ZTest, row: &mut impl FnMut(&str, String, String)) {
    let [x, y] = test.worst_at;
    let against = match test.known {
        Known::Both => "",
        Known::Image => "; B is taken as exact",
        Known::Reference => "; A is taken as exact",
    };
    let worst = format!(
        "worst, at {x},{y}; pixels beyond {:.2}: {}{against}",
        test.limit, test.beyond
    );
    row("z-test", format!("{:.2}", test.worst), worst);
    let limit = format!("pooled, of at most {:.2}", test.pooled_limit);
    row("", format!("{:.2}", test.pooled), limit);
    let rms = "rms, 1 where the standard errors are right".into();
    row("", format!("{:.2}", test.rms), rms);
    if test.untested > 0 {
        let more = "values untested: not finite, or of unknown standard error";
        row("", test.untested.to_string(), more.into());
    }
}

pub(super) fn legend(target: &Target, map: &HeatMap) -> String {
    format!(
        "\n{target}: relative error of each pixel, black 0, pale yellow {}; {} of the pixels lie beyond\n",
        percent(map.range),
        percent(map.beyond)
    )
}

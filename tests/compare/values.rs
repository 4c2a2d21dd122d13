//! Errors of values.

use super::{input, near, noise, report};

#[test]
fn figures_of_two_pixels_by_hand() {
    // M = 1: floor 0.01.
    let a = input(2, vec![[1.1, 1.0, 1.0], [0.0, 1.0, 2.5]]);
    let b = input(2, vec![[1.0, 1.0, 1.0], [0.0, 1.0, 2.0]]);
    let errors = report(&a, &b).errors.expect("finite pixels");
    let (first, last) = (0.01 / 1.01, 0.25 / 4.01);
    near(errors.reference_mean, 1.0, 1.0e-12);
    near(errors.relrmse, f64::sqrt((first + last) / 6.0), 1.0e-7);
    near(
        errors.mape,
        (f64::sqrt(first) + f64::sqrt(last)) / 6.0,
        1.0e-7,
    );
    near(errors.mse, (0.01 + 0.25) / 6.0, 1.0e-7);
    near(errors.worst, f64::sqrt(last / 3.0), 1.0e-7);
    assert_eq!(errors.worst_at, [1, 0]);
    near(errors.bias.overall.expect("light"), 0.1, 1.0e-7);
    near(errors.bias.red.expect("light"), 0.1, 1.0e-7);
    near(errors.bias.green.expect("light"), 0.0, 0.0);
    near(errors.bias.blue.expect("light"), 1.0 / 6.0, 1.0e-7);
    // The roles are not the same.
    let back = report(&b, &a).errors.expect("finite pixels");
    assert!((back.relrmse - errors.relrmse).abs() > 1.0e-3);
}

#[test]
fn relative_figures_do_not_depend_on_the_unit() {
    let (a, b) = (noise(400, 1), noise(400, 2));
    let scaled =
        |pixels: &[[f32; 3]], s: f32| input(20, pixels.iter().map(|p| p.map(|v| v * s)).collect());
    let one = report(&scaled(&a, 1.0), &scaled(&b, 1.0))
        .errors
        .expect("finite");
    let thousand = report(&scaled(&a, 1024.0), &scaled(&b, 1024.0))
        .errors
        .expect("finite");
    near(thousand.relrmse, one.relrmse, 1.0e-14);
    near(thousand.mape, one.mape, 1.0e-14);
    near(thousand.mse, one.mse * 1024.0 * 1024.0, 1.0e-6);
    // The companion: the scale of one alone is seen.
    let wrong = report(&scaled(&a, 1.01), &scaled(&b, 1.0))
        .errors
        .expect("finite");
    assert!((wrong.relrmse - one.relrmse).abs() > 1.0e-3);
    near(
        wrong.bias.overall.expect("light") - one.bias.overall.expect("light"),
        0.01,
        1.0e-3,
    );
}

#[test]
fn black_references_leave_no_relative_error() {
    let black = input(2, vec![[0.0; 3]; 4]);
    let same = report(&black, &black).errors.expect("finite");
    assert_eq!((same.relrmse, same.bias.overall), (0.0, None));
    let grey = input(2, vec![[0.5; 3]; 4]);
    assert_eq!(
        report(&grey, &black).errors.expect("finite").relrmse,
        f64::INFINITY
    );
    near(
        report(&black, &grey).errors.expect("finite").relrmse,
        1.01f64.sqrt().recip(),
        1.0e-12,
    );
}

#[test]
fn what_is_not_finite_is_counted_and_spoils_what_is_seen() {
    let mut pixels = noise(400, 1);
    pixels[7][1] = f32::NAN;
    pixels[9] = [f32::INFINITY; 3];
    let mut other = noise(400, 1);
    other[9][0] = f32::NEG_INFINITY;
    let r = report(&input(20, pixels), &input(20, other));
    assert_eq!(
        (
            r.non_finite.image,
            r.non_finite.reference,
            r.non_finite.either
        ),
        (2, 1, 2)
    );
    assert_eq!((r.flip, r.ssim), (None, None));
    let errors = r.errors.expect("finite pixels");
    assert_eq!((errors.relrmse, errors.pixels), (0.0, 398));
    let nothing = input(1, vec![[f32::NAN; 3]]);
    assert_eq!(report(&nothing, &nothing).errors, None);
}

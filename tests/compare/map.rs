//! The map of errors.

use super::input;
use gpu_trace::compare::{HeatMap, heat_colour};
use gpu_trace::input::decode;
use gpu_trace::output::png;

#[test]
fn the_map_shows_where_errors_are() {
    let mut pixels = vec![[1.0; 3]; 400];
    pixels[0] = [1.5; 3];
    pixels[1][0] = f32::NAN;
    for pixel in &mut pixels[20..40] {
        *pixel = [1.04; 3];
    }
    let (a, b) = (input(20, pixels), input(20, vec![[1.0; 3]; 400]));
    let map = HeatMap::of(&a.picture, &b.picture);
    // 0.04/sqrt(1.01) = 0.0398 is the largest of the lower 99 %.
    assert_eq!((map.range, map.beyond), (0.05, 1.0 / 400.0));
    let file = map.encode().expect("a PNG file");
    let shown = decode(&file).unwrap_or_else(|e| panic!("{e}"));
    let level = |i: usize| png::quantise(shown.picture.pixels[i], 1.0);
    assert_eq!(level(0), [252, 253, 191]);
    assert_eq!(level(1), [0, 255, 255]);
    assert_eq!(level(2), [0, 0, 4]);
    assert_eq!(level(25), heat_colour(0.04 / 1.01f64.sqrt() / 0.05));
    assert_eq!(shown.about["pale_yellow"], "0.05");
    // Brighter is more, at every step.
    let luma = |share: f64| {
        let [r, g, b] = heat_colour(share).map(f64::from);
        0.2126 * r + 0.7152 * g + 0.0722 * b
    };
    assert!((0..100).all(|i| luma(f64::from(i + 1) / 100.0) > luma(f64::from(i) / 100.0)));
}

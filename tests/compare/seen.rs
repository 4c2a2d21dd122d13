//! What is seen, by figures of others' code.

use super::{input, near};
use crate::common::images::mean;
use gpu_trace::compare::{Options, Seen, compare, flip, ssim};
use gpu_trace::image::linear;

/// The display values of `references/perception.py` in 0..=1.
fn levels(shift: usize, noise: usize) -> Vec<[f64; 3]> {
    let pixel = |i: usize| {
        let (x, y) = (i % 40, i / 40);
        let red = 6 * x + noise * ((x * y) % 23);
        let green = 5 * y + 2 * x.saturating_sub(shift);
        let blue = if ((x + shift) / 6 + y / 5) % 2 == 1 {
            200
        } else {
            40
        };
        [red, green, blue].map(|level| level.min(255) as f64 / 255.0)
    };
    (0..40 * 32).map(pixel).collect()
}

fn seen(pixels: &[[f64; 3]]) -> Seen {
    Seen {
        width: 40,
        pixels: pixels.iter().map(|p| p.map(linear)).collect(),
    }
}

/// Of the authors' own code, in f32 (`references/perception.py`).
#[test]
fn flip_is_that_of_its_authors() {
    let (a, b) = (seen(&levels(2, 1)), seen(&levels(0, 0)));
    for (ppd, wanted, pixels) in [
        (67.0, 0.212_641, [0.208_74, 0.237_60, 0.153_64, 0.192_36]),
        (20.0, 0.365_665, [0.001_16, 0.231_87, 0.170_31, 0.264_21]),
    ] {
        let map = flip(&a, &b, ppd);
        near(mean(&map), wanted, 2.0e-5);
        for ((x, y), wanted) in [(0, 0), (39, 31), (13, 7), (20, 16)]
            .into_iter()
            .zip(pixels)
        {
            // Differences near 0 are raised to powers below 1, which shows f32's rounding.
            near(
                map[y * 40 + x],
                wanted,
                if wanted < 0.01 { 2.0e-3 } else { 2.0e-5 },
            );
        }
        assert!(map.iter().all(|e| (0.0..=1.0).contains(e)));
        near(mean(&flip(&b, &a, ppd)), mean(&map), 1.0e-12);
        assert_eq!(mean(&flip(&a, &a, ppd)), 0.0);
    }
    // The companion: another observer sees something else.
    assert!((mean(&flip(&a, &b, 60.0)) - 0.212_641).abs() > 1.0e-3);
}

/// Of scikit-image, in f64.
#[test]
fn ssim_is_that_of_others() {
    let luma = |pixels: &[[f64; 3]]| seen(pixels).luma();
    let (a, b) = (luma(&levels(2, 1)), luma(&levels(0, 0)));
    near(
        ssim(&a, &b, 40).expect("large enough"),
        0.788_577_089,
        1.0e-7,
    );
    near(
        ssim(&b, &a, 40).expect("large enough"),
        0.788_577_089,
        1.0e-7,
    );
    near(ssim(&a, &a, 40).expect("large enough"), 1.0, 1.0e-12);
    assert_eq!(ssim(&a[..400], &b[..400], 40), None);
    // Constant planes: only the means differ.
    let (x, y) = (vec![0.25; 121], vec![0.75; 121]);
    let wanted = (2.0 * 0.25 * 0.75 + 1.0e-4) / (0.0625 + 0.5625 + 1.0e-4);
    near(ssim(&x, &y, 11).expect("large enough"), wanted, 1.0e-12);
}

#[test]
fn exposure_decides_what_is_seen_and_nothing_else() {
    let bright = |v: f32| input(12, vec![[v; 3]; 144]);
    let at = |exposure| {
        let options = Options {
            exposure,
            ..Options::default()
        };
        compare(&bright(8.0), &bright(4.0), &options)
    };
    let (dark, light) = (at(-3.0), at(0.0));
    assert_eq!((light.flip, light.clipped), (Some(0.0), 1.0));
    assert!(dark.flip > Some(0.1) && dark.clipped == 0.0, "{dark:?}");
    assert_eq!(dark.errors, light.errors);
}

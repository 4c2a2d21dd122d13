//! `gpu-trace compare`: figures known by hand or from others' code, and what they lead to.

mod command;
mod map;
mod noise;
mod seen;
mod values;

use gpu_trace::compare::{Options, Report, compare};
use gpu_trace::image::Picture;
use gpu_trace::input::{Input, decode};
use gpu_trace::output::npy;

/// A picture as any reader gives it.
fn input(width: u32, pixels: Vec<[f32; 3]>) -> Input {
    let height = pixels.len() as u32 / width;
    decode(&npy::encode(&Picture::new(width, height, pixels))).unwrap_or_else(|e| panic!("{e}"))
}

fn report(a: &Input, b: &Input) -> Report {
    compare(a, b, &Options::default())
}

/// Values without a pattern, in 0..1; the same for the same seed.
fn noise(count: usize, seed: u32) -> Vec<[f32; 3]> {
    let mut state = seed;
    let mut next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 24) as f32
    };
    (0..count).map(|_| [next(), next(), next()]).collect()
}

fn near(value: f64, wanted: f64, error: f64) {
    assert!((value - wanted).abs() <= error, "{value} is not {wanted}");
}

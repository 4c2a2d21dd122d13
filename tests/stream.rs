//! The sample stream: the same bits in WGSL and in Rust, and uniform, independent numbers.

use crate::common::probe;
use gpu_trace::sampling::random::{mix_bits, sample_key, unit_float};
use gpu_trace::settings::stream_words;
use gpu_trace::statistics::{SIGNIFICANCE, correlation, sidak, uniform_ks};
use gpu_trace::verify::Random;

/// Where, and which: the two rows of the probe's `random4`.
type Key = [[u32; 4]; 2];

fn key(stream: [u32; 2], pixel: [u32; 2], sample_low: u32, dimension: u32) -> Key {
    [
        [stream[0], stream[1], pixel[0], pixel[1]],
        [sample_low, dimension, 0, 0],
    ]
}

fn on_host(key: &Key) -> [f64; 4] {
    let [[s, t, x, y], [sample, dimension, ..]] = *key;
    random4([s, t], [x, y], sample, dimension)
}

/// Keys as renders have them: corners of the index ranges, then random ones.
fn keys() -> Vec<Key> {
    let mut keys = Vec::new();
    let edges = [
        0,
        1,
        (1 << 16) - 1,
        1 << 16,
        (1 << 32) - 1,
        1 << 32,
        (1 << 32) + 1,
        u64::MAX,
    ];
    for seed in [0, 1, u64::MAX] {
        for sample in edges {
            let stream = stream_words(seed, (sample >> 32) as u32);
            for pixel in [[0, 0], [1, 0], [0, 1], [65535, 65535]] {
                for dimension in [0, 1, 64, u32::MAX] {
                    keys.push(key(stream, pixel, sample as u32, dimension));
                }
            }
        }
    }
    let mut random = Random::new("keys");
    while keys.len() < 120_000 {
        let [seed_low, seed_high, high, low] = random.words();
        let [x, y, dimension, _] = random.words();
        let seed = u64::from(seed_high) << 32 | u64::from(seed_low);
        keys.push(key(
            stream_words(seed, high),
            [x & 0xffff, y & 0xffff],
            low,
            dimension & 0xff,
        ));
    }
    keys
}

/// How many of the keys give other bits on the device than `host` says.
fn differences(keys: &[Key], host: impl Fn(&Key) -> [f64; 4]) -> usize {
    let device: Vec<[u32; 4]> = probe(&[]).call("random4", keys).expect("the probe runs");
    keys.iter()
        .zip(&device)
        .filter(|(k, d)| host(k).map(|x| (x as f32).to_bits()) != **d)
        .count()
}

/// The stream as one function of all that it depends on.
fn random4(stream: [u32; 2], pixel: [u32; 2], sample_low: u32, dimension: u32) -> [f64; 4] {
    let key = sample_key(stream, pixel, sample_low);
    gpu_trace::sampling::random::random4(key, dimension)
}

#[test]
fn the_stream_has_the_same_bits_on_device_and_host() {
    let keys = keys();
    assert!(keys.len() >= 100_000);
    assert_eq!(differences(&keys, on_host), 0);
}

#[test]
fn mix_bits_has_the_same_bits_on_device_and_host() {
    let mut random = Random::new("mix_bits");
    let keys: Vec<Key> = (0..100_000)
        .map(|_| [random.words(), random.words()])
        .collect();
    let device: Vec<[u32; 4]> = probe(&[]).call("mix_bits", &keys).expect("the probe runs");
    let wrong = keys
        .iter()
        .zip(&device)
        .filter(|([words, key], d)| words.map(|w| mix_bits(w, key[0])) != **d)
        .count();
    assert_eq!(wrong, 0);
}

#[test]
fn companion_a_perturbed_key_gives_other_bits() {
    let keys = keys();
    for part in 0..6 {
        let flip = |k: &Key| {
            let mut k = *k;
            k[part / 4][part % 4] ^= 1;
            on_host(&k)
        };
        // 96 bits each: the same by chance once in 2^96.
        assert_eq!(
            differences(&keys, flip),
            keys.len(),
            "word {part} does not matter"
        );
    }
}

#[test]
fn the_high_word_of_the_sample_index_matters() {
    let numbers = |sample: u64| {
        random4(
            stream_words(7, (sample >> 32) as u32),
            [3, 4],
            sample as u32,
            0,
        )
    };
    assert_ne!(numbers(5), numbers(5 + (1 << 32)));
    assert_ne!(numbers((1 << 32) - 1), numbers(1 << 32));
}

#[test]
fn the_largest_number_is_below_one() {
    assert_eq!(unit_float([u32::MAX; 4]), [1.0 - gpu_trace::verify::U; 4]);
    assert!((unit_float([u32::MAX; 4])[0] as f32) < 1.0);
}

/// One component of the stream over the pixels of a square image, by rows.
fn image(seed: u64, sample: u64, dimension: u32, component: usize, side: u32) -> Vec<f64> {
    let stream = stream_words(seed, (sample >> 32) as u32);
    (0..side * side)
        .map(|i| random4(stream, [i % side, i / side], sample as u32, dimension)[component])
        .collect()
}

#[test]
fn numbers_are_uniform() {
    // Over pixels and over samples; every component of camera and first bounces.
    let mut p_values = Vec::new();
    for dimension in 0..4 {
        for component in 0..4 {
            p_values.push(uniform_ks(&mut image(0, 0, dimension, component, 256)));
            let stream = stream_words(0, 0);
            let mut samples: Vec<f64> = (0..65536)
                .map(|s| random4(stream, [17, 5], s, dimension)[component])
                .collect();
            p_values.push(uniform_ks(&mut samples));
        }
    }
    let level = sidak(p_values.len());
    let least = p_values.iter().copied().fold(1.0, f64::min);
    assert!(
        least > level,
        "p = {least:e} of {} tests, level {level:e}",
        p_values.len()
    );
}

#[test]
fn companion_numbers_off_by_two_percent_are_not_uniform() {
    let mut values = image(0, 0, 0, 0, 256);
    for v in &mut values {
        // At most 0.05/e away from uniform.
        *v = v.powf(1.05);
    }
    let p = uniform_ks(&mut values);
    assert!(p < SIGNIFICANCE * 1.0e-3, "p = {p}");
}

/// Largest correlation, in standard deviations, between the component that a pixel, a sample, a
/// dimension has and that of its neighbours.
fn largest_correlation(numbers: impl Fn([u32; 2], u32, u32) -> [f64; 4]) -> (f64, String) {
    const SIDE: u32 = 256;
    let field = |dx: u32, dy: u32, sample: u32, dimension: u32, component: usize| -> Vec<f64> {
        (0..SIDE * SIDE)
            .map(|i| numbers([i % SIDE + dx, i / SIDE + dy], sample, dimension)[component])
            .collect()
    };
    let mut largest = (0.0, String::new());
    for component in 0..4 {
        let base = field(0, 0, 9, 0, component);
        for other in 0..4 {
            for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1), (2, 0), (8, 0), (0, 8)] {
                for (sample, dimension) in [(9, 0), (10, 0), (11, 0), (25, 0), (9, 1), (9, 2)] {
                    if (dx, dy, sample, dimension) == (0, 0, 9, 0) && other <= component {
                        continue;
                    }
                    let moved = field(dx, dy, sample, dimension, other);
                    let deviations = correlation(&base, &moved).abs() * f64::from(SIDE);
                    if deviations > largest.0 {
                        let place = format!(
                            "component {component} and {other}, {dx} right, {dy} down, sample 9 and \
                             {sample}, dimension 0 and {dimension}"
                        );
                        largest = (deviations, place);
                    }
                }
            }
        }
    }
    largest
}

#[test]
fn neighbours_are_uncorrelated() {
    // The largest of 662 independent deviates is below 4 with probability 0.96 and below 4.8 in
    // 999 cases of 1000; the stream is fixed, so this is one draw, and 4/sqrt(n) is what is asked.
    let stream = stream_words(0, 0);
    let (largest, place) = largest_correlation(|p, s, d| random4(stream, p, s, d));
    assert!(largest < 4.0, "{largest} deviations: {place}");
}

/// Largest correlation, in standard deviations, between the numbers of a seed and of the seeds that
/// differ from it in one bit or in all.
fn largest_seed_correlation(words: impl Fn(u64) -> [u32; 2]) -> f64 {
    let numbers = |seed: u64| -> Vec<f64> {
        let stream = words(seed);
        (0..65_536)
            .map(|i| random4(stream, [i % 256, i / 256], 3, 1)[0])
            .collect()
    };
    let base = numbers(0);
    (0..64)
        .map(|bit| 1 << bit)
        .chain([u64::MAX])
        .map(|seed| correlation(&base, &numbers(seed)).abs() * 256.0)
        .fold(0.0, f64::max)
}

#[test]
fn neighbouring_seeds_are_uncorrelated() {
    // The largest of 65 independent deviates is below 4 with probability 0.996.
    let largest = largest_seed_correlation(|seed| stream_words(seed, 0));
    assert!(largest < 4.0, "{largest} deviations");
}

#[test]
fn companion_seeds_that_are_not_mixed_are_correlated() {
    let largest = largest_seed_correlation(|seed| [(seed >> 60) as u32, 0]);
    assert!(largest > 100.0, "only {largest} deviations");
}

#[test]
fn companion_a_weak_hash_is_correlated() {
    // One multiplication instead of two, and shifts.
    let weak = |p: [u32; 2], s: u32, d: u32| {
        let key = p[0].wrapping_mul(1_664_525) ^ p[1].wrapping_mul(22_695_477) ^ s ^ d << 8;
        unit_float([
            key,
            key.rotate_left(8),
            key.rotate_left(16),
            key.rotate_left(24),
        ])
    };
    let (largest, _) = largest_correlation(weak);
    assert!(largest > 4.0, "only {largest} deviations");
}

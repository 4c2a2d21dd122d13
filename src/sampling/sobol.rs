//! Twin of `shaders/sampler/sobol.wesl`: the same bits. Sources are cited there.

use super::random::{mix_bits, unit_float};

/// What every bit of a point's index adds to [`sobol_point`].
const DIRECTIONS: [u32; 6] = [
    0x2020_2020,
    0x3030_3010,
    0x0818_2808,
    0x1424_3c04,
    0x3e3a_2202,
    0x1d17_3301,
];

/// The point that comes at `place` in a scramble of `last` + 1 points.
#[must_use]
pub fn shuffled(place: u32, last: u32, key: u32) -> u32 {
    let mut x = place ^ key;
    x = x.wrapping_mul(key >> 5 | 1);
    x ^= (x & last) >> 1;
    x ^= key >> 12;
    x = x.wrapping_mul(key >> 17 | 1);
    x ^= (x & last) >> 2;
    x = x.wrapping_mul(key >> 9 | 1);
    x ^= (x & last) >> 3;
    x.wrapping_add(key >> 25) & last
}

/// Point `index` < 64 of the sequence: six digits of each coordinate in the bytes of a word.
#[must_use]
pub fn sobol_point(index: u32) -> u32 {
    let bit = |j: usize| if index >> j & 1 == 1 { u32::MAX } else { 0 };
    (0..6).fold(0, |point, j| point ^ (DIRECTIONS[j] & bit(j)))
}

/// Owen's scramble of a point's four coordinates in Matousek's form.
#[must_use]
pub fn owen_scramble(point: u32, a: u32, b: u32, shift: u32) -> u32 {
    let mask = |bit: u32| (point >> bit & 0x0101_0101).wrapping_mul(255);
    point
        ^ shift & 0x3f3f_3f3f
        ^ mask(5) & a & 0x1f1f_1f1f
        ^ mask(4) & b & 0x0f0f_0f0f
        ^ mask(3) & a >> 5 & 0x0707_0707
        ^ mask(2) & b >> 4 & 0x0303_0303
        ^ mask(1) & b >> 6 & 0x0101_0101
}

/// The four words of one dimension of a sample, before they become numbers.
#[must_use]
pub fn sobol_words(key: [u32; 2], dimension: u32, place: u32, last: u32) -> [u32; 4] {
    let word = |[base, key]: [u32; 2], counter: u32| {
        mix_bits(base.wrapping_add(counter.wrapping_mul(0x9e37_79b9)), key)
    };
    let [order, a, b, shift] =
        [0, 1, 2, 3].map(|i| word(key, dimension.wrapping_mul(4).wrapping_add(i)));
    let digits = owen_scramble(sobol_point(shuffled(place, last, order)), a, b, shift);
    let number = dimension.wrapping_mul(64).wrapping_add(place);
    let random = [0, 1].map(|i| word([key[1], key[0]], number.wrapping_mul(2).wrapping_add(i)));
    [0, 1, 2, 3].map(|i| {
        let tail = random[i % 2].rotate_left(i as u32 / 2 * 16);
        digits << (26 - 8 * i) & 0xfc00_0000 | tail >> 6
    })
}

/// Four numbers of one dimension of the sample at `place` in a scramble of `last` + 1 samples; `key`
/// is the first one's.
#[must_use]
pub fn sobol4(key: [u32; 2], dimension: u32, place: u32, last: u32) -> [f64; 4] {
    unit_float(sobol_words(key, dimension, place, last))
}

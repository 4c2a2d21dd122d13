//! Twin of `shaders/core/random.wesl`: the same bits.

/// A keyed bijection of words; see the kernel's source.
#[must_use]
pub fn mix_bits(word: u32, key: u32) -> u32 {
    let mut x = word;
    x ^= x >> 16;
    x = x.wrapping_mul(0x21f0_aaad);
    x ^= key;
    x ^= x >> 15;
    x = x.wrapping_mul(0xd35a_2d97);
    x ^ (x >> 15)
}

/// What identifies a sample: two words.
#[must_use]
pub fn sample_key(stream: [u32; 2], pixel: [u32; 2], sample_low: u32) -> [u32; 2] {
    let place = pixel[0] | (pixel[1] << 16);
    [place, !place].map(|word| {
        let of_pixel = mix_bits(word, stream[0]);
        mix_bits(of_pixel.wrapping_add(sample_low), stream[1])
    })
}

/// Uniform in [0, 1) with 24 bits, exactly the kernel's numbers.
#[must_use]
pub fn unit_float(bits: [u32; 4]) -> [f64; 4] {
    bits.map(|b| f64::from(b >> 8) * 2f64.powi(-24))
}

/// The four words of one dimension of a sample, before they become numbers.
#[must_use]
pub fn random_words(key: [u32; 2], dimension: u32) -> [u32; 4] {
    [0, 1, 2, 3].map(|i| {
        let counter = dimension.wrapping_mul(4).wrapping_add(i);
        mix_bits(
            key[0].wrapping_add(counter.wrapping_mul(0x9e37_79b9)),
            key[1],
        )
    })
}

/// Four numbers of a sample; `dimension` counts dimensions by fours ([`super::purpose`]).
#[must_use]
pub fn random4(key: [u32; 2], dimension: u32) -> [f64; 4] {
    unit_float(random_words(key, dimension))
}

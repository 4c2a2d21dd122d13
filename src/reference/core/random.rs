//! Twin of `shaders/core/random.wesl`: the same bits.

/// PCG4D of Jarzynski and Olano, "Hash Functions for GPU Rendering" (JCGT 9(3), 2020), listing 2.
#[must_use]
pub fn pcg4d(key: [u32; 4]) -> [u32; 4] {
    let mut v = key.map(|k| k.wrapping_mul(1_664_525).wrapping_add(1_013_904_223));
    let mut round = |shift: bool| {
        v[0] = v[0].wrapping_add(v[1].wrapping_mul(v[3]));
        v[1] = v[1].wrapping_add(v[2].wrapping_mul(v[0]));
        v[2] = v[2].wrapping_add(v[0].wrapping_mul(v[1]));
        v[3] = v[3].wrapping_add(v[1].wrapping_mul(v[2]));
        if shift {
            v = v.map(|x| x ^ (x >> 16));
        }
    };
    round(true);
    round(false);
    v
}

/// Uniform in [0, 1) with 24 bits, exactly the kernel's numbers.
#[must_use]
pub fn unit_float(bits: [u32; 4]) -> [f64; 4] {
    bits.map(|b| f64::from(b >> 8) * 2f64.powi(-24))
}

/// Four numbers of one dimension of one sample; see the kernel's source.
#[must_use]
pub fn random4(stream: [u32; 2], pixel: [u32; 2], sample_low: u32, dimension: u32) -> [f64; 4] {
    unit_float(pcg4d([
        (pixel[0] | (pixel[1] << 16)) ^ stream[0],
        sample_low,
        dimension,
        stream[1],
    ]))
}

//! Cases 33 and 34: random numbers. Integers and bits: most of the limits are 0.

use super::Case;
use super::context::Context;
use super::film::{mixed, must, sized};
use crate::error::Result;
use crate::sampling::random::{random4, sample_key};
use crate::settings::{Settings, stream_words};
use crate::statistics::{correlation, sidak, uniform_ks};
use crate::verify::{Measure, Random, share_off};

pub(super) const CASES: &[Case] = &[
    Case {
        id: 33,
        name: "integers to floats",
        setup: "the largest words give numbers below 1; uniform by Kolmogorov and Smirnov; neighbours \
                in pixel, sample, dimension and component correlate by less than 4/sqrt(n)",
        run: floats,
    },
    Case {
        id: 34,
        name: "sample indices past 2^16 and 2^32",
        setup: "the random numbers of the samples around both have the bits that the host gives them; \
                a render across them has the reference's values",
        run: sample_indices,
    },
];

/// Where, and which: the two rows of the probe's `random4`.
type Key = [[u32; 4]; 2];

fn key(seed: u64, pixel: [u32; 2], sample: u64, dimension: u32) -> Key {
    let [s, t] = stream_words(seed, (sample >> 32) as u32);
    [[s, t, pixel[0], pixel[1]], [sample as u32, dimension, 0, 0]]
}

/// What the device makes of the keys.
fn on_device(context: &Context, keys: &[Key]) -> Result<Vec<[f32; 4]>> {
    context.probe(&[])?.call("random4", keys)
}

/// What the host makes of one.
fn on_host([[s, t, x, y], [sample, dimension, ..]]: &Key) -> [f64; 4] {
    random4(sample_key([*s, *t], [*x, *y], *sample), *dimension)
}

/// The inverse of an odd number modulo 2^32.
fn inverse(odd: u32) -> u32 {
    // Newton: an odd number is its own inverse in 3 bits, and every step doubles them.
    (0..4).fold(odd, |x: u32, _| {
        x.wrapping_mul(2u32.wrapping_sub(odd.wrapping_mul(x)))
    })
}

/// The word that the stream's `mix_bits` takes to `word`.
fn unmix(word: u32, key: u32) -> u32 {
    let undo = |x: u32| x ^ (x >> 15) ^ (x >> 30);
    let x = undo(word).wrapping_mul(inverse(0xd35a_2d97));
    let x = (undo(x) ^ key).wrapping_mul(inverse(0x21f0_aaad));
    x ^ (x >> 16)
}

/// A dimension and the component of it in which a sample has the word `word`.
fn where_is(word: u32, key: [u32; 2]) -> (u32, usize) {
    let counter = unmix(word, key[1])
        .wrapping_sub(key[0])
        .wrapping_mul(inverse(0x9e37_79b9));
    (counter >> 2, counter as usize & 3)
}

/// The largest words there are: f32(word) 2^-32 is 1.0 for the last 128 of them.
fn largest_words(context: &Context, measure: &mut Measure) -> Result<()> {
    let mut random = Random::new("largest words");
    let mut keys: Vec<Key> = Vec::new();
    let mut wanted = Vec::new();
    for i in 0..context.size(4096, 65_536) {
        let [x, y, sample, seed] = random.words();
        let mut key = key(
            u64::from(seed),
            [x & 0xffff, y & 0xffff],
            u64::from(sample),
            0,
        );
        let word = u32::MAX - i % 512;
        let stream = [key[0][0], key[0][1]];
        let (dimension, component) =
            where_is(word, sample_key(stream, [key[0][2], key[0][3]], sample));
        key[1][1] = dimension;
        keys.push(key);
        wanted.push((word, component));
    }
    for (numbers, (word, component)) in on_device(context, &keys)?.iter().zip(wanted) {
        // The disturbance is what is wrong with the plain conversion.
        let truth = if context.options.disturb {
            (f64::from(word) * 2f64.powi(-32)) as f32
        } else {
            (f64::from(word >> 8) * 2f64.powi(-24)) as f32
        };
        let number = numbers[component];
        let right = number.to_bits() == truth.to_bits() && number < 1.0;
        must(measure, right, || {
            format!("word {word:#x} gives {number:?}, not {truth:?}")
        });
    }
    Ok(())
}

/// Steps right and down, sample, dimension: the first is what the others are compared with.
const NEIGHBOURS: [[u32; 4]; 9] = [
    [0, 0, 9, 0],
    [1, 0, 9, 0],
    [0, 1, 9, 0],
    [8, 0, 9, 0],
    [0, 8, 9, 0],
    [0, 0, 10, 0],
    [0, 0, 25, 0],
    [0, 0, 9, 1],
    [0, 0, 9, 2],
];

fn floats(context: &Context) -> Result<Measure> {
    let mut measure = Measure::new(1.0, "of the bound");
    largest_words(context, &mut measure)?;
    let side = context.size(128, 256);
    let keys: Vec<Key> = NEIGHBOURS
        .iter()
        .flat_map(|[dx, dy, sample, dimension]| {
            (0..side * side).map(move |i| {
                let pixel = [i % side + dx, i / side + dy];
                key(0, pixel, u64::from(*sample), *dimension)
            })
        })
        .collect();
    let numbers = on_device(context, &keys)?;
    // By neighbour and component.
    let fields: Vec<[Vec<f64>; 4]> = numbers
        .chunks((side * side) as usize)
        .map(|field| {
            [0, 1, 2, 3].map(|c| {
                // The disturbance is at most 0.05/e away from uniform.
                let power = context.disturbed(0.05);
                field.iter().map(|x| f64::from(x[c]).powf(power)).collect()
            })
        })
        .collect();
    let level = sidak(4 * fields.len());
    for (field, place) in fields.iter().zip(NEIGHBOURS) {
        for (c, values) in field.iter().enumerate() {
            let inside = values.iter().all(|x| (0.0..1.0).contains(x));
            must(&mut measure, inside, || {
                format!("beyond [0, 1): component {c} of {place:?}")
            });
            let p = uniform_ks(&mut values.clone());
            measure.add(level / p, || {
                format!("uniform with p = {p:.1e}: component {c} of {place:?}")
            });
        }
    }
    // What a driver changes it changes in integers, so that these are the same draws everywhere.
    for (field, place) in fields.iter().zip(NEIGHBOURS) {
        for (a, base) in fields[0].iter().enumerate() {
            for (b, other) in field.iter().enumerate() {
                if place == NEIGHBOURS[0] && b <= a {
                    continue;
                }
                let deviations = correlation(base, other).abs() * f64::from(side);
                measure.add(deviations / 4.0, || {
                    format!("{deviations:.2} deviations: components {a} and {b} of {place:?}")
                });
            }
        }
    }
    Ok(measure)
}

/// Sample indices where a word or half of one overflows.
const EDGES: [u64; 6] = [
    (1 << 16) - 1,
    1 << 16,
    (1 << 32) - 1,
    1 << 32,
    (1 << 48) - 1,
    u64::MAX - 1,
];

fn sample_indices(context: &Context) -> Result<Measure> {
    let mut measure = Measure::new(0.0, "wrong");
    let mut keys: Vec<Key> = Vec::new();
    for seed in [0, 1, u64::MAX] {
        for sample in EDGES {
            for pixel in [[0, 0], [1, 0], [0, 1], [65_535, 65_535]] {
                keys.extend([0, 1, 64, 65_536].map(|d| key(seed, pixel, sample, d)));
            }
        }
    }
    for (at, numbers) in keys.iter().zip(on_device(context, &keys)?) {
        let mut told = *at;
        told[1][0] ^= u32::from(context.options.disturb);
        let truth = on_host(&told).map(|x| x as f32);
        let wrong = numbers.map(f32::to_bits) != truth.map(f32::to_bits);
        measure.count(1, u64::from(wrong), || {
            format!("sample key {at:?}: {numbers:?}")
        });
    }
    let scene = mixed()?;
    let edges: &[u64] = context.size(&[1 << 32][..], &[1 << 16, 1 << 32, (1 << 48) - 16][..]);
    for edge in edges {
        let settings = Settings {
            samples: edge - 16..edge + 16,
            ..sized(context, &scene, [12, 10], 1)
        };
        let film = context.render(&scene, &settings)?;
        let later = u64::from(context.options.disturb);
        let shifted = Settings {
            samples: edge - 16 - later..edge + 16 - later,
            seed: later,
            ..settings
        };
        let share = share_off(&film, &context.reference(&scene, &shifted)?);
        // A path parts from its twin where a choice falls within a rounding of its threshold: some
        // 1e-5 of the events, of which a pixel has a hundred.
        measure.count(1, u64::from(share > 0.05), || {
            format!("around sample {edge}: {share:.3} of the values are not the reference's")
        });
    }
    Ok(measure)
}

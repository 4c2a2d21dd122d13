//! The points of the sampler `sobol`: the same bits in WGSL and in Rust, nets after every scramble,
//! uniform numbers, and nothing in common between vertices, scrambles and pixels.

use crate::common::probe;
use gpu_trace::sampling::random::{random_words, sample_key, unit_float};
use gpu_trace::sampling::sobol::{owen_scramble, shuffled, sobol_point, sobol_words, sobol4};
use gpu_trace::settings::stream_words;
use gpu_trace::statistics::{SIGNIFICANCE, correlation, mean_and_error, sidak, uniform_ks};
use gpu_trace::verify::Random;

/// Last places of the scrambles that a render has.
const LASTS: [u32; 3] = [3, 15, 63];

/// The key of a scramble; all that tells scrambles apart goes through this.
fn key_of(pixel: [u32; 2], start: u32) -> [u32; 2] {
    sample_key(stream_words(0, 0), pixel, start)
}

/// Inputs of `sobol4`: corners, then random ones.
fn inputs() -> Vec<[[u32; 4]; 2]> {
    let mut all = Vec::new();
    for last in LASTS {
        for place in [0, 1, last / 2, last] {
            for dimension in [0, 1, 64, u32::MAX] {
                for key in [[0, 0], [1, 0], [0, 1], [u32::MAX; 2]] {
                    all.push([[key[0], key[1], dimension, place], [last, 0, 0, 0]]);
                }
            }
        }
    }
    let mut random = Random::new("sobol4");
    while all.len() < 120_000 {
        let [a, b, c, d] = random.words();
        let last = LASTS[d as usize % 3];
        all.push([[a, b, c & 0xff, d >> 8 & last], [last, 0, 0, 0]]);
    }
    all
}

/// How many inputs give other bits on the device than `host` says.
fn differences(
    function: &str,
    inputs: &[[[u32; 4]; 2]],
    host: impl Fn(&[[u32; 4]; 2]) -> [u32; 4],
) -> usize {
    let device: Vec<[u32; 4]> = probe(&["sobol"])
        .call(function, inputs)
        .expect("the probe runs");
    let pairs = inputs.iter().zip(&device);
    pairs.filter(|(input, bits)| host(input) != **bits).count()
}

fn numbers_of(input: &[[u32; 4]; 2]) -> [u32; 4] {
    let [[a, b, dimension, place], [last, ..]] = *input;
    sobol4([a, b], dimension, place, last).map(|x| (x as f32).to_bits())
}

#[test]
fn numbers_have_the_same_bits_on_device_and_host() {
    let inputs = inputs();
    assert_eq!(differences("sobol4", &inputs, numbers_of), 0);
    // Companion: every input matters.
    for word in 0..4 {
        let flip = |input: &[[u32; 4]; 2]| {
            let mut input = *input;
            input[0][word] ^= 1;
            numbers_of(&input)
        };
        let wrong = differences("sobol4", &inputs, flip);
        assert_eq!(wrong, inputs.len(), "word {word} does not matter");
    }
}

#[test]
fn the_parts_have_the_same_bits_on_device_and_host() {
    let mut random = Random::new("parts");
    let words: Vec<[[u32; 4]; 2]> = (0..100_000)
        .map(|_| [random.words(), random.words()])
        .collect();
    let wrong = differences("owen_scramble", &rows(&words, |w| w), |[w, _]| {
        [owen_scramble(w[0], w[1], w[2], w[3]), 0, 0, 0]
            .map(|_| owen_scramble(w[0], w[1], w[2], w[3]))
    });
    assert_eq!(wrong, 0, "owen_scramble");
    let places = rows(&words, |[place, last, key, _]| {
        let last = LASTS[last as usize % 3];
        [place & last, last, key, 0]
    });
    let wrong = differences("shuffled", &places, |[w, _]| {
        [shuffled(w[0], w[1], w[2]); 4]
    });
    assert_eq!(wrong, 0, "shuffled");
    let indices: Vec<[[u32; 4]; 2]> = (0..64).map(|i| [[i, 0, 0, 0], [0; 4]]).collect();
    let wrong = differences("sobol_point", &indices, |[w, _]| [sobol_point(w[0]); 4]);
    assert_eq!(wrong, 0, "sobol_point");
}

/// The same inputs with another first row.
fn rows(inputs: &[[[u32; 4]; 2]], change: impl Fn([u32; 4]) -> [u32; 4]) -> Vec<[[u32; 4]; 2]> {
    inputs.iter().map(|[a, b]| [change(*a), *b]).collect()
}

#[test]
fn points_are_those_of_sobol() {
    // The first eight points of the sequence, in natural order, in eighths: van der Corput's, and
    // three more as the direction numbers m = (1), (1, 3), (1, 3, 1) of the polynomials x + 1,
    // x^2 + x + 1 and x^3 + x + 1 give them by hand.
    let wanted = [
        [0, 0, 0, 0],
        [4, 4, 4, 4],
        [2, 6, 6, 6],
        [6, 2, 2, 2],
        [1, 5, 3, 1],
        [5, 1, 7, 5],
        [3, 3, 5, 7],
        [7, 7, 1, 3],
    ];
    for (index, point) in (0..).zip(wanted) {
        let eighths = [0, 1, 2, 3].map(|d| sobol_point(index) >> (8 * d + 3) & 7);
        assert_eq!(eighths, point, "point {index}");
    }
}

/// Whether 2^m points (words, of which the highest bits count) have 2^t in every elementary interval
/// of volume 2^(t - m) in the dimensions `axes`.
fn is_net(points: &[[u32; 4]], axes: &[usize], t: u32) -> bool {
    let m = points.len().ilog2();
    let Some(digits) = m.checked_sub(t) else {
        return true;
    };
    splits(digits, axes.len()).iter().all(|split| {
        let mut counts = vec![0; 1 << digits];
        for point in points {
            let cell = axes.iter().zip(split).fold(0, |cell: u64, (axis, bits)| {
                cell << bits | u64::from(point[*axis]) >> (32 - bits)
            });
            counts[cell as usize] += 1;
        }
        counts.iter().all(|count| *count == 1 << t)
    })
}

/// All ways to write `total` as a sum of `parts` numbers.
fn splits(total: u32, parts: usize) -> Vec<Vec<u32>> {
    if parts == 1 {
        return vec![vec![total]];
    }
    let first = |a| {
        move |mut rest: Vec<u32>| {
            rest.push(a);
            rest
        }
    };
    (0..=total)
        .flat_map(|a| splits(total - a, parts - 1).into_iter().map(first(a)))
        .collect()
}

/// The points of a scramble in the order of its samples.
fn scramble(key: [u32; 2], dimension: u32, last: u32) -> Vec<[u32; 4]> {
    (0..=last)
        .map(|place| sobol_words(key, dimension, place, last))
        .collect()
}

/// Axes, and the least t for scrambles of 4, 16 and 64 points.
const NETS: [(&[usize], [u32; 3]); 8] = [
    (&[0], [0; 3]),
    (&[1], [0; 3]),
    (&[2], [0; 3]),
    (&[3], [0; 3]),
    (&[0, 1], [0; 3]),
    (&[0, 2], [0, 0, 1]),
    (&[0, 1, 2], [1, 1, 1]),
    (&[0, 1, 2, 3], [1, 2, 2]),
];

#[test]
fn every_scramble_is_a_net() {
    for start in 0..300 {
        let key = key_of([start % 17, start / 17], 64 * start);
        for (last, n) in LASTS.into_iter().zip(0..) {
            let points = scramble(key, start % 5, last);
            for (axes, t) in NETS {
                assert!(
                    is_net(&points, axes, t[n]),
                    "{axes:?} of {} points",
                    last + 1
                );
                // The bound is sharp, so that a test of less would not do.
                let sharper = t[n]
                    .checked_sub(1)
                    .is_some_and(|t| is_net(&points, axes, t));
                assert!(!sharper, "{axes:?} of {} points: t < {}", last + 1, t[n]);
            }
        }
    }
}

#[test]
fn companion_other_points_are_no_net() {
    for start in 0..300 {
        let key = key_of([start % 17, start / 17], 64 * start);
        let independent: Vec<[u32; 4]> = (0..64)
            .map(|i| random_words(key_of([3, 4], 64 * start + i), 0))
            .collect();
        assert!(!is_net(&independent, &[0, 1], 0));
        // Points of two scrambles.
        let mut mixed = scramble(key, 1, 63);
        mixed[32..].copy_from_slice(&scramble(key, 2, 63)[32..]);
        assert!(!is_net(&mixed, &[0, 1], 0));
    }
}

#[test]
fn shuffles_are_permutations_without_a_bias() {
    let mut random = Random::new("shuffles");
    let keys: Vec<u32> = (0..2500).flat_map(|_| random.words()).collect();
    for last in LASTS {
        for key in &keys[..1000] {
            let mut seen: Vec<u32> = (0..=last).map(|i| shuffled(i, last, *key)).collect();
            seen.sort_unstable();
            assert!(seen.iter().copied().eq(0..=last), "key {key}");
        }
        // How often two places get points that differ by each exclusive or, over the mean.
        let worst = worst_pair(last, |place| {
            keys.iter().map(|key| shuffled(place, last, *key)).collect()
        });
        assert!(
            worst < 6.0,
            "{worst} times as often as others, of {}",
            last + 1
        );
        eprintln!("{worst:.2} times as often as others, of {}", last + 1);
        // Companion: with a shift alone every pair stays what it is.
        let worst = worst_pair(last, |place| {
            keys.iter().map(|key| (place ^ key) & last).collect()
        });
        assert!(worst > f64::from(last) * 0.99, "{worst}");
    }
}

fn worst_pair(last: u32, points: impl Fn(u32) -> Vec<u32>) -> f64 {
    let all: Vec<Vec<u32>> = (0..=last).map(points).collect();
    let mut worst: f64 = 0.0;
    for apart in 1..=last {
        let mut counts = vec![0; last as usize + 1];
        for (i, a) in (0..).zip(&all) {
            let b = &all[(i ^ apart) as usize];
            a.iter()
                .zip(b)
                .for_each(|(a, b)| counts[(a ^ b) as usize] += 1);
        }
        let mean = f64::from(counts.iter().sum::<i32>()) / f64::from(last);
        worst = counts
            .iter()
            .fold(worst, |w, c| w.max(f64::from(*c) / mean));
    }
    worst
}

#[test]
fn a_scramble_keeps_what_points_share_and_no_more() {
    // Over all keys: two points whose first k digits are equal, and the next not, have results of
    // which that is true too, and the digits after that differ in half of the cases each.
    let mut random = Random::new("scrambles");
    for _ in 0..200 {
        let [i, j, ..] = random.words().map(|w| w & 63);
        let (p, q) = (sobol_point(i), sobol_point(j));
        let mut differing = [[0; 6]; 4];
        for _ in 0..400 {
            let [a, b, shift, _] = random.words();
            let apart = owen_scramble(p, a, b, shift) ^ owen_scramble(q, a, b, shift);
            for (d, counts) in differing.iter_mut().enumerate() {
                let digits = apart >> (8 * d) & 63;
                let shared = ((p ^ q) >> (8 * d) & 63).leading_zeros();
                assert_eq!(digits.leading_zeros(), shared);
                (0..6).for_each(|k| counts[k] += digits >> (5 - k) & 1);
            }
        }
        for (d, counts) in differing.iter().enumerate() {
            let shared = ((p ^ q) >> (8 * d) & 63).leading_zeros() as usize - 26;
            for count in counts.iter().skip(shared + 1) {
                // 5 standard deviations of 10; some thousand of these.
                assert!((150..=250).contains(count), "{count} of 400");
            }
        }
    }
}

#[test]
fn numbers_are_uniform() {
    let mut p_values = Vec::new();
    for axis in 0..4 {
        for dimension in [0, 1, 5] {
            for (last, place) in [(3, 2), (15, 11), (63, 0), (63, 40)] {
                // One place of many scrambles: each is a draw of its own.
                let mut over_scrambles: Vec<f64> = (0..65_536)
                    .map(|i| sobol4(key_of([9, 2], 64 * i), dimension, place, last)[axis])
                    .collect();
                p_values.push(uniform_ks(&mut over_scrambles));
            }
            let mut over_pixels: Vec<f64> = (0..65_536)
                .map(|i| sobol4(key_of([i & 255, i >> 8], 256), dimension, 17, 63)[axis])
                .collect();
            p_values.push(uniform_ks(&mut over_pixels));
            // Digits after the sixth: the place within a cell.
            let mut within: Vec<f64> = (0..65_536)
                .map(|i| {
                    let key = key_of([7, 7], 64 * (i >> 6));
                    (64.0 * sobol4(key, dimension, i & 63, 63)[axis]).fract()
                })
                .collect();
            p_values.push(uniform_ks(&mut within));
        }
    }
    let least = p_values.iter().copied().fold(1.0, f64::min);
    assert!(least > sidak(p_values.len()), "p = {least:e}");
}

#[test]
fn companion_a_digit_that_never_changes_is_found() {
    let mut values: Vec<f64> = (0..65_536)
        .map(|i| {
            let words = sobol_words(key_of([9, 2], 64 * i), 0, 2, 3);
            unit_float(words.map(|w| w & !(1 << 27)))[0]
        })
        .collect();
    let p = uniform_ks(&mut values);
    assert!(p < SIGNIFICANCE * 1.0e-3, "p = {p}");
}

/// One number of a place in a scramble as a deviate.
type Number = dyn Fn(u32) -> f64;

#[test]
fn scrambles_pixels_and_vertices_are_uncorrelated() {
    const COUNT: u32 = 65_536;
    let at = |dx: u32, scramble: u32, dimension: u32, place: u32, axis: usize| -> Vec<f64> {
        let number: Box<Number> = Box::new(move |i| {
            let key = key_of([i % 256 + dx, i / 256], 64 * scramble);
            sobol4(key, dimension, place, 63)[axis]
        });
        (0..COUNT).map(number).collect()
    };
    let mut largest: f64 = 0.0;
    for axis in 0..4 {
        let base = at(0, 5, 1, 9, axis);
        for other in 0..4 {
            let same_vertex = (0..4).contains(&other) && other != axis;
            let mut others = vec![
                at(1, 5, 1, 9, other),
                at(0, 6, 1, 9, other),
                at(0, 5, 2, 9, other),
                at(0, 5, 0, 9, other),
                at(0, 5, 2, 10, other),
                at(0, 6, 1, 10, other),
            ];
            if same_vertex {
                others.push(at(0, 5, 1, 9, other));
            }
            for other in others {
                largest = largest.max(correlation(&base, &other).abs() * 256.0);
            }
        }
    }
    // Of 108 independent deviates; the stream is fixed, so this is one draw.
    assert!(largest < 4.0, "{largest} deviations");
    // Companion: neighbours in a scramble repel each other, if only by 1/63.
    let neighbours: f64 = (0..4)
        .map(|axis| correlation(&at(0, 5, 1, 9, axis), &at(0, 5, 1, 10, axis)) * 256.0)
        .sum();
    assert!(neighbours < -8.0, "{neighbours}");
}

/// 1 in the upper half of the unit interval, -1 in the lower.
fn half(word: u32) -> f64 {
    if word >> 31 == 1 { 1.0 } else { -1.0 }
}

/// Variance of the mean over a scramble of the product of two vertices' halves, times its samples;
/// and its standard error.
fn product_variance(last: u32, point: impl Fn([u32; 2], u32, u32) -> u32) -> (f64, f64) {
    let squares: Vec<f64> = (0..20_000)
        .map(|i| {
            let key = key_of([i % 100, i / 100], 256);
            let product = |place| half(point(key, 1, place)) * half(point(key, 2, place));
            let sum: f64 = (0..=last).map(product).sum();
            sum * sum / f64::from(last + 1)
        })
        .collect();
    mean_and_error(&squares)
}

#[test]
fn products_over_two_vertices_are_no_worse_than_independent_ones() {
    for last in [15, 63] {
        let (variance, error) =
            product_variance(last, |key, d, place| sobol_words(key, d, place, last)[0]);
        // With a random permutation 1 + 1/(S - 1); the shuffle is within 10 % of that.
        let wanted = 1.0 + 1.0 / f64::from(last);
        assert!(
            (variance / wanted - 1.0).abs() < 0.1 + 4.0 * error,
            "{variance}"
        );
        // Companion: Burley's nested shuffle, whose pairs stay pairs, has 2.
        let nested = |key: [u32; 2], d: u32, place: u32| {
            let [shuffle, shift, ..] = random_words(key, d);
            let bits = |x: u32| x.reverse_bits() >> (32 - (last + 1).ilog2());
            let mut x = bits(place);
            for k in 1..6 {
                // Flips a bit by a hash of the bits below.
                let below = x & ((1 << k) - 1);
                let hash = shuffle.rotate_left(k * 5) ^ (below.wrapping_mul(0x9e37_79b9) >> 7);
                x ^= (hash.count_ones() % 2) << k;
            }
            (sobol_point(bits(x & last)) << 26) ^ shift
        };
        let (variance, _) = product_variance(last, nested);
        assert!(variance > 1.5, "{variance} with a nested shuffle");
    }
}

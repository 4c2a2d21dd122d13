//! Cases 32 to 37: samples, their sums, and images of any size. Integers and bits: most of the limits
//! are 0.

use super::context::Context;
use super::Case;
use crate::error::{Error, Result};
use crate::film::Film;
use crate::gpu::device::Gpu;
use crate::gpu::renderer::{DispatchLimits, GpuRenderer};
use crate::job::prepare;
use crate::reference::core::random::{random4, sample_key};
use crate::render::render_quietly;
use crate::scene::Scene;
use crate::settings::{Rect, Settings, stream_words};
use crate::statistics::{correlation, sidak, uniform_ks};
use crate::verify::{Measure, Random, SceneText, image_bits, means, share_off};

pub(super) const CASES: &[Case] = &[
    Case {
        id: 32,
        name: "sums of very many samples",
        setup: "a constant environment of 0.1, 0.7 and 0.3 over 1e7 samples of a pixel (2e5 in the \
                quick form): the mean is the constant to 1e-6",
        run: many_samples,
    },
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
    Case {
        id: 35,
        name: "images of odd sizes",
        setup: "1x1, 7x5, 8191x1: every pixel is there, and a crop has the whole image's bits",
        run: odd_sizes,
    },
    Case {
        id: 36,
        name: "images of several regions",
        setup: "a crop across the seam at 1024 has the whole image's bits; what no device or file can \
                hold is refused before any work",
        run: seams,
    },
    Case {
        id: 37,
        name: "any split into dispatches",
        setup: "by tiles, by samples and by both: image, variance and rays have the same bits",
        run: dispatches,
    },
];

/// Something of everything that a path can meet, in a bright environment.
fn mixed() -> Result<Scene> {
    SceneText::new([0.0, 0.0, 4.0], [0.0, 0.0, 0.0])
        .environment(0.5)
        .diffuse("floor", 0.6, 0.0)
        .diffuse("lamp", 0.2, 4.0)
        .dielectric("glass", 1.5)
        .material("mirror", "type = \"mirror\"\nreflectance = [0.9, 0.8, 0.7]")
        .sphere([0.0, -1001.0, 0.0], 1000.0, "floor")
        .sphere([0.0, 1.6, -0.5], 0.4, "lamp")
        .sphere([-0.5, -0.3, 0.5], 0.6, "glass")
        .sphere([0.8, -0.4, -0.3], 0.6, "mirror")
        .load()
}

/// Settings for a whole image.
fn sized(context: &Context, scene: &Scene, size: [u32; 2], spp: u64) -> Settings {
    let [width, height] = size;
    Settings {
        width,
        height,
        crop: Rect {
            x: 0,
            y: 0,
            width,
            height,
        },
        ..context.settings(scene, 1, spp)
    }
}

fn many_samples(context: &Context) -> Result<Measure> {
    // Rounded to f32 none of them adds up without error; a plain f32 sum of 0.1 averages 0.1088.
    const VALUES: [f32; 3] = [0.1, 0.7, 0.3];
    let scene = context.scene(
        "[camera]\nposition = [0, 0, 0]\nlook_at = [0, 0, 1]\nfov = 36.0\n\
         [image]\nwidth = 1\nheight = 1\n[environment]\nradiance = [0.1, 0.7, 0.3]\n",
    )?;
    let spp = context.size(200_000, 10_000_000);
    let film = context.render(&scene, &context.settings(&scene, 1, spp))?;
    let mut measure = Measure::new(1.0e-6, "of the value");
    for (mean, value) in film.mean(0).into_iter().zip(VALUES) {
        let truth = f64::from(value) * context.disturbed(1.0e-4);
        measure.add((mean / truth - 1.0).abs(), || {
            format!("{value} averages {mean:.9} over {spp} samples")
        });
    }
    Ok(measure)
}

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

/// Takes note of something that holds or not, among errors.
pub(super) fn must(measure: &mut Measure, holds: bool, place: impl FnOnce() -> String) {
    measure.add(if holds { 0.0 } else { f64::INFINITY }, place);
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

/// Renders a crop by itself, and counts the values that are not the whole image's.
fn compare_crop(
    context: &Context,
    scene: &Scene,
    whole: &Settings,
    image: &[u32],
    crop: Rect,
    measure: &mut Measure,
) -> Result<()> {
    let settings = Settings {
        crop,
        seed: u64::from(context.options.disturb),
        ..whole.clone()
    };
    let part = image_bits(&context.render(scene, &settings)?);
    let rows = part.chunks_exact(3 * crop.width as usize);
    let wrong: usize = rows
        .zip(crop.y..)
        .map(|(row, y)| {
            let from = 3 * (y as usize * whole.width as usize + crop.x as usize);
            let other = &image[from..from + row.len()];
            row.iter().zip(other).filter(|(a, b)| a != b).count()
        })
        .sum();
    measure.count(part.len() as u64, wrong as u64, || {
        format!("{crop:?} of {}x{}", whole.width, whole.height)
    });
    Ok(())
}

fn odd_sizes(context: &Context) -> Result<Measure> {
    let scene = mixed()?;
    let mut measure = Measure::new(0.0, "values");
    let mut sizes = vec![[1, 1], [7, 5], [8191, 1]];
    if !context.options.quick {
        sizes.extend([[1, 600], [65_536, 1], [1025, 9]]);
    }
    for [width, height] in sizes {
        // Without roulette every path ends in light: no pixel is black that was rendered.
        let whole = Settings {
            roulette: false,
            ..sized(context, &scene, [width, height], 1)
        };
        let film = context.render(&scene, &whole)?;
        let values = means(&film);
        let missing = values
            .iter()
            .filter(|x| !(x.is_finite() && **x > 0.0))
            .count();
        measure.count(values.len() as u64, missing as u64, || {
            format!("black pixels in {width}x{height}")
        });
        let crop = Rect {
            x: width / 2,
            y: height / 2,
            width: (width - width / 2).min(3),
            height: 1,
        };
        let image = image_bits(&film);
        compare_crop(context, &scene, &whole, &image, crop, &mut measure)?;
    }
    Ok(measure)
}

fn seams(context: &Context) -> Result<Measure> {
    let scene = mixed()?;
    let mut measure = Measure::new(0.0, "values");
    let across = Rect {
        x: 1000,
        y: 0,
        width: 60,
        height: 2,
    };
    let down = Rect {
        x: 0,
        y: 1000,
        width: 2,
        height: 60,
    };
    let corner = Rect {
        x: 1010,
        y: 1010,
        width: 30,
        height: 30,
    };
    let mut images = vec![([2100, 2], across), ([2, 2100], down)];
    if !context.options.quick {
        images.push(([1050, 1050], corner));
    }
    for (size, crop) in images {
        let whole = sized(context, &scene, size, 4);
        let image = image_bits(&context.render(&scene, &whole)?);
        compare_crop(context, &scene, &whole, &image, crop, &mut measure)?;
    }
    refusals(context, &scene, &mut measure)?;
    Ok(measure)
}

/// What is too large is refused with words, and before anything is rendered.
fn refusals(context: &Context, scene: &Scene, measure: &mut Measure) -> Result<()> {
    let side = if context.options.disturb {
        65_536
    } else {
        65_537
    };
    let too_wide = context.scene(&format!(
        "[camera]\nposition = [0, 0, 4]\nlook_at = [0, 0, 0]\nfov = 36.0\n\
         [image]\nwidth = {side}\nheight = 1\n"
    ));
    let refused = matches!(&too_wide, Err(Error::Scene(_)));
    measure.count(1, u64::from(!refused), || {
        format!("an image {side} pixels wide is no error")
    });
    // A device whose buffers hold the partial sums of a few pixels only.
    let mut gpu = context.gpu.clone();
    gpu.limits.max_buffer_size = 1 << 12;
    let settings = sized(context, scene, [64, 64], 1);
    let refused = matches!(renderer(gpu, scene, &settings), Err(Error::DeviceLimit(_)));
    measure.count(1, u64::from(!refused), || {
        "buffers beyond the device's limit are no error".into()
    });
    Ok(())
}

fn renderer(gpu: Gpu, scene: &Scene, settings: &Settings) -> Result<GpuRenderer> {
    GpuRenderer::new(gpu, &prepare(scene, settings)?)
}

fn dispatches(context: &Context) -> Result<Measure> {
    let scene = mixed()?;
    let settings = Settings {
        samples: 3..67,
        ..sized(context, &scene, [41, 33], 1)
    };
    let whole = context.render(&scene, &settings)?;
    let mut splits = vec![(1, u64::MAX), (7, 1), (u32::MAX, 4)];
    if !context.options.quick {
        splits.extend([(1, 1), (3, 12), (30, 8)]);
    }
    let mut measure = Measure::new(0.0, "values");
    for (tiles, samples) in splits {
        let settings = Settings {
            seed: u64::from(context.options.disturb),
            ..settings.clone()
        };
        let limits = DispatchLimits { tiles, samples };
        let mut renderer = renderer(context.gpu.clone(), &scene, &settings)?.with_limits(limits);
        let split = render_quietly(&mut renderer, &settings)?.film;
        let (a, b) = (all_bits(&whole), all_bits(&split));
        let wrong = a.iter().zip(&b).filter(|(a, b)| a != b).count();
        measure.count(a.len() as u64, wrong as u64, || {
            format!("by at most {tiles} tiles and {samples} samples")
        });
    }
    Ok(measure)
}

/// All that a film holds: means, variances, rays.
fn all_bits(film: &Film) -> Vec<u64> {
    let variances =
        (0..film.rect().pixels()).flat_map(|i| film.variance_of_mean(i).unwrap_or_default());
    means(film)
        .into_iter()
        .chain(variances)
        .map(f64::to_bits)
        .chain([film.tally().rays])
        .collect()
}

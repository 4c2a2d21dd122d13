//! Cases 32 and 35 to 37: sums of samples, and images of any size. Integers and bits: most of the limits
//! are 0.

use super::Case;
use super::context::Context;
use crate::error::{Error, Result};
use crate::film::Film;
use crate::gpu::device::Gpu;
use crate::gpu::renderer::{DispatchLimits, GpuRenderer};
use crate::job::prepare;
use crate::render::render_quietly;
use crate::scene::Scene;
use crate::settings::{Rect, Settings};
use crate::verify::{Measure, SceneText, image_bits, means};

pub(super) const CASES: &[Case] = &[
    Case {
        id: 32,
        name: "sums of very many samples",
        setup: "a constant environment of 0.1, 0.7 and 0.3 over 1e7 samples of a pixel (2e5 in the \
                quick form): the mean is the constant to 1e-6",
        run: many_samples,
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
pub(super) fn mixed() -> Result<Scene> {
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
pub(super) fn sized(context: &Context, scene: &Scene, size: [u32; 2], spp: u64) -> Settings {
    let [width, height] = size;
    Settings {
        width,
        height,
        crop: Rect::whole(width, height),
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

/// Takes note of something that holds or not, among errors.
pub(super) fn must(measure: &mut Measure, holds: bool, place: impl FnOnce() -> String) {
    measure.add(if holds { 0.0 } else { f64::INFINITY }, place);
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
            roulette: Some(false),
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

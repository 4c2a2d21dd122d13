//! Images compared by the means of square blocks of their pixels: less noise than in pixels, and still what is wrong in
//! one place.

use std::iter::zip;
use std::ops::Range;

use gpu_trace::film::Film;
use gpu_trace::gpu::renderer::GpuRenderer;
use gpu_trace::image::Picture;
use gpu_trace::render::render_quietly;
use gpu_trace::settings::Settings;
use gpu_trace::statistics::mean_and_error;

use super::images::Image;

/// Means of blocks of pixels and of the whole image, each with its variance.
pub(crate) struct Blocks {
    across: usize,
    /// Red, green and blue of each block, rows from the top.
    pub(crate) channels: Vec<[f64; 2]>,
    /// Of all channels of all pixels.
    pub(crate) image: [f64; 2],
}

impl Blocks {
    /// Of blocks of `side` pixels a side, the pixels being independent.
    pub(crate) fn of(film: &Film, side: usize) -> Self {
        assert_eq!(film.tally().non_finite, 0);
        let [width, height] = [film.rect().width, film.rect().height].map(|x| x as usize);
        assert!(width.is_multiple_of(side) && height.is_multiple_of(side));
        let (across, pixels) = (width / side, width * height);
        let mut channels = vec![[0.0; 2]; 3 * (pixels / (side * side))];
        let mut image = [0.0; 2];
        for i in 0..pixels {
            let block = 3 * (i / width / side * across + i % width / side);
            let mean = film.mean(i);
            let variance = film.variance_of_mean(i).expect("16 batches");
            for (channel, add) in zip(&mut channels[block..], zip(mean, variance)) {
                channel[0] += add.0;
                channel[1] += add.1;
            }
            image[0] += mean.iter().sum::<f64>();
            // The channels of a pixel go together: their deviations add.
            image[1] += variance.iter().map(|v| v.sqrt()).sum::<f64>().powi(2);
        }
        let over = |[sum, variance]: [f64; 2], n: f64| [sum / n, variance / (n * n)];
        let in_block = |channel| over(channel, (side * side) as f64);
        Self {
            across,
            channels: channels.into_iter().map(in_block).collect(),
            image: over(image, (3 * pixels) as f64),
        }
    }

    /// The mean of images with samples of their own.
    pub(crate) fn mean_of(all: &[Self]) -> Self {
        Self::joined(all, |each| {
            let n = each.len() as f64;
            let sum = |k: usize| each.iter().map(|x| x[k]).sum::<f64>();
            [sum(0) / n, sum(1) / (n * n)]
        })
    }

    /// The mean of images that are the same but for their samples, whose spread is the variance.
    pub(crate) fn of_seeds(all: &[Self]) -> Self {
        Self::joined(all, |each| {
            let means: Vec<f64> = each.iter().map(|x| x[0]).collect();
            let (mean, error) = mean_and_error(&means);
            [mean, error * error]
        })
    }

    fn joined(all: &[Self], join: impl Fn(&[[f64; 2]]) -> [f64; 2]) -> Self {
        let of = |value: &dyn Fn(&Self) -> [f64; 2]| {
            let each: Vec<[f64; 2]> = all.iter().map(value).collect();
            join(&each)
        };
        let count = all[0].channels.len();
        Self {
            across: all[0].across,
            channels: (0..count).map(|i| of(&|one| one.channels[i])).collect(),
            image: of(&|one| one.image),
        }
    }

    /// By how many standard errors of both each channel of a block is above the other's.
    pub(crate) fn deviations(&self, wanted: &Self) -> Vec<f64> {
        let pairs = zip(&self.channels, &wanted.channels);
        pairs.map(|(a, b)| deviation(*a, *b)).collect()
    }

    /// The mean square of the deviations; the size of that of the image's mean; and the half of the 99 % interval of
    /// the image's mean, relative: what a bias could be and not be seen.
    pub(crate) fn apart(&self, wanted: &Self) -> [f64; 3] {
        let mut all = self.deviations(wanted);
        // Blocks of a lamp alone have no noise.
        all.retain(|z| z.is_finite());
        let squares = all.iter().map(|z| z * z).sum::<f64>() / all.len() as f64;
        let [mean, variance] = wanted.image;
        let unseen = 2.576 * (self.image[1] + variance).sqrt() / mean;
        [squares, deviation(self.image, wanted.image).abs(), unseen]
    }
}

/// By how many standard errors of both a mean with its variance is above another.
pub(crate) fn deviation(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]) / (a[1] + b[1]).sqrt()
}

impl Image for Blocks {
    fn picture(&self) -> Picture {
        let (blocks, _) = self.channels.as_chunks::<3>();
        let pixels = blocks
            .iter()
            .map(|block| block.map(|[mean, _]| mean as f32));
        let rows = blocks.len() / self.across;
        Picture::new(self.across as u32, rows as u32, pixels.collect())
    }
}

/// Blocks of what a renderer makes, over seeds.
pub(crate) fn blocks_of_seeds(
    mut renderer: GpuRenderer,
    settings: &Settings,
    seeds: Range<u64>,
    side: usize,
) -> Blocks {
    let mut all = Vec::new();
    for seed in seeds {
        renderer = renderer.with_seed(seed);
        let outcome = render_quietly(&mut renderer, settings);
        all.push(Blocks::of(
            &outcome.unwrap_or_else(|e| panic!("{e}")).film,
            side,
        ));
    }
    Blocks::of_seeds(&all)
}

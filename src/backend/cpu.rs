//! Renders windows on the CPU by the reference, path by path.

use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::film::{AovSums, BLOCK, NonFinite, PixelSums, Tally, Tiles, Window};
use crate::job::Job;
use crate::memory::{aov_bytes, check_memory, render_pixel_bytes};
use crate::placement::Placement;
use crate::placement::cells::Cells;
use crate::reference::path::PathTracer;
use crate::reference::state::{Cache, PathResult};
use crate::render::{Control, Renderer};
use crate::sampler::Sampler;
use crate::scene::Scene;
use crate::settings::{Rect, Settings};

/// Renders windows on the CPU.
#[derive(Debug)]
pub struct ReferenceRenderer {
    scene: Scene,
    placement: Placement,
    settings: Settings,
    /// Of the cells, for all batches: else a pilot finds them for each.
    values: Option<Vec<DVec3>>,
    threads: rayon::ThreadPool,
}

impl ReferenceRenderer {
    /// A renderer on `threads` threads; 0: one a core.
    ///
    /// # Errors
    /// [`Error::Device`] if the threads do not start, [`Error::Usage`] if the image needs more memory than there is, and
    /// for a view of what is not here.
    pub fn new(job: &Job, threads: usize) -> Result<Self> {
        let settings = job.settings();
        if let Some(view) = settings.view {
            return Err(Error::Usage(format!(
                "--view {}: the CPU reference has no tree: it asks every sphere",
                view.name()
            )));
        }
        let threads = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .map_err(|e| Error::Device(format!("cannot start {threads} threads: {e}")))?;
        // After the threads have taken their part.
        check_memory(
            &settings.crop,
            render_pixel_bytes(settings, own_pixel_bytes(settings)),
        )?;
        Ok(Self {
            scene: job.scene().clone(),
            placement: job.placement().clone(),
            settings: settings.clone(),
            values: None,
            threads,
        })
    }

    /// The same with these values of the cells for all batches: for pilots that only ask what samples vary.
    #[must_use]
    pub(crate) fn with_values(mut self, values: Vec<DVec3>) -> Self {
        self.values = Some(values);
        self
    }

    fn cells(&self) -> Option<&Cells> {
        self.placement.cells().map(AsRef::as_ref)
    }

    fn tracer(&self) -> PathTracer<'_> {
        PathTracer::new(&self.scene, &self.placement, &self.settings)
    }

    /// Takes samples of a pixel, by the values of the cells for their batch.
    fn pixel(
        &self,
        pixel: [u32; 2],
        samples: &Range<u64>,
        values: &[DVec3],
        state: &mut PixelState,
    ) {
        let cache = |cells| Cache { cells, values };
        let tracer = PathTracer {
            cache: self.cells().map(cache),
            ..self.tracer()
        };
        for sample in samples.clone() {
            let path = tracer.trace(pixel, sample);
            state.add(pixel, sample, &path, self.settings.sampler);
        }
    }
}

/// Bytes that a pixel takes here in the middle of a window.
pub(super) fn own_pixel_bytes(settings: &Settings) -> usize {
    let aovs = aov_bytes(settings);
    // Boxed, with what the heap adds.
    let boxed = if aovs > 0 { aovs + 16 } else { 0 };
    size_of::<PixelState>() + boxed
}

/// One pixel's sums in the middle of a window.
#[derive(Clone, Debug, Default)]
struct PixelState {
    sums: PixelSums,
    /// Only if something was asked for: they are large.
    aovs: Option<Box<AovSums>>,
    batch: DVec3,
    in_batch: u64,
    batches: f64,
    batch_mean: DVec3,
    tally: Tally,
    /// Sum of the last full batch.
    last_batch: DVec3,
}

impl PixelState {
    fn add(&mut self, pixel: [u32; 2], sample: u64, path: &PathResult, sampler: Sampler) {
        self.tally.rays += u64::from(path.rays);
        if path.cut.max_element() > 0.0 {
            self.tally.cut_paths += 1;
            self.tally.cut_throughput += path.cut.element_sum() / 3.0;
        }
        if path.radiance.is_finite() {
            self.batch += path.radiance;
            if let Some(aovs) = &mut self.aovs {
                aovs.add(&path.aovs);
            }
        } else {
            self.tally.non_finite += 1;
            let place = NonFinite {
                pixel,
                sample,
                bounce: path.bounces,
            };
            self.tally.first_non_finite = self.tally.first_non_finite.or(Some(place));
        }
        self.in_batch += 1;
        let length = sampler.batch(sample);
        if (sample + 1).is_multiple_of(length) {
            self.end_batch(self.in_batch == length);
        }
    }

    fn end_batch(&mut self, full: bool) {
        if full {
            // Welford 1962.
            self.batches += 1.0;
            let delta = self.batch - self.batch_mean;
            self.batch_mean += delta / self.batches;
            self.last_batch = self.batch;
            let m2 = delta * (self.batch - self.batch_mean);
            self.sums.m2 = (DVec3::from(self.sums.m2) + m2).to_array();
        }
        self.sums.sum = (DVec3::from(self.sums.sum) + self.batch).to_array();
        self.batch = DVec3::ZERO;
        self.in_batch = 0;
    }
}

impl Renderer for ReferenceRenderer {
    fn device(&self) -> (String, String, String) {
        let threads = self.threads.current_num_threads();
        (
            format!(
                "CPU reference, f64, {threads} thread{}",
                if threads == 1 { "" } else { "s" }
            ),
            "cpu".into(),
            "none".into(),
        )
    }

    fn render_tiles(
        &mut self,
        samples: Range<u64>,
        tiles: Option<&Tiles>,
        control: &mut dyn Control,
    ) -> Result<Window> {
        let crop: Rect = self.settings.crop;
        let width = crop.width as usize;
        let blank = PixelState {
            aovs: self.settings.has_aovs().then(Box::default),
            ..PixelState::default()
        };
        let mut state = vec![blank; crop.pixels()];
        let chosen = |x: usize, y: usize| tiles.is_none_or(|t| t.has_pixel(x as u32, y as u32));
        let all = (0..crop.pixels()).filter(|i| chosen(i % width, i / width));
        let all = all.count() as u64;
        let mut tally = Tally::default();
        let batch = self.settings.sampler.batch(samples.start);
        let (mut start, mut values, mut of_batch) = (samples.start, Vec::new(), None);
        let mut image = Vec::new();
        while start < samples.end {
            if let Some(cells) = self.cells()
                && self.values.is_none()
                && of_batch != Some(start / batch)
            {
                let pilot = || self.tracer().pilot(cells, start / batch * batch, batch);
                let (found, rays) = self.threads.install(pilot);
                (values, of_batch) = (found, Some(start / batch));
                tally.rays += rays;
            }
            // A block at a time over the whole image: then it can stop.
            let end = (start / BLOCK * BLOCK)
                .saturating_add(BLOCK)
                .min(samples.end);
            self.threads.install(|| {
                state
                    .par_chunks_mut(width)
                    .enumerate()
                    .for_each(|(y, row)| {
                        for (x, state) in row.iter_mut().enumerate() {
                            if !chosen(x, y) {
                                continue;
                            }
                            let pixel = [crop.x + x as u32, crop.y + y as u32];
                            let values = self.values.as_ref().unwrap_or(&values);
                            self.pixel(pixel, &(start..end), values, state);
                        }
                    });
            });
            let paths = all * (end - start);
            start = end;
            let ends_batch = start.is_multiple_of(batch) && start >= samples.start + batch;
            if self.cells().is_some() && ends_batch {
                let sum: DVec3 = state.iter().map(|pixel| pixel.last_batch).sum();
                image.push(sum.to_array());
            }
            if !control.proceed(paths) {
                break;
            }
        }
        for pixel in &mut state {
            pixel.end_batch(false);
            tally.add(&pixel.tally);
        }
        Ok(Window {
            image,
            rect: crop,
            samples: samples.start..start,
            batch: self.settings.sampler.batch(samples.start),
            aovs: match self.settings.has_aovs() {
                // Of known length, so that no room is left over.
                true => state
                    .iter()
                    .map(|s| s.aovs.as_deref().copied().unwrap_or_default())
                    .collect(),
                false => Vec::new(),
            },
            pixels: state.into_iter().map(|s| s.sums).collect(),
            tally,
        })
    }

    fn show(&mut self, crop: Rect) {
        self.settings.crop = crop;
    }

    fn device_bytes(&self) -> u64 {
        0
    }
}

//! The radiance cache on the device: its values, and the pilots that fill it.

use std::ops::Range;
use std::sync::Arc;

use bytemuck::Zeroable as _;

use crate::error::{Error, Result};
use crate::gpu::device::Gpu;
use crate::gpu::engine::{Engine, Pass, Program, Readings, Recording};
use crate::placement::cells::Cells;
use crate::records::layout::{CELLS_WIDTH, PilotRecord};
use crate::settings::{Rect, pilot_words};

/// Buffers and textures by their names in `shaders/`.
const VALUES: &str = "cell_values";
const PILOT_VALUES: &str = "pilot_values";
const USED: &str = "used_cells";
const WORK: &str = "pilot_work";
const BATCH_SUMS: &str = "batch_sums";

/// Most full batches of a window: `BATCHES` of `shaders/film/pixel.wesl`.
const BATCHES: u32 = 12;
/// Most batches that a window has a part of.
const TOUCHED: u32 = BATCHES + 2;
/// Bytes of a texel.
const TEXEL: u32 = 16;
/// Bytes of a pixel's batch sums.
pub(super) const PIXEL_BYTES: u32 = BATCHES * 16;
/// Invocations of a workgroup of the pilot.
const WORKGROUP: u32 = 64;
/// Paths of a dispatch of the pilot, about.
const PATHS: u32 = 1 << 17;

/// The pilot's pass, and what it fills the cache with.
#[derive(Debug)]
pub(super) struct Cache {
    pilot: Pass,
    cells: Arc<Cells>,
    /// Samples of a cell that an invocation takes in one dispatch.
    most_samples: u32,
}

impl Cache {
    /// Compiles the pilot, an invocation of which may take so many samples in one dispatch.
    ///
    /// # Errors
    /// [`Error::DeviceLimit`] if the device does not take the values, and if it fails.
    pub(super) fn new(
        gpu: &Gpu,
        program: &Program,
        constants: &[(&str, f64)],
        cells: &Arc<Cells>,
        most_samples: u32,
    ) -> Result<Self> {
        let (rows, most) = (rows(cells), gpu.limits.max_texture_dimension_2d);
        if rows.max(CELLS_WIDTH) > most {
            return Err(Error::DeviceLimit(format!(
                "the radiance cache needs a texture of {CELLS_WIDTH} x {rows} texels, more than the device's limit \
                 of {most}; --radiance-cache off needs none"
            )));
        }
        Ok(Self {
            pilot: program.pass(gpu, "pilot", constants)?,
            cells: cells.clone(),
            most_samples,
        })
    }

    /// Makes what passes bind, for regions of at most so many pixels.
    ///
    /// # Errors
    /// If the device fails.
    pub(super) fn create(&self, engine: &mut Engine, pixels: u64) -> Result<()> {
        let used = self.cells.used().iter();
        let mut used: Vec<u32> = used
            .map(|cell| {
                u32::from(cell.sphere) << 16 | u32::from(cell.row) << 8 | u32::from(cell.column)
            })
            .collect();
        used.resize(used.len().max(1), 0);
        let values = vec![0; (CELLS_WIDTH * rows(&self.cells) * TEXEL) as usize];
        engine.buffer(PILOT_VALUES, values.len() as u64);
        engine.buffer(BATCH_SUMS, pixels * u64::from(PIXEL_BYTES));
        engine.stage(BATCH_SUMS)?;
        engine.stage(PILOT_VALUES)?;
        let work = PilotRecord::zeroed();
        let mut recording = Recording::default();
        recording
            .upload_texels(VALUES, &values, CELLS_WIDTH)
            .upload(USED, bytemuck::cast_slice(&used))
            .upload(WORK, bytemuck::bytes_of(&work));
        engine.run(recording)?;
        Ok(())
    }

    /// Fills the cache for all batches of a window's samples, which are of length `batch`; the rays that it took.
    ///
    /// # Errors
    /// If the device fails.
    pub(super) fn fill(
        &self,
        engine: &mut Engine,
        seed: u64,
        window: &Range<u64>,
        batch: u64,
    ) -> Result<u64> {
        let cells = self.cells.used().len() as u32;
        if cells == 0 {
            return Ok(0);
        }
        let samples = self.cells.samples(batch);
        let step = (PATHS / samples / WORKGROUP).max(1) * WORKGROUP;
        let mut works = Vec::new();
        let mut touched = 0;
        for number in window.start / batch..window.end.div_ceil(batch) {
            let first = number * batch;
            for first_sample in (0..samples).step_by(self.most_samples as usize) {
                works.extend((0..cells).step_by(step as usize).map(|begin| PilotRecord {
                    stream: pilot_words(seed, (first >> 32) as u32),
                    batch: first as u32,
                    begin,
                    end: (begin + step).min(cells),
                    first_value: touched * self.cells.count(),
                    samples,
                    first_sample,
                    end_sample: (first_sample + self.most_samples).min(samples),
                    ..PilotRecord::zeroed()
                }));
            }
            touched += 1;
        }
        let values = touched * self.cells.count();
        let mut recording = Recording::default();
        for work in &works {
            recording
                .upload(WORK, bytemuck::bytes_of(work))
                .dispatch(&self.pilot, (work.end - work.begin).div_ceil(WORKGROUP));
        }
        recording.copy(PILOT_VALUES, VALUES).read(PILOT_VALUES);
        let readings = engine.run(recording)?;
        let texels: &[[u32; 4]] = bytemuck::cast_slice(readings[PILOT_VALUES].bytes());
        Ok(texels
            .iter()
            .take(values as usize)
            .map(|texel| u64::from(texel[3].saturating_sub(1)))
            .sum())
    }

    /// Records that the sums of the batches are read.
    pub(super) fn record(recording: &mut Recording<'_>) {
        recording.read(BATCH_SUMS);
    }

    /// The sums over a region's pixels of each of so many full batches, in the kernel's unit.
    pub(super) fn sums(readings: &Readings, region: Rect, batches: usize) -> Vec<[f64; 3]> {
        let sums: &[[f32; 4]] = bytemuck::cast_slice(readings[BATCH_SUMS].bytes());
        let mut image = vec![[0.0; 3]; batches];
        let pixels = sums.chunks_exact(BATCHES as usize);
        for pixel in pixels.take(region.pixels()) {
            for (sum, more) in image.iter_mut().zip(pixel) {
                (0..3).for_each(|c| sum[c] += f64::from(more[c]));
            }
        }
        image
    }
}

/// Rows of the texture of all values.
fn rows(cells: &Cells) -> u32 {
    (cells.count() * TOUCHED).div_ceil(CELLS_WIDTH).max(1)
}

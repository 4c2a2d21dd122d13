//! The GPU renderer: dispatches sized by time, sums continued in the order of the sample index.

use std::mem::offset_of;
use std::ops::Range;
use std::time::{Duration, Instant};

use bytemuck::Zeroable as _;
use wgpu::util::DeviceExt as _;

use crate::effects::Effects;
use crate::error::{Error, Result};
use crate::film::{AovSums, BLOCK, NonFinite, PixelSums, TILE, Tally, Tiles, Window};
use crate::gpu::aov::AovLayout;
use crate::gpu::device::Gpu;
use crate::gpu::layout::{CameraRecord, ChosenTiles, CountersRecord, DispatchRecord};
use crate::gpu::upload::Uploads;
use crate::placement::Placement;
use crate::render::{Control, Renderer};
use crate::sampler::Sampler;
use crate::scene::Scene;
use crate::settings::{Integrator, Rect, Settings, stream_words};
use crate::shader::{Kernel, LOOP_ITERATIONS, Stage, link, ray_steps};

/// Longest side of a region, the unit of memory: images beyond it are rendered in pieces. A multiple of
/// the tile's, and of no more tiles than `ChosenTiles` can hold.
const REGION: u32 = 1024;
/// What a dispatch should take: short enough for every watchdog and for a smooth progress bar.
const DISPATCH: Duration = Duration::from_millis(75);
/// What all dispatches between two looks at the stop rules should take.
const SLAB: Duration = Duration::from_millis(3000);
/// Tiles that keep a GPU busy: below that a dispatch takes fewer samples instead.
const BUSY_TILES: u32 = 64;

/// The most that one dispatch may do, whatever the time it would take. No bit of an image depends on
/// it; it is for tests of just that, and for drivers with a short watchdog.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DispatchLimits {
    /// Tiles of 8 x 8 pixels; at least 1.
    pub tiles: u32,
    /// Samples a pixel; rounded up to whole blocks.
    pub samples: u64,
}

impl Default for DispatchLimits {
    fn default() -> Self {
        Self {
            tiles: u32::MAX,
            samples: u64::MAX,
        }
    }
}

/// Renders windows on a GPU.
#[derive(Debug)]
pub struct GpuRenderer {
    gpu: Gpu,
    kernel: Kernel,
    crop: Rect,
    seed: u64,
    sampler: Sampler,
    pipeline: wgpu::ComputePipeline,
    bind_group: wgpu::BindGroup,
    work: wgpu::Buffer,
    chosen: wgpu::Buffer,
    counters: wgpu::Buffer,
    aovs: Option<Aovs>,
    /// Longest side of a region.
    side: u32,
    region: RegionTargets,
    /// Kernel radiance per radiance.
    light: f64,
    /// Paths a second, from the last dispatch.
    rate: f64,
    limits: DispatchLimits,
    /// Loop iterations after which an invocation starts no further path.
    step_limit: u32,
    /// Of all buffers and textures.
    device_bytes: u64,
}

/// Sums beside the image, if the kernel keeps any: they are among the partial sums.
#[derive(Debug)]
struct Aovs {
    layout: AovLayout,
    partials: wgpu::Buffer,
    staging: wgpu::Buffer,
}

/// Textures that the kernel writes and buffers through which they are read.
#[derive(Debug)]
struct RegionTargets {
    textures: [wgpu::Texture; 3],
    staging: [wgpu::Buffer; 3],
    counters: wgpu::Buffer,
}

impl GpuRenderer {
    /// Links the kernel, uploads the scene and compiles the pipeline.
    ///
    /// # Errors
    /// [`Error::Gpu`] if the image or the scene is beyond a limit of the device, or it fails.
    pub fn new(
        gpu: Gpu,
        scene: &Scene,
        placement: &Placement,
        effects: &Effects,
        settings: &Settings,
    ) -> Result<Self> {
        let kernel = link(Stage::Path, scene, placement, effects)?;
        let device = &gpu.device;
        let (_, partial_size) = kernel
            .struct_members("Partial")
            .ok_or_else(|| Error::Shader("the kernel has no struct Partial".into()))?;
        let side = region_side(&gpu.limits, partial_size);
        let (width, height) = (
            settings.crop.width.min(side),
            settings.crop.height.min(side),
        );

        let uniform = |label, contents: &[u8]| {
            device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some(label),
                contents,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            })
        };
        let camera = uniform(
            "camera",
            bytemuck::bytes_of(&CameraRecord::new(&placement.camera)),
        );
        let work = uniform("work", bytemuck::bytes_of(&DispatchRecord::zeroed()));
        let chosen = uniform("chosen", bytemuck::bytes_of(&ChosenTiles::all()));
        let buffer = |label, size: u64, usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage,
                mapped_at_creation: false,
            })
        };
        let pixels = u64::from(width) * u64::from(height);
        let partials_size = pixels * u64::from(partial_size);
        let storage = Uploads::new(&kernel, scene, placement, effects);
        storage.check(&gpu.limits, partials_size)?;
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
        let partials = buffer("partials", partials_size, usage);
        let counter_usage = wgpu::BufferUsages::STORAGE
            | wgpu::BufferUsages::COPY_SRC
            | wgpu::BufferUsages::COPY_DST;
        let counters = buffer(
            "counters",
            size_of::<CountersRecord>() as u64,
            counter_usage,
        );
        let region = RegionTargets::new(device, width, height);
        let views = region
            .textures
            .each_ref()
            .map(|t| t.create_view(&wgpu::TextureViewDescriptor::default()));

        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("path"),
            source: wgpu::ShaderSource::Wgsl(kernel.wgsl.as_str().into()),
        });
        let mut constants = vec![("MAX_BOUNCES", f64::from(settings.max_bounces))];
        if let Integrator::Lecture { termination } = settings.integrator {
            constants.push(("LECTURE_TERMINATION", termination));
        }
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("path"),
            layout: None,
            module: &module,
            entry_point: Some("render"),
            compilation_options: wgpu::PipelineCompilationOptions {
                constants: &constants,
                ..Default::default()
            },
            cache: None,
        });
        let uploaded = storage.create(device);
        let mut entries = vec![
            (4, camera.as_entire_binding()),
            (5, work.as_entire_binding()),
            (6, partials.as_entire_binding()),
            (7, counters.as_entire_binding()),
            (15, chosen.as_entire_binding()),
        ];
        entries.extend(
            uploaded
                .iter()
                .map(|(binding, b)| (*binding, b.as_entire_binding())),
        );
        entries.extend(
            (8..)
                .zip(&views)
                .map(|(i, view)| (i, wgpu::BindingResource::TextureView(view))),
        );
        let entries: Vec<wgpu::BindGroupEntry<'_>> = entries
            .into_iter()
            .filter(|(binding, _)| kernel.has_binding(*binding))
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        let bind_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("path"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        gpu.check()?;
        let uploads: u64 = uploaded.iter().map(|(_, buffer)| buffer.size()).sum();
        let aovs = AovLayout::of(&kernel, placement).map(|layout| Aovs {
            layout,
            staging: buffer(
                "staging",
                partials_size,
                wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            ),
            partials: partials.clone(),
        });
        let staged = aovs.as_ref().map_or(0, |a| a.staging.size());
        let device_bytes = uploads + partials.size() + staged + region.bytes();
        // A path that is begun must fit.
        let path = (u64::from(settings.max_bounces) + 1) * u64::from(ray_steps(placement, effects));
        let step_limit = LOOP_ITERATIONS.saturating_sub(path).max(1) as u32;
        let mut renderer = Self {
            gpu,
            kernel,
            crop: settings.crop,
            seed: settings.seed,
            sampler: settings.sampler,
            pipeline,
            bind_group,
            work,
            chosen,
            counters,
            aovs,
            side,
            region,
            light: placement.light,
            rate: 1.0e6,
            limits: DispatchLimits::default(),
            step_limit,
            device_bytes,
        };
        // Some drivers compile at the first dispatch: one that does nothing takes that out of the
        // rendering's time.
        renderer.dispatch(&DispatchRecord::zeroed(), 1)?;
        Ok(renderer)
    }

    /// The same renderer with smaller dispatches.
    #[must_use]
    pub fn with_limits(mut self, limits: DispatchLimits) -> Self {
        self.limits = limits;
        self
    }

    /// The same renderer, compiled once, with another seed: for studies over many.
    #[must_use]
    pub fn with_seed(mut self, seed: u64) -> Self {
        self.seed = seed;
        self
    }

    /// The kernel in use.
    #[must_use]
    pub fn kernel(&self) -> &Kernel {
        &self.kernel
    }

    fn dispatch(&mut self, record: &DispatchRecord, tiles: u32) -> Result<()> {
        self.gpu
            .queue
            .write_buffer(&self.work, 0, bytemuck::bytes_of(record));
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &self.bind_group, &[]);
            let across = tiles.min(self.gpu.limits.max_compute_workgroups_per_dimension);
            pass.dispatch_workgroups(across, tiles.div_ceil(across), 1);
        }
        self.gpu.queue.submit([encoder.finish()]);
        self.gpu.wait()
    }

    /// Dispatches until every pixel of the tiles has reached the end: a pixel stops early where it
    /// would run into a driver's limit on loop iterations.
    fn finish_tiles(&mut self, mut record: DispatchRecord) -> Result<()> {
        let tiles = record.end_tile - record.first_tile;
        loop {
            self.dispatch(&record, tiles)?;
            let counters = self.counters()?;
            if counters.unfinished == 0 {
                return Ok(());
            }
            if counters.advanced == 0 {
                return Err(Error::Gpu(format!(
                    "{}: {} pixels make no progress: a path takes more loop iterations than the \
                     driver allows. Lower --max-bounces, or use --backend cpu",
                    self.gpu.summary.name, counters.unfinished
                )));
            }
            record.fresh = 0;
        }
    }

    /// Reads the counters of the last dispatch.
    fn counters(&self) -> Result<CountersRecord> {
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let size = size_of::<CountersRecord>() as u64;
        encoder.copy_buffer_to_buffer(&self.counters, 0, &self.region.counters, 0, size);
        let of_dispatch = offset_of!(CountersRecord, unfinished) as u64;
        encoder.clear_buffer(&self.counters, of_dispatch, None);
        self.gpu.queue.submit([encoder.finish()]);
        let buffer = &self.region.counters;
        // Whether it worked shows when the range is taken.
        buffer.map_async(wgpu::MapMode::Read, .., |_| ());
        self.gpu.wait()?;
        let counters = {
            let bytes = buffer.get_mapped_range(..).map_err(|e| self.lost(&e))?;
            *bytemuck::from_bytes(&bytes)
        };
        buffer.unmap();
        Ok(counters)
    }

    fn lost(&self, error: &dyn std::fmt::Display) -> Error {
        Error::Gpu(format!(
            "{}: no data came back: {error}",
            self.gpu.summary.name
        ))
    }

    /// Renders `samples` of `region`; returns the end that was reached. The first region of a window ends
    /// early if `control` says so between two slabs, and `rest` is then how much larger the others are
    /// together; they follow. Any of several is left if the window is given up.
    fn render_region(
        &mut self,
        region: Rect,
        samples: Range<u64>,
        chosen: Option<&ChosenTiles>,
        rest: Option<f64>,
        control: &mut dyn Control,
    ) -> Result<u64> {
        let begin = Instant::now();
        let tiles = tiles_of(region);
        let is_chosen = |tile: &u32| chosen.is_none_or(|c| c.has(*tile));
        let all = (0..tiles).filter(is_chosen).count() as u32;
        let pixels = chosen_pixels(region, chosen);
        let mut record = DispatchRecord {
            region_origin: [region.x, region.y],
            region_size: [region.width, region.height],
            window_start: samples.start as u32,
            stream: stream_words(self.seed, (samples.start >> 32) as u32),
            step_limit: self.step_limit,
            last_of_batch: (self.sampler.batch(samples.start) - 1) as u32,
            ..DispatchRecord::zeroed()
        };
        let mut start = samples.start;
        while start < samples.end {
            // Where the first region stops, the others have to follow.
            let all_pixels = pixels.max(1.0) * (1.0 + rest.unwrap_or(0.0));
            let end = self.slab_end(start..samples.end, all_pixels);
            record.fresh = u32::from(start == samples.start);
            record.end_sample = end as u32;
            let mut proceed = true;
            let mut first = 0;
            while first < tiles {
                let most = self.tile_count(end - start);
                let next = (first..tiles).filter(is_chosen).nth(most as usize);
                let next = next.unwrap_or(tiles);
                let count = (first..next).filter(is_chosen).count() as u32;
                if count == 0 {
                    break;
                }
                record.first_tile = first;
                record.end_tile = next;
                let before = Instant::now();
                self.finish_tiles(record)?;
                let paths = f64::from(count) * f64::from(TILE * TILE) * (end - start) as f64;
                self.rate = paths / before.elapsed().as_secs_f64().max(1.0e-6);
                first = next;
                let share = f64::from(count) / f64::from(all);
                let done = share * pixels * (end - start) as f64;
                proceed &= control.proceed(done as u64);
                if !proceed && rest != Some(0.0) && control.gives_up() {
                    return Ok(samples.start);
                }
            }
            start = end;
            let in_time = |rest| control.has_time(begin.elapsed().mul_f64(rest));
            if rest.is_some_and(|rest| !proceed || !in_time(rest)) {
                break;
            }
        }
        Ok(start)
    }

    /// Where a slab that starts with `samples` ends: equal parts of what is left, by time.
    fn slab_end(&self, samples: Range<u64>, pixels: f64) -> u64 {
        let left = samples.end - samples.start;
        let fit = self.rate * SLAB.as_secs_f64() / pixels;
        let busy = self.rate * DISPATCH.as_secs_f64() / f64::from(BUSY_TILES * TILE * TILE);
        let parts = (left as f64 / fit.min(busy.max(BLOCK as f64)))
            .ceil()
            .max(1.0);
        let length = ((left as f64 / parts).ceil() as u64).min(self.limits.samples);
        // Slabs end where blocks do.
        (samples.start + length)
            .checked_next_multiple_of(BLOCK)
            .map_or(samples.end, |end| end.min(samples.end))
    }

    fn tile_count(&self, samples: u64) -> u32 {
        let paths = self.rate * DISPATCH.as_secs_f64();
        let count = paths / (f64::from(TILE * TILE) * samples as f64);
        (count as u32).min(self.limits.tiles).max(1)
    }

    /// Reads back what the kernel left for `region`.
    fn read(
        &mut self,
        region: Rect,
        samples: &Range<u64>,
        chosen: Option<&ChosenTiles>,
    ) -> Result<(Vec<PixelSums>, Tally)> {
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let stride = row_stride(region.width);
        for (texture, staging) in self.region.textures.iter().zip(&self.region.staging) {
            encoder.copy_texture_to_buffer(
                texture.as_image_copy(),
                wgpu::TexelCopyBufferInfo {
                    buffer: staging,
                    layout: wgpu::TexelCopyBufferLayout {
                        offset: 0,
                        bytes_per_row: Some(stride),
                        rows_per_image: None,
                    },
                },
                wgpu::Extent3d {
                    width: region.width,
                    height: region.height,
                    depth_or_array_layers: 1,
                },
            );
        }
        self.gpu.queue.submit([encoder.finish()]);
        for buffer in &self.region.staging {
            // Whether it worked shows when the range is taken.
            buffer.map_async(wgpu::MapMode::Read, .., |_| ());
        }
        self.gpu.wait()?;
        let mut pixels = vec![PixelSums::default(); region.pixels()];
        let mut tally = Tally::default();
        {
            let [high, low, deviation] = self
                .region
                .staging
                .each_ref()
                .map(|b| b.get_mapped_range(..));
            let (high, low, deviation) = (
                high.map_err(|e| self.lost(&e))?,
                low.map_err(|e| self.lost(&e))?,
                deviation.map_err(|e| self.lost(&e))?,
            );
            for y in 0..region.height {
                let row = (y * stride) as usize..;
                let row = |bytes: &wgpu::BufferView| -> Vec<[f32; 4]> {
                    bytemuck::cast_slice(&bytes[row.clone()][..region.width as usize * 16]).to_vec()
                };
                let (high, low, deviation) = (row(&high), row(&low), row(&deviation));
                let across = region.width.div_ceil(TILE);
                for x in 0..region.width as usize {
                    // Elsewhere the textures hold what was before.
                    let tile = y / TILE * across + x as u32 / TILE;
                    if !chosen.is_none_or(|c| c.has(tile)) {
                        continue;
                    }
                    let pixel = &mut pixels[(y * region.width) as usize + x];
                    for c in 0..3 {
                        let sum = f64::from(high[x][c]) + f64::from(low[x][c]);
                        pixel.sum[c] = sum / self.light;
                        pixel.m2[c] = f64::from(deviation[x][c]) / (self.light * self.light);
                    }
                    tally.rays += high[x][3] as u64;
                    tally.cut_throughput += f64::from(low[x][3]);
                    tally.cut_paths += deviation[x][3] as u64;
                }
            }
        }
        for buffer in &self.region.staging {
            buffer.unmap();
        }
        let counters = self.counters()?;
        if counters.non_finite > 0 {
            let number = u32::MAX - counters.first_pixel;
            tally.non_finite = u64::from(counters.non_finite);
            tally.first_non_finite = Some(NonFinite {
                pixel: [
                    region.x + number % region.width,
                    region.y + number / region.width,
                ],
                sample: (samples.start >> 32 << 32) + u64::from(counters.sample_low),
                bounce: counters.bounce,
            });
        }
        self.clear_counters();
        self.gpu.check()?;
        Ok((pixels, tally))
    }

    fn clear_counters(&self) {
        let zero = CountersRecord::zeroed();
        let bytes = bytemuck::bytes_of(&zero);
        self.gpu.queue.write_buffer(&self.counters, 0, bytes);
    }
}

impl GpuRenderer {
    /// What the kernel has kept beside the image for `region`; nothing if it was not asked to.
    fn read_aovs(&self, region: Rect, chosen: Option<&ChosenTiles>) -> Result<Vec<AovSums>> {
        let Some(aovs) = &self.aovs else {
            return Ok(Vec::new());
        };
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(&aovs.partials, 0, &aovs.staging, 0, aovs.staging.size());
        self.gpu.queue.submit([encoder.finish()]);
        // Whether it worked shows when the range is taken.
        aovs.staging.map_async(wgpu::MapMode::Read, .., |_| ());
        self.gpu.wait()?;
        let mut sums = {
            let bytes = aovs
                .staging
                .get_mapped_range(..)
                .map_err(|e| self.lost(&e))?;
            aovs.layout.read(&bytes, region)
        };
        aovs.staging.unmap();
        let across = region.width.div_ceil(TILE);
        for (i, sums) in (0..).zip(&mut sums) {
            let tile = i / region.width / TILE * across + i % region.width / TILE;
            // Elsewhere the buffer holds what was before.
            if !chosen.is_none_or(|c| c.has(tile)) {
                *sums = AovSums::default();
            }
        }
        Ok(sums)
    }
}

impl Renderer for GpuRenderer {
    fn device(&self) -> (String, String, String) {
        let s = &self.gpu.summary;
        (s.name.clone(), s.backend.clone(), s.driver.clone())
    }

    fn render_tiles(
        &mut self,
        samples: Range<u64>,
        tiles: Option<&Tiles>,
        control: &mut dyn Control,
    ) -> Result<Window> {
        let mut window = Window {
            rect: self.crop,
            batch: self.sampler.batch(samples.start),
            samples,
            pixels: vec![PixelSums::default(); self.crop.pixels()],
            aovs: match self.aovs {
                Some(_) => vec![AovSums::default(); self.crop.pixels()],
                None => Vec::new(),
            },
            tally: Tally::default(),
        };
        if tiles.is_some() && !self.kernel.has_binding(15) {
            return Err(Error::Shader("the kernel renders all tiles or none".into()));
        }
        let with_tiles = |region: Rect| {
            let corner = [region.x - self.crop.x, region.y - self.crop.y];
            let chosen = tiles.map(|tiles| ChosenTiles::of(tiles, corner, region));
            let pixels = chosen_pixels(region, chosen.as_ref());
            (region, chosen, pixels)
        };
        let regions = self.crop.pieces(self.side).map(with_tiles);
        let regions: Vec<_> = regions.filter(|(_, _, pixels)| *pixels > 0.0).collect();
        let total: f64 = regions.iter().map(|(_, _, pixels)| pixels).sum();
        for (i, (region, chosen, pixels)) in regions.into_iter().enumerate() {
            // All regions get the samples that the first one got.
            let wanted = window.samples.clone();
            if self.kernel.has_binding(15) {
                let bits = chosen.unwrap_or(ChosenTiles::all());
                let bytes = bytemuck::bytes_of(&bits);
                self.gpu.queue.write_buffer(&self.chosen, 0, bytes);
            }
            let chosen = chosen.as_ref();
            let rest = (i == 0).then_some(total / pixels - 1.0);
            window.samples.end = self.render_region(region, wanted, chosen, rest, control)?;
            if window.samples.is_empty() {
                // None of the regions has any.
                self.clear_counters();
                window.pixels.fill(PixelSums::default());
                window.aovs.fill(AovSums::default());
                window.tally = Tally::default();
                break;
            }
            let (pixels, tally) = self.read(region, &window.samples, chosen)?;
            let aovs = self.read_aovs(region, chosen)?;
            window.tally.add(&tally);
            for (y, row) in pixels.chunks(region.width as usize).enumerate() {
                let line = (region.y - self.crop.y) as usize + y;
                let from = line * self.crop.width as usize + (region.x - self.crop.x) as usize;
                window.pixels[from..from + row.len()].copy_from_slice(row);
                if self.aovs.is_some() {
                    let row = &aovs[y * row.len()..(y + 1) * row.len()];
                    window.aovs[from..from + row.len()].copy_from_slice(row);
                }
            }
        }
        Ok(window)
    }

    fn show(&mut self, crop: Rect) {
        self.crop = crop;
    }

    fn device_bytes(&self) -> u64 {
        self.device_bytes
    }
}

impl RegionTargets {
    fn new(device: &wgpu::Device, width: u32, height: u32) -> Self {
        let texture = |label| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d {
                    width,
                    height,
                    depth_or_array_layers: 1,
                },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: wgpu::TextureFormat::Rgba32Float,
                usage: wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::COPY_SRC,
                view_formats: &[],
            })
        };
        let staging = |size: u64| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("staging"),
                size,
                usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
                mapped_at_creation: false,
            })
        };
        let size = u64::from(row_stride(width)) * u64::from(height);
        Self {
            textures: ["sum_high", "sum_low", "deviations"].map(texture),
            staging: [size; 3].map(staging),
            counters: staging(size_of::<CountersRecord>() as u64),
        }
    }

    fn bytes(&self) -> u64 {
        let texels = |t: &wgpu::Texture| u64::from(t.width()) * u64::from(t.height()) * 16;
        let textures: u64 = self.textures.iter().map(texels).sum();
        textures + self.staging.iter().map(wgpu::Buffer::size).sum::<u64>()
    }
}

fn tiles_of(region: Rect) -> u32 {
    region.width.div_ceil(TILE) * region.height.div_ceil(TILE)
}

/// Of a region's pixels about as many as are in chosen tiles: those at its edge may be smaller.
fn chosen_pixels(region: Rect, chosen: Option<&ChosenTiles>) -> f64 {
    let tiles = tiles_of(region);
    let is_chosen = |tile: &u32| chosen.is_none_or(|c| c.has(*tile));
    let count = (0..tiles).filter(is_chosen).count();
    region.pixels() as f64 * count as f64 / f64::from(tiles)
}

/// Longest side of a region: a multiple of the tile's, such that one buffer can hold its partial sums.
fn region_side(limits: &wgpu::Limits, partial_size: u32) -> u32 {
    let bytes = limits
        .max_storage_buffer_binding_size
        .min(limits.max_buffer_size);
    let pixels = (bytes / u64::from(partial_size)).isqrt();
    let most = u64::from(REGION.min(limits.max_texture_dimension_2d)).min(pixels);
    (most as u32 / TILE * TILE).max(TILE)
}

/// Bytes from a row of rgba32float texels to the next in a buffer.
fn row_stride(width: u32) -> u32 {
    (width * 16).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT)
}

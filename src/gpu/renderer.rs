//! The GPU renderer: sums of a window's samples, continued from dispatch to dispatch in the order of the
//! sample index.

use std::mem::offset_of;
use std::ops::Range;
use std::time::Instant;

use bytemuck::Zeroable as _;

use crate::effects::Effect;
use crate::error::{Error, Result};
use crate::film::{AovSums, PixelSums, TILE, Tally, Tiles, Window, full_batches};
use crate::gpu::aov::AovLayout;
use crate::gpu::cache::{self, Cache};
use crate::gpu::data::{self, SceneBytes};
use crate::gpu::device::Gpu;
use crate::gpu::engine::{Engine, Pass, Program, Recording};
use crate::gpu::pace::Pace;
use crate::gpu::region::{self, chosen_pixels, tile_at, tiles_of};
use crate::job::Job;
use crate::memory::{check_memory, render_pixel_bytes, window_bytes};
use crate::records::layout::{CameraRecord, ChosenTiles, CountersRecord, DispatchRecord};
use crate::render::{Control, Renderer};
use crate::sampler::Sampler;
use crate::settings::{Integrator, Rect, Settings, stream_words};
use crate::shader::steps::{paths_at_most, step_limit};
use crate::shader::{Kernel, Stage, link};

pub use crate::gpu::pace::DispatchLimits;

/// Buffers by their names in `shaders/`.
const VIEW: &str = "view";
const DISPATCH: &str = "dispatch";
const PARTIALS: &str = "partials";
const COUNTERS: &str = "counters";
const ADAPTIVE_TILES: &str = "adaptive_tiles";

/// Bytes of this program's memory that a pixel takes here in the middle of a window: a copy of what comes from the
/// device, region by region.
pub(crate) fn own_pixel_bytes(settings: &Settings) -> usize {
    window_bytes(settings)
}

/// Renders windows on a GPU.
#[derive(Debug)]
pub struct GpuRenderer {
    engine: Engine,
    program: Program,
    render: Pass,
    /// The radiance cache, if the kernel has one.
    cache: Option<Cache>,
    crop: Rect,
    seed: u64,
    sampler: Sampler,
    /// Where the sums beside the image are among the partial sums, if the kernel keeps any.
    aovs: Option<AovLayout>,
    /// Longest side of a region.
    side: u32,
    /// Kernel radiance per radiance.
    radiance_scale: f64,
    pace: Pace,
    /// Loop iterations after which an invocation starts no further path.
    step_limit: u32,
}

impl GpuRenderer {
    /// Links the kernel, uploads the scene and compiles the pipeline.
    ///
    /// # Errors
    /// [`Error::Gpu`] if the image or the scene is beyond a limit of the device, or it fails; [`Error::Usage`] if the image
    /// needs more memory than this program has.
    pub fn new(gpu: Gpu, job: &Job) -> Result<Self> {
        Self::with_constants(gpu, job, &[])
    }

    /// The same with other values of the kernel's `override`s: for tests of what these do.
    ///
    /// # Errors
    /// Those of [`new`](Self::new).
    pub fn with_constants(gpu: Gpu, job: &Job, more: &[(&str, f64)]) -> Result<Self> {
        let (scene, settings) = (job.scene(), job.settings());
        let (placement, effects) = (job.placement(), job.effects());
        let kernel = link(Stage::Path, scene, placement, effects)?;
        let (_, partial_size) = kernel
            .struct_members("Partial")
            .ok_or_else(|| Error::Shader("the kernel has no struct Partial".into()))?;
        let largest = match job.cells() {
            Some(_) => partial_size.max(cache::PIXEL_BYTES),
            None => partial_size,
        };
        let side = region::side(&gpu.limits, largest);
        let (width, height) = (
            settings.crop.width.min(side),
            settings.crop.height.min(side),
        );
        let partials = u64::from(width) * u64::from(height) * u64::from(partial_size);
        region::check(&gpu.limits, partials)?;
        if effects.keeps_spheres() {
            data::check_spheres(&gpu.limits, placement, effects)?;
            data::check_materials(&gpu.limits, scene, placement, effects)?;
        }
        if effects.has(Effect::Bvh) {
            data::check_tree(&gpu.limits, placement)?;
        }
        if let Some(sky) = data::sky_of(scene, effects) {
            data::check_sky(&gpu.limits, sky)?;
        }
        if effects.reads_records() {
            data::check_records(&gpu.limits, scene, placement, effects)?;
        }
        if effects.has(Effect::TextureImage) {
            data::check_images(&gpu.limits, scene, placement)?;
        }
        if effects.has_tables() {
            data::check_tables(&gpu.limits, scene, placement)?;
        }

        let program = Program::new(&gpu, "path", kernel);
        let mut constants = vec![("MAX_BOUNCES", f64::from(settings.max_bounces))];
        if let Integrator::Lecture { termination } = settings.integrator {
            constants.push(("LECTURE_TERMINATION", termination));
        }
        constants.extend_from_slice(more);
        let render = program.pass(&gpu, "render", &constants)?;
        let cells = job.placement().cells();
        let most_samples = paths_at_most(placement, effects, settings.max_bounces);
        let cache = cells.map(|cells| Cache::new(&gpu, &program, &constants, cells, most_samples));
        let cache = cache.transpose()?;
        let gl = gpu.summary.backend == "gl";

        let mut engine = Engine::new(gpu);
        engine.buffer(PARTIALS, partials);
        engine.buffer(COUNTERS, size_of::<CountersRecord>() as u64);
        engine.stage(COUNTERS)?;
        region::create(&mut engine, width, height)?;
        let aovs = AovLayout::of(program.kernel(), placement);
        if aovs.is_some() {
            engine.stage(PARTIALS)?;
        }
        if let Some(cache) = &cache {
            cache.create(&mut engine, u64::from(width) * u64::from(height))?;
        }
        let camera = CameraRecord::new(&placement.camera);
        let all = ChosenTiles::all();
        let nothing = DispatchRecord::zeroed();
        let data = SceneBytes::new(scene, placement, effects);
        let mut recording = Recording::default();
        recording.upload(VIEW, bytemuck::bytes_of(&camera));
        if render.binds(ADAPTIVE_TILES) {
            recording.upload(ADAPTIVE_TILES, bytemuck::bytes_of(&all));
        }
        data.upload(&mut recording, &render);
        // Some drivers compile at the first dispatch: one that does nothing takes that out of the
        // rendering's time.
        recording.upload(DISPATCH, bytemuck::bytes_of(&nothing));
        recording.dispatch(&render, 1);
        engine.run(recording)?;
        // After the driver has taken its part.
        check_memory(
            &settings.crop,
            render_pixel_bytes(settings, own_pixel_bytes(settings)),
        )?;

        Ok(Self {
            engine,
            program,
            render,
            cache,
            crop: settings.crop,
            seed: settings.seed,
            sampler: settings.sampler,
            aovs,
            side,
            // Steps have no unit.
            radiance_scale: match settings.view {
                None => placement.radiance_scale,
                Some(_) => 1.0,
            },
            pace: Pace::unknown(),
            step_limit: step_limit(placement, effects, settings.max_bounces, gl),
        })
    }

    /// The same renderer with smaller dispatches.
    #[must_use]
    pub fn with_limits(mut self, limits: DispatchLimits) -> Self {
        self.pace.limits = limits;
        self
    }

    /// The same renderer, compiled once, with another seed: for studies over many.
    #[must_use]
    pub fn with_seed(mut self, seed: u64) -> Self {
        self.seed = seed;
        self
    }

    /// The same renderer whose invocations start no further path after so many loop iterations, whatever the driver
    /// stands: for tests of what happens then.
    #[must_use]
    pub fn with_step_limit(mut self, steps: u32) -> Self {
        self.step_limit = steps;
        self
    }

    /// The kernel in use.
    #[must_use]
    pub fn kernel(&self) -> &Kernel {
        self.program.kernel()
    }

    /// Dispatches until every pixel of the tiles has reached the end: a pixel stops early where it
    /// would run into a driver's limit on loop iterations.
    fn finish_tiles(&mut self, mut record: DispatchRecord) -> Result<()> {
        let tiles = record.end_tile - record.first_tile;
        let of_dispatch = offset_of!(CountersRecord, unfinished) as u64;
        // Pixels without progress in the last dispatch.
        let mut stuck = None;
        loop {
            let mut recording = Recording::default();
            recording
                .upload(DISPATCH, bytemuck::bytes_of(&record))
                .dispatch(&self.render, tiles)
                .read(COUNTERS)
                .clear(COUNTERS, of_dispatch);
            let readings = self.engine.run(recording)?;
            let counters: &CountersRecord = bytemuck::from_bytes(readings[COUNTERS].bytes());
            if counters.unfinished == 0 {
                return Ok(());
            }
            // Paths side by side may have used up what is allowed to them together, and some be gone now.
            if counters.advanced == 0 && stuck == Some(counters.unfinished) {
                return Err(Error::Gpu(format!(
                    "{}: {} pixels make no progress: a path takes more loop iterations than the \
                     driver allows. Lower --max-bounces, or use --backend cpu",
                    self.engine.gpu().summary.name,
                    counters.unfinished
                )));
            }
            stuck = (counters.advanced == 0).then_some(counters.unfinished);
            record.fresh = 0;
        }
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
            step_most: self.engine.gpu().loop_iterations(),
            last_of_batch: (self.sampler.batch(samples.start) - 1) as u32,
            ..DispatchRecord::zeroed()
        };
        let mut start = samples.start;
        while start < samples.end {
            // Where the first region stops, the others have to follow.
            let all_pixels = pixels.max(1.0) * (1.0 + rest.unwrap_or(0.0));
            let end = self.pace.slab_end(start..samples.end, all_pixels);
            record.fresh = u32::from(start == samples.start);
            record.end_sample = end as u32;
            let mut proceed = true;
            let mut first = 0;
            while first < tiles {
                let most = self.pace.tile_count(end - start);
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
                self.pace.took(paths, before.elapsed());
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

    /// Reads what the kernel left for `region`: sums, and those beside the image if it keeps any.
    fn read(
        &mut self,
        region: Rect,
        samples: &Range<u64>,
        chosen: Option<&ChosenTiles>,
    ) -> Result<RegionSums> {
        let mut recording = Recording::default();
        region::record(&mut recording, region);
        if self.cache.is_some() {
            Cache::record(&mut recording);
        }
        if self.aovs.is_some() {
            recording.read(PARTIALS);
        }
        recording.read(COUNTERS).clear(COUNTERS, 0);
        let readings = self.engine.run(recording)?;
        let (pixels, mut tally) = region::sums(&readings, region, chosen, self.radiance_scale);
        let counters = bytemuck::from_bytes(readings[COUNTERS].bytes());
        region::count(&mut tally, counters, region, samples);
        let mut aovs = match &self.aovs {
            Some(layout) => layout.read(readings[PARTIALS].bytes(), region),
            None => Vec::new(),
        };
        for (number, sums) in (0..).zip(&mut aovs) {
            let place = [number % region.width, number / region.width];
            // Elsewhere the buffer holds what was before.
            if !chosen.is_none_or(|c| c.has(tile_at(region, place))) {
                *sums = AovSums::default();
            }
        }
        let batches = match &self.cache {
            Some(_) => full_batches(samples, self.sampler.batch(samples.start)) as usize,
            None => 0,
        };
        let mut image = Vec::new();
        if batches > 0 {
            image = Cache::sums(&readings, region, batches);
            let scale = self.radiance_scale;
            image
                .iter_mut()
                .for_each(|sum| *sum = sum.map(|x| x / scale));
        }
        Ok(RegionSums {
            pixels,
            aovs,
            image,
            tally,
        })
    }
}

/// What a region's pixels have after a window.
struct RegionSums {
    pixels: Vec<PixelSums>,
    aovs: Vec<AovSums>,
    /// As in a [`Window`].
    image: Vec<[f64; 3]>,
    tally: Tally,
}

impl Renderer for GpuRenderer {
    fn device(&self) -> (String, String, String) {
        let s = &self.engine.gpu().summary;
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
            image: Vec::new(),
            tally: Tally::default(),
        };
        if let Some(cache) = &self.cache {
            let rays = cache.fill(&mut self.engine, self.seed, &window.samples, window.batch)?;
            window.tally.rays += rays;
        }
        let adaptive = self.render.binds(ADAPTIVE_TILES);
        if tiles.is_some() && !adaptive {
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
            if adaptive {
                let bits = chosen.unwrap_or(ChosenTiles::all());
                let mut recording = Recording::default();
                recording.upload(ADAPTIVE_TILES, bytemuck::bytes_of(&bits));
                self.engine.run(recording)?;
            }
            let chosen = chosen.as_ref();
            let rest = (i == 0).then_some(total / pixels - 1.0);
            window.samples.end = self.render_region(region, wanted, chosen, rest, control)?;
            if window.samples.is_empty() {
                // None of the regions has any.
                let mut recording = Recording::default();
                recording.clear(COUNTERS, 0);
                self.engine.run(recording)?;
                window.pixels.fill(PixelSums::default());
                window.aovs.fill(AovSums::default());
                window.tally = Tally::default();
                break;
            }
            let RegionSums {
                pixels,
                aovs,
                image,
                tally,
            } = self.read(region, &window.samples, chosen)?;
            window.tally.add(&tally);
            window.image.resize(image.len(), [0.0; 3]);
            for (sum, more) in window.image.iter_mut().zip(&image) {
                (0..3).for_each(|c| sum[c] += more[c]);
            }
            let width = region.width as usize;
            for y in 0..region.height as usize {
                let line = (region.y - self.crop.y) as usize + y;
                let from = line * self.crop.width as usize + (region.x - self.crop.x) as usize;
                let row = y * width..(y + 1) * width;
                window.pixels[from..from + width].copy_from_slice(&pixels[row.clone()]);
                if self.aovs.is_some() {
                    window.aovs[from..from + width].copy_from_slice(&aovs[row]);
                }
            }
        }
        Ok(window)
    }

    fn show(&mut self, crop: Rect) {
        self.crop = crop;
    }

    fn device_bytes(&self) -> u64 {
        self.engine.bytes()
    }
}

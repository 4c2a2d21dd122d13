//! What renders: an opened GPU, or the CPU reference.

pub mod cpu;

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::film::{self, AovSums, PixelSums};
use crate::gpu::device::{self, DRIVER_ADVICE, DeviceChoice, Gpu};
use crate::gpu::renderer::GpuRenderer;
use crate::job::Job;
use crate::numbers::significant;
use crate::render::Renderer;
use crate::settings::{Rect, Settings};
use cpu::ReferenceRenderer;

/// What renders.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum BackendKind {
    /// In f32, through wgpu.
    Gpu,
    /// In f64, on the processor's cores.
    Cpu,
}

impl BackendKind {
    /// All of them.
    pub const ALL: &'static [Self] = &[Self::Gpu, Self::Cpu];

    /// The one of that name.
    #[must_use]
    pub fn of_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|kind| kind.name() == name)
    }

    /// The name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Gpu => "gpu",
            Self::Cpu => "cpu",
        }
    }
}

/// Which device should render.
#[derive(Clone, Copy, Debug, Default)]
pub struct BackendChoice<'a> {
    /// `None`: a GPU, or the CPU reference where none can be used.
    pub kind: Option<BackendKind>,
    /// Index or part of the name of a GPU.
    pub device: Option<&'a str>,
    /// Threads of the CPU reference; 0 is one a core.
    pub threads: usize,
}

/// A device that is ready: any number of renderers can be made on it.
#[derive(Clone)]
pub enum Backend {
    /// A GPU, in f32.
    Gpu(Box<Gpu>),
    /// The CPU reference, in f64.
    Cpu {
        /// Threads; 0 is one a core.
        threads: usize,
    },
}

impl Backend {
    /// Opens what was chosen. Without a choice, and without a usable GPU, that is the CPU reference, with a
    /// warning.
    ///
    /// # Errors
    /// [`Error::Usage`] if there is no device of that name, [`Error::Device`] if there is none at all.
    pub fn open(choice: &BackendChoice<'_>, warnings: &mut Vec<String>) -> Result<Self> {
        let cpu = Self::Cpu {
            threads: choice.threads,
        };
        if choice.kind == Some(BackendKind::Cpu) {
            return Ok(cpu);
        }
        match open_gpu(choice.device) {
            Ok(gpu) => Ok(Self::Gpu(Box::new(gpu))),
            Err(error) if choice.kind.is_some() || choice.device.is_some() => Err(error),
            Err(_) => {
                warnings.push(format!(
                    "no usable GPU driver: rendering on the CPU reference, which is slower; {DRIVER_ADVICE}"
                ));
                Ok(cpu)
            }
        }
    }

    /// Which of the two it is.
    #[must_use]
    pub fn kind(&self) -> BackendKind {
        match self {
            Self::Gpu(_) => BackendKind::Gpu,
            Self::Cpu { .. } => BackendKind::Cpu,
        }
    }

    /// A renderer of the job. On a GPU that links and compiles the kernel, which takes its time.
    ///
    /// # Errors
    /// If the device fails or has not enough memory.
    pub fn renderer(&self, job: &Job) -> Result<Box<dyn Renderer>> {
        let settings = job.settings();
        if let (Self::Cpu { .. }, Some(view)) = (self, settings.view) {
            return Err(Error::Usage(format!(
                "--view {}: the CPU reference has no tree: it asks every sphere",
                view.name()
            )));
        }
        let renderer: Box<dyn Renderer> = match self {
            Self::Gpu(gpu) => Box::new(GpuRenderer::new(Gpu::clone(gpu), job)?),
            Self::Cpu { threads } => Box::new(ReferenceRenderer::new(job, *threads)?),
        };
        // After the driver and the threads have taken their part.
        check_memory(&settings.crop, self.pixel_bytes(settings))?;
        Ok(renderer)
    }

    /// Bytes of this program's memory that a pixel takes in a render, at most.
    #[must_use]
    pub fn pixel_bytes(&self, settings: &Settings) -> usize {
        let aovs = aov_bytes(settings);
        let window = size_of::<PixelSums>() + aovs;
        // The pilot has a film of its own.
        let films = if settings.adaptive { 2 } else { 1 };
        let film = films * (film::PIXEL_BYTES + aovs);
        let renderer = match self {
            // A copy of what comes from the device, region by region.
            Self::Gpu(_) => window,
            // Boxed, with what the heap adds.
            Self::Cpu { .. } if aovs > 0 => cpu::PIXEL_BYTES + aovs + 16,
            Self::Cpu { .. } => cpu::PIXEL_BYTES,
        };
        film + (window + renderer).max(file_bytes(layers(settings)))
    }
}

/// Bytes of this program's memory that a pixel takes while films are joined: the sum, and either another film or
/// the image files.
#[must_use]
pub fn joined_pixel_bytes(settings: &Settings) -> usize {
    let film = film::PIXEL_BYTES + aov_bytes(settings);
    film + film.max(file_bytes(layers(settings)))
}

/// Bytes of what a pixel keeps beside its light.
fn aov_bytes(settings: &Settings) -> usize {
    match settings.has_aovs() {
        true => size_of::<AovSums>(),
        false => 0,
    }
}

/// Values of a pixel in layers, at most.
fn layers(settings: &Settings) -> usize {
    match settings.has_aovs() {
        true => MOST_LAYERS,
        false => FEWEST_LAYERS,
    }
}

/// Opens a GPU: the one with this index or name, or the best.
///
/// # Errors
/// [`Error::Usage`] if one was named and cannot be had, so that the user can name another;
/// [`Error::Device`] if there is none.
pub fn open_gpu(named: Option<&str>) -> Result<Gpu> {
    let choice = named.map_or(DeviceChoice::Best, |text| text.parse().unwrap_or_default());
    device::open(&choice).map_err(|error| match error {
        Error::Device(text) if named.is_some() => Error::Usage(format!("--device: {text}")),
        other => other,
    })
}

/// Values of a pixel in layers that take no sums of their own: `stderr` and `samples`.
const FEWEST_LAYERS: usize = 4;
/// The same of all layers: five kinds of light, normal, albedo and depth as well.
const MOST_LAYERS: usize = FEWEST_LAYERS + 5 * 3 + 3 + 3 + 1;

/// What a pixel takes while files are written, one by one: picture and layers; in the EXR encoder the
/// same by channels; and the file, whose bytes grow by doubling and may not compress.
const fn file_bytes(layers: usize) -> usize {
    4 * (3 + layers) * (1 + 1 + 2)
}

/// What a pixel takes on any device: in the film, and in the files.
pub const LEAST_PIXEL_BYTES: usize = film::PIXEL_BYTES + file_bytes(FEWEST_LAYERS);

/// What a render takes whatever its size: the stacks of the threads that compress EXR files, one a core,
/// and what all small things come to.
fn fixed_bytes() -> usize {
    const STACK: usize = (2 << 20) + (1 << 16);
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    (16 << 20) + cores * STACK
}

/// Refuses an image that would end the program in the middle for want of memory.
///
/// # Errors
/// [`Error::Usage`] if there is less than `pixel_bytes` for each pixel of `crop`, and what any image takes.
pub fn check_memory(crop: &Rect, pixel_bytes: usize) -> Result<()> {
    let bytes = crop.pixels().saturating_mul(pixel_bytes);
    let bytes = bytes.saturating_add(fixed_bytes());
    let mut room: Vec<u8> = Vec::new();
    let there = room.try_reserve_exact(bytes).is_ok();
    // Without this, the compiler may leave the allocation out and assume that it works.
    std::hint::black_box(&room);
    if there {
        return Ok(());
    }
    Err(Error::Usage(format!(
        "{}x{} pixels need {} GiB of memory, more than there is: choose a smaller --size, or \
         render parts of the image with --crop",
        crop.width,
        crop.height,
        significant(bytes as f64 / f64::from(1 << 30)),
    )))
}

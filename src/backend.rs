//! What renders: an opened GPU, or the CPU reference.

pub mod cpu;

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::gpu::device::{self, DRIVER_ADVICE, DeviceChoice, Gpu};
use crate::gpu::renderer::{self, GpuRenderer};
use crate::job::Job;
use crate::memory::render_pixel_bytes;
use crate::render::Renderer;
use crate::settings::Settings;
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

impl BackendChoice<'_> {
    /// Refuses a GPU's name where none is used.
    ///
    /// # Errors
    /// [`Error::Usage`].
    pub fn check(&self) -> Result<()> {
        if self.kind == Some(BackendKind::Cpu) && self.device.is_some() {
            return Err(Error::Usage(
                "--device chooses a GPU, --backend cpu uses none".into(),
            ));
        }
        Ok(())
    }
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
    /// [`Error::Usage`] if there is no device of that name, or none is used; [`Error::Device`] if there is none at all.
    pub fn open(choice: &BackendChoice<'_>, warnings: &mut Vec<String>) -> Result<Self> {
        choice.check()?;
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
    /// If the device fails or there is not enough memory, and for a view that it does not have.
    pub fn renderer(&self, job: &Job) -> Result<Box<dyn Renderer>> {
        Ok(match self {
            Self::Gpu(gpu) => Box::new(GpuRenderer::new(Gpu::clone(gpu), job)?),
            Self::Cpu { threads } => Box::new(ReferenceRenderer::new(job, *threads)?),
        })
    }

    /// Bytes of this program's memory that a pixel takes in a render, at most.
    #[must_use]
    pub fn pixel_bytes(&self, settings: &Settings) -> usize {
        let own = match self {
            Self::Gpu(_) => renderer::own_pixel_bytes(settings),
            Self::Cpu { .. } => cpu::own_pixel_bytes(settings),
        };
        render_pixel_bytes(settings, own)
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

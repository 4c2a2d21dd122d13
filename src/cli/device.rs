//! From what was typed to an opened device.

use super::args::BackendArg;
use crate::backend::Backend;
use crate::error::{Error, Result};
use crate::gpu::device::{self, DRIVER_ADVICE, DeviceChoice};

/// `--backend`, `--device` and `--threads`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Choice<'a> {
    pub(super) backend: BackendArg,
    pub(super) device: Option<&'a str>,
    pub(super) threads: Option<u16>,
}

/// Opens what was chosen. Without a choice, and without a usable GPU, that is the CPU reference, with a
/// warning.
pub(super) fn open(choice: &Choice<'_>, warnings: &mut Vec<String>) -> Result<Backend> {
    let cpu = Backend::Cpu {
        threads: choice.threads.map_or(0, usize::from),
    };
    if choice.backend == BackendArg::Cpu {
        return Ok(cpu);
    }
    let adapter = choice
        .device
        .map_or(DeviceChoice::Best, |text| text.parse().unwrap_or_default());
    match device::open(&adapter) {
        Ok(gpu) => Ok(Backend::Gpu(Box::new(gpu))),
        // The user named it, so the user can name another.
        Err(Error::Device(text)) if choice.device.is_some() => {
            Err(Error::Usage(format!("--device: {text}")))
        }
        Err(error) if choice.backend == BackendArg::Gpu => Err(error),
        Err(_) => {
            warnings.push(format!(
                "no usable GPU driver: rendering on the CPU reference, which is slower; {DRIVER_ADVICE}"
            ));
            Ok(cpu)
        }
    }
}

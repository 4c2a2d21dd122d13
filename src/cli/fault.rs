//! Failures on request (`--inject-fault`), so that tests see what users would. No renderer knows of
//! them: this one wraps any other.

use std::ops::Range;
use std::str::FromStr;

use crate::error::{Error, Result};
use crate::film::{NonFinite, Tiles, Window};
use crate::gpu::device::Gpu;
use crate::render::{Control, Renderer};
use crate::settings::Rect;

/// What fails, and when.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fault {
    kind: FaultKind,
    /// Windows that are rendered before.
    window: u64,
}

/// What can fail on request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum FaultKind {
    /// The device is destroyed.
    DeviceLost,
    /// The device reports that it has no memory left.
    OutOfMemory,
    /// A window counts samples that are not finite.
    NonFinite,
}

impl FromStr for Fault {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let form = "write KIND@WINDOW, as in device-lost@2, with one of device-lost, \
                    out-of-memory and non-finite, and the number of windows before";
        let (kind, window) = text.split_once('@').ok_or(form)?;
        Ok(Self {
            kind: match kind {
                "device-lost" => FaultKind::DeviceLost,
                "out-of-memory" => FaultKind::OutOfMemory,
                "non-finite" => FaultKind::NonFinite,
                _ => return Err(form.into()),
            },
            window: window.parse().map_err(|_| form)?,
        })
    }
}

/// A renderer in which something fails. The failure is only provoked: finding it is left to what it
/// wraps.
pub(super) struct Faulty {
    inner: Box<dyn Renderer>,
    gpu: Option<Gpu>,
    fault: Fault,
    /// Windows so far.
    windows: u64,
}

impl Faulty {
    /// Lets `fault` happen to `inner`, which renders on `gpu`, or on the CPU.
    ///
    /// # Errors
    /// [`Error::Usage`] for a device's fault where there is no device.
    pub(super) fn new(inner: Box<dyn Renderer>, gpu: Option<Gpu>, fault: Fault) -> Result<Self> {
        if gpu.is_none() && fault.kind != FaultKind::NonFinite {
            return Err(Error::Usage(
                "--inject-fault: the CPU has no device to fail, only non-finite happens there"
                    .into(),
            ));
        }
        Ok(Self {
            inner,
            gpu,
            fault,
            windows: 0,
        })
    }
}

impl Renderer for Faulty {
    fn device(&self) -> (String, String, String) {
        self.inner.device()
    }

    fn render_tiles(
        &mut self,
        samples: Range<u64>,
        tiles: Option<&Tiles>,
        control: &mut dyn Control,
    ) -> Result<Window> {
        let due = self.windows == self.fault.window;
        self.windows += 1;
        if let Some(gpu) = self.gpu.as_ref().filter(|_| due) {
            match self.fault.kind {
                FaultKind::DeviceLost => gpu.device.destroy(),
                FaultKind::OutOfMemory => gpu.report(&wgpu::Error::OutOfMemory {
                    source: "injected".into(),
                }),
                FaultKind::NonFinite => {}
            }
        }
        let mut window = self.inner.render_tiles(samples, tiles, control)?;
        if due && self.fault.kind == FaultKind::NonFinite {
            let tally = &mut window.tally;
            tally.non_finite += 3;
            tally.first_non_finite = tally.first_non_finite.or(Some(NonFinite {
                pixel: [window.rect.x, window.rect.y],
                sample: window.samples.start,
                bounce: 1,
            }));
        }
        Ok(window)
    }

    fn show(&mut self, crop: Rect) {
        self.inner.show(crop);
    }

    fn device_bytes(&self) -> u64 {
        self.inner.device_bytes()
    }
}

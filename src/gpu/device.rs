//! Adapters and devices: finding, choosing, opening, and noticing when one fails.

use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::error::{Error, Result};
use crate::shader::steps::LOOP_ITERATIONS;

/// What can be said about an adapter before it is opened.
#[derive(Clone, Debug)]
pub struct AdapterSummary {
    /// Position in the list of adapters, as `--device` takes it.
    pub index: usize,
    /// The adapter's name.
    pub name: String,
    /// Graphics interface: `vulkan`, `metal`, `dx12` or `gl`.
    pub backend: String,
    /// Driver name and version.
    pub driver: String,
    /// Discrete, integrated, virtual or software.
    pub kind: &'static str,
    /// Its limits.
    pub limits: wgpu::Limits,
    /// Why it cannot run the kernel, if it cannot.
    pub unusable: Option<String>,
}

/// An open device. Clones are handles to the same device.
#[derive(Clone, Debug)]
pub struct Gpu {
    /// The device.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
    /// The limits it was opened with: the adapter's own.
    pub limits: wgpu::Limits,
    /// What it is.
    pub summary: AdapterSummary,
    faults: Faults,
}

/// How to choose among adapters.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum DeviceChoice {
    /// The fastest kind of device.
    #[default]
    Best,
    /// By position in the list of `gpu-trace devices`.
    Index(usize),
    /// By part of the name, in any case.
    Name(String),
}

impl std::str::FromStr for DeviceChoice {
    type Err = std::convert::Infallible;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Ok(text
            .parse()
            .map_or_else(|_| Self::Name(text.to_owned()), Self::Index))
    }
}

/// The adapters of `backends`, numbered from `first`.
fn adapters(backends: wgpu::Backends, first: usize) -> Vec<(wgpu::Adapter, AdapterSummary)> {
    // The environment's WGPU_BACKEND is honoured; no display is needed.
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle_from_env();
    descriptor.backends &= backends;
    let instance = wgpu::Instance::new(descriptor);
    let all = pollster::block_on(instance.enumerate_adapters(backends));
    all.into_iter()
        .zip(first..)
        .map(|(adapter, index)| {
            let summary = summarize(index, &adapter);
            (adapter, summary)
        })
        .collect()
}

/// The adapters to choose from. GL comes last, and only if it is needed: asking for it takes time,
/// and some of its libraries complain on stderr where there is no display.
fn candidates(choice: Option<&DeviceChoice>) -> Vec<(wgpu::Adapter, AdapterSummary)> {
    let mut all = adapters(wgpu::Backends::PRIMARY, 0);
    let enough = match choice {
        None => false,
        Some(DeviceChoice::Best) => all.iter().any(|(_, s)| s.unusable.is_none()),
        Some(DeviceChoice::Index(index)) => *index < all.len(),
        Some(DeviceChoice::Name(name)) => all.iter().any(|(_, s)| s.is_called(name)),
    };
    if !enough {
        all.extend(adapters(wgpu::Backends::GL, all.len()));
    }
    all
}

impl AdapterSummary {
    fn is_called(&self, name: &str) -> bool {
        self.name.to_lowercase().contains(&name.to_lowercase())
    }
}

fn summarize(index: usize, adapter: &wgpu::Adapter) -> AdapterSummary {
    let info = adapter.get_info();
    let limits = adapter.limits();
    let driver = match (info.driver.is_empty(), info.driver_info.is_empty()) {
        (false, false) => format!("{} {}", info.driver, info.driver_info),
        (false, true) => info.driver.clone(),
        _ => info.driver_info.clone(),
    };
    AdapterSummary {
        index,
        name: info.name,
        backend: info.backend.to_string(),
        driver,
        kind: match info.device_type {
            wgpu::DeviceType::DiscreteGpu => "discrete",
            wgpu::DeviceType::IntegratedGpu => "integrated",
            wgpu::DeviceType::VirtualGpu => "virtual",
            wgpu::DeviceType::Cpu => "software",
            wgpu::DeviceType::Other => "other",
        },
        unusable: lacks(adapter, &limits),
        limits,
    }
}

/// The most storage buffers that a pass may bind. Devices have eight; the others are left for what comes.
pub const STORAGE_BUFFERS: u32 = 3;

/// What the kernel needs and the adapter does not have.
fn lacks(adapter: &wgpu::Adapter, limits: &wgpu::Limits) -> Option<String> {
    let flags = adapter.get_downlevel_capabilities().flags;
    if !flags.contains(wgpu::DownlevelFlags::COMPUTE_SHADERS) {
        return Some("no compute shaders".into());
    }
    let storage = adapter.get_texture_format_features(wgpu::TextureFormat::Rgba32Float);
    if !storage
        .allowed_usages
        .contains(wgpu::TextureUsages::STORAGE_BINDING)
    {
        return Some("no rgba32float storage textures".into());
    }
    let needs = [
        (
            "storage textures a stage",
            limits.max_storage_textures_per_shader_stage,
            3,
        ),
        (
            "storage buffers a stage",
            limits.max_storage_buffers_per_shader_stage,
            STORAGE_BUFFERS,
        ),
        (
            "invocations a workgroup",
            limits.max_compute_invocations_per_workgroup,
            64,
        ),
    ];
    needs
        .iter()
        .find(|(_, has, needs)| has < needs)
        .map(|(what, has, needs)| format!("{has} {what}, {needs} needed"))
}

/// All adapters, in the order in which `--device INDEX` counts them.
#[must_use]
pub fn list() -> Vec<AdapterSummary> {
    candidates(None)
        .into_iter()
        .map(|(_, summary)| summary)
        .collect()
}

/// What to do where there is no adapter.
pub const DRIVER_ADVICE: &str = "to get one without a GPU, install Mesa's lavapipe \
     (Debian and Ubuntu: apt-get install mesa-vulkan-drivers; Fedora: dnf install mesa-vulkan-drivers)";

/// Opens an adapter.
///
/// # Errors
/// [`Error::Device`] if there is none that fits, or it does not open.
pub fn open(choice: &DeviceChoice) -> Result<Gpu> {
    let adapters = candidates(Some(choice));
    let known = || {
        let names: Vec<String> = adapters
            .iter()
            .map(|(_, s)| format!("  {}: {} ({})", s.index, s.name, s.backend))
            .collect();
        if names.is_empty() {
            "there is no adapter".into()
        } else {
            names.join("\n")
        }
    };
    let (adapter, summary) = match choice {
        DeviceChoice::Best => adapters
            .iter()
            .filter(|(_, s)| s.unusable.is_none())
            .min_by_key(|(_, s)| preference(s))
            .ok_or_else(|| Error::Device(format!("no usable GPU adapter; {DRIVER_ADVICE}")))?,
        DeviceChoice::Index(index) => adapters.get(*index).ok_or_else(|| {
            Error::Device(format!(
                "there is no device {index}; the devices are\n{}",
                known()
            ))
        })?,
        DeviceChoice::Name(name) => adapters
            .iter()
            .filter(|(_, s)| s.is_called(name))
            .min_by_key(|(_, s)| preference(s))
            .ok_or_else(|| {
                Error::Device(format!(
                    "no device is called '{name}'; the devices are\n{}",
                    known()
                ))
            })?,
    };
    if let Some(why) = &summary.unusable {
        return Err(Error::Device(format!(
            "device {} ({}) has {why}",
            summary.index, summary.name
        )));
    }
    let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
        label: Some("gpu-trace"),
        required_limits: summary.limits.clone(),
        ..Default::default()
    }))
    .map_err(|e| {
        Error::Device(format!(
            "device {} ({}) does not open: {e}",
            summary.index, summary.name
        ))
    })?;
    let gpu = Gpu {
        device,
        queue,
        limits: summary.limits.clone(),
        summary: summary.clone(),
        faults: Faults::default(),
    };
    let faults = gpu.faults.clone();
    gpu.device
        .on_uncaptured_error(Arc::new(move |error: wgpu::Error| faults.report(&error)));
    let faults = gpu.faults.clone();
    // Whatever the reason: a device that is only dropped has nobody left who would ask.
    gpu.device
        .set_device_lost_callback(move |_, message| faults.lost(&message));
    Ok(gpu)
}

/// What a device has reported, in order.
#[derive(Clone, Debug, Default)]
struct Faults(Arc<Mutex<Vec<Fault>>>);

#[derive(Debug, PartialEq, Eq)]
enum Fault {
    OutOfMemory,
    /// What the device says.
    Reported(String),
    /// The reason, where there is one.
    Lost(String),
}

impl fmt::Display for Fault {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OutOfMemory => formatter.write_str("the device is out of memory"),
            Self::Reported(text) => write!(formatter, "the device reports: {text}"),
            // A device that was destroyed gives no reason.
            Self::Lost(reason) if reason.is_empty() => formatter.write_str("the device is lost"),
            Self::Lost(reason) => write!(formatter, "the device is lost: {reason}"),
        }
    }
}

impl Faults {
    fn list(&self) -> MutexGuard<'_, Vec<Fault>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn report(&self, error: &wgpu::Error) {
        let mut list = self.list();
        // What has no memory is invalid from then on, which every use of it would report again.
        if list.last() == Some(&Fault::OutOfMemory) {
            return;
        }
        list.push(match error {
            wgpu::Error::OutOfMemory { .. } => Fault::OutOfMemory,
            other => Fault::Reported(other.to_string()),
        });
    }

    fn lost(&self, message: &str) {
        let reason = message.trim_end_matches('.').to_owned();
        self.list().push(Fault::Lost(reason));
    }
}

/// Real GPUs first; of the same kind, the more direct interface first.
fn preference(summary: &AdapterSummary) -> (usize, usize, usize) {
    let place =
        |order: &[&str], of: &str| order.iter().position(|k| *k == of).unwrap_or(order.len());
    (
        place(
            &["discrete", "integrated", "virtual", "other", "software"],
            summary.kind,
        ),
        place(&["vulkan", "metal", "dx12", "gl"], &summary.backend),
        summary.index,
    )
}

impl Gpu {
    /// Takes note of an error as if the device had reported it.
    pub fn report(&self, error: &wgpu::Error) {
        self.faults.report(error);
    }

    /// Says whether the device has reported a failure since it was opened.
    ///
    /// # Errors
    /// [`Error::Gpu`] with all that it reported.
    pub fn check(&self) -> Result<()> {
        let faults = self.faults.list();
        if faults.is_empty() {
            return Ok(());
        }
        let faults: Vec<String> = faults.iter().map(Fault::to_string).collect();
        Err(Error::Gpu(format!(
            "{}: {}",
            self.summary.name,
            faults.join("; ")
        )))
    }

    /// Loop iterations of an invocation up to which the driver ends no loop in silence.
    #[must_use]
    pub fn loop_iterations(&self) -> u32 {
        match self.summary.name.contains("llvmpipe") {
            true => LOOP_ITERATIONS as u32,
            false => u32::MAX,
        }
    }

    /// Waits until the queue is empty.
    ///
    /// # Errors
    /// [`Error::Gpu`] if the device failed.
    pub fn wait(&self) -> Result<()> {
        let waited = self.device.poll(wgpu::PollType::wait_indefinitely());
        self.check()?;
        waited
            .map(|_| ())
            .map_err(|e| Error::Gpu(format!("{}: {e}", self.summary.name)))
    }
}

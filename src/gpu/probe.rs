//! Single functions of the kernel on a device: for tests, and for the hazard suite.
//!
//! Every function has an entry point `probe_<function>` in `shaders/probe.wesl`, where its rows are
//! listed. An invocation reads a few rows of four 32-bit words and writes a few; here a row is
//! `[f32; 4]` or `[u32; 4]`, and an invocation's rows are an array or a `repr(C)` struct of these.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use bytemuck::{Pod, Zeroable};

use crate::effects::Effects;
use crate::error::{Error, Result};
use crate::gpu::data::SceneBytes;
use crate::gpu::device::Gpu;
use crate::gpu::engine::{Engine, Pass, Program, Recording};
use crate::placement::Placement;
use crate::records::layout::CameraRecord;
use crate::scene::Scene;
use crate::shader::{Kernel, Stage, link};

/// Bytes of a row.
const ROW: usize = 16;
/// Invocations of a workgroup.
const WORKGROUP: usize = 64;
/// Invocations of a dispatch: well within the workgroups that every device allows, and short.
const DISPATCH: usize = 1 << 18;

/// `Shape` of `shaders/probe.wesl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct ShapeRecord {
    /// Invocations that have work.
    pub count: u32,
    /// Rows that an invocation reads.
    pub inputs: u32,
    /// Rows that it writes.
    pub outputs: u32,
    /// Always 0, which no shader compiler knows.
    pub zero: u32,
}

/// The kernel's functions, ready to be called.
#[derive(Debug)]
pub struct Probe {
    gpu: Gpu,
    program: Program,
    camera: CameraRecord,
    data: SceneBytes,
    /// Functions that were called, by name: a driver takes seconds to compile a large one.
    compiled: Mutex<BTreeMap<String, Arc<Pass>>>,
}

impl Probe {
    /// Links the functions that `effects` bring; `scene` and `placement` give camera and
    /// environment.
    ///
    /// # Errors
    /// [`Error::Shader`] if they do not link, [`Error::Gpu`] if the device refuses them.
    pub fn new(gpu: &Gpu, scene: &Scene, placement: &Placement, effects: &Effects) -> Result<Self> {
        let kernel = link(Stage::Probe, scene, placement, effects)?;
        let program = Program::new(gpu, "probe", kernel);
        gpu.check()?;
        let data = SceneBytes::new(program.kernel(), scene, placement, effects);
        Ok(Self {
            gpu: gpu.clone(),
            data,
            program,
            camera: CameraRecord::new(&placement.camera),
            compiled: Mutex::default(),
        })
    }

    /// The kernel in use.
    #[must_use]
    pub fn kernel(&self) -> &Kernel {
        self.program.kernel()
    }

    /// Calls `function` once for each of `inputs`.
    ///
    /// # Errors
    /// [`Error::Gpu`] if the device fails, [`Error::Shader`] if no effect in use brings `function`.
    ///
    /// # Panics
    /// If an input or an output is not a whole number of rows.
    pub fn call<I: Pod, O: Pod>(&self, function: &str, inputs: &[I]) -> Result<Vec<O>> {
        assert_eq!(
            size_of::<I>() % ROW,
            0,
            "inputs of {function} are not whole rows"
        );
        assert_eq!(
            size_of::<O>() % ROW,
            0,
            "outputs of {function} are not whole rows"
        );
        let pass = self.compiled(function)?;
        let mut engine = Engine::new(self.gpu.clone());
        let mut outputs = Vec::with_capacity(inputs.len());
        let mut data = Recording::default();
        self.data.upload(&mut data, &pass);
        engine.run(data)?;
        for part in inputs.chunks(DISPATCH) {
            let shape = ShapeRecord {
                count: part.len() as u32,
                inputs: (size_of::<I>() / ROW) as u32,
                outputs: (size_of::<O>() / ROW) as u32,
                zero: 0,
            };
            engine.buffer("outputs", (part.len() * size_of::<O>()) as u64);
            let mut recording = Recording::default();
            recording
                .upload("view", bytemuck::bytes_of(&self.camera))
                .upload("shape", bytemuck::bytes_of(&shape))
                .upload("inputs", bytemuck::cast_slice(part))
                .dispatch(&pass, part.len().div_ceil(WORKGROUP) as u32)
                .read("outputs");
            let readings = engine.run(recording)?;
            let records = readings["outputs"].bytes().chunks_exact(size_of::<O>());
            outputs.extend(records.map(bytemuck::pod_read_unaligned::<O>));
        }
        Ok(outputs)
    }

    /// The function, compiled once.
    fn compiled(&self, function: &str) -> Result<Arc<Pass>> {
        let mut compiled = self.compiled.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(pass) = compiled.get(function) {
            return Ok(pass.clone());
        }
        let entry = format!("probe_{function}");
        let mut entries = self.kernel().module.entry_points.iter();
        if !entries.any(|e| e.name == entry) {
            return Err(Error::Shader(format!(
                "the kernel has no function {function}"
            )));
        }
        let pass = Arc::new(self.program.pass(&self.gpu, &entry, &[])?);
        compiled.insert(function.to_owned(), pass.clone());
        Ok(pass)
    }
}

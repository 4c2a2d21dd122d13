//! Single functions of the kernel on a device: for tests, and for the hazard suite.
//!
//! Every function has an entry point `probe_<function>` in `shaders/probe/`, where its rows are
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
use crate::shader::{Binding, Folder, Stage, link};

/// Bytes of a row.
const ROW: usize = 16;
/// Invocations of a workgroup.
const WORKGROUP: usize = 64;
/// Invocations of a dispatch: well within the workgroups that every device allows, and short.
const DISPATCH: usize = 1 << 18;

/// `Shape` of `shaders/probe/rows.wesl`.
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
    scene: Scene,
    placement: Placement,
    effects: Effects,
    /// Folders of which a function was asked for.
    folders: Mutex<BTreeMap<Folder, Arc<Linked>>>,
    /// Functions that were called, by name: a driver takes seconds to compile a large one.
    compiled: Mutex<BTreeMap<String, Arc<Pass>>>,
}

/// The functions of a folder.
#[derive(Debug)]
struct Linked {
    program: Program,
    data: SceneBytes,
}

impl Probe {
    /// The functions that `effects` bring, with the camera, the environment and the spheres of `scene` as it is placed.
    #[must_use]
    pub fn new(gpu: &Gpu, scene: &Scene, placement: &Placement, effects: &Effects) -> Self {
        Self {
            gpu: gpu.clone(),
            scene: scene.clone(),
            placement: placement.clone(),
            effects: effects.clone(),
            folders: Mutex::default(),
            compiled: Mutex::default(),
        }
    }

    /// The functions of a folder, linked once.
    fn folder(&self, folder: Folder) -> Result<Arc<Linked>> {
        let mut folders = self.folders.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(linked) = folders.get(&folder) {
            return Ok(linked.clone());
        }
        let (scene, placement, effects) = (&self.scene, &self.placement, &self.effects);
        let kernel = link(Stage::Probe(folder), scene, placement, effects)?;
        let program = Program::new(&self.gpu, "probe", kernel);
        self.gpu.check()?;
        let data = SceneBytes::new(scene, placement, effects);
        let linked = Arc::new(Linked { program, data });
        folders.insert(folder, linked.clone());
        Ok(linked)
    }

    /// The kernel that has the entry point `entry`, and what it reads of the scene; `None` if no effect in use brings it.
    fn linked(&self, entry: &str) -> Result<Option<Arc<Linked>>> {
        let Some(folder) = Folder::with(entry) else {
            return Ok(None);
        };
        let linked = self.folder(folder)?;
        let mut entries = linked.program.kernel().module.entry_points.iter();
        let found = entries.any(|e| e.name == entry);
        Ok(found.then_some(linked))
    }

    /// What the entry point `entry` binds; nothing if no effect in use brings it.
    ///
    /// # Errors
    /// [`Error::Shader`] if its folder does not link, [`Error::Gpu`] if the device refuses it.
    pub fn bindings(&self, entry: &str) -> Result<Vec<Binding>> {
        let linked = self.linked(entry)?;
        Ok(linked.map_or(vec![], |linked| linked.program.kernel().bindings(entry)))
    }

    /// Calls `function` once for each of `inputs`.
    ///
    /// # Errors
    /// [`Error::Gpu`] if the device fails, [`Error::Shader`] if its folder does not link or no effect in use brings
    /// `function`.
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
        let entry = format!("probe_{function}");
        let linked = self
            .linked(&entry)?
            .ok_or_else(|| Error::Shader(format!("the kernel has no function {function}")))?;
        let pass = self.compiled(&linked, &entry)?;
        let camera = CameraRecord::new(&self.placement.camera);
        let mut engine = Engine::new(self.gpu.clone());
        let mut outputs = Vec::with_capacity(inputs.len());
        let mut data = Recording::default();
        linked.data.upload(&mut data, &pass);
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
                .upload("view", bytemuck::bytes_of(&camera))
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

    /// The entry point, compiled once.
    fn compiled(&self, linked: &Linked, entry: &str) -> Result<Arc<Pass>> {
        let mut compiled = self.compiled.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(pass) = compiled.get(entry) {
            return Ok(pass.clone());
        }
        let pass = Arc::new(linked.program.pass(&self.gpu, entry, &[])?);
        compiled.insert(entry.to_owned(), pass.clone());
        Ok(pass)
    }
}

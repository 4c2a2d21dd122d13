//! The kernel: linked from `shaders/` for exactly the effects in use, and validated by naga.
//!
//! The only module that knows WESL.

mod baked;
mod binding;
mod bsdf;
mod dispatch;
mod mixes;
mod names;
mod sources;
pub mod steps;
mod textures;
mod without;

pub use bsdf::{members as material_members, record_of as material_record};
pub use names::declared_names;

use glam::DVec3;
use wesl::{CompileOptions, ManglerKind, ModulePath, VirtualResolver, Wesl};

use crate::bvh;
use crate::effects::{Effect, Effects, Role};
use crate::error::{Error, Result};
use crate::materials;
use crate::placement::{Medium, Placement};
use crate::records::layout::{ATTRIBUTES_WIDTH, CELLS_WIDTH, SKY_TABLE_WIDTH, SPHERES_WIDTH};
use crate::records::material::anchored_spheres;
use crate::records::measured::MEASURED_WIDTH;
use crate::records::tables::{MATERIALS_WIDTH, RECORDS_WIDTH, SceneTables};
use crate::records::textures::IMAGE_WIDTH;
use crate::scene::{Environment, Scene};

pub use binding::Binding;

/// A linked and validated kernel.
#[derive(Debug)]
pub struct Kernel {
    /// Plain WGSL.
    pub wgsl: String,
    /// The same as naga understands it, for reflection.
    pub module: naga::Module,
    /// What its functions use.
    info: naga::valid::ModuleInfo,
}

impl Kernel {
    /// What the entry point `entry` binds, in no order; nothing if there is no such entry point.
    #[must_use]
    pub fn bindings(&self, entry: &str) -> Vec<Binding> {
        binding::of(&self.module, &self.info, entry)
    }

    /// For every loop the name in the sources of the function or entry point that it is in.
    #[must_use]
    pub fn loops(&self) -> Vec<String> {
        let functions = self.module.functions.iter().map(|(_, function)| function);
        let entries = self
            .module
            .entry_points
            .iter()
            .map(|e| (&e.name, &e.function));
        let named = functions.filter_map(|f| Some((f.name.as_ref()?, f)));
        named
            .chain(entries)
            .flat_map(|(name, function)| {
                let count = steps::loops_in(&function.body);
                std::iter::repeat_n(binding::source_name(name), count)
            })
            .collect()
    }

    /// Bytes of the variables of the entry point `entry`, as naga lays them out: the state that its loop carries from one
    /// turn to the next, which a driver keeps in registers or in memory of each invocation. 0, if there is no such
    /// entry point.
    ///
    /// # Panics
    /// Never: a module that is valid has a layout.
    #[must_use]
    pub fn state_bytes(&self, entry: &str) -> u32 {
        let mut layouter = naga::proc::Layouter::default();
        let laid_out = layouter.update(self.module.to_ctx());
        laid_out.expect("a module that is valid has a layout");
        let entries = self.module.entry_points.iter().filter(|e| e.name == entry);
        entries
            .flat_map(|e| e.function.local_variables.iter())
            // What has no name is naga's own, for a single expression.
            .filter(|(_, variable)| variable.name.is_some())
            .map(|(_, variable)| layouter[variable.ty].size)
            .sum()
    }

    /// Name, offset and size in bytes of every member of the struct type `name` (as the linker
    /// named it: the end of the name is enough), and the struct's own size.
    #[must_use]
    pub fn struct_members(&self, name: &str) -> Option<(Vec<(String, u32)>, u32)> {
        self.module
            .types
            .iter()
            .find_map(|(_, ty)| match (&ty.name, &ty.inner) {
                (Some(n), naga::TypeInner::Struct { members, span })
                    if n == name || n.ends_with(&format!("_{name}")) =>
                {
                    let members = members
                        .iter()
                        .map(|m| (m.name.clone().unwrap_or_default(), m.offset))
                        .collect();
                    Some((members, *span))
                }
                _ => None,
            })
    }
}

/// Which entry point to link.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// The path tracer (`shaders/path.wesl`).
    Path,
    /// Single functions, for tests (`shaders/probe/`).
    Probe(Folder),
}

/// The folder of `shaders/` whose functions a probe has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[expect(missing_docs, reason = "named as they are")]
pub enum Folder {
    Core,
    Scene,
    Materials,
    Light,
    /// Records of `scene/data`.
    Data,
}

impl Folder {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::Core,
        Self::Scene,
        Self::Materials,
        Self::Light,
        Self::Data,
    ];

    fn root(self) -> &'static str {
        match self {
            Self::Core => "probe/core",
            Self::Scene => "probe/scene",
            Self::Materials => "probe/materials",
            Self::Light => "probe/light",
            Self::Data => "probe/data",
        }
    }

    /// The one whose probe has the entry point `entry`, for some effects.
    #[must_use]
    pub fn with(entry: &str) -> Option<Self> {
        let declared = format!("fn {entry}(");
        Self::ALL.into_iter().find(|folder| {
            let mut sources = sources::ALL.iter();
            sources.any(|(path, text)| *path == folder.root() && text.contains(&declared))
        })
    }
}

/// Links the kernel of `stage` for `scene` with exactly `effects`.
///
/// # Errors
/// [`Error::Shader`] if the sources do not link or the result is not valid WGSL.
pub fn link(
    stage: Stage,
    scene: &Scene,
    placement: &Placement,
    effects: &Effects,
) -> Result<Kernel> {
    link_from(stage, scene, placement, effects, None)
}

/// Links the kernel of a render for `scene` with exactly `effects` from sources that have nothing of `effect`,
/// which is none of them: what costs nothing leaves it as it is.
///
/// # Errors
/// Those of [`link`].
pub fn link_without(
    effect: Effect,
    scene: &Scene,
    placement: &Placement,
    effects: &Effects,
) -> Result<Kernel> {
    link_from(Stage::Path, scene, placement, effects, Some(effect))
}

fn link_from(
    stage: Stage,
    scene: &Scene,
    placement: &Placement,
    effects: &Effects,
    without: Option<Effect>,
) -> Result<Kernel> {
    let source = |text: &'static str| match without {
        None => text.into(),
        Some(effect) => without::strip(text, effect).into(),
    };
    let is_there = |path: &str| without.is_none_or(|e| !without::is_own(path, e, effects));
    let mut resolver = VirtualResolver::new();
    for (path, text) in sources::ALL.iter().filter(|(path, _)| is_there(path)) {
        resolver.add_module(module_path(path), source(text));
    }
    // Of those in use only: nothing can ask for another one.
    for material in materials::ALL {
        if !effects
            .forms()
            .any(|(_, form)| material.forms.contains(form))
        {
            continue;
        }
        let path = format!("materials/{}", material.module);
        resolver.add_module(module_path(&path), source(material.wesl));
    }
    for Role { name, file } in effects.roles() {
        let chosen = file.filter(|path| is_there(path));
        let chosen = sources::ALL.iter().find(|(path, _)| Some(*path) == chosen);
        if let Some((_, text)) = chosen {
            resolver.add_module(module_path(name), source(text));
        }
    }
    resolver.add_module(module_path("bsdf"), bsdf::module(effects).into());
    resolver.add_module(
        module_path("config"),
        config(scene, placement, effects).into(),
    );
    if effects.has(Effect::Baked) {
        let text = baked::geometry(placement, effects);
        resolver.add_module(module_path("geometry"), text.into());
        let text = baked::attributes(scene, placement, effects);
        resolver.add_module(module_path("attributes"), text.into());
    }
    if effects.has(Effect::LampImages) {
        let text = baked::images(placement);
        resolver.add_module(module_path("lamp_images"), text.into());
    }
    let mut compiler = Wesl::new_barebones().set_custom_resolver(resolver);
    compiler
        .set_options(CompileOptions {
            imports: true,
            condcomp: true,
            generics: false,
            // What no entry point reaches is left out.
            strip: true,
            lazy: true,
            lower: false,
            validate: false,
            ..CompileOptions::default()
        })
        .set_mangler(ManglerKind::Escape)
        .set_missing_feature_behavior(wesl::Feature::Error);
    for (name, used) in effects.flags() {
        compiler.set_feature(name, used);
    }
    let root = match stage {
        Stage::Path => "path",
        Stage::Probe(folder) => folder.root(),
    };
    let mut linked = compiler
        .compile(&module_path(root))
        .map_err(|e| Error::Shader(format!("the kernel does not link: {e}")))?;
    binding::number(&mut linked.syntax);
    // The linker's order varies from run to run; declarations may stand in any.
    let declarations = linked.syntax.global_declarations.iter();
    let mut declarations: Vec<String> = declarations.map(|d| d.to_string().trim().into()).collect();
    declarations.sort_unstable();
    let wgsl = declarations.join("\n\n") + "\n";
    let (module, info) = validate(&wgsl)?;
    Ok(Kernel { wgsl, module, info })
}

/// Parses and validates WGSL with naga.
///
/// # Errors
/// [`Error::Shader`] with the place in the source.
fn validate(wgsl: &str) -> Result<(naga::Module, naga::valid::ModuleInfo)> {
    let module = naga::front::wgsl::parse_str(wgsl).map_err(|e| {
        Error::Shader(format!(
            "the kernel is not WGSL: {}",
            e.emit_to_string(wgsl)
        ))
    })?;
    let info = naga::valid::Validator::new(
        naga::valid::ValidationFlags::all(),
        naga::valid::Capabilities::empty(),
    )
    .validate(&module)
    .map_err(|e| {
        Error::Shader(format!(
            "the kernel is not valid: {}",
            e.emit_to_string(wgsl)
        ))
    })?;
    Ok((module, info))
}

fn module_path(path: &str) -> ModulePath {
    format!("package::{}", path.replace('/', "::"))
        .parse()
        .expect("a literal path of this crate")
}

/// The module `config`: sizes and constants of this scene.
fn config(scene: &Scene, placement: &Placement, effects: &Effects) -> String {
    let mut text = String::new();
    if effects.keeps_spheres() {
        text += &format!("const SPHERE_COUNT: u32 = {}u;\n", placement.spheres.len());
        let records = scene.materials.len() + anchored_spheres(scene, placement).count();
        text += &format!(
            "const MATERIALS_WIDTH: u32 = {MATERIALS_WIDTH}u;\nconst ATTRIBUTES_WIDTH: u32 = {ATTRIBUTES_WIDTH}u;\n"
        );
        if effects.has_mixes() {
            text += &format!("const PART_MATERIALS: u32 = {records}u;\n");
        }
        if effects.has(Effect::Pole) {
            text += &format!("const POLE_COUNT: u32 = {}u;\n", placement.poles);
        }
    }
    if effects.has(Effect::List) {
        text += &format!("const SPHERES_WIDTH: u32 = {SPHERES_WIDTH}u;\n");
    }
    if effects.has(Effect::RadianceCache) {
        let cells = placement.cells().map_or(0, |cells| cells.count());
        text +=
            &format!("const CELLS: u32 = {cells}u;\nconst CELLS_WIDTH: u32 = {CELLS_WIDTH}u;\n");
    }
    if effects.has(Effect::Bvh) {
        let tree = placement.tree();
        text += &format!(
            "const TREE_WIDTH: u32 = {}u;\nconst TREE_ROOT: u32 = {}u;\n\
             const TREE_STACK: u32 = {}u;\nconst TREE_APART: u32 = {}u;\n",
            bvh::WIDTH,
            tree.root,
            tree.stack(),
            tree.apart
        );
    }
    text += &format!(
        "const RAY_STEPS: u32 = {}u;\n",
        steps::vertex_steps(placement, effects)
    );
    if effects.looks_at_offset() || effects.has_textures() {
        let unit = baked::number(1.0 / placement.scale);
        text += &format!("const SCENE_UNIT: f32 = {unit};\n");
    }
    if effects.has_textures() {
        text += &format!("const IMAGE_WIDTH: u32 = {IMAGE_WIDTH}u;\n");
    }
    if effects.reads_records() {
        text += &format!("const RECORDS_WIDTH: u32 = {RECORDS_WIDTH}u;\n");
        let mut start = 0;
        for list in SceneTables::new(scene, placement).lists(placement, effects) {
            text += &format!("const {}: u32 = {start}u;\n", list.first);
            start += list.size();
        }
    }
    if effects.has_tables() {
        text += &format!("const MEASURED_WIDTH: u32 = {MEASURED_WIDTH}u;\n");
    }
    text += &environment(scene, placement, effects);
    if effects.has(Effect::Lights) {
        let count = placement.lights.table.len().max(1);
        text += &format!("const LIGHT_COUNT: u32 = {count}u;\n");
    }
    if effects.has(Effect::Nudge) {
        let [back, out] = placement.offset.distances().unwrap_or_default();
        text += &format!(
            "const NUDGE_BACK: f32 = {};\nconst NUDGE_OUT: f32 = {};\n",
            baked::number(back),
            baked::number(out)
        );
    }
    if effects.has(Effect::Dispersion) {
        let kind = |medium: &Medium| {
            let sphere = &placement.spheres[medium.sphere];
            &scene.materials[sphere.material].kind
        };
        let dispersive = |medium| kind(medium).dispersion().is_some();
        let any = placement.within.iter().any(dispersive);
        text += &format!("const INITIAL_DISPERSIVE: bool = {any};\n");
    }
    text += &initial_media(placement, effects);
    text
}

/// What paths see that hit nothing.
fn environment(scene: &Scene, placement: &Placement, effects: &Effects) -> String {
    let scaled = |radiance: DVec3| baked::vector(radiance * placement.radiance_scale);
    let environment = scene.environment.as_ref();
    let mut text = String::new();
    if effects.has(Effect::Environment) {
        let radiance = environment.and_then(Environment::constant);
        let radiance = scaled(radiance.unwrap_or_default());
        text += &format!("const ENVIRONMENT: vec3f = {radiance};\n");
    }
    if effects.has(Effect::Gradient)
        && let Some(Environment::Gradient(gradient)) = environment
    {
        for (name, radiance) in [
            ("ZENITH", gradient.zenith),
            ("HORIZON", gradient.horizon),
            ("GROUND", gradient.ground),
        ] {
            text += &format!("const GRADIENT_{name}: vec3f = {};\n", scaled(radiance));
        }
    }
    if effects.has(Effect::Sky)
        && let Some(sky) = environment.and_then(Environment::sky)
    {
        text += &format!(
            "const SKY_WIDTH: u32 = {}u;\nconst SKY_HEIGHT: u32 = {}u;\nconst SKY_TURN: f32 = {};\n",
            sky.image().width,
            sky.image().height,
            baked::number(sky.rotation() / 360.0)
        );
    }
    if effects.has(Effect::Skylight) {
        text += &format!("const SKY_TABLE_WIDTH: u32 = {SKY_TABLE_WIDTH}u;\n");
    }
    text
}

/// What the camera is in.
fn initial_media(placement: &Placement, effects: &Effects) -> String {
    let camera = &placement.within;
    let sphere = |medium: Option<&Medium>| {
        let index = medium.map_or(u32::MAX, |m| m.sphere as u32);
        format!("{index}u")
    };
    if !effects.has(Effect::Priority) {
        return if effects.transmits() {
            format!("const INITIAL_WITHIN: u32 = {};\n", sphere(camera.first()))
        } else {
            String::new()
        };
    }
    let levels = placement.media.levels.max(1);
    let inside: u32 = camera.iter().map(|medium| 1 << medium.level).sum();
    let each = |value: &dyn Fn(Option<&Medium>) -> String| -> String {
        let values = (0..levels).map(|level| value(camera.iter().find(|m| m.level == level)));
        values.collect::<Vec<_>>().join(", ")
    };
    format!(
        "const LEVELS: u32 = {levels}u;\nconst INITIAL_MEDIA: u32 = {inside}u;\n\
         const INITIAL_IOR = array<f32, {levels}>({});\n\
         const INITIAL_SPHERES = array<u32, {levels}>({});\n",
        each(&|medium| baked::number(medium.map_or(1.0, |m| m.ior))),
        each(&sphere)
    )
}

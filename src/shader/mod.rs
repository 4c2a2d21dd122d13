//! The kernel: linked from `shaders/` for exactly the effects in use, and validated by naga.
//!
//! The only module that knows WESL.

mod baked;
mod bsdf;
mod names;
mod sources;

pub use bsdf::members as material_members;
pub use names::declared_names;

use wesl::{CompileOptions, ManglerKind, ModulePath, VirtualResolver, Wesl};

use crate::effects::{Effect, Effects, Role};
use crate::error::{Error, Result};
use crate::materials;
use crate::media::Medium;
use crate::placement::Placement;
use crate::scene::Scene;

/// A linked and validated kernel.
#[derive(Debug)]
pub struct Kernel {
    /// Plain WGSL.
    pub wgsl: String,
    /// The same as naga understands it, for reflection.
    pub module: naga::Module,
}

impl Kernel {
    /// Whether the kernel has a resource at `binding` of group 0.
    #[must_use]
    pub fn has_binding(&self, binding: u32) -> bool {
        self.module.global_variables.iter().any(|(_, variable)| {
            variable
                .binding
                .is_some_and(|b| b.group == 0 && b.binding == binding)
        })
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
    /// Single functions, for tests (`shaders/probe.wesl`).
    Probe,
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
    let mut resolver = VirtualResolver::new();
    for (path, text) in sources::ALL {
        resolver.add_module(module_path(path), (*text).into());
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
        resolver.add_module(module_path(&path), material.wesl.into());
    }
    for Role { name, file } in effects.roles() {
        let source = sources::ALL.iter().find(|(path, _)| Some(*path) == file);
        if let Some((_, text)) = source {
            resolver.add_module(module_path(name), (*text).into());
        }
    }
    resolver.add_module(module_path("bsdf"), bsdf::module(effects).into());
    resolver.add_module(
        module_path("config"),
        config(scene, placement, effects).into(),
    );
    if effects.has(Effect::Baked) {
        let text = baked::geometry(scene, placement, effects);
        resolver.add_module(module_path("geometry"), text.into());
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
        Stage::Probe => "probe",
    };
    let wgsl = compiler
        .compile(&module_path(root))
        .map_err(|e| Error::Shader(format!("the kernel does not link: {e}")))?
        .to_string();
    // The linker's order varies from run to run; declarations may stand in any.
    let mut declarations: Vec<&str> = wgsl.split("\n\n").map(str::trim).collect();
    declarations.sort_unstable();
    let wgsl = declarations.join("\n\n") + "\n";
    let module = validate(&wgsl)?;
    Ok(Kernel { wgsl, module })
}

/// Parses and validates WGSL with naga.
///
/// # Errors
/// [`Error::Shader`] with the place in the source.
pub fn validate(wgsl: &str) -> Result<naga::Module> {
    let module = naga::front::wgsl::parse_str(wgsl).map_err(|e| {
        Error::Shader(format!(
            "the kernel is not WGSL: {}",
            e.emit_to_string(wgsl)
        ))
    })?;
    naga::valid::Validator::new(
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
    Ok(module)
}

fn module_path(path: &str) -> ModulePath {
    format!("package::{}", path.replace('/', "::"))
        .parse()
        .expect("a literal path of this crate")
}

/// The most loop iterations of an invocation in one dispatch: llvmpipe, lavapipe's machine, ends
/// every loop in silence after 65535 iterations of all loops together.
pub const LOOP_ITERATIONS: u64 = 65_000;

/// Loop iterations that the kernel makes for one ray.
#[must_use]
pub fn ray_steps(placement: &Placement, effects: &Effects) -> u32 {
    if effects.has(Effect::Baked) {
        return 1;
    }
    let others = placement.spheres.len() - placement.poles;
    // One a pole sphere, one for eight others, and one to leave each loop; with light sampling there
    // are two rays a vertex.
    let ray = placement.poles + others.div_ceil(8) + 2;
    let rays = if effects.has(Effect::Lights) { 2 } else { 1 };
    // And the path loop's own.
    (rays * ray + 1 + light_steps(placement, effects)) as u32
}

/// Loop iterations to choose a light, with one to leave the loop.
fn light_steps(placement: &Placement, effects: &Effects) -> usize {
    if effects.weighs_lights() && effects.has(Effect::List) {
        placement.lights.table.len() + 1
    } else {
        0
    }
}

/// The module `config`: sizes and constants of this scene.
fn config(scene: &Scene, placement: &Placement, effects: &Effects) -> String {
    let mut text = String::new();
    if effects.has(Effect::List) {
        text += &format!("const SPHERE_COUNT: u32 = {}u;\n", placement.spheres.len());
        if effects.has(Effect::Pole) {
            text += &format!("const POLE_COUNT: u32 = {}u;\n", placement.poles);
        }
    }
    text += &format!(
        "const RAY_STEPS: u32 = {}u;\n",
        ray_steps(placement, effects)
    );
    if effects.has(Effect::Environment) {
        let radiance = scene.environment.unwrap_or_default() * placement.light;
        text += &format!("const ENVIRONMENT: vec3f = {};\n", baked::vector(radiance));
    }
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
    text += &initial_media(placement, effects);
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

//! Which effects a scene asks for: the one place that looks at a scene and decides.
//!
//! An effect that nothing asks for is not in the kernel: its module is not imported, its members
//! are dropped from the shared structs, its branches and bindings are gone. The kernel's sources
//! (`shaders/`) name effects in `@if(...)`; [`Effects::flags`] says which are on.

use crate::placement::lights::MOST_WEIGHED;
use crate::placement::{PlacedSphere, Placement, Side};
use crate::sampler::Sampler;
use crate::scene::{MaterialKind, Scene};
use crate::settings::{GeometryChoice, Integrator, LightSampling, Offset, Settings};

/// Spheres up to which they are baked into the kernel as constants: measured, see
/// `benches/RESULTS.md`.
pub const BAKED_LIMIT: usize = 64;

/// Most spheres that can be baked at all: beyond, compiling takes minutes.
pub const BAKED_MOST: usize = 256;

/// One effect and what asked for it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Effect {
    /// Its name: in the scene file, in the kernel, and in every output.
    pub name: &'static str,
    /// What it adds, in a few words.
    pub what: &'static str,
    /// The first objects or options that asked for it; empty if nothing did.
    pub reasons: Vec<String>,
}

impl Effect {
    /// Whether the effect is in the kernel.
    #[must_use]
    pub fn used(&self) -> bool {
        !self.reasons.is_empty()
    }
}

/// All effects that the program has, used or not, in the order of the data flow.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Effects {
    table: Vec<Effect>,
}

/// Reasons listed for one effect; the rest is counted.
const REASONS: usize = 3;

impl Effects {
    /// Derives the effects of `scene` as `placement` and `settings` have it.
    #[must_use]
    pub fn derive(scene: &Scene, placement: &Placement, settings: &Settings) -> Self {
        let surfaces = |wanted: &dyn Fn(&crate::scene::Material) -> bool| {
            reasons(in_order(placement).filter_map(|sphere| {
                let material = &scene.materials[sphere.material];
                let name = &material.name;
                wanted(material).then(|| format!("sphere {} ({name})", sphere.source + 1))
            }))
        };
        let kind = |wanted: &dyn Fn(&MaterialKind) -> bool| surfaces(&|m| wanted(&m.kind));
        let placed = |wanted: &dyn Fn(&PlacedSphere) -> Option<&'static str>| {
            reasons(placement.spheres.iter().filter_map(|sphere| {
                let material = &scene.materials[sphere.material];
                wanted(sphere)
                    .map(|why| format!("sphere {} ({}){why}", sphere.source + 1, material.name))
            }))
        };
        let when = |condition: bool, reason: String| if condition { vec![reason] } else { vec![] };

        let count = placement.spheres.len();
        let exact = settings.offset == Offset::Exact;
        let nudged = || format!("--offset {}", settings.offset);
        let baked = match settings.geometry {
            GeometryChoice::Auto => count <= BAKED_LIMIT,
            GeometryChoice::Baked => true,
            GeometryChoice::List => false,
        };
        let form = |chosen: &str| match settings.geometry {
            GeometryChoice::Auto => format!("{count} spheres; baked up to {BAKED_LIMIT}"),
            _ => format!("--geometry {chosen}"),
        };
        let lecture = matches!(settings.integrator, Integrator::Lecture { .. });
        let integrator = format!("integrator {}", settings.integrator.name());
        let sampled = || {
            reasons(placement.lights.table.iter().map(|light| {
                let sphere = &placement.spheres[light.sphere];
                let name = &scene.materials[sphere.material].name;
                format!("sphere {} ({name})", sphere.source + 1)
            }))
        };
        let to_lights = matches!(settings.integrator, Integrator::Path | Integrator::Nee)
            && !placement.lights.table.is_empty();
        let lights = placement.lights.table.len();
        let from_table = placement.lights.from_table(settings.light_sampling);
        let projected = settings.light_sampling == LightSampling::Projected;
        let table = vec![
            Effect {
                name: "baked",
                what: "spheres as constants in the kernel",
                reasons: when(baked, form("baked")),
            },
            Effect {
                name: "list",
                what: "a loop over spheres in a storage buffer",
                reasons: when(!baked, form("list")),
            },
            Effect {
                name: "pole",
                what: "frames at the poles of spheres much larger than what is near them",
                reasons: placed(&|s| s.pole.map(|_| "")),
            },
            Effect {
                name: "interior",
                what: "paths inside spheres",
                reasons: placed(&|s| match s.side {
                    Side::Outside => None,
                    Side::Inside => Some(", which the camera is in"),
                    Side::Tracked => Some(", which has two sides"),
                    Side::Sign => Some(", which paths may be on both sides of"),
                }),
            },
            Effect {
                name: "straddle",
                what: "surfaces of which only a sign tells on which side a path is",
                reasons: if exact {
                    placed(&|s| {
                        (s.side == Side::Sign).then_some(", which the lens is on both sides of")
                    })
                } else {
                    when(count > 0, nudged())
                },
            },
            Effect {
                name: "nested",
                what: "surfaces just within those of dielectrics",
                reasons: placed(&|s| s.container.map(|_| ", which lies just within a dielectric")),
            },
            Effect {
                name: "nudge",
                what: "hits as points, moved off the surface by a distance",
                reasons: when(settings.offset.distances().is_some(), nudged()),
            },
            Effect {
                name: "ulp",
                what: "hits as points, moved off the surface by some ulp",
                reasons: when(settings.offset == Offset::Ulp, nudged()),
            },
            Effect {
                name: "lens",
                what: "a thin lens",
                reasons: when(
                    scene.camera.aperture_radius > 0.0,
                    format!("camera: aperture_radius = {}", scene.camera.aperture_radius),
                ),
            },
            Effect {
                name: "sobol",
                what: "samples in scrambled Sobol' sequences",
                reasons: when(settings.sampler == Sampler::Sobol, "sampler sobol".into()),
            },
            Effect {
                name: "classes",
                what: "light by the kind of its path",
                reasons: when(settings.classes, "--aov".into()),
            },
            Effect {
                name: "features",
                what: "normal, albedo and depth of what is seen first",
                reasons: when(settings.features, "--aov".into()),
            },
            Effect {
                name: "adaptive",
                what: "samples of some tiles of the image only",
                reasons: when(settings.adaptive, "--adaptive".into()),
            },
            Effect {
                name: "diffuse",
                what: "Lambert's law",
                reasons: kind(&|k| matches!(k, MaterialKind::Diffuse { .. })),
            },
            Effect {
                name: "mirror",
                what: "perfect mirrors",
                reasons: kind(&|k| matches!(k, MaterialKind::Mirror { .. })),
            },
            Effect {
                name: "dielectric",
                what: "smooth glass: Fresnel reflection and refraction",
                reasons: kind(&|k| matches!(k, MaterialKind::Dielectric { .. })),
            },
            Effect {
                name: "priority",
                what: "dielectrics that touch, nest or overlap",
                reasons: placement.media.example.map_or(vec![], |[a, b]| {
                    vec![format!("spheres {} and {}", a.min(b) + 1, a.max(b) + 1)]
                }),
            },
            Effect {
                name: "reflective",
                what: "the lecture's lobe around the ideal reflection",
                reasons: kind(&|k| matches!(k, MaterialKind::Reflective { .. })),
            },
            Effect {
                name: "emission",
                what: "surfaces that emit",
                reasons: surfaces(&|m| m.emission.max_element() > 0.0),
            },
            Effect {
                name: "environment",
                what: "constant light from everywhere",
                reasons: match scene.environment {
                    Some(e) if e.max_element() > 0.0 && !placement.enclosed => {
                        vec![format!(
                            "environment: radiance = [{}, {}, {}]",
                            e.x, e.y, e.z
                        )]
                    }
                    _ => vec![],
                },
            },
            Effect {
                name: "lecture",
                what: "uniform hemisphere, constant probability of termination",
                reasons: when(lecture, "--integrator lecture".into()),
            },
            Effect {
                name: "bsdf",
                what: "BSDF sampling",
                reasons: when(!lecture, integrator.clone()),
            },
            Effect {
                name: "lights",
                what: "light sampling: at every vertex a direction to a lamp",
                reasons: if to_lights { sampled() } else { vec![] },
            },
            Effect {
                name: "projected",
                what: "light sampling by projected solid angle",
                reasons: when(to_lights && projected, "light sampling projected".into()),
            },
            Effect {
                name: "table",
                what: "lights drawn from a table by power, whatever the vertex",
                reasons: when(
                    to_lights && from_table,
                    if projected {
                        format!("{lights} lights; weighed at each vertex up to {MOST_WEIGHED}")
                    } else {
                        "--light-sampling cone".into()
                    },
                ),
            },
            Effect {
                name: "mis",
                what: "weights between light sampling and BSDF sampling",
                reasons: when(
                    settings.integrator == Integrator::Path && to_lights,
                    integrator.clone(),
                ),
            },
            Effect {
                name: "roulette",
                what: "Russian roulette on the throughput",
                reasons: when(settings.roulette && !lecture, integrator),
            },
        ];
        Self { table }
    }

    /// Exactly the effects of `names`, for tests of the linker.
    ///
    /// # Panics
    /// If a name is not an effect's.
    #[must_use]
    pub fn of(scene: &Scene, placement: &Placement, settings: &Settings, names: &[&str]) -> Self {
        let mut effects = Self::derive(scene, placement, settings);
        for name in names {
            assert!(
                effects.table.iter().any(|e| e.name == *name),
                "no effect {name}"
            );
        }
        for effect in &mut effects.table {
            effect.reasons.clear();
            if names.contains(&effect.name) {
                effect.reasons.push("asked for".into());
            }
        }
        effects
    }

    /// All effects, used or not.
    #[must_use]
    pub fn table(&self) -> &[Effect] {
        &self.table
    }

    /// The names of the effects in use.
    pub fn names(&self) -> impl Iterator<Item = &'static str> {
        self.table.iter().filter(|e| e.used()).map(|e| e.name)
    }

    /// Whether the effect `name` is in use.
    ///
    /// # Panics
    /// If there is no effect of that name: a misspelt name must not read as "not used".
    #[must_use]
    pub fn has(&self, name: &str) -> bool {
        let effect = self.table.iter().find(|e| e.name == name);
        effect
            .unwrap_or_else(|| panic!("no effect is called {name}"))
            .used()
    }

    /// Name and state of every flag that the kernel's sources may ask for.
    pub fn flags(&self) -> impl Iterator<Item = (&'static str, bool)> {
        self.table.iter().map(|e| (e.name, e.used()))
    }

    /// The form of the geometry: `baked` or `list`.
    #[must_use]
    pub fn geometry(&self) -> &'static str {
        if self.has("baked") { "baked" } else { "list" }
    }
}

/// The spheres in scene order.
fn in_order(placement: &Placement) -> impl Iterator<Item = &PlacedSphere> {
    let mut spheres: Vec<&PlacedSphere> = placement.spheres.iter().collect();
    spheres.sort_by_key(|s| s.source);
    spheres.into_iter()
}

/// The first few of `all`, and how many more there are.
fn reasons(all: impl Iterator<Item = String>) -> Vec<String> {
    let mut all: Vec<String> = all.collect();
    if all.len() > REASONS {
        let more = all.len() - REASONS;
        all.truncate(REASONS);
        all.push(format!("and {more} more"));
    }
    all
}

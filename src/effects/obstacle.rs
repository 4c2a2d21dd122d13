//! Where the radiance cache and images of lamps are not used, and why.

use glam::DVec3;

use crate::materials::Material;
use crate::placement::{Placement, Side};
use crate::sampler::Sampler;
use crate::scene::{Environment, Scene};
use crate::settings::{DEFAULT_MAX_BOUNCES, GeometryChoice, Integrator, Offset, Settings};

/// Most spheres of a scene with a cache: beyond, cells would be more than what they save.
const MOST_SPHERES: usize = 64;
/// Most bounces and, of a mix, parts and bounces: a path of the pilot, whose loop does not look whether a driver has
/// ended it, then makes fewer loop iterations than drivers stand (`shader::steps::paths_at_most`), whatever else a scene
/// has. `tests/radiance_cache.rs` holds it to that.
const MOST_BOUNCES: u32 = 128;
const MOST_PARTS: usize = 4;
const MOST_MIXED_BOUNCES: u32 = DEFAULT_MAX_BOUNCES;

/// What stands against whatever goes by ways of paths of its own, with the reason.
fn obstacles(
    scene: &Scene,
    placement: &Placement,
    settings: &Settings,
) -> [(bool, &'static str); 12] {
    [
        (
            settings.integrator != Integrator::Path,
            "--integrator is not path",
        ),
        (settings.classes, "layers by the kind of path"),
        (settings.view.is_some(), "--view"),
        (settings.offset != Offset::Exact, "--offset is not exact"),
        (placement.moves(), "spheres that move"),
        (
            kinds(scene, placement).any(|material| !material.textures.is_empty()),
            "textures",
        ),
        (
            kinds(scene, placement).any(|material| material.kind.dispersion().is_some()),
            "dispersion",
        ),
        (
            kinds(scene, placement).any(|material| material.kind.absorption() != DVec3::ZERO),
            "absorption",
        ),
        (placement.media.levels > 0, "dielectrics that share points"),
        (!placement.within.is_empty(), "a camera in a dielectric"),
        (
            placement.spheres.iter().any(|s| s.side == Side::Sign),
            "a surface that the lens straddles",
        ),
        (
            placement.spheres.iter().any(|s| s.container.is_some()),
            "surfaces just within a dielectric",
        ),
    ]
}

/// The materials of all spheres.
fn kinds<'a>(scene: &'a Scene, placement: &'a Placement) -> impl Iterator<Item = &'a Material> {
    let spheres = placement.spheres.iter();
    spheres.map(|sphere| &scene.materials[sphere.material])
}

fn first(mut obstacles: impl Iterator<Item = (bool, &'static str)>) -> Option<&'static str> {
    obstacles.find(|(is, _)| *is).map(|(_, why)| why)
}

/// Why vertices look for no images of lamps; `None` where they can.
#[must_use]
pub fn image_obstacle(
    scene: &Scene,
    placement: &Placement,
    settings: &Settings,
) -> Option<&'static str> {
    let own = [
        (
            kinds(scene, placement).any(|material| material.kind.is_translucent()),
            "a surface that scatters light to its other side",
        ),
        (
            placement.lights.from_table(settings.light_sampling()),
            "lamps are drawn from a table",
        ),
        (
            placement.lights.table.is_empty(),
            "there is no lamp that light sampling looks for",
        ),
        (
            placement.images.is_none(),
            "more than 16 images of lamps in smooth spheres",
        ),
        (
            placement.images.as_ref().is_some_and(Vec::is_empty),
            "no smooth mirror or glass sphere is apart from a lamp",
        ),
    ];
    first(obstacles(scene, placement, settings).into_iter().chain(own))
}

/// Why a render has no radiance cache; `None` where it can have one.
#[must_use]
pub fn cache_obstacle(
    scene: &Scene,
    placement: &Placement,
    settings: &Settings,
) -> Option<&'static str> {
    let sky = scene
        .environment
        .as_ref()
        .filter(|e| e.brightest() > 0.0 && !placement.enclosed);
    let has_sky = sky.and_then(Environment::sky).is_some();
    let own = [
        (
            settings.sampler != Sampler::Sobol,
            "--sampler is not sobol: there are no scrambles",
        ),
        (
            settings.max_bounces < DEFAULT_MAX_BOUNCES,
            "--max-bounces is below 64, which a cell's value would not hold to",
        ),
        (
            settings.max_bounces > MOST_BOUNCES,
            "--max-bounces is above 128",
        ),
        (
            placement.mixed[0] > MOST_PARTS,
            "a mix of more than 4 materials",
        ),
        (
            placement.mixed[0] > 0 && settings.max_bounces > MOST_MIXED_BOUNCES,
            "--max-bounces is above 64, with a mix of materials",
        ),
        (settings.adaptive, "--adaptive"),
        (
            settings.geometry == GeometryChoice::Bvh || placement.spheres.len() > MOST_SPHERES,
            "a tree over the spheres",
        ),
        (
            !kinds(scene, placement).any(Material::is_diffuse),
            "no sphere is diffuse",
        ),
        (
            placement.lights.table.is_empty() && !has_sky,
            "there is no lamp, nor an image around all",
        ),
    ];
    first(obstacles(scene, placement, settings).into_iter().chain(own))
}

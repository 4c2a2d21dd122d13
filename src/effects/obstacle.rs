//! Where the radiance cache is not used, and why.

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

/// Why a render has no radiance cache; `None` where it can have one.
#[must_use]
pub fn cache_obstacle(
    scene: &Scene,
    placement: &Placement,
    settings: &Settings,
) -> Option<&'static str> {
    let kinds = || {
        let spheres = placement.spheres.iter();
        spheres.map(|sphere| &scene.materials[sphere.material])
    };
    let sky = scene
        .environment
        .as_ref()
        .filter(|e| e.brightest() > 0.0 && !placement.enclosed);
    let has_sky = sky.and_then(Environment::sky).is_some();
    let obstacles = [
        (
            settings.integrator != Integrator::Path,
            "--integrator is not path",
        ),
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
        (settings.classes, "layers by the kind of path"),
        (settings.view.is_some(), "--view"),
        (settings.offset != Offset::Exact, "--offset is not exact"),
        (
            settings.geometry == GeometryChoice::Bvh || placement.spheres.len() > MOST_SPHERES,
            "a tree over the spheres",
        ),
        (placement.moves(), "spheres that move"),
        (
            kinds().any(|material| !material.textures.is_empty()),
            "textures",
        ),
        (
            kinds().any(|material| material.kind.dispersion().is_some()),
            "dispersion",
        ),
        (
            kinds().any(|material| material.kind.absorption() != DVec3::ZERO),
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
        (!kinds().any(Material::is_diffuse), "no sphere is diffuse"),
        (
            placement.lights.table.is_empty() && !has_sky,
            "there is no lamp, nor an image around all",
        ),
    ];
    let first = obstacles.into_iter().find(|(is, _)| *is);
    first.map(|(_, why)| why)
}

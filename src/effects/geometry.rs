//! Effects of where spheres, paths and the camera are.

use glam::DVec3;

use super::surfaces::forms_that;
use super::{Effect, Row, when};
use crate::placement::Side;
use crate::settings::{GeometryChoice, Offset};

/// Spheres up to which they are baked into the kernel as constants, and beyond which a tree is faster than a loop
/// over all: measured, see `benches/RESULTS.md`.
pub const BAKED_LIMIT: usize = 64;

/// Most spheres that can be baked at all: beyond, compiling takes minutes.
pub const BAKED_MOST: usize = 256;

pub(super) fn rows() -> Vec<Row> {
    vec![
        form(Effect::Baked, "baked", "spheres as constants in the kernel")
            .excludes([Effect::List, Effect::Bvh]),
        form(Effect::List, "list", "a loop over spheres in a texture")
            .excludes([Effect::Bvh])
            .marks([
                "FIRST_CENTERED",
                "SPHERE_COUNT",
                "sphere_texels",
                "sphere_texel",
                "SPHERE_TEXELS",
                "SPHERES_WIDTH",
                "sphere_of",
                "nearer_sphere",
            ]),
        form(Effect::Bvh, "bvh", "a tree over spheres in a texture").marks([
            "tree",
            "data::texel",
            "sphere_at",
            "Attributes::place",
            "TREE_ROOT",
            "TREE_STACK",
            "TREE_APART",
            "TREE_WIDTH",
            "tree_steps",
            "NOTHING",
            "LEAF",
            "SLACK",
            "OFFSET_SLACK",
            "LEAST",
            "BoxRay",
            "box_ray",
            "Children",
            "in_order",
            "children_of",
            "nearer_leaf",
            "nearer_known",
            "nearest_beside",
            "traverse",
            "ends_loops",
        ]),
        Row::new(
            Effect::Pole,
            "pole",
            "frames at the poles of spheres much larger than what is near them",
            |asked| asked.placed(|s| s.pole.map(|_| "")),
        )
        .needs(forms_that(|_| true))
        .marks([
            "pole",
            "pole_quadratic",
            "aim_pole",
            "Pole",
            "data::pole_of",
            "POLE_COUNT",
            "POLE_TEXELS",
            "FIRST_POLE",
            "Light::curvature",
            "Pattern::place",
            "Pattern::cell",
            "on_sphere",
        ]),
        Row::new(
            Effect::Interior,
            "interior",
            "paths inside spheres",
            |asked| {
                asked.placed(|s| match s.side {
                    Side::Outside => None,
                    Side::Inside => Some(", which the camera is in"),
                    Side::Tracked => Some(", which has two sides"),
                    Side::Sign => Some(", which paths may be on both sides of"),
                })
            },
        )
        .needs(forms_that(|_| true))
        .marks([
            "root_interior",
            "root_from",
            "inside",
            "INSIDE",
            "is_inside",
            "side",
        ]),
        Row::new(
            Effect::Straddle,
            "straddle",
            "surfaces of which only a sign tells on which side a path is",
            |asked| {
                if asked.settings.offset == Offset::Exact {
                    return asked.placed(|s| {
                        (s.side == Side::Sign).then_some(", which the lens is on both sides of")
                    });
                }
                let offset = asked.settings.offset;
                when(!asked.placement.spheres.is_empty(), || {
                    format!("--offset {offset}")
                })
            },
        )
        .needs([Effect::Interior])
        .needs([Effect::Lens, Effect::Nudge, Effect::Ulp])
        .marks(["inward", "SIGN"]),
        Row::new(
            Effect::Nested,
            "nested",
            "surfaces just within those of dielectrics",
            |asked| asked.placed(|s| s.container.map(|_| ", which lies just within a dielectric")),
        )
        .needs([Effect::Interior])
        .needs(forms_that(|form| form.transmits))
        // Of what is within: something opaque, or a dielectric, which then shares points with the one around it.
        .needs([forms_that(|form| !form.transmits), vec![Effect::Priority]].concat())
        .excludes([Effect::Nudge, Effect::Ulp])
        .marks([
            "can_be_hit",
            "container",
            "core0",
            "core1",
            "core2",
            "core3",
        ]),
        Row::new(
            Effect::Nudge,
            "nudge",
            "hits as points, moved off the surface by a distance",
            |asked| {
                let offset = asked.settings.offset;
                when(offset.distances().is_some(), || {
                    format!("--offset {offset}")
                })
            },
        )
        .needs([Effect::Straddle])
        .excludes([Effect::Ulp])
        .marks(["NUDGE_BACK", "NUDGE_OUT"]),
        Row::new(
            Effect::Ulp,
            "ulp",
            "hits as points, moved off the surface by some ulp",
            |asked| {
                let offset = asked.settings.offset;
                when(offset == Offset::Ulp, || format!("--offset {offset}"))
            },
        )
        .needs([Effect::Straddle])
        .marks(["ulp_away"]),
        Row::new(Effect::Lens, "lens", "a thin lens", |asked| {
            let radius = asked.scene.camera.aperture_radius;
            when(radius > 0.0, || {
                format!("camera: aperture_radius = {radius}")
            })
        })
        .marks(["lens_across", "lens_down", "lens_share", "focus"]),
        Row::new(
            Effect::Motion,
            "motion",
            "spheres that move while the shutter is open: a time for each path",
            |asked| asked.placed(|s| (s.motion != DVec3::ZERO).then_some(", which moves")),
        )
        .needs(forms_that(|_| true))
        .marks(["motion", "time", "anchors_apart", "TIME"]),
    ]
}

/// The form of the geometry that `auto` takes for so many spheres.
fn automatic(count: usize) -> Effect {
    if count <= BAKED_LIMIT {
        Effect::Baked
    } else {
        Effect::Bvh
    }
}

/// A form of the geometry.
fn form(effect: Effect, name: &'static str, what: &'static str) -> Row {
    Row::new(effect, name, what, move |asked| {
        let count = asked.placement.spheres.len();
        let choice = asked.settings.geometry;
        let chosen = match choice {
            GeometryChoice::Auto => automatic(count),
            GeometryChoice::Baked => Effect::Baked,
            GeometryChoice::List => Effect::List,
            GeometryChoice::Bvh => Effect::Bvh,
        };
        when(chosen == effect, || match choice {
            GeometryChoice::Auto => {
                format!("{count} spheres; baked up to {BAKED_LIMIT}, bvh beyond")
            }
            _ => format!("--geometry {}", choice.name()),
        })
    })
}

//! The account of the kernel's loops, for drivers that count iterations.
//!
//! llvmpipe, lavapipe's machine, counts the iterations of all loops of an invocation together, and
//! after 65535 ends every loop in silence. So every loop that a scene can lengthen is in [`LOOPS`],
//! the only place that says how long it is. The kernel adds up what its vertices cost and starts no
//! further path beyond a limit that leaves room for one more; the host dispatches again. A path that alone
//! takes more is no sample, and an error: a loop within it may have been ended.
//!
//! A tree's loop has no length that is known beforehand, and its most, all nodes, may be beyond any limit. It counts
//! itself (`tree_steps`), and an invocation starts no further path beyond a quarter of what it may make. That
//! is not enough: llvmpipe counts the iterations of some invocations together, eight on most machines, and these
//! differ in a tree. So a path that has ended asks a loop of its own whether loops still turn (`ends_loops` in
//! `shaders/path/turns.wesl`); if they do not, it is no sample, and the next dispatch begins it again.

use crate::effects::{Effect, Effects};
use crate::materials::schema::MOST_OCTAVES;
use crate::materials::texturable::WEIGHT;
use crate::placement::Placement;

/// The most loop iterations that an invocation is to make in one dispatch: below the 65535 after which
/// llvmpipe ends every loop.
pub const LOOP_ITERATIONS: u64 = 65_000;

/// Spheres that an iteration of the loop over spheres about their centres tests.
const SPHERES_AN_ITERATION: usize = 8;

/// Bins of an image's impact parameters, as in `shaders/light/images.wesl`.
const BINS: usize = 4;

/// One loop of the path tracer's kernel.
#[derive(Debug)]
pub struct Loop {
    /// The function that it is in, as in `shaders/`.
    pub function: &'static str,
    /// Whether a kernel with these effects has it.
    pub used: fn(&Effects) -> bool,
    /// Most iterations at a vertex, with one to leave the loop for each time it is run.
    pub at_vertex: fn(&Placement, &Effects) -> usize,
}

/// All loops of the path tracer's kernel.
pub const LOOPS: [Loop; 22] = [
    // Over vertices.
    Loop {
        function: "render",
        used: |_| true,
        at_vertex: |_, _| 1,
    },
    // Over those of the radiance cache's pilots, which are in no render: `paths_at_most`.
    Loop {
        function: "fill_cell",
        used: |effects| effects.has(Effect::RadianceCache),
        at_vertex: |_, _| 0,
    },
    // Over spheres about their poles.
    Loop {
        function: "nearest_pole",
        used: |effects| effects.keeps_spheres() && effects.has(Effect::Pole),
        at_vertex: |placement, effects| rays(effects) * (placement.poles + 1),
    },
    // Over leaves beside the tree.
    Loop {
        function: "nearest_beside",
        used: |effects| effects.has(Effect::Bvh),
        at_vertex: |placement, effects| rays(effects) * (placement.tree().apart as usize + 1),
    },
    // Over the dielectrics that a ray may be in.
    Loop {
        function: "nearest_beside",
        used: |effects| effects.has(Effect::Bvh) && effects.has(Effect::Priority),
        at_vertex: |placement, effects| {
            rays(effects) * (placement.media.levels.max(1) as usize + 1)
        },
    },
    // Over nodes: it counts itself.
    Loop {
        function: "traverse",
        used: |effects| effects.has(Effect::Bvh),
        at_vertex: |_, _| 0,
    },
    // Whether loops still turn.
    Loop {
        function: "ends_loops",
        used: |effects| effects.has(Effect::Bvh),
        at_vertex: |_, _| 2,
    },
    // Over the spheres of a list.
    Loop {
        function: "closest_hit",
        used: |effects| effects.has(Effect::List),
        at_vertex: |placement, effects| {
            let spheres = placement.spheres.len() - placement.poles;
            rays(effects) * (spheres.div_ceil(SPHERES_AN_ITERATION) + 1)
        },
    },
    // Over the cells that may hold the flake of a point: at most three along each axis.
    Loop {
        function: "flake_at",
        used: Effects::has_flakes,
        at_vertex: |placement, effects| {
            // By `sample`, with the lecture's integrator by `share` and `evaluate`; and for a light.
            let lecture = usize::from(effects.has(Effect::Lecture));
            (rays(effects) + lecture + parts_visited(placement, effects)) * (27 + 1)
        },
    },
    // Over the octaves of a noise.
    Loop {
        function: "noise_value",
        used: |effects| effects.has(Effect::TextureNoise),
        at_vertex: |placement, effects| {
            // Each key once, and what a light emits; those of a mix's parts as often as they are visited, with its weights.
            let keys = effects.textured_keys().count();
            let parts = keys * (parts_visited(placement, effects) + 1);
            let weights = visits(effects) * placement.mixed[1];
            let mixed = usize::from(effects.has_mixes()) * (parts + weights);
            let lookups = keys + mixed + usize::from(effects.has(Effect::Lights));
            lookups * (MOST_OCTAVES as usize + 1)
        },
    },
    // Over the keys that are textures.
    Loop {
        function: "with_textures",
        used: |effects| effects.textured_keys().count() > 1,
        at_vertex: |placement, effects| {
            let parts = usize::from(effects.has_mixes()) * parts_visited(placement, effects);
            (1 + parts) * (effects.textured_keys().count() + 1)
        },
    },
    // Over the parts of a mix: which has the delta lobe that is drawn, then which is drawn from,
    Loop {
        function: "choose_part",
        used: draws_from_parts,
        at_vertex: |placement, effects| {
            let turns = 1 + usize::from(effects.mixes_deltas());
            turns * placement.mixed[0] + 1
        },
    },
    // what all say of the direction that one has drawn,
    Loop {
        function: "sample_mix",
        used: Effects::has_mixes,
        at_vertex: |placement, _| placement.mixed[0] + 1,
    },
    // what they say of one, to a light or drawn uniformly,
    Loop {
        function: "evaluate_mix",
        used: |effects| {
            effects.has_mixes() && (effects.samples_light() || effects.has(Effect::Lecture))
        },
        at_vertex: |placement, effects| {
            let lecture = usize::from(effects.has(Effect::Lecture));
            (lecture + rays(effects) - 1) * (placement.mixed[0].max(1) + 1)
        },
    },
    // the probability of their delta lobes,
    Loop {
        function: "share_mix",
        used: |effects| effects.mixes_deltas() && effects.has(Effect::Lecture),
        at_vertex: |placement, _| placement.mixed[0] + 1,
    },
    // and their colour.
    Loop {
        function: "color_at",
        used: |effects| {
            effects.has_mixes() && effects.has_textures() && effects.has(Effect::Features)
        },
        at_vertex: |placement, _| placement.mixed[0] + 1,
    },
    // Over the weights of a part that are textures.
    Loop {
        function: "part_weight",
        used: |effects| effects.textured_keys().any(|key| key == WEIGHT),
        at_vertex: |placement, effects| visits(effects) * (placement.mixed[0] + placement.mixed[1]),
    },
    // Over the lights that are weighed.
    Loop {
        function: "weigh_lights",
        used: |effects| effects.weighs_lights() && effects.keeps_spheres(),
        at_vertex: |placement, _| placement.lights.table.len().max(1) + 1,
    },
    // Over images of lamps: one is chosen,
    Loop {
        function: "choose_image",
        used: |effects| effects.has(Effect::LampImages),
        at_vertex: |placement, _| images(placement) + 1,
    },
    // and the pdf of one asked for where a path comes to a lamp.
    Loop {
        function: "image_pdf",
        used: |effects| effects.has(Effect::LampImages),
        at_vertex: |placement, _| images(placement) + 1,
    },
    // Over bins of what is seen, for each of the two.
    Loop {
        function: "bins_of",
        used: |effects| effects.has(Effect::LampImages),
        at_vertex: |_, _| 2 * (BINS + 1),
    },
    // Over the surfaces on the way to one.
    Loop {
        function: "light_by",
        used: |effects| effects.has(Effect::LampImages),
        at_vertex: |_, _| IMAGE_RAYS + 1,
    },
];

/// Rays of the longest way to an image: to the sphere, through it, and to the lamp.
const IMAGE_RAYS: usize = 3;

/// Images of lamps that vertices look for.
fn images(placement: &Placement) -> usize {
    placement.images.as_ref().map_or(0, Vec::len)
}

/// Whether directions are drawn from one of a mix's parts: by the lecture's integrator only where it is a delta lobe.
fn draws_from_parts(effects: &Effects) -> bool {
    effects.has_mixes() && (effects.mixes_deltas() || !effects.has(Effect::Lecture))
}

/// How often all parts of a mix are gone through at a vertex: by the loops over them.
fn visits(effects: &Effects) -> usize {
    let often = [
        effects.has_mixes(),
        effects.mixes_deltas(),
        draws_from_parts(effects),
        effects.has(Effect::Lecture),
        effects.has(Effect::Lecture) && effects.mixes_deltas(),
        effects.samples_light(),
        effects.has(Effect::Features),
    ];
    often.into_iter().filter(|loops| *loops).count()
}

/// The parts that are gone through together.
fn parts_visited(placement: &Placement, effects: &Effects) -> usize {
    match effects.has_mixes() {
        true => visits(effects) * placement.mixed[0],
        false => 0,
    }
}

/// Rays that are traced at a vertex: with light sampling also one to a light, and with images of lamps some to one; and
/// with the radiance cache the next one, and one to another point of a cell.
fn rays(effects: &Effects) -> usize {
    let cache = usize::from(effects.has(Effect::RadianceCache));
    let images = usize::from(effects.has(Effect::LampImages));
    1 + usize::from(effects.samples_light()) + IMAGE_RAYS * images + 2 * cache
}

/// Most loop iterations that the kernel makes for one vertex of a path, but for those of loops that count themselves.
#[must_use]
pub fn vertex_steps(placement: &Placement, effects: &Effects) -> u32 {
    let loops = LOOPS.iter().filter(|l| (l.used)(effects));
    let steps: usize = loops.map(|l| (l.at_vertex)(placement, effects)).sum();
    steps as u32
}

/// Loop iterations after which an invocation is to start no further path; `gl`: on a driver of that interface.
///
/// Through GL a path that was ended is at times taken for a sample all the same, where nothing but the question whether
/// loops still turn keeps it from that (29 of 4096 in the scene of `tests/bvh.rs`). Why is not known; it is not what the
/// compiler makes of that loop. There eight invocations together stay below what is ended, unless their paths take
/// thousands of iterations each.
#[must_use]
pub fn step_limit(placement: &Placement, effects: &Effects, max_bounces: u32, gl: bool) -> u32 {
    if effects.has(Effect::Bvh) {
        return (LOOP_ITERATIONS / if gl { 16 } else { 4 }) as u32;
    }
    // A path that is begun must fit.
    let vertex = u64::from(vertex_steps(placement, effects));
    // What corrects a value of the radiance cache is two paths.
    let paths = if effects.has(Effect::RadianceCache) {
        2
    } else {
        1
    };
    let path = paths * (u64::from(max_bounces) + 1) * vertex;
    LOOP_ITERATIONS.saturating_sub(path).max(1) as u32
}

/// The paths of the radiance cache's pilot that an invocation takes in one dispatch: as many as fit however long they
/// are, for its loop does not look. One does at least: where none might there is no radiance cache.
#[must_use]
pub fn paths_at_most(placement: &Placement, effects: &Effects, max_bounces: u32) -> u32 {
    let vertex = u64::from(vertex_steps(placement, effects));
    let path = (u64::from(max_bounces) + 1) * vertex;
    (LOOP_ITERATIONS / path).max(1) as u32
}

/// Loops of a block, those within others among them.
pub(super) fn loops_in(block: &naga::Block) -> usize {
    use naga::Statement;
    let inner = |statement: &Statement| match statement {
        Statement::Block(block) => loops_in(block),
        Statement::If { accept, reject, .. } => loops_in(accept) + loops_in(reject),
        Statement::Switch { cases, .. } => cases.iter().map(|case| loops_in(&case.body)).sum(),
        Statement::Loop {
            body, continuing, ..
        } => 1 + loops_in(body) + loops_in(continuing),
        _ => 0,
    };
    block.iter().map(inner).sum()
}

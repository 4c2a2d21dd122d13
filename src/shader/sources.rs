//! The kernel's sources, embedded.

macro_rules! sources {
    ($($path:literal),* $(,)?) => {
        /// Path below `shaders/` without extension, and text; those of materials are with the materials.
        pub(super) const ALL: &[(&str, &str)] = &[
            $(($path, include_str!(concat!("../../shaders/", $path, ".wesl")))),*
        ];
    };
}

sources![
    "path",
    "probe",
    "cache/cells",
    "cache/chart",
    "cache/pilot",
    "core/random",
    "core/sampling",
    "core/spectrum",
    "core/sum",
    "core/turn",
    "film/pixel",
    "film/work",
    "light/aim",
    "light/direct",
    "light/environment",
    "light/gradient",
    "light/light",
    "light/mis",
    "light/nee",
    "light/projected",
    "light/sky",
    "light/skylight",
    "light/table",
    "light/weighed",
    "materials/beckmann",
    "materials/contract",
    "materials/flakes",
    "materials/ggx",
    "materials/lattice",
    "materials/lobes",
    "materials/paint",
    "materials/powers",
    "materials/uniform",
    "path/class",
    "path/state",
    "path/termination/constant",
    "path/termination/never",
    "path/termination/throughput",
    "sampler/independent",
    "sampler/purpose",
    "sampler/sobol",
    "scene/absorption",
    "scene/attributes",
    "scene/bvh",
    "scene/camera",
    "scene/data",
    "scene/dispersion",
    "scene/list",
    "scene/media/nested",
    "scene/media/single",
    "scene/nearer",
    "scene/ray",
    "scene/sphere",
    "scene/surface",
    "scene/texture",
];

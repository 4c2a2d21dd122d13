//! The kernel's sources, embedded.

macro_rules! sources {
    ($($path:literal),* $(,)?) => {
        /// Path below `shaders/` without extension, and text.
        pub(super) const ALL: &[(&str, &str)] = &[
            $(($path, include_str!(concat!("../../shaders/", $path, ".wesl")))),*
        ];
    };
}

sources![
    "path",
    "probe",
    "core/random",
    "core/sampling",
    "core/sobol",
    "core/sum",
    "scene/ray",
    "scene/sphere",
    "scene/data",
    "scene/list",
    "scene/priority",
    "scene/material",
    "scene/camera",
    "bsdf/sample",
    "bsdf/scatter",
    "bsdf/diffuse",
    "bsdf/mirror",
    "bsdf/dielectric",
    "bsdf/reflective",
    "bsdf/evaluate",
    "bsdf/event",
    "light/aim",
    "light/environment",
    "light/projected",
    "light/sphere",
];

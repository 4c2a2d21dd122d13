//! Effects of what surfaces are made of.

use glam::DVec3;

use super::{Effect, Row};
use crate::materials::{Form, forms, measured, mix};

/// The forms of materials that are `wanted`.
pub(super) fn forms_that(wanted: impl Fn(&Form) -> bool) -> Vec<Effect> {
    (0..)
        .zip(forms())
        .filter(|(_, form)| wanted(form))
        .map(|(code, _)| Effect::Form(code))
        .collect()
}

pub(super) fn rows() -> Vec<Row> {
    let materials = (0..).zip(forms()).map(|(code, form)| {
        let row = Row::new(Effect::Form(code), form.name, form.what, move |asked| {
            asked.surfaces(|material| material.forms().any(|own| own == *form))
        })
        .marks(["sample", "evaluate", "share", "find"].map(|what| format!("{what}_{}", form.name)));
        if form.transmits {
            row.needs([Effect::Interior])
        } else if mix::is_mix(form) {
            row.needs(forms_that(|form| !form.transmits && !mix::is_mix(form)))
                .marks([
                    "mix",
                    "data::MixPart",
                    "data::mix_part_of",
                    "material_of_part",
                    "FIRST_PART",
                    "PART_MATERIALS",
                    "share_of",
                    "sample_part",
                    "evaluate_part",
                ])
        } else if measured::is_tabled(form) {
            row.marks(["MEASURED_WIDTH"])
        } else {
            row
        }
    });
    let priority = Row::new(
        Effect::Priority,
        "priority",
        "dielectrics that touch, nest or overlap",
        |asked| {
            asked.placement.media.example.map_or(vec![], |[a, b]| {
                vec![format!("spheres {} and {}", a.min(b) + 1, a.max(b) + 1)]
            })
        },
    )
    .needs(forms_that(|form| form.transmits))
    .marks([
        "LEVELS",
        "INITIAL_MEDIA",
        "INITIAL_IOR",
        "INITIAL_SPHERES",
        "Media::ior",
        "Media::sphere",
        "Attributes::level",
    ]);
    let absorption = Row::new(
        Effect::Absorption,
        "absorption",
        "light that dielectrics absorb on its way through them",
        |asked| asked.surfaces(|material| material.kind.absorption() != DVec3::ZERO),
    )
    .needs(forms_that(|form| form.transmits))
    .marks(["absorption", "absorption_within", "absorb"]);
    let dispersion = Row::new(
        Effect::Dispersion,
        "dispersion",
        "refractive indices by the wavelength, of which a path keeps one",
        |asked| asked.surfaces(|material| material.kind.dispersion().is_some()),
    )
    .needs(forms_that(|form| form.transmits))
    .marks([
        "spectrum",
        "dispersion",
        "wavelength",
        "WAVELENGTH",
        "INITIAL_DISPERSIVE",
        "keep_wavelength",
        "Path::spectral",
    ]);
    materials
        .chain([priority, absorption, dispersion])
        .collect()
}

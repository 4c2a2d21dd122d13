//! Effects of what surfaces are made of.

use super::{Effect, Row};
use crate::materials::forms;

pub(super) fn rows() -> Vec<Row> {
    let materials = (0..).zip(forms()).map(|(code, form)| {
        let row = Row::new(Effect::Form(code), form.name, form.what, move |asked| {
            asked.surfaces(|material| material.kind.form() == *form)
        })
        .marks([format!("sample_{}", form.name)]);
        if form.transmits {
            row.needs([Effect::Interior])
        } else {
            row
        }
    });
    let transmitting: Vec<Effect> = (0..)
        .zip(forms())
        .filter(|(_, form)| form.transmits)
        .map(|(code, _)| Effect::Form(code))
        .collect();
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
    .needs(transmitting)
    .marks(["LEVELS", "INITIAL_MEDIA", "INITIAL_IOR", "INITIAL_SPHERES"]);
    materials.chain([priority]).collect()
}

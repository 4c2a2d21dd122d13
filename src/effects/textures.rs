//! Effects of what on surfaces depends on where on their sphere they are.

use super::surfaces::forms_that;
use super::{Effect, Row};
use crate::materials::texturable::{EMISSION, WEIGHT, flag, texture_member, textured_keys};
use crate::materials::{Material, Texture};

/// All keys that may be textures.
fn keys() -> Vec<Effect> {
    let count = textured_keys().len() as u32;
    (0..count).map(Effect::Textured).collect()
}

/// A kind of textures.
fn kind(
    effect: Effect,
    name: &'static str,
    what: &'static str,
    is_it: impl Fn(&Texture) -> bool + Send + Sync + 'static,
) -> Row {
    let has = move |material: &Material| material.looked_up().iter().any(|(_, t)| is_it(t));
    Row::new(effect, name, what, move |asked| asked.surfaces(&has)).needs(keys())
}

pub(super) fn rows() -> Vec<Row> {
    let kinds = [
        kind(
            Effect::TextureChecker,
            "texture_checker",
            "values in the cells of a lattice, in turn",
            |texture| matches!(texture, Texture::Checker { .. }),
        )
        .marks(["checker_value"]),
        kind(
            Effect::TextureNoise,
            "texture_noise",
            "values by a gradient noise",
            |texture| matches!(texture, Texture::Noise { .. }),
        )
        .marks(["noise_value", "gradient_noise", "noise_slope"]),
        kind(
            Effect::TextureImage,
            "texture_image",
            "values by images about an axis",
            |texture| matches!(texture, Texture::Image(_)),
        )
        .marks([
            "image_value",
            "image_place",
            "image_texel",
            "image_texels",
            "data::Image",
            "data::image_of",
            "FIRST_IMAGE",
            "IMAGE_WIDTH",
        ]),
    ];
    let each = (0..).zip(textured_keys()).map(|(number, key)| {
        let member = texture_member(key).name;
        let row = Row::new(
            Effect::Textured(number),
            flag(key),
            "this key of materials as a texture",
            move |asked| {
                let is_it = |material: &Material| {
                    let keys = material.looked_up();
                    keys.iter().any(|(own, _)| own == key)
                };
                asked.surfaces(is_it)
            },
        )
        .needs([
            Effect::TextureChecker,
            Effect::TextureNoise,
            Effect::TextureImage,
        ])
        .marks([member]);
        match *key {
            EMISSION => row.needs([Effect::Emission]).marks(["emission_at"]),
            name => {
                let row = row.needs(forms_that(|form| form.texturable().any(|t| t.key == name)));
                match name {
                    WEIGHT => row.marks(["data::PartWeight", "part_weight_of", "FIRST_WEIGHT"]),
                    _ => row,
                }
            }
        }
    });
    kinds.into_iter().chain(each).collect()
}

//! Effects of where samples are, and of what pixels keep of them.

use super::{Effect, Row, when};
use crate::sampler::Sampler;
use crate::settings::View;

pub(super) fn rows() -> Vec<Row> {
    let aov = |wanted: bool| when(wanted, || "--aov".into());
    vec![
        Row::new(
            Effect::Sobol,
            "sobol",
            "samples in scrambled Sobol' sequences",
            |asked| {
                let sobol = asked.settings.sampler == Sampler::Sobol;
                when(sobol, || "sampler sobol".into())
            },
        )
        .marks([
            "sobol4",
            "sobol_point",
            "owen_scramble",
            "shuffled",
            "digit_mask",
            "Stream::place",
            "Stream::last",
            "Partial::batch",
        ]),
        Row::new(
            Effect::Classes,
            "classes",
            "light by the kind of its path",
            move |asked| aov(asked.settings.classes),
        )
        .marks([
            "path::class",
            "light_class",
            "classes",
            "receive_over",
            "Path::by_class",
            "Direct::event",
        ]),
        Row::new(
            Effect::Features,
            "features",
            "normal, albedo and depth of what is seen first",
            move |asked| aov(asked.settings.features),
        )
        .marks([
            "Seen",
            "Path::seen",
            "see",
            "features_seen",
            "features_normal",
            "features_albedo",
            "features_depth",
        ]),
        Row::new(
            Effect::BvhCost,
            "bvh_cost",
            "an image of steps through the tree in the place of light",
            |asked| {
                let wanted = asked.settings.view == Some(View::BvhCost);
                when(wanted, || "--view bvh-cost".into())
            },
        )
        .needs([Effect::Bvh])
        .marks(["show_cost", "steps_before"]),
        Row::new(
            Effect::Adaptive,
            "adaptive",
            "samples of some tiles of the image only",
            |asked| when(asked.settings.adaptive, || "--adaptive".into()),
        )
        .marks(["adaptive_tiles", "is_chosen"]),
    ]
}

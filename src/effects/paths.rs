//! Effects of how paths go on and where they end.

use super::surfaces::forms_that;
use super::{Effect, Row, cache_obstacle, when};

pub(super) fn rows() -> Vec<Row> {
    vec![
        Row::new(
            Effect::Lecture,
            "lecture",
            "uniform hemisphere, constant probability of termination",
            |asked| {
                when(asked.settings.integrator.is_lecture(), || {
                    "--integrator lecture".into()
                })
            },
        )
        .marks(["LECTURE_TERMINATION"]),
        Row::new(
            Effect::Roulette,
            "roulette",
            "Russian roulette on the throughput",
            |asked| {
                when(asked.settings.has_roulette(), || {
                    format!("integrator {}", asked.settings.integrator.name())
                })
            },
        )
        .excludes([Effect::Lecture])
        .marks(["ROULETTE_FACTOR"]),
        Row::new(
            Effect::RadianceCache,
            "radiance_cache",
            "values of cells in the place of paths, drawn anew for every scramble and corrected without bias",
            |asked| {
                let settings = asked.settings;
                let is_used = settings.radiance_cache
                    && cache_obstacle(asked.scene, asked.placement, settings).is_none();
                when(is_used, || "--radiance-cache on".into())
            },
        )
        .needs([Effect::Sobol])
        .needs([Effect::Mis])
        .needs(forms_that(|form| form.lambertian))
        .excludes([
            Effect::Lecture,
            Effect::Bvh,
            Effect::Straddle,
            Effect::Nested,
            Effect::Nudge,
            Effect::Ulp,
            Effect::Motion,
            Effect::Classes,
            Effect::Adaptive,
            Effect::Priority,
            Effect::Absorption,
            Effect::Dispersion,
            Effect::TextureChecker,
            Effect::TextureNoise,
            Effect::TextureImage,
        ])
        .marks([
            "cache",
            "cell_values",
            "texel_of",
            "cell_place",
            "begin_at",
            "begin_on",
            "chart_pdf",
            "Path::plain",
            "Path::arrived",
            "Path::arrives_at",
            "Path::first_value",
            "Path::other",
            "Begin",
            "pairs",
            "batch_sums",
            "BATCHES",
            "pilot",
            "fill_cell",
            "CORRECTED",
            "chart_of",
            "data::chart_record",
            "FIRST_CHART",
            "CELLS",
            "CELLS_WIDTH",
        ]),
    ]
}

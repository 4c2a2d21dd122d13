//! Effects of where light comes from and how it is looked for.

use super::surfaces::forms_that;
use super::{Asked, Effect, Row, when};
use crate::placement::lights::MOST_WEIGHED;
use crate::settings::{Integrator, LightSampling};

pub(super) fn rows() -> Vec<Row> {
    vec![
        Row::new(
            Effect::Emission,
            "emission",
            "surfaces that emit",
            |asked| asked.surfaces(|m| m.emission.max_element() > 0.0),
        )
        .needs(forms_that(|_| true))
        .marks(["emission", "receive_emission"]),
        Row::new(
            Effect::Environment,
            "environment",
            "constant light from everywhere",
            |asked| match asked.scene.environment {
                Some(e) if e.max_element() > 0.0 && !asked.placement.enclosed => {
                    vec![format!(
                        "environment: radiance = [{}, {}, {}]",
                        e.x, e.y, e.z
                    )]
                }
                _ => vec![],
            },
        )
        .marks(["light::environment", "ENVIRONMENT"]),
        Row::new(
            Effect::Lights,
            "lights",
            "light sampling: at every vertex a direction to a lamp",
            |asked| {
                if !samples_lights(asked) {
                    return vec![];
                }
                let lights = asked.placement.lights.table.iter();
                asked.listed(lights.map(|light| (&asked.placement.spheres[light.sphere], "")))
            },
        )
        .needs([Effect::Emission])
        .needs([Effect::Projected, Effect::Table])
        .excludes([Effect::Lecture])
        .marks([
            "lights",
            "light::aim",
            "light::light",
            "light::direct",
            "Path::departure",
            "data::Light",
            "share_of_hit",
            "share_of_light",
            "receive_direct",
            "light_weight",
            "lamp_hit",
            "lighting",
            "LIGHT_COUNT",
            "is_delta",
            "both_sides",
        ]),
        Row::new(
            Effect::Projected,
            "projected",
            "light sampling by projected solid angle",
            |asked| {
                let projected = asked.settings.light_sampling == LightSampling::Projected;
                when(samples_lights(asked) && projected, || {
                    "light sampling projected".into()
                })
            },
        )
        .needs([Effect::Lights])
        .marks(["light::projected", "weigh_lights"]),
        Row::new(
            Effect::Table,
            "table",
            "lights drawn from a table by power, whatever the vertex",
            |asked| {
                let lights = &asked.placement.lights;
                let sampling = asked.settings.light_sampling;
                when(
                    samples_lights(asked) && lights.from_table(sampling),
                    || match sampling {
                        LightSampling::Projected => format!(
                            "{} lights; weighed at each vertex up to {MOST_WEIGHED}",
                            lights.table.len()
                        ),
                        LightSampling::Cone => "--light-sampling cone".into(),
                    },
                )
            },
        )
        .needs([Effect::Lights])
        .marks(["light_from_table"]),
        Row::new(
            Effect::Mis,
            "mis",
            "weights between light sampling and BSDF sampling",
            |asked| {
                let integrator = asked.settings.integrator;
                when(
                    samples_lights(asked) && integrator == Integrator::Path,
                    || format!("integrator {}", integrator.name()),
                )
            },
        )
        .needs([Effect::Lights])
        .marks(["mis_weight"]),
    ]
}

/// Whether vertices look for lights.
fn samples_lights(asked: &Asked<'_>) -> bool {
    let lights = !asked.placement.lights.table.is_empty();
    lights
        && matches!(
            asked.settings.integrator,
            Integrator::Path | Integrator::Nee
        )
}

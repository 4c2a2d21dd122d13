//! Effects of where light comes from and how it is looked for.

use super::surfaces::forms_that;
use super::{Asked, Effect, Row, image_obstacle, when};
use crate::placement::lights::MOST_WEIGHED;
use crate::scene::Environment;
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
            |asked| match environment(asked) {
                Some(Environment::Constant(e)) => {
                    vec![format!(
                        "environment: radiance = [{}, {}, {}]",
                        e.x, e.y, e.z
                    )]
                }
                _ => vec![],
            },
        )
        .excludes([Effect::Gradient, Effect::Sky])
        .marks(["ENVIRONMENT"]),
        Row::new(
            Effect::Gradient,
            "gradient",
            "light from everywhere, of three colours by height",
            |asked| {
                let gradient = matches!(environment(asked), Some(Environment::Gradient(_)));
                when(gradient, || "environment: gradient".into())
            },
        )
        .excludes([Effect::Sky])
        .marks([
            "gradient_radiance",
            "GRADIENT_ZENITH",
            "GRADIENT_HORIZON",
            "GRADIENT_GROUND",
        ]),
        Row::new(
            Effect::Sky,
            "sky",
            "light from everywhere, by an image in a texture",
            |asked| {
                let sky = environment(asked).and_then(Environment::sky);
                sky.map_or(vec![], |sky| {
                    vec![format!("environment: image = {:?}", sky.name())]
                })
            },
        )
        .marks(["light::sky", "SKY_WIDTH", "SKY_HEIGHT", "SKY_TURN"]),
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
            "data::Light",
            "data::lamp_of",
            "LIGHT_TEXELS",
            "FIRST_LIGHT",
            "light_aim",
            "limb_distance",
            "share_of_emission",
            "light_weight",
            "LAMP_SHARE",
            "LIGHT_COUNT",
            "both_sides",
        ]),
        Row::new(
            Effect::Skylight,
            "skylight",
            "light sampling: at every vertex a direction to the image around all",
            |asked| when(samples_sky(asked), || "an image as environment".into()),
        )
        .needs([Effect::Sky])
        .excludes([Effect::Lecture])
        .marks([
            "light::skylight",
            "share_of_sky",
            "SKY_SHARE",
            "SKY_TABLE_WIDTH",
        ]),
        Row::new(
            Effect::Projected,
            "projected",
            "light sampling by projected solid angle",
            |asked| {
                let projected = asked.settings.light_sampling() == LightSampling::Projected;
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
                let sampling = asked.settings.light_sampling();
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
                let looks = samples_lights(asked) || samples_sky(asked);
                when(looks && integrator == Integrator::Path, || {
                    format!("integrator {}", integrator.name())
                })
            },
        )
        .needs([Effect::Lights, Effect::Skylight])
        .marks(["mis_weight"]),
        Row::new(
            Effect::LampImages,
            "lamp_images",
            "light sampling: at every vertex a direction to an image of a lamp in a smooth sphere",
            |asked| {
                let is_used = asked.settings.lamp_images
                    && image_obstacle(asked.scene, asked.placement, asked.settings).is_none();
                when(is_used, || "--lamp-images on".into())
            },
        )
        .needs([Effect::Mis])
        .needs([Effect::Projected])
        .needs(forms_that(|form| form.imaging.is_some()))
        .excludes([
            Effect::Lecture,
            Effect::Straddle,
            Effect::Nested,
            Effect::Nudge,
            Effect::Ulp,
            Effect::Motion,
            Effect::Classes,
            Effect::BvhCost,
            Effect::Table,
            Effect::Priority,
            Effect::Absorption,
            Effect::Dispersion,
            Effect::TextureChecker,
            Effect::TextureNoise,
            Effect::TextureImage,
        ])
        .excludes(forms_that(|form| form.is_translucent()))
        .marks([
            "light::images",
            "lamp_images",
            "sample_imaging",
            "imaging",
            "receive_image",
            "Departure::chain",
            "IMAGED",
        ]),
    ]
}

/// The environment, if a path can see it.
fn environment<'a>(asked: &Asked<'a>) -> Option<&'a Environment> {
    let environment = asked.scene.environment.as_ref();
    environment.filter(|e| e.brightest() > 0.0 && !asked.placement.enclosed)
}

/// Whether vertices look for light.
fn looks_for_light(asked: &Asked<'_>) -> bool {
    asked.settings.integrator.samples_lights()
}

/// Whether they look for lamps.
fn samples_lights(asked: &Asked<'_>) -> bool {
    looks_for_light(asked) && !asked.placement.lights.table.is_empty()
}

/// Whether they look for an image around all.
fn samples_sky(asked: &Asked<'_>) -> bool {
    looks_for_light(asked) && environment(asked).is_some_and(|e| e.sky().is_some())
}
